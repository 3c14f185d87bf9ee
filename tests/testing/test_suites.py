"""Files of tests: what is read, what is evaluated, what is said of mistakes."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError, Severity
from fsmkit.testing.reading import read_suite
from fsmkit.testing.running import run_case
from fsmkit.testing.runtimes import runtime

GATE = """\
chart: Gate
types: {Fault: [none, jam]}
constants: {OPENING: 1}
inputs: {blocked: bool}
data: {weight: 0..2000 = 0, last: Fault = none}
operations: [motor(direction -1..1), weigh(slot 0..3) -> 0..2000]
events: {in: [request, limit, fault(code Fault)], out: [opened(weight 0..2000)]}
initial: closed
states:
  closed: {rest: true, on: {request: opening, fault: {do: last = event.code}}}
  opening:
    entry: motor(OPENING); weight = weigh(1)
    exit: motor(0)
    on: {limit: {target: open, do: send opened(weight = weight)}}
    after: {10s: stuck}
  open: {after: {3s: closing}}
  closing:
    entry: motor(-1)
    exit: motor(0)
    on: {request: opening, limit: closed}
    always: [{if: blocked and weight > 3, target: opening}]
    after: {10s: stuck}
  stuck: {}
"""
TESTS = """\
tests: Gate
chart: gate.yaml
before: [set blocked false]
cases:
  opens and closes:
    - weigh(slot = 1) returns 500, 700
    - post request
    - expect: {in: opening, called: [motor(OPENING), weigh(_)], that: weight == 500}
    - wait 9s; post limit
    - expect: {in: open, sent: opened(500), not called: motor(1), only: true, called: motor(0)}
    - wait 3s
    - expect: {in: closing, called: motor(direction = -1), not in: [open, stuck], fault: none}
  opens again:
    - weigh returns 500, 700
    - post request; post limit; wait 3s; request
    - expect: {in: opening, that: [weight == 700, not blocked]}
  keeps the code:
    - post fault code=jam
    - expect: {in: closed, that: last == Fault.jam}
  gives up:
    - post request; wait 10s
    - expect: {in: stuck}
