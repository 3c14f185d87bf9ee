"""States that are filled with other charts: names, meaning, corners, inheritance, findings."""

# ruff: noqa: E501  (charts in flow style)

from __future__ import annotations

import json
from pathlib import Path
from textwrap import dedent, indent

import pytest

from devtools import expansions
from devtools.copies import compare_pair, explain, pairs
from devtools.differential import Case, compare
from devtools.differential import elaborated as chart_of
from devtools.differential import explain as explained
from devtools.expansions import random_host
from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.scripts import random_script
from devtools.random_charts.using import random_using
from devtools.runtimes import harness
from fsmkit.chart.chart import Chart
from fsmkit.chart.copies import splicing
from fsmkit.chart.drawing.states.folding import folded
from fsmkit.chart.loading import load, load_with_findings, read_document
from fsmkit.chart.views.chart_json import chart_document
from fsmkit.chart.views.chart_tree import chart_tree
from fsmkit.chart.views.origins import Origins
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.document.document import Kind
from fsmkit.document.front_ends import FrontEnd
from fsmkit.document.walk import states
from fsmkit.plugins import plugin
from fsmkit.runtime.script import run_script

NOWHERE = Origins({}, {}, {}, {})
AXIS = """
chart: Axis
types: {Mode: [slow, fast]}
constants: {FAR: 2800, T_MOVE: 20ms}
data: {tries: 0..3 = 0, mode: Mode = slow, seen: "uint8[2] = [1, 2]"}
inputs: {at_far: bool}
outputs: {lit: bool = false}
operations: ["goto(position 0..4000)"]
events: {in: [go, halt], out: [arrived(n 0..9)], internal: [hop]}
entries: {resumed: halted, again: was}
initial: work
states:
  work:
    states:
      idle: {on: {go: moving}}
      moving:
        entry: goto(FAR); lit = true
        exit: lit = false
        on: {halt: halted}
        always: [{if: at_far, target: there, do: send arrived(n = tries)}]
        after: {T_MOVE: [{if: tries < 3, target: moving, do: "tries += 1; seen[0] = 9"}, {target: jammed}]}
      halted: {on: {go: moving}}
      was: {history: shallow, default: idle}
  there: {final: true}
  jammed: {final: true, done: {with: {count: tries}}}
"""
HOST = """
chart: Press
data: {lost: 0..3 = 0}
inputs: {sensor: bool}
outputs: {lamp: bool = false}
operations: ["drive(axis 0..3, position 0..4000)"]
events: {in: [start, stop, resume, back], internal: [arrived(n 0..9)]}
initial: idle
states:
  idle: {on: {start: left, resume: left.resumed, back: left.again}}
  left:
    use: axis.yaml
    with: {FAR: 2500}
    start: {tries: 1}
    bind: {go: start, halt: stop, arrived: arrived, at_far: sensor, goto: "drive(0, position)", lit: lamp}
    exits: {there: idle, jammed: {target: idle, do: lost = exit.count}}
    exit: log "left"
    on: {resume: idle}
"""


@pytest.fixture
def charts(tmp_path: Path) -> Path:
    (tmp_path / "axis.yaml").write_text(AXIS)
    (tmp_path / "press.yaml").write_text(HOST)
    return tmp_path


def using(charts: Path, states: str, more: str = "", name: str = "test.yaml") -> Chart:
    text = f"chart: Test\n{dedent(more)}\nstates:\n{indent(dedent(states), '  ')}"
    (charts / name).write_text(text)
    return load(charts / name)


def trace(chart: Chart, *lines: str) -> list[str]:
    return run_script(chart, [*lines])


def configuration(told: list[str]) -> str:
    return next(line for line in reversed(told) if line.startswith("= "))[2:]


def dumped(chart: Chart, *lines: str) -> dict[str, str]:
    told = trace(chart, *lines, "dump")
    return dict(line.split(" ", 2)[1:] for line in told if line.startswith("d "))


def names_of(chart: Chart) -> set[str]:
    return {d.name for d in (*chart.data, *chart.inputs, *chart.outputs)}


