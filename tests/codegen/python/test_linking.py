"""A module contains exactly the parts that are reachable."""

from __future__ import annotations

import ast
import builtins
import dis
from collections.abc import Iterator
from types import CodeType
from typing import Any

import pytest

from devtools.differential import random_case
from fsmkit.codegen.python.generate import module_text
from fsmkit.diagnostics import FsmkitError

OPTIONS: tuple[dict[str, Any], ...] = (
    {},
    {"traced": True},
    {"saved": True},
    {"recorded": True},
    {"covered": True},
)
KINDS = 10
"""Numbers of random charts after which their kinds come again."""


def code_within(code: CodeType) -> Iterator[CodeType]:
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield constant
            yield from code_within(constant)


def missing(text: str) -> set[str]:
    """Return globals and attributes of machines that a module names and does not have."""
    code, names = compile(text, "m.py", "exec"), dict[str, object]({"__name__": "m"})
    exec(code, names)
    found = {
        each.argval
        for part in code_within(code)
        for each in dis.get_instructions(part)
        if each.opname == "LOAD_GLOBAL"
    }
    attributes = [
        node
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "self"
    ]
    known = {name for each in names.values() if isinstance(each, type) for name in dir(each)}
    known |= {node.attr for node in attributes if isinstance(node.ctx, ast.Store)}
    return (found - {*names, *dir(builtins)}) | ({node.attr for node in attributes} - known)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(2 * KINDS))
def test_random_charts(number: int) -> None:
    chart = random_case(19, number, has_functions=number % 3 == 0).chart
    for options in OPTIONS:
        try:
            text = module_text(chart, **options)
        except FsmkitError:  # it cannot be recorded
            continue
        assert not missing(text), options


def test_what_is_left_out_is_seen() -> None:
    text = "class M:\n    def f(self):\n        self.g()\n        return h()\n"
    assert missing(text) == {"g", "h"}
