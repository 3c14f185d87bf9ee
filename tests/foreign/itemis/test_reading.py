"""Statecharts of itemis CREATE: each construct does what its test says, or is rejected by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.testing.conformance.conformance import Result
from fsmkit.testing.foreign.sctunit import run_tests
from fsmkit.testing.runtimes import runtime
from tests.foreign.imports import imported, messages
from tests.foreign.itemis.charts import region, state, statechart, vertex

BASE = "interface:\nin event e\nin event f\nin event v : integer\nout event o : integer\n"
DATA = "var x : integer = 0\nvar b : boolean\noperation test(id : string) : boolean\n"
EVENT, CYCLE, CHILD = "@EventDriven\n", "", "@EventDriven\n@ChildFirstExecution\n"
CHOICE = region(
    "r",
    state("A", "", ("e / x = 2", "c")),
    vertex("Choice", "", "c", ("else", "C"), ("[x == 2]", "B")),
    state("B", ""),
    state("C", ""),
)
EXIT = region(
    "r",
    state("A", "", ("# out >", "B"), ("/ x += 10", "C"), inner=region(
        "s",
        state("D", "", ("e / x = 1", "named"), ("f", "plain")),
        vertex("Exit", "out", "named"),
        vertex("Exit", "", "plain"),
    )),
    state("B", "", ("e", "A")),
    state("C", ""),
)  # fmt: skip
ENTRY = region(
    "r",
    state("A", "", ("e # > other", "B"), ("f", "B")),
    state("B", "entry / x = 1", inner=region(
        "s",
        state("C", ""),
        vertex("Entry", "other", "o", ("/ x += 5", "D")),
        state("D", ""),
    )),
)  # fmt: skip
FORK = region(
    "r",
    state("A", "entry / x += 1", ("e", "fork")),
    vertex("Synchronization", "", "fork", ("", "C2"), ("", "D2")),
    state("B", "", inner=region("s", state("C1", ""), state("C2", "", ("e", "join")))
          + region("t", state("D1", ""), state("D2", "", ("[b]", "join")))),
    vertex("Synchronization", "", "join", ("", "A")),
)  # fmt: skip
HISTORY = region(
    "r",
    state("A", "", ("e", "B"), inner=region(
        "s", vertex("Entry", "", "h", ("", "C"), more='kind="SHALLOW_HISTORY"'),
        state("C", "", ("f", "D")), state("D", ""))),
    state("B", "", ("e", "A")),
)  # fmt: skip
GUARDS = region("r", state("A", "e / x += 10", ("[test('one')]", "B"), ("[test('two')]", "C")),
                state("B", ""), state("C", ""))  # fmt: skip
EXITS = region("r", state("A", "exit / x = x * 10 + 9", ("e", "B"), inner=region(
    "s", state("C", "exit / x = x * 10 + 1")) + region("t", state("D", "exit / x = x * 10 + 2"))),
    state("B", ""))  # fmt: skip
CASES = {
    "choice": (EVENT, CHOICE, "enter raise e assert active(T.r.B)"),
    "exit points": (
        EVENT,
        EXIT,
        ("enter raise e assert active(r.B) assert x == 1 raise e raise f assert active(r.C)"
        " assert x == 11"),
    ),
    "entry points": (EVENT, ENTRY, "enter raise e assert active(r.B.s.D) assert x == 6"),
    "default entry": (EVENT, ENTRY, "enter raise f assert active(r.B.s.C) assert x == 1"),
    "fork and join": (
        CYCLE,
        FORK,
        ("enter raise e proceed 1 cycle assert active(r.B.s.C2) && active(r.B.t.D2)"
        " raise e proceed 1 cycle assert active(r.B.s.C2) b = true raise e proceed 1 cycle"
        " assert active(r.A) assert x == 2"),
    ),
    "history": (EVENT, HISTORY, "enter raise f raise e raise e assert active(r.A.s.D)"),
    "history after exit": (EVENT, HISTORY, "enter raise f exit enter assert active(r.A.s.D)"),
    "guards are evaluated once": (
        EVENT,
        GUARDS,
        ('mock test("one") returns (false) mock test("two") returns (x > 0) enter raise e'
        ' assert called test("one") assert active(r.A) assert x == 10 raise f assert active(r.C)'),
    ),
    "exit actions in order": (EVENT, EXITS, "enter raise e assert x == 129"),
    "exit actions of the machine": (EVENT, EXITS, "enter exit assert x == 129 assert !is_active"),
    "values and out events": (
        EVENT,
        region("r", state("A", "v / raise o : valueof(v) * 2")),
        "enter raise v : 4 assert o && valueof(o) == 8 raise e assert !o",
    ),
    "assignments in expressions": (
        EVENT,
        region(
            "r", state("A", "e / x = (x += 2) * 3 + x++\nf / b = (x = 1) == 2 || (x += 4) == 5")
        ),
        "enter raise e assert x == 8 raise f assert b && x == 5",
    ),
    "precedence": (
        EVENT,
        region("r", state("A", "entry / x = 7 & 3 << 1 ^ 8; b = ! x == 3 || false")),
        "enter assert x == 14 assert b",
    ),
    "start values of a test": (
        EVENT,
        region("r", state("A", "entry [b] / x = 3")),
        "assert x == 0 b = true enter assert x == 3",
    ),
    "timers": (
        EVENT,
        region("r", state("A", "every 2 s / x += 1\nafter 2 s / x += 10", ("after 5 s", "B")),
               state("B", "", ("[x == 12]", "C")), state("C", "")),
        ("enter proceed 4 s assert x == 12 proceed 1 s assert active(r.B) raise e "
         "assert active(r.C)"),
    ),
    "a cycle sees all events": (
        CYCLE,
        region("r", state("A", "e, f / x += 1", ("[e && f]", "B")), state("B", "")),
        ("enter raise e proceed 1 cycle assert x == 1 raise e raise f assert active(r.A)"
        " proceed 200 ms assert active(r.B)"),
    ),
    "local events wait": (
        CHILD + "internal:\nevent l\nevent m\n",
        region("r", state("A", "", ("e / raise l; raise m", "B")), state("B", "", ("m", "C")),
               state("C", "l / x = 1")),
        "enter raise e assert active(r.C) assert x == 0",
    ),
    "parent first": (
        EVENT,
        region("r", state("A", "", ("e", "B"), inner=region("s", state("C", "", ("e", "D")),
                                                             state("D", ""))), state("B", "")),
        "enter raise e assert active(r.B)",
    ),
    "child first": (
        CHILD,
        region("r", state("A", "e / x = 5", ("e", "B"),
                          inner=region("s", state("C", "", ("e", "D")), state("D", ""))),
               state("B", "")),
        "enter raise e assert active(r.A.s.D) assert x == 5",
    ),
}  # fmt: skip


def written(tmp_path: Path, case: str, tests: str = "") -> tuple[Path, Path]:
    """Write the statechart and the test of a case."""
    text, regions, steps = CASES[case]
    head = text if "internal" in text else text + BASE + DATA
    if "internal" in text:
        head = (
            text.partition("internal")[0] + BASE + DATA + "internal" + text.partition("internal")[2]
        )
    chart, unit = tmp_path / "t.sct", tmp_path / "t.sctunit"
    chart.write_text(statechart(head, regions))
    unit.write_text(
        f"testclass U for statechart T {{ @Test operation t() {{ {tests or steps} }} }}"
    )
    return unit, chart


@pytest.mark.parametrize("case", CASES)
def test_a_construct(case: str, tmp_path: Path) -> None:
    unit, chart = written(tmp_path, case)
    (result,) = run_tests(unit, chart)
    assert (result.result, result.reason) == (Result.PASSED, "")


@pytest.mark.cc
@pytest.mark.parametrize("case", ["fork and join", "exit actions in order", "local events wait"])
def test_generated_code_does_the_same(case: str, tmp_path: Path) -> None:
    unit, chart = written(tmp_path, case)
    (result,) = run_tests(unit, chart, [runtime("c"), runtime("python")])
    assert (result.result, result.reason) == (Result.PASSED, "")


@pytest.mark.parametrize(
    ("steps", "result"),
    [
        ("enter assert active(T.r.C)", Result.FAILED),
        ("enter raise e assert x == 3", Result.FAILED),
        ("raise e", Result.SKIPPED),
        ("enter assert e", Result.SKIPPED),
        ("enter proceed 1 cycle", Result.SKIPPED),
        ("enter assert active(nowhere)", Result.SKIPPED),
        ("enter raise nothing", Result.SKIPPED),
    ],
)
def test_a_test_that_does_not_pass(steps: str, result: Result, tmp_path: Path) -> None:
    unit, chart = written(tmp_path, "choice", steps)
    (found,) = run_tests(unit, chart)
    assert found.result is result
    assert found.reason


def one(text: str, *arcs: tuple[str, str]) -> str:
    """Return a region of two states, of which the first has these reactions and transitions."""
    return region("r", state("A", text, *arcs), state("B", ""))


CHOOSING = region("s", vertex("Entry", "", "h", ("", "c")),
                  vertex("Choice", "", "c", ("[b]", "C"), ("else", "D")),
                  state("C", ""), state("D", ""))  # fmt: skip
REJECTED = {
    "a choice is entered before other regions are": (
        DATA, region("r", state("A", "", inner=CHOOSING + region("t", state("E", ""))))),
    "a final state in a region with history": (
        DATA, region("r", vertex("Entry", "", "h", ("", "A"), more='kind="SHALLOW_HISTORY"'),
                     state("A", "", ("e", "end")), vertex("FinalState", "", "end"))),
    "a local event is raised while the machine is entered": (
        EVENT + "internal:\nevent l\n", one("entry / raise l")),
    "a cast with `as` is not read": (DATA, one("entry / x = 2.5 as integer")),
    "`null` has no counterpart": (DATA, one("", ("[null == null]", "B"))),
    "the type `Colour` is not read": ("var c : Colour", one("")),
    "the annotation `@SuperSteps` is not read": ("@SuperSteps(yes)\n" + DATA, one("")),
    "an event-driven statechart raises its own `in` event": (EVENT, one("e / raise f")),
    "the start value of `z` is not a constant": (DATA + "var z : integer = x", one("")),
    "this delay is not a constant": (DATA, one("", ("after x s", "B"))),
    "a delay is not a positive number of milliseconds": (DATA, one("", ("after 5 us", "B"))),
    "no transition takes over from this exit point": (
        DATA, region("r", state("A", "", inner=region("s", state("C", "", ("e", "x")),
                                                      vertex("Exit", "x", "x"))))),
    "this choice has no transition for all other cases": (
        DATA, region("r", state("A", "", ("e", "c")), vertex("Choice", "", "c", ("[b]", "A")))),
    "a guard of a choice has an effect or calls an operation": (
        DATA, region("r", state("A", "", ("e", "c")),
                     vertex("Choice", "", "c", ("[test('a')]", "A"), ("else", "A")))),
    "this transition leads from one region to another of the same state": (
        DATA, region("r", state("A", "", inner=region("s", state("C", "", ("e", "D")))
                                + region("t", state("D", ""))))),
    "a variable number of parameters is not read": ("operation o(n... : integer)\n", one("")),
    "imports are not read": ("import: 'a.types'", one("")),
    "this transition has a loose end": (DATA, one("", ("e", "nowhere"))),
    "a vertex of the kind `Other` is not read": (DATA, region("r", state("A", ""),
                                                              vertex("Other", "", "x"))),
    "`y` is not declared": (DATA, one("", ("[y > 2]", "B"))),
    "`This` is not declared": (DATA, one("This text is prose")),
    "`/` is missing before `the end`": (DATA, one("e [b]")),
    "the exit points of this transition lead in a circle": (
        DATA, region("r", vertex("Entry", "", "h", ("", "A")), state("A", "", ("e", "i")),
                     vertex("Entry", "i", "i", ("", "i")))),
}  # fmt: skip


@pytest.mark.parametrize("message", REJECTED)
def test_what_is_rejected(message: str) -> None:
    text, regions = REJECTED[message]
    first = text if text.startswith("@") else ""
    rest = "" if first else text
    head = first.partition("\n")[0] + "\n" + BASE + first.partition("\n")[2] + rest
    _, findings = imported("itemis", statechart(head, regions), "t.sct")
    expected = [each for each in messages(findings) if message in each or each in message]
    assert expected
    assert all(each.primary is not None for each in findings)