def test_names_that_are_not_bound_are_dotted(charts: Path) -> None:
    chart = load(charts / "press.yaml")
    assert names_of(chart) == {"lost", "sensor", "lamp", "left.tries", "left.mode", "left.seen"}
    assert {o.name for o in chart.operations} == {"drive"}
    assert "left.hop" in chart.event_index
    assert "left.go" not in chart.event_index
    assert dict(chart.constants)["left.FAR"].value == 2500
    assert [str(t) for t in chart.types] == ["Mode"]
    alone = using(charts, "a: {use: axis.yaml, exits: {there: a, jammed: a}}")
    assert names_of(alone) == {f"a.{n}" for n in ("tries", "mode", "seen", "at_far", "lit")}
    assert {o.name for o in alone.operations} == {"a.goto"}


def test_it_is_what_is_written_out_by_hand(charts: Path) -> None:
    """The same chart in the notation without copies, dots of its names written as `__`."""
    by_hand = """
        chart: Press
        constants: {left__FAR: 2500, left__T_MOVE: 20ms}
        types: {Mode: [slow, fast]}
        data: {lost: 0..3 = 0, left__tries: 0..3 = 1, left__mode: Mode = slow, left__seen: "uint8[2] = [1, 2]"}
        inputs: {sensor: bool}
        outputs: {lamp: bool = false}
        operations: ["drive(axis 0..3, position 0..4000)"]
        events: {in: [start, stop, resume, back], internal: [arrived(n 0..9), left__hop]}
        initial: idle
        states:
          idle: {on: {start: left, resume: left__halted, back: left__was}}
          left:
            exit: log "left"
            on: {resume: idle}
            initial: left__work
            states:
              left__work:
                states:
                  left__idle: {on: {start: left__moving}}
                  left__moving:
                    entry: drive(0, left__FAR); lamp = true
                    exit: lamp = false
                    on: {stop: left__halted}
                    always: [{if: sensor, target: left__there, do: raise arrived(n = left__tries)}]
                    after: {left__T_MOVE: [{if: left__tries < 3, target: left__moving, do: "left__tries += 1; left__seen[0] = 9"}, {target: left__jammed}]}
                  left__halted: {on: {start: left__moving}}
                  left__was: {history: shallow, default: left__idle}
              left__there: {choice: [idle]}
              left__jammed: {choice: [{target: idle, do: lost = left__tries}]}
    """
    (charts / "by_hand.yaml").write_text(dedent(by_hand))

    def told(name: str) -> object:
        text = json.dumps(chart_document(load(charts / name), NOWHERE))
        document = json.loads(text.replace("left.", "left__"))
        del document["sources"]
        return _without_places(document)

    assert told("press.yaml") == told("by_hand.yaml")


def _without_places(part: object) -> object:
    if isinstance(part, dict):
        return {k: _without_places(v) for k, v in part.items() if k not in ("at", "origin")}
    if isinstance(part, list):
        return [_without_places(each) for each in part]
    return part


KEPT = {
    "doc": "doc: waits for an order",
    "rest": "rest: true",
    "req": "req: SAFE-1",
}
"""For each field that a copy keeps as it is: a key that gives it another value than the default."""


@pytest.mark.parametrize("field", splicing.KEPT)
def test_a_copy_keeps_what_is_written_of_its_states(charts: Path, field: str) -> None:
    (charts / "axis.yaml").write_text(
        f"chart: Axis\ninitial: idle\nstates: {{idle: {{{KEPT[field]}}}}}\n"
    )
    chart = using(charts, "left: {use: axis.yaml}", "initial: left")
    used = load(charts / "axis.yaml").states[1]
    copy = chart.states[chart.state_index["left.idle"]]
    assert getattr(copy, field) == getattr(used, field) != getattr(chart.root, field)


def test_an_exit_is_taken_at_once_and_its_content_comes_last(charts: Path) -> None:
    chart = load(charts / "press.yaml")
    lines = ["start 0", "post start", "post start", "run 0", "run 20", "run 40", "run 60"]
    told = trace(chart, *lines)
    assert configuration(told) == "idle"
    last = told[max(n for n, line in enumerate(told) if line.startswith("@")) :]
    assert [line for line in last if line[0] in "+-l"] == [
        "- left.moving", "- left.work", "+ left.jammed", "- left.jammed", "- left", "log left",
        "+ idle",
    ]  # fmt: skip
    assert dumped(chart, *lines)["lost"] == "3"
    assert not any("done.state.left" in line for line in told)


def test_a_raised_event_stays_within_the_macrostep(charts: Path) -> None:
    chart = load(charts / "press.yaml")
    told = trace(chart, "start 0", "post start", "post start", "input sensor 1", "run 0")
    assert "raise arrived 1" in told
    assert not any(line.startswith("out") for line in told)


