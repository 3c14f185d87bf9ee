"""No text of a chart is code, wherever it stands: a part of the grid of `make injection`."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.cli import execute as command_line
from fsmkit.codegen.pyext.generate import generate
from fsmkit.loading import load
from fsmkit.texts import Identifier, RawText, Written, c, printing, telling, written
from tests.codegen.c.conftest import WARNINGS
from tests.injection.grid import texts_of_round, tried
from tests.injection.places import SHAPES

FINDINGS = Path(__file__).parent / "findings"
QUICK = {"yaml": 4, "scxml": 9, "plain": 14, "invoking": 19, "system": 24, "deployment": 24}
"""A round for each kind of files; all rounds with all outputs: `make injection`."""


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize("shape", SHAPES)
def test_a_round_of_the_grid(shape: str, tmp_path: Path) -> None:
    count = tried(shape, texts_of_round(shape, QUICK[shape]), tmp_path, is_quick=True)
    assert not count.wrong, "\n".join(count.wrong)
    assert count.right


@pytest.mark.slow
@pytest.mark.cc
def test_the_name_of_a_chart_is_not_executed_by_the_explorer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert command_line(["check", str(FINDINGS / "chart_name.yaml")]) == 0
    assert not (tmp_path / "owned").exists()


@pytest.mark.cc
def test_the_name_of_a_type_is_not_executed_by_an_extension_module(tmp_path: Path) -> None:
    given = [str(FINDINGS / "type_name.yaml"), "--target", "pyext", "--out", str(tmp_path)]
    assert command_line(["compile", *given]) == 0
    subprocess.run([sys.executable, "-c", "import poc"], check=True, cwd=tmp_path)
    assert not (tmp_path / "owned").exists()


@pytest.mark.external
@pytest.mark.parametrize("form", ["speed", "size"])
@pytest.mark.parametrize(
    "compiler", [("gcc", "-std=c99"), ("gcc", "-std=gnu2x"), ("clang", "-std=c11"), ("g++",)]
)
def test_words_of_c_are_names(form: str, compiler: tuple[str, ...], tmp_path: Path) -> None:
    """Keywords, macros of headers and members of ours, of C, C++ and Python."""
    given = [str(FINDINGS / "kw.scxml"), "--optimize", form, "--out", str(tmp_path)]
    assert command_line(["compile", *given]) == 0
    kind = "*.h" if compiler == ("g++",) else "*.c"
    files = map(str, sorted(tmp_path.glob(kind)))
    more = ["-x", "c++"] if kind == "*.h" else WARNINGS
    subprocess.run([*compiler, "-fsyntax-only", *more, *files], check=True)


FILE_NAMES = {
    "not of UTF-8": b"\xff\xfe.yaml",
    "shell": b"$(touch owned).yaml",
    "lines": b"a\nint creat;\n.yaml",
    "docstring": b'a"""+x.yaml',
    "quote at the end": b'a.yaml"',
}


@pytest.mark.parametrize("name", FILE_NAMES.values(), ids=FILE_NAMES)
def test_the_name_of_the_file_is_no_code_of_an_extension_module(name: bytes) -> None:
    chart = load(FINDINGS / "type_name.yaml")
    source = replace(chart.sources[0], name=os.fsdecode(name))
    _, files = generate(replace(chart, sources=(source, *chart.sources[1:])))
    for file, text in files.items():
        text.encode()
        if file.endswith(".pyi"):
            assert isinstance(ast.parse(text).body[1], ast.ImportFrom)


@pytest.mark.cc
def test_a_machine_of_two_underscores_is_found_in_the_body_of_its_class(tmp_path: Path) -> None:
    texts = {"chart": "\"' x"}
    count = tried("plain", texts, tmp_path, is_quick=True)
    assert not count.wrong, "\n".join(count.wrong)
    assert count.right


# --- the guard ------------------------------------------------------------------------------------


@printing
def raw(text: str) -> str:
    return f"/* {text} */"


@printing
def through_the_door(text: str) -> str:
    return f"/* {c.comment(text)} */"


@telling
def told(text: str) -> str:
    return f"the state {text}"


def test_a_printer_takes_no_text_raw() -> None:
    with pytest.raises(RawText):
        raw(Written("x */ y"))
    assert through_the_door(Written("x */ y")) == "/* x * / y */"


def test_what_is_made_of_a_text_is_guarded_too() -> None:
    hostile = Written("x */ y")
    for made in ("of " + hostile, hostile + " is", told(hostile), hostile.upper(), str(hostile)):
        with pytest.raises(RawText):
            raw(made)


def test_a_chart_is_written_even_where_a_printer_forgot_a_harmless_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(written, "is_strict", False)
    assert raw(Written("idle")) == "/* idle */"
    monkeypatch.setattr(written, "is_strict", True)
    with pytest.raises(RawText):
        raw(Written("idle"))


def test_findings_say_names_as_they_are() -> None:
    assert f"`{Written('x */ y')}`" == "`x */ y`"


@pytest.mark.parametrize("text", ["", "1a", "a b", "a;", "é"])
def test_an_identifier_is_one(text: str) -> None:
    with pytest.raises(RawText):
        Identifier(text)
