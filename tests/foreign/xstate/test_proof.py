"""The program of the page on XState runs a machine by the library beside its chart."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("tree_sitter_typescript")

from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source
from fsmkit.foreign.xstate.reader import import_machine
from fsmkit.testing.foreign.proof import Difference, compare_with_program
from tests.foreign.xstate.machines import NODE_FOLDER
from tests.needs import need, tool

PAGE = Path(__file__).parents[3] / "docs/cookbook/from-xstate.md"


def file_of(name: str) -> str:
    """Return a file that the page announces."""
    text = PAGE.read_text(encoding="utf-8")
    found = re.search(
        rf"[Pp]ut this into `{re.escape(name)}`[^\n]*:\n\n```\w+\n(.*?)```", text, re.DOTALL
    )
    assert found is not None
    return found[1]


def proof(tmp_path: Path, change: tuple[str, str]) -> Difference | None:
    """Compare the chart of the page's machine with the library, which runs a changed machine."""
    node = tool("node")
    need((NODE_FOLDER / "node_modules" / "xstate").is_dir(), "xstate")
    written = file_of("fetch.ts")
    (tmp_path / "node_modules").symlink_to(NODE_FOLDER / "node_modules")
    (tmp_path / "package.json").write_text('{"type": "module"}')
    (tmp_path / "fetch.js").write_text(re.sub(r"\n  types:.*", "", written).replace(*change))
    (tmp_path / "prove.mjs").write_text(file_of("prove.mjs"))
    found = import_machine(Source("fetch.ts", written), "fetcher", Findings())
    assert found is not None
    chart = elaborate((found.document,), Findings())
    assert chart is not None
    return compare_with_program(chart, f"{node} {tmp_path / 'prove.mjs'}", 1_000)


@pytest.mark.cc
@pytest.mark.external
def test_the_library_and_the_chart_of_the_page_do_the_same(tmp_path: Path) -> None:
    """Random events, waits and answers give the same operations and states."""
    assert proof(tmp_path, ("", "")) is None


@pytest.mark.cc
@pytest.mark.external
def test_a_changed_machine_is_found(tmp_path: Path) -> None:
    """A machine with another delay differs from the chart."""
    difference = proof(tmp_path, ("5000", "6000"))
    assert difference is not None
    assert "state failure" in difference.expected or "state failure" in difference.found