def test_entry_points_and_histories(charts: Path) -> None:
    chart = load(charts / "press.yaml")
    assert configuration(trace(chart, "start 0", "post resume", "run 0")) == "left.halted"
    lines = ["start 0", "post back", "run 0"]
    assert configuration(trace(chart, *lines)) == "left.idle"
    lines = ["start 0", "post resume", "run 0", "post resume", "post back", "run 0"]
    assert configuration(trace(chart, *lines)) == "left.halted"


@pytest.mark.parametrize(
    ("reset", "tries", "seen"), [("false", "2", "[9 2]"), ("true", "1", "[1 2]")]
)
def test_reset_sets_start_values_at_default_entry(
    charts: Path, reset: str, tries: str, seen: str
) -> None:
    text = HOST.replace("use: axis.yaml", f"use: {{chart: axis.yaml, reset: {reset}}}")
    (charts / "press.yaml").write_text(text)
    chart = load(charts / "press.yaml")
    lines = ["start 0", "post start", "post start", "run 0", "run 20", "post resume", "run 20"]
    assert dumped(chart, *lines)["left.tries"] == "2"
    found = dumped(chart, *lines, "post start", "run 20")
    assert (found["left.tries"], found["left.seen"]) == (tries, seen)
    assert dumped(chart, *lines, "post resume", "run 20")["left.tries"] == "2"


def test_arrays_have_a_constant_index(charts: Path) -> None:
    chart = using(
        charts,
        """
        a: {on: {back: both}}
        both:
          regions:
            "axis[i in 1..2]":
              use: axis.yaml
              with: {FAR: 1000 * i}
              start: {tries: i}
              bind: {goto: "drive(i, position)"}
              entry: log "in", i
          on:
            done.state.both: {if: "axis[1].tries > axis[2].tries", target: a}
            back: {if: "In(axis[2].moving)", target: "axis[2].resumed"}
        """,
        """
        events: {in: [back]}
        operations: ["drive(axis 0..3, position 0..4000)"]
        """,
    )
    told = trace(chart, "start 0", "post back", "post axis.2.go", "run 0", "post back", "run 0")
    assert [line for line in told if line.startswith("log")][:2] == ["log in 1", "log in 2"]
    assert "op drive 2 2000" in told
    assert configuration(told) == "axis.1.idle axis.2.halted"
    assert dumped(chart, "start 0")["axis.2.tries"] == "2"


def test_copies_in_copies_and_deep_histories(charts: Path) -> None:
    using(
        charts,
        """
        gate: {on: {open: inner}}
        inner: {use: axis.yaml, exits: {there: over, jammed: over}}
        over: {final: true}
        """,
        "events: {in: [open]}\nentries: {late: inner.resumed}",
        "between.yaml",
    )
    chart = using(
        charts,
        """
        out: {on: {in: inside, back: was, late: outer.late}}
        inside:
          on: {out: out}
          states:
            was: {history: deep, default: outer}
            outer: {use: between.yaml, exits: {over: out}}
        """,
        "events: {in: [in, out, back, late]}",
    )
    lines = ["start 0", "post in", "post outer.open", "post outer.inner.go", "run 0"]
    assert configuration(trace(chart, *lines)) == "outer.inner.moving"
    assert configuration(trace(chart, *lines, "post out", "post back", "run 0")) == (
        "outer.inner.moving"
    )
    assert configuration(trace(chart, "start 0", "post late", "run 0")) == "outer.inner.halted"
    assert [copy.name for copy in chart.copies] == ["outer", "outer.inner"]


def test_a_base_is_refined(charts: Path) -> None:
    (charts / "fast.yaml").write_text("chart: Fast\nextends: axis.yaml\nconstants: {T_MOVE: 5ms}\n")
    (charts / "derived.yaml").write_text(
        dedent("""
        chart: Derived
        extends: press.yaml
        refine:
          left:
            use: fast.yaml
            with: {FAR: 9}
            start: {mode: fast}
            exits: {jammed: left}
            override: [use, exits]
        """)
    )
    chart = load(charts / "derived.yaml")
    constants = dict(chart.constants)
    assert (constants["left.FAR"].value, constants["left.T_MOVE"].value) == (9, 5)
    found = dumped(chart, "start 0")
    assert (found["left.tries"], found["left.mode"]) == ("1", "1")
    jammed = chart.states[chart.state_index["left.jammed"]]
    assert [chart.transitions[t].targets for t in jammed.transitions] == [
        (chart.state_index["left"],)
    ]


