"""Damaged and hostile statecharts: read, or rejected with a location, in bounded time."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from devtools.foreign.__main__ import damaged
from fsmkit.diagnostics import FsmkitError
from fsmkit.testing.foreign.sctunit import read_tests
from fsmkit.yaml.writer import write_document
from tests.foreign.imports import imported
from tests.foreign.itemis.charts import HEAD, region, state, statechart
from tests.foreign.itemis.test_reading import BASE, CASES, DATA

DAMAGED = 12
"""Variants of each statechart; `python -m devtools.foreign damage` tries more."""
DEEP = "(" * 5_000 + "1" + ")" * 5_000


def read(content: bytes | str) -> None:
    """Read a file, whatever is in it; all findings have a location."""
    found, findings = imported("itemis", content, "t.sct")
    if found is not None and not findings.has_errors:
        write_document(found.document)
    assert all(one.primary is not None for one in findings)


@pytest.mark.parametrize("case", CASES)
def test_damaged_files(case: str) -> None:
    chosen = random.Random(case)
    content = statechart(CASES[case][0] + BASE + DATA, CASES[case][1]).encode()
    for _ in range(DAMAGED):
        read(damaged(content, chosen))


def nested(depth: int) -> str:
    """Return states within each other."""
    inner = ""
    for number in range(depth):
        inner = region(f"r{number}", state(f"S{number}", "", inner=inner))
    return inner


@pytest.mark.parametrize(
    "content",
    [
        "",
        "no XML",
        "<xmi:XMI",
        f"{HEAD}</xmi:XMI>",
        '<!DOCTYPE a [<!ENTITY b "bbbb"><!ENTITY c "&b;&b;&b;">]><a>&c;</a>',
        '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>',
        statechart("Once upon a time, in event"),
        statechart("interface: var"),
        statechart("interface: in event"),
        statechart("internal: operation o("),
        statechart("@"),
        statechart(BASE, region("r")),
        statechart(BASE + DATA, region("r", state("A", f"entry / x = {DEEP}"))),
        statechart(BASE + DATA, region("r", state("A", f"entry / x = {'~' * 5_000}1"))),
        statechart(BASE, nested(60)),
        statechart(BASE + DATA, *(region(f"r{n}", state(f"S{n}", "")) for n in range(300))),
        statechart(
            BASE + DATA, region("r", state("A", "entry / " + "; ".join(["x += 1"] * 3_000)))
        ),
        statechart(BASE + DATA, region("r", state("A", "/* no end " * 3_000))),
        statechart(BASE, region("r", state("log", "", ("e", "if")), state("if", ""))),
    ],
)
def test_hostile_files(content: str) -> None:
    read(content)


@pytest.mark.parametrize(
    "content",
    ["", "testclass", "testclass T for statechart C {", "testclass T for statechart C { @Test }",
     f"testclass T for statechart C {{ @Test operation t() {{ assert {DEEP} }} }}",
     "testclass T for statechart C { @Test operation t() { while (true) {" * 500, "\x00\xff"],
    ids=range(7),
)  # fmt: skip
def test_hostile_tests(content: str, tmp_path: Path) -> None:
    path = tmp_path / "t.sctunit"
    path.write_text(content)
    with pytest.raises(FsmkitError):
        read_tests(path)
