"""`Math` of integers: what is typed computes what node does."""

from __future__ import annotations

import json
import os
import random
import shutil
import subprocess
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest

from fsmkit.codegen.python.expressions import Printer
from fsmkit.codegen.python.linking import resolve_links
from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.language import INT32, Expr, Scope, Storage, type_expression
from fsmkit.runtime.python import arithmetic

COUNT = int(os.environ.get("FSMKIT_MATH_ARGUMENTS", "3000"))
"""Pairs of random arguments; the long run has 1,000,000."""
FUNCTIONS = [
    *(f"Math.{name}(x / y)" for name in ("floor", "ceil", "round", "trunc")),
    *(f"Math.{name}(x / 7)" for name in ("floor", "ceil", "round")),
    *(f"Math.{name}(x / -6)" for name in ("floor", "ceil", "round")),
    *(f"Math.{name}(x)" for name in ("floor", "ceil", "round", "trunc", "sign", "abs")),
    "Math.min(x, y)",
    "Math.max(x, y, 3)",
    "Math.pow(z, 3)",
]
EDGES = (0, 1, -1, 2, -2, 3, 7, -7, 2**31 - 1, 1 - 2**31, 2**30, -(2**30), 100, -100)


def typed(text: str) -> Expr:
    variables = dict.fromkeys("xyz", (INT32, Storage.LOCAL))
    scope = Scope(variables=variables, dialect="ecmascript")
    findings = Findings()
    place = Text(text, Span(Source("<test>", text), 0, len(text)))
    found = type_expression(place, scope, findings)
    assert found is not None, [d.message for d in findings]
    return found


def computed(text: str) -> Callable[[int, int, int], int]:
    """Return an expression as the target `python` prints it, as a function."""
    names = cast("Any", SimpleNamespace(constant=lambda *_: None))
    printer = Printer(names, parameters={name: name for name in "xyz"})
    source = f"lambda x, y, z: {resolve_links(printer.print(typed(text)))}"
    return cast("Callable[[int, int, int], int]", eval(source, vars(arithmetic).copy()))


def arguments(count: int) -> list[tuple[int, int, int]]:
    """Return edges first, then random numbers of all sizes; the second is never 0.

    The least int32 is left out: its negation is none, and wraps around as any sum does.
    """
    choose = random.Random(9)
    pairs = [(x, y) for x in EDGES for y in EDGES if y]
    while len(pairs) < count:
        x, y = (choose.randint(1 - 2**31, 2**31 - 1) >> choose.randint(0, 31) for _ in "xy")
        pairs.append((x, y or 1))
    return [(x, y, choose.randint(-1290, 1290)) for x, y in pairs[:count]]


@pytest.mark.external
def test_integers_are_those_of_node() -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("there is no node")
    given = arguments(COUNT)
    program = (
        "const [fs, given] = JSON.parse(require('fs').readFileSync(0, 'utf8'));"
        "for (const f of fs) { const g = new Function('x', 'y', 'z', 'return ' + f);"
        "console.log(JSON.stringify(given.map(([x, y, z]) => g(x, y, z) + 0))) }"
    )
    ran = subprocess.run(
        [node, "-e", program],
        input=json.dumps([FUNCTIONS, given]), capture_output=True, text=True, check=True,
    )  # fmt: skip
    for text, line in zip(FUNCTIONS, ran.stdout.splitlines(), strict=True):
        function = computed(text)
        found = [function(*three) for three in given]
        assert found == json.loads(line), text


@pytest.mark.parametrize(("x", "y", "expected"), [(7, 2, 4), (-7, 2, -3), (7, -2, -3), (-5, 2, -2)])
def test_rounding_goes_up_from_the_middle(x: int, y: int, expected: int) -> None:
    assert computed("Math.round(x / y)")(x, y, 0) == expected