@pytest.mark.parametrize(
    ("states", "rule"),
    [
        ("a: {use: axis.yaml, bind: {arrived: nowhere}}", "unknown-name"),
        ("a: {use: axis.yaml, bind: {nosuch: b}}", "unknown-binding"),
        ("a: {use: axis.yaml, with: {nosuch: 1}}", "unknown-binding"),
        ("a: {use: axis.yaml, start: {nosuch: 1}}", "unknown-binding"),
        ("a: {use: axis.yaml, exits: {idle: a}}", "unknown-binding"),
        ("a: {use: axis.yaml, initial: idle}", "unknown-binding"),
        ("a: {use: axis.yaml, bind: {FAR: 3}}", "unknown-binding"),
        ("a: {use: axis.yaml, bind: {hop: e}}", "unknown-binding"),
        ("a: {use: axis.yaml, bind: {go: nosuch}}", "unknown-name"),
        ("a: {use: axis.yaml, bind: {goto: nosuch}}", "unknown-name"),
        ("a: {use: axis.yaml, bind: {at_far: nosuch}}", "unknown-name"),
        ("a: {use: axis.yaml, bind: {at_far: n}}", "type-mismatch"),
        ("a: {use: axis.yaml, bind: {at_far: sense()}}", "binding-mismatch"),
        ("a: {use: axis.yaml, bind: {tries: n}}", "binding-mismatch"),
        ("a: {use: axis.yaml, bind: {lit: n}}", "binding-mismatch"),
        ("a: {use: axis.yaml, bind: {arrived: wide}}", "binding-mismatch"),
        ("a: {use: axis.yaml, bind: {arrived: e}, exits: {jammed: {target: a, if: true}}}",
         "choice-without-default"),
        ("a: {use: axis.yaml, bind: {arrived: both_ways}}", "ambiguous-binding"),
        ("a: {use: axis.yaml, bind: {goto: sense}}", "binding-mismatch"),
        ("a: {use: axis.yaml, bind: {tries: t}, start: {tries: 1}}", "bad-use"),
        ("a: {use: axis.yaml, regions: {b: {}}}", "unexpected-shape"),
        ("n: {use: axis.yaml}", "duplicate-name"),
        ("exit: {use: axis.yaml}", "bad-use"),
        ("a-b: {use: axis.yaml}", "bad-use"),
        ("a: {bind: {go: e}}", "missing-key"),
        ('"a[i in 2..0]": {use: axis.yaml}', "bad-index"),
        ('"a[i in 0..1]": {}', "missing-key"),
        ("a: {use: axis.yaml, on: {e: a.moving}}", "target-inside-copy"),
        ("a: {use: axis.yaml, on: {e: {do: a.tries = 1}}}", "assignment-into-copy"),
        ("a: {use: axis.yaml, on: {e: {do: log a.nosuch}}}", "unknown-name"),
        ("a: {use: axis.yaml, on: {e: {do: log exit.count}}}", "unknown-name"),
        ("a: {use: axis.yaml, exits: {there: {target: a, do: log exit.count}}}", "unknown-name"),
        ("a: {use: test.yaml}", "use-cycle"),
        ("a: {use: empty.yaml}", "unreadable-file"),
        ("a: {use: abstract.yaml}", "abstract-chart"),
        ("a: {use: ticks.yaml}", "different-ticks"),
        ("a: {use: types.yaml}", "type-differs"),
        ("a: {use: names.yaml}", "not-in-a-copy"),
        ("a: {use: loose.scxml}", "not-in-a-copy"),
    ],
)  # fmt: skip
def test_what_is_refused(charts: Path, states: str, rule: str) -> None:
    plain = "initial: a\nstates: {a: {}}\n"
    (charts / "abstract.yaml").write_text(f"chart: Abstract\nabstract: true\n{plain}")
    (charts / "ticks.yaml").write_text(f"chart: Ticks\ncapacity: {{tick: 5ms}}\n{plain}")
    (charts / "types.yaml").write_text(f"chart: Types\ntypes: {{Kind: [x]}}\n{plain}")
    (charts / "names.yaml").write_text(
        "chart: Names\nevents: {in: [e]}\nstates: {a: {on: {e: {do: log event.name}}}}\n"
    )
    (charts / "loose.scxml").write_text(
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0"><state id="a"/></scxml>'
    )
    with pytest.raises(FsmkitError) as error:
        using(
            charts,
            states,
            """
            types: {Kind: [x, y]}
            data: {n: 0..9 = 0, t: 0..3 = 0}
            operations: ["sense() -> bool"]
            events: {in: [e, both_ways(n 0..9), "wide(n 0..9, m 0..9)"], out: [both_ways(n 0..9)]}
            """,
        )
    assert rule in {d.rule.name for d in error.value.diagnostics}


