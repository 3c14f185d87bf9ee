"""No target searches the tree of states: what lies around or inside of a state is in the Plan."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

FOLDER = Path(__file__).parents[2] / "fsmkit" / "codegen"
TREE = {"ancestors", "children", "depth", "is_descendant", "last_descendant", "parent"}
"""Members of a Chart and of its states by which the tree is searched."""
SEARCHES = "fsmkit.chart.structure"
"""The module whose functions search it."""
ALLOWED = {"transitions": 38}
"""Searches that are left, by package. Lower a number when you remove one."""


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
    found: Counter[str] = Counter()
    lines = []
    for path in sorted(FOLDER.rglob("*.py")):
        name = path.relative_to(FOLDER)
        for line in searches(ast.parse(path.read_text(encoding="utf-8"))):
            found[name.parts[0]] += 1
            lines.append(f"{name}:{line}")
    assert found == ALLOWED, "\n".join(lines)
