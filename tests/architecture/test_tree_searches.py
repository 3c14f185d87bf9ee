"""No target searches the tree of states: what lies around or inside of a state is in the Plan."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

FOLDER = Path(__file__).parents[2] / "fsmkit" / "codegen"
TREE = {"ancestors", "children", "depth", "is_descendant", "last_descendant", "parent"}
"""Members of a Chart and of its states by which the tree is searched."""
SEARCHES = "fsmkit.chart.structure"
"""The module whose functions search it."""


def searches(tree: ast.Module) -> Iterator[int]:
    """Yield the lines in which a module searches the tree of a chart."""
    for node in ast.walk(tree):
        match node:
            case ast.Attribute(ast.Call(ast.Name("Path" | "File")) | ast.Name("path"), "parent"):
                pass  # a folder
            case ast.Attribute(_, name) if name in TREE:
                yield node.lineno
            case ast.ImportFrom(module=module, names=names) if module == SEARCHES:
                yield from (node.lineno for _ in names)


def test_targets_search_no_tree() -> None:
    found = [
        f"{path.relative_to(FOLDER)}:{line}"
        for path in sorted(FOLDER.rglob("*.py"))
        for line in searches(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert found == []


def test_a_search_is_found() -> None:
    for text in ("chart.ancestors(state)", "state.parent", f"from {SEARCHES} import lcca"):
        assert [*searches(ast.parse(text))] == [1]
    assert [*searches(ast.parse("Path(__file__).parent"))] == []
