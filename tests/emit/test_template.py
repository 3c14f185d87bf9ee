"""Templates are filled line by line, and all of them are in the package."""

from __future__ import annotations

import fnmatch
import tomllib
from pathlib import Path

import pytest

from fsmkit.emit.template import filled
from fsmkit.emit.written import RawText, Written, printing

ROOT = Path(__file__).parents[2]
DATA = {".py", ".pyc", ".so"}


def test_fields_and_lines() -> None:
    text = "a @{x} @{x}\n  @{lines}\n\t@{none}\nend @{x}\n"
    fields = {"x": "$y", "lines": ["1", "", "$y"], "none": []}
    assert filled(text, fields) == "a $y $y\n  1\n\n  $y\nend $y\n"
    assert filled("${KEPT} @name %n\n", {}) == "${KEPT} @name %n\n"


def test_values_are_not_filled_again() -> None:
    assert filled("@{x}\n", {"x": "@{x}"}) == "@{x}\n"
    assert filled("@{x}\n", {"x": ["@{y}"]}) == "@{y}\n"
    with pytest.raises(KeyError):
        filled("@{other}", {"x": ""})


def test_everything_is_in_the_package() -> None:
    """Each file that is no module is named among the data of the package."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = settings["tool"]["setuptools"]["package-data"]["fsmkit"]
    files = [path for path in (ROOT / "fsmkit").rglob("*") if path.is_file()]
    names = [path.relative_to(ROOT / "fsmkit").as_posix() for path in files]
    data = [name for name in names if Path(name).suffix not in DATA]
    assert len(data) > 100
    left_out = [name for name in data if not any(fnmatch.fnmatch(name, p) for p in patterns)]
    assert left_out == []


@printing
def _printed(name: str) -> str:
    return filled("@{x} @{lines}\n", {"x": name, "lines": name})


def test_texts_of_charts_do_not_pass() -> None:
    with pytest.raises(RawText):
        _printed(Written("*/ evil"))
