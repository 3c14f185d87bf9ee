"""No printer reads text: what is printed is decided by the Chart, the Plan and the IR."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "fsmkit"
PRINTERS = ("codegen", "export")
"""Folders whose modules print; of those of carriers, the ones with a function that prints."""
READER = "codegen/existing_c"
"""The folder there that reads headers and bindings."""
PRINTED = {"body", "code", "done", "found", "line", "lines", "printed", "source", "text", "texts"}
"""Names of what was printed."""
ALLOWED = {
    "codegen/c/ir.py": "reads the marks that printers put before names: they are the IR",
    "codegen/c/pieces.py": "reads C of the library, which is no output, by its marks",
    "codegen/c/reserved.py": "compares names of the chart with names of the library",
    "codegen/conditional.py": "reads texts of the library, which are no output, line by line",
    "codegen/python/trimming.py": "reads Python of the library, which is no output, by one line",
    "codegen/system/program.py": "reads an option",
    "carriers/ros/rclc_tables.py": "makes a name of a name as ROS does",
    "codegen/units/service.py": "makes a name of a name as systemd does",
    "export/identifiers.py": "makes a name of a name",
    "export/promela/trail.py": "reads what Spin has found",
    "export/uppaal/tchecker.py": "rewrites expressions of one notation in the grammar of another",
}
"""Files that may import `re`, and why."""


def offences(path: Path, tree: ast.Module) -> Iterator[str]:
    """Yield where a module reads what was printed."""
    name = path.relative_to(PACKAGE).as_posix()
    for node in ast.walk(tree):
        line = f"{name}:{getattr(node, 'lineno', 0)}"
        match node:
            case ast.Import(names) if any(each.name == "re" for each in names):
                if name not in ALLOWED:
                    yield f"{line}: imports re"
            case ast.Call(ast.Attribute(ast.Call(ast.Attribute(_, "finish" | "collected")), verb)):
                if verb in {"split", "splitlines", "find", "count", "index", "partition"}:
                    yield f"{line}: takes printed text apart"
            case ast.Compare(left, [ast.In() | ast.NotIn()], [ast.Name(where)]):
                is_text = isinstance(left, ast.Constant | ast.JoinedStr)
                is_long = isinstance(left, ast.Constant) and len(str(left.value)) < 2
                if where in PRINTED and is_text and not is_long:
                    yield f"{line}: looks for a text in `{where}`"


@pytest.mark.slow
def test_no_printer_reads_text() -> None:
    files = sorted(
        path
        for name in PRINTERS
        for path in (PACKAGE / name).rglob("*.py")
        if not path.is_relative_to(PACKAGE / READER)
    )
    carriers = sorted((PACKAGE / "carriers").rglob("*.py"))
    files += [path for path in carriers if "@printing" in path.read_text(encoding="utf-8")]
    found = {path: ast.parse(path.read_text(encoding="utf-8")) for path in files}
    assert [o for path, tree in found.items() for o in offences(path, tree)] == []
    assert {name for name in ALLOWED if not (PACKAGE / name).is_file()} == set()
    idle = [
        name
        for name in ALLOWED
        if not any(isinstance(n, ast.Import) and n.names[0].name == "re"
                   for n in ast.walk(found[PACKAGE / name]))
    ]  # fmt: skip
    assert idle == [], "they do not import re"


def test_an_offence_is_seen() -> None:
    text = "import re\nis_used = 'call(' in body\nlines = out.finish().splitlines()\n"
    seen = [*offences(PACKAGE / "codegen" / "c" / "header.py", ast.parse(text))]
    assert seen == [
        "codegen/c/header.py:1: imports re",
        "codegen/c/header.py:2: looks for a text in `body`",
        "codegen/c/header.py:3: takes printed text apart",
    ]