def test_what_is_odd_is_told_once_at_its_own_line(charts: Path) -> None:
    (charts / "odd.yaml").write_text(
        "chart: Odd\ninputs: {on: bool}\nevents: {in: [e]}\n"
        "states: {a: {on: {e: [{target: b}, {target: a}]}}, b: {on: {e: a}}}\n"
    )
    findings = Findings()
    (charts / "test.yaml").write_text(
        'chart: Test\nstates: {all: {regions: {"odd[i in 0..2]": {use: odd.yaml}}}}\n'
    )
    load_with_findings(charts / "test.yaml", findings)
    told = [d for d in findings if d.rule.name == "dead-transition"]
    assert len(told) == 1
    assert told[0].primary is not None
    assert told[0].primary.span.source.name.endswith("odd.yaml")


def test_an_exit_that_nothing_follows_is_noted(charts: Path) -> None:
    findings = Findings()
    (charts / "test.yaml").write_text("chart: Test\nstates: {a: {use: axis.yaml}}\n")
    load_with_findings(charts / "test.yaml", findings)
    assert [d.rule.name for d in findings if d.rule.name == "unbound-exit"] == ["unbound-exit"]


@pytest.mark.parametrize("name", ["axis", "press"])
def test_both_notations_say_it(charts: Path, name: str) -> None:
    yaml, scxml = plugin(FrontEnd, "yaml"), plugin(FrontEnd, "scxml")
    document = read_document(charts / f"{name}.yaml", Findings())
    path = charts / f"{name}.scxml"
    path.write_text(scxml.write(document))
    again = read_document(path, Findings())
    assert again == document
    assert yaml.write(again) == yaml.write(document)


def test_drawings_fold_copies(charts: Path) -> None:
    chart = load(charts / "press.yaml")
    active = frozenset({chart.state_index["left"], chart.state_index["left.moving"]})
    drawn, shown = folded(chart, (), active)
    assert [s.id for s in drawn.states[1:]] == [
        "idle", "left", "left.resumed", "left.again", "left.there", "left.jammed",
    ]  # fmt: skip
    assert {drawn.states[s].id for s in shown} == {"left"}
    assert drawn.copies[0].path == "moving"
    assert drawn.states[drawn.state_index["left.there"]].kind is Kind.CHOICE
    arrows = {(t.source, t.targets) for t in drawn.transitions}
    assert (drawn.state_index["idle"], (drawn.state_index["left.resumed"],)) in arrows
    assert folded(chart, ("left",)) == (chart, frozenset())


def test_show_says_of_which_copy_a_line_is(charts: Path) -> None:
    from rich.console import Console

    chart = load(charts / "press.yaml")
    console = Console(width=200, record=True, file=None, force_terminal=False)
    with console.capture() as captured:
        console.print(chart_tree(chart, NOWHERE, with_origin=True))
    assert "axis.yaml:17 as left]" in captured.get()
    assert "left: Axis" in captured.get()


@pytest.mark.slow
def test_a_copy_does_what_the_chart_does_alone() -> None:
    for pair in pairs(seed=7, first=0, count=6):
        for name in ("interpreter", "python"):
            found = compare_pair(pair, harness(name))
            assert found is None, explain(pair, found)


@pytest.mark.slow
def test_random_charts_mean_what_is_written_out_by_hand() -> None:
    copies = 0
    for number in range(8):
        document = random_host(SeededChoices(f"by hand {number}"), number)
        copies += len(chart_of((document,)).copies)
        assert expansions.compare(document) == ""
        hand = expansions.by_hand(document)
        assert not any(state.use for state in states(hand.root))
    assert copies > 8


@pytest.mark.slow
@pytest.mark.cc
def test_charts_with_copies_do_the_same_everywhere() -> None:
    for number in range(4):
        choices = SeededChoices(f"copies {number}")
        documents = random_using(choices)
        chart = chart_of(documents)
        case = Case(documents, chart, random_script(choices, chart), f"chart {number}")
        for name in ("c-size", "python", "javascript")[: 2 + (number == 0)]:
            found = compare(case, harness(name))
            assert found is None, explained(case, found)