"""


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    (tmp_path / "gate.yaml").write_text(GATE)
    (tmp_path / "gate.test.yaml").write_text(TESTS)
    return tmp_path


def failures(file: Path, case: int = 0) -> list[str]:
    suite = read_suite(file, Findings())
    return [failure.message for failure in run_case(suite, suite.cases[case]).failures]


def with_case(gate: Path, *steps: str) -> Path:
    text = TESTS[: TESTS.index("  opens")] + "  it:\n" + "".join(f"    - {s}\n" for s in steps)
    (gate / "gate.test.yaml").write_text(text)
    return gate / "gate.test.yaml"


def test_all_cases_pass(gate: Path) -> None:
    suite = read_suite(gate / "gate.test.yaml", Findings())
    assert [case.name.value for case in suite.cases] == [
        "opens and closes",
        "opens again",
        "keeps the code",
        "gives up",
    ]
    assert [run_case(suite, case).failures for case in suite.cases] == [()] * 4


@pytest.mark.parametrize("target", ["python", pytest.param("c", marks=pytest.mark.cc)])
def test_generated_code_does_the_same(gate: Path, target: str) -> None:
    suite = read_suite(gate / "gate.test.yaml", Findings())
    make = runtime(target)
    assert [run_case(suite, case, runtime=make).failures for case in suite.cases] == [()] * 4


def test_a_runtime_that_differs_fails_the_case(gate: Path) -> None:
    """A runtime of another chart stands for one with a fault."""
    suite = read_suite(gate / "gate.test.yaml", Findings())
    (gate / "gate.yaml").write_text(GATE.replace("after: {10s: stuck}", "after: {9s: stuck}", 1))
    other = read_suite(gate / "gate.test.yaml", Findings()).system.machines[0].chart
    make = runtime("python")
    outcome = run_case(suite, suite.cases[0], runtime=lambda _: make(other))
    (failure,) = outcome.failures
    assert "generated Python does otherwise" in failure.message


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        (["expect: {in: opening}"], "not in `opening`: active is closed"),
        (["expect: {not in: closed}"], "in `closed` all the same: active is closed"),
        (["request", "expect: {called: motor(0)}"], "not called: `motor(0)`; called was motor(1)"),
        (["request", "expect: {not called: weigh}"], "called all the same: weigh(1)"),
        (
            ["request", "expect: {called: [weigh, motor]}"],
            "not called: `motor`; called was motor(1), weigh(1)",
        ),
        (["request", "expect: {called: motor, only: true}"], "called was more than that"),
        (["expect: {sent: opened}"], "not sent: `opened`; sent was nothing"),
        (["request; limit", "expect: {not sent: opened(_)}"], "sent all the same: opened(0)"),
        (["expect: {fault: range}"], "the fault is none"),
        (["expect: {that: weight > 1}"], "`weight > 1` does not hold"),
        (["expect: {that: 1 / weight > 0}"], "has no value: division by zero"),
    ],
)
def test_failures_say_what_was_there(gate: Path, steps: list[str], message: str) -> None:
    (found,) = failures(with_case(gate, *steps))
    assert message in found


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        (["post arived", "expect: {in: open}"], "there is no event `arived`"),
        (["post request a", "expect: {in: open}"], "does not take `a`"),
        (["set blocked 3", "expect: {in: open}"], "`blocked` is a bool"),
        (["wait long", "expect: {in: open}"], "the time to wait"),
        (["motor returns 3", "expect: {in: open}"], "the operation `motor` returns nothing"),
        (["weigh returns 3000", "expect: {in: open}"], "the result of `weigh`"),
        (["weigh(9) returns 3", "expect: {in: open}"], "`slot` of `weigh`"),
        (["weigh(1, 2) returns 3", "expect: {in: open}"], "`weigh` takes `slot`"),
        (["expect: {in: opn}"], "there is no state `opn`"),
        (["expect: {called: motr}"], "there is no operation `motr`"),
        (["expect: {sent: request}"], "the chart sends no event `request`"),
        (["expect: {that: weight}"], "bool"),
        (["expect: {within: 3s}"], "an expectation has no key `within`"),
        (["expect: {}"], "it expects nothing"),
        (["expect: {only: yes, called: motor}"], "neither `true` nor `false`"),
        (["post request"], "the case `it` expects nothing"),
        (["start", "expect: {in: open}"], "starts again"),
        (["{wait: 3s}", "expect: {in: open}"], "a step is a text"),
    ],
)
def test_mistakes_have_a_place_and_a_way_out(gate: Path, steps: list[str], message: str) -> None:
    file = with_case(gate, *steps)
    with pytest.raises(FsmkitError) as error:
        read_suite(file, Findings())
    (first,) = (d for d in error.value.diagnostics if d.severity is Severity.ERROR)
    assert message in first.message
    assert first.primary is not None
    assert first.primary.span.source.name == str(file)


@pytest.mark.parametrize(
    "text",
    ["", "tests: A\n", "tests: A\nchart: gate.yaml\n", "[]\n", "tests: A\nchart: no.yaml\n",
     "tests: A\nchart: gate.yaml\nsystem: gate.yaml\n",
     "tests: [A]\nchart: gate.yaml\ncases: {}\n"],
)  # fmt: skip
def test_a_file_that_is_no_suite_is_refused(gate: Path, text: str) -> None:
    (gate / "gate.test.yaml").write_text(text)
    with pytest.raises(FsmkitError):
        read_suite(gate / "gate.test.yaml", Findings())


def test_an_event_that_finds_no_room_fails_the_case(gate: Path) -> None:
    (gate / "gate.yaml").write_text(
        "chart: E\nevents: {in: [go]}\ninitial: a\nstates: {a: {on: {go: b}}, b: {final: true}}\n"
    )
    (gate / "gate.test.yaml").write_text(
        "tests: E\nchart: gate.yaml\ncases: {it: [go; go, {expect: {in: b}}]}\n"
    )
    assert failures(gate / "gate.test.yaml") == [
        "the event is not accepted: the machine is no more"
    ]


SYSTEM = """\
system: Two
machines: {a: ping.yaml, b: pong.yaml}
connect: [a.ball -> b.ball]
"""


def test_machines_of_a_system_are_named(tmp_path: Path) -> None:
    (tmp_path / "ping.yaml").write_text(
        "chart: Ping\nevents: {in: [serve], out: [ball(n 0..9)]}\ninitial: i\n"
        "states: {i: {on: {serve: {do: send ball(n = 4)}}}}\n"
    )
    (tmp_path / "pong.yaml").write_text(
        "chart: Pong\ndata: {n: 0..9 = 0}\nevents: {in: [ball(n 0..9)]}\ninitial: i\n"
        "states: {i: {on: {ball: {target: j, do: n = event.n}}}, j: {}}\n"
    )
    (tmp_path / "two.yaml").write_text(SYSTEM)
    file = tmp_path / "two.test.yaml"
    file.write_text(
        "tests: Two\nsystem: two.yaml\ncases:\n  it:\n    - a.serve\n"
        "    - expect: {in: [a.i, b.j], sent: a.ball(4), that: b.n == 4 and b.In(j)}\n"
    )
    assert failures(file) == []
    file.write_text(file.read_text().replace("a.ball(4)", "c.ball(4)"))
    with pytest.raises(FsmkitError, match="there is no machine `c`"):
        read_suite(file, Findings())


@pytest.mark.parametrize("mutant", range(6))
def test_mutants_of_the_gate_fail_readably(
    gate: Path, mutant: int, capsys: pytest.CaptureFixture[str]
) -> None:
    old, new = [
        ("motor(OPENING)", "motor(0)"),
        ("{3s: closing}", "{4s: closing}"),
        ("weight = weight)", "weight = 0)"),
        ("request: opening, limit: closed", "limit: closed"),
        ("after: {10s: stuck}", "after: {11s: stuck}"),
        ("do: last = event.code", "do: last = Fault.none"),
    ][mutant]
    assert old in GATE
    (gate / "gate.yaml").write_text(GATE.replace(old, new, 1))
    assert execute(["test", str(gate / "gate.test.yaml")]) == 1
    told = capsys.readouterr()
    assert "FAILED" in told.out
    assert "gate.test.yaml:" in told.err
    assert "FK0621" in told.err


def test_the_verb_looks_below_folders(gate: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (gate / "more").mkdir()
    (gate / "more" / "b.test.yaml").write_text(TESTS.replace("gate.yaml", "../gate.yaml"))
    assert execute(["test", str(gate)]) == 0
    assert "8 passed, 0 failed" in capsys.readouterr().out
    assert execute(["test", str(gate), "--case", "gives up", "--json"]) == 0
    assert capsys.readouterr().out.count('"passed": true') == 2
    assert execute(["test", str(gate), "--case", "nothing"]) == 2
    assert execute(["test", str(gate / "gate.yaml")]) == 1
    assert "broken-tests: " in capsys.readouterr().err
    (gate / "empty").mkdir()
    assert execute(["test", str(gate / "empty")]) == 1
    assert "nothing-to-check: " in capsys.readouterr().err


def test_cases_have_the_ids_of_their_requirements(tmp_path: Path) -> None:
    (tmp_path / "lamp.yaml").write_text(
        "chart: Lamp\nevents: {in: [press]}\ninitial: dark\n"
        "states: {dark: {on: {press: lit}}, lit: {on: {press: dark}}}\n"
    )
    file = tmp_path / "lamp.test.yaml"
    file.write_text(
        "tests: Lamp\nreq: L-1\nchart: lamp.yaml\ncases:\n  on:\n    - post press\n"
        "    - expect: {in: lit}\n  twice:\n    req: [L-2, L-1]\n    steps:\n"
        "      - post press; post press\n      - expect: {in: dark}\n"
    )
    suite = read_suite(file, Findings())
    ids = {case.name.value: [one.value for one in case.req] for case in suite.cases}
    assert ids == {"on": ["L-1"], "twice": ["L-1", "L-2"]}
    file.write_text(file.read_text().replace("steps:", "step:"))
    with pytest.raises(FsmkitError, match="no key `step`"):
        read_suite(file, Findings())
