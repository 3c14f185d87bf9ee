"""Numbers of JavaScript against the interpreter and against BigInt alone, at the ends of ranges."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.javascript.expressions import ALL_BIG
from fsmkit.diagnostics import FsmkitError
from fsmkit.language.types import IntType
from fsmkit.testing.harness.harness import INTERPRETER
from fsmkit.testing.harness.javascript import run_many

SAFE = 2**53 - 1
RANGES = (
    "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
    f"{-SAFE}..{SAFE}", f"{-SAFE - 1}..{SAFE + 1}", f"0..{2**62}", "-7..9 wrap",
    f"{2**52}..{SAFE} wrap", f"{-SAFE}..{SAFE} wrap", "-3..3", "0..6",
)  # fmt: skip
EXPRESSIONS = (
    *(f"a {op} b" for op in ("+", "-", "*", "/", "%", "&", "|", "^", "<<", ">>")),
    *("min(a, b)", "max(a, b)", "abs(a)", "-a", "~b", "a > b ? a : b", "a", "(a + b) * a"),
    *("a - b - 1", "a * b % 7", "-(a / b)", "abs(b) / 3", "(a ^ b) >> 1", "~(a & b)"),
)
CONDITIONS = tuple(f"a {op} b" for op in ("<", "<=", "==", "!="))
STORED = ("int32", "int64", "uint64", "uint8", "-9..9", "-9..9 fault", "0..1000 wrap", "float32")
PER_PAIR = 2
"""Into how many of these types each result is stored."""
pytestmark = [pytest.mark.slow, pytest.mark.external]


def written(one: str, other: str, kept: list[tuple[str, str]]) -> str:
    lines = ["chart: Extreme", "inputs:", f'  a: "{one}"', f'  b: "{other}"', "data:"]
    lines += [f'  r{n}: "{stored}"' for n, (_, stored) in enumerate(kept)]
    lines += ["events:", f"  in: [{', '.join(f'e{n}' for n in range(len(kept)))}]"]
    lines += ["initial: s", "states:", "  s:", "    on:"]
    lines += [f'      e{n}: {{do: "r{n} = {text}"}}' for n, (text, _) in enumerate(kept)]
    lines += ["      error.execution: {do: log 1}", "      error.range: {do: log 2}"]
    return "\n".join(lines) + "\n"


@dataclass
class Reader:
    file: Path

    def chart(self, one: str, other: str, kept: list[tuple[str, str]]) -> Chart | None:
        self.file.write_text(written(one, other, kept), encoding="utf-8")
        try:
            return load(self.file)
        except FsmkitError:
            return None


def ends(type_: IntType) -> Iterator[int]:
    """Yield values at the ends of a range and about 0."""
    middle = (type_.lo + type_.hi) // 2
    for value in (type_.lo, type_.lo + 1, -2, -1, 0, 1, 3, middle, type_.hi - 1, type_.hi):
        if type_.lo <= value <= type_.hi:
            yield value


def jobs(folder: Path, shift: int) -> Iterator[tuple[Chart, list[str]]]:
    """Yield a chart for each pair of types, and a script with all ends of both."""
    reader = Reader(folder / "extreme.yaml")
    for number, one in enumerate(RANGES):
        other = RANGES[(number + shift) % len(RANGES)]
        wanted = [(text, "bool") for text in CONDITIONS]
        for place, text in enumerate(EXPRESSIONS):
            some = range(number + place, number + place + PER_PAIR)
            wanted += [(text, STORED[at % len(STORED)]) for at in some]
        kept = [each for each in wanted if reader.chart(one, other, [each]) is not None]
        chart = reader.chart(one, other, kept)
        assert chart is not None
        yield chart, list(script(chart, kept))


def script(chart: Chart, kept: list[tuple[str, str]]) -> Iterator[str]:
    faults = {number for number, (_, stored) in enumerate(kept) if stored.endswith("fault")}
    yield "start 0"
    a, b = (variable.type for variable in chart.inputs)
    assert isinstance(a, IntType)
    assert isinstance(b, IntType)
    for first in dict.fromkeys(ends(a)):
        yield f"input a {first}"
        for second in dict.fromkeys(ends(b)):
            yield f"input b {second}"
            for number in range(len(kept)):
                yield f"dispatch e{number}"
                if number in faults:
                    yield "dump"
                    yield "start 0"
            yield "dump"


@pytest.mark.parametrize("shift", range(0, len(RANGES), 9))
def test_ends_of_ranges(shift: int, tmp_path: Path) -> None:
    given = list(jobs(tmp_path, shift))
    expected = [INTERPRETER.run(chart, lines) for chart, lines in given]
    for safe in (SAFE, ALL_BIG):
        assert run_many(given, safe=safe) == expected
    assert sum(map(len, expected)) > 10_000


def test_random_charts_of_bigint_alone() -> None:
    cases = [random_case(2025, number) for number in range(50)]
    got = run_many([(case.chart, case.script) for case in cases], safe=ALL_BIG)
    for case, trace in zip(cases, got, strict=True):
        assert trace == INTERPRETER.run(case.chart, case.script), case.name
