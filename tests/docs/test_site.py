"""The site: it is built offline without a warning, and nothing is fetched when it is read."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import fsmkit
from devtools.site.sources import BESIDE, linked, pages
from fsmkit.diagnostics.rules import rules
from tests.needs import need

ROOT = Path(__file__).parents[2]
FETCHED = re.compile(r"""<(?:script|img|link|iframe)[^>]+(?:src|href)=["'](?:https?:)?//""")


def test_links_out_of_the_docs_become_pages_or_paths() -> None:
    def led(text: str) -> str:
        return linked(text, "docs/how-to/cell.md", "how-to/cell.md")

    assert led("[a](../reference/c.md#x)") == "[a](../reference/c.md#x)"
    cell = "[a](../../machines/production_cell/README.md)"
    assert led(cell) == "[a](../about/production-cell.md)"
    assert led("[the notes](../../benchmarks/results)") == "the notes (`benchmarks/results`)"
    assert led("[a](https://example.org/x)") == "[a](https://example.org/x)"


def test_newest_version_is_stable(tmp_path: Path) -> None:
    need(find_spec("sphinx") is not None, "sphinx")
    from devtools.site.__main__ import index

    for version in ("0.9", "0.10", "drafts"):
        (tmp_path / version).mkdir()
        (tmp_path / version / "index.html").write_text(version)
    index(tmp_path)
    index(tmp_path)
    assert (tmp_path / "stable/index.html").read_text() == "0.10"
    listed = (tmp_path / "versions.js").read_text()
    assert listed == 'const versions = ["stable", "0.10", "0.9"];\n'


@pytest.mark.slow
@pytest.mark.external
def test_it_is_built_without_a_warning(tmp_path: Path) -> None:
    need(find_spec("furo") is not None and find_spec("myst_parser") is not None, "sphinx, furo")
    done = subprocess.run(
        [sys.executable, "-m", "devtools.site", str(tmp_path)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    minor = fsmkit.__version__.rpartition(".")[0]
    for page, _ in pages():
        assert (tmp_path / minor / page).with_suffix(".html").is_file(), page
    assert (tmp_path / minor / f"reference/rules/{rules()[0].code}.html").is_file()
    assert set(BESIDE.values()) <= {page for page, _ in pages()}
    found = {
        file.name: FETCHED.findall(file.read_text(encoding="utf-8"))
        for file in tmp_path.rglob("*.html")
    }
    assert not {name: urls for name, urls in found.items() if urls}
