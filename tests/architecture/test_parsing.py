"""JSON that anybody may have written is parsed in one place, which knows how parsing can fail."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from fsmkit.diagnostics.parsing import parse_json

PACKAGE = Path(__file__).parents[2] / "fsmkit"
PARSER = "diagnostics/parsing.py"


@pytest.mark.slow
def test_one_module_calls_the_parser_of_the_standard_library() -> None:
    callers = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Attribute)
        and node.attr in {"load", "loads"}
        and isinstance(node.value, ast.Name)
        and node.value.id == "json"
    }
    assert callers == {PARSER}


@pytest.mark.parametrize(
    "text", ["", "[" * 100_000, '{"a":' * 100_000, "9" * 10_000, "{]", b"\xff", b"\x00", "\ud800"]
)
def test_whatever_is_no_json_is_a_value_error(text: str | bytes) -> None:
    with pytest.raises(ValueError, match=r"."):
        parse_json(text)
