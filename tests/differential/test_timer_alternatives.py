"""Transitions of one state with one delay share a timer: the first enabled one is taken.

Every runtime does the same, and a chart in SCXML the same as in YAML.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest

from devtools.runtimes import harnesses
from fsmkit.chart.chart import Chart
from fsmkit.chart.limits import timeouts_at_once
from fsmkit.chart.loading import load, load_with_findings, read_documents
from fsmkit.diagnostics import Findings
from fsmkit.scxml.writer import write_document as write_scxml
from fsmkit.testing.harness.harness import INTERPRETER, Harness
from fsmkit.yaml.writer import write_document as write_yaml
from tests.parameters import sampled

GUARDS = ("n == 0", "n == 1", "n == 2", "10 / n > 3", "t + 100 > 250", "In(other)", None)
"""The fourth cannot be evaluated where ``n`` is 0, the fifth stops the machine where ``t`` is high.
"""
BODIES = ("do: n = 1", "target: other", "target: inner, do: t = 200", "do: [n = 2, raise own]")

HEAD = """
chart: Alternatives
data: {n: 0..9 = 0, t: 0..255 = 0}
events: {in: [go, back, high], internal: [own]}
"""


def alternatives(seed: int, key: str) -> str:
    """Return one to four transitions of one delay."""
    found = []
    for place in range(1 + seed % 4):
        guard = GUARDS[(seed * 5 + place * 3) % len(GUARDS)]
        body = BODIES[(seed * 7 + place * 5) % len(BODIES)]
        found.append(f"{{{'' if guard is None else f'if: {guard}, '}{body}}}")
    return f"{key}: {{10ms: [{', '.join(found)}], 25ms: [{', '.join(found[::-1])}]}}"


def text(seed: int) -> str:
    """Return a chart with timers of several alternatives in a leaf, around it and in regions."""
    leaf, around, region = (
        alternatives(seed + step, key)
        for step, key in zip((0, 11, 29), ("after", "every", "after"), strict=True)
    )
    return f"""{HEAD}
initial: outer
states:
  outer:
    {around}
    on: {{go: both, high: {{do: t = 200}}}}
    states:
      inner:
        {leaf}
        on: {{own: {{do: t = 1}}}}
  both:
    on: {{back: outer}}
    regions:
      left: {{states: {{one: {{{region}}}}}}}
      right: {{states: {{other: {{every: {{10ms: [{{if: n == 0, do: n = 3}}, {{do: n = 0}}]}}}}}}}}
"""


SCRIPT = (
    *("start 0", "run 10", "save", "run 25", "run 100", "post high", "run 130", "save"),
    *("post go", "run 140", "save", "run 200", "post back", "run 300", "post go", "run 400"),
)


def chart_of(folder: Path, written: str) -> Chart:
    path = folder / "chart.yaml"
    path.write_text(written)
    return load_with_findings(path, Findings())


@pytest.mark.external
@pytest.mark.parametrize("runtime", harnesses(), ids=lambda runtime: runtime.name)
def test_every_runtime_takes_the_first_enabled_one(runtime: Harness, tmp_path: Path) -> None:
    taken = set()
    for seed in range(0, 28, 9):
        chart = chart_of(tmp_path, text(seed))
        expected = INTERPRETER.run(chart, SCRIPT)
        assert runtime.run(chart, SCRIPT) == expected, seed
        taken |= {line for line in expected if "timeout" in line}
    assert len(taken) > 10


@pytest.mark.parametrize("seed", sampled(range(28), every=4))
def test_both_notations_say_the_same(seed: int, tmp_path: Path) -> None:
    first = tmp_path / "first.yaml"
    first.write_text(text(seed))
    (document,) = read_documents(first, Findings())
    second = tmp_path / "second.scxml"
    second.write_text(write_scxml(document))
    (again,) = read_documents(second, Findings())
    third = tmp_path / "third.yaml"
    third.write_text(write_yaml(again))
    traces = [INTERPRETER.run(load(path), SCRIPT) for path in (first, second, third)]
    assert traces[0] == traces[1] == traces[2]
    assert third.read_text() == write_yaml(document)


@pytest.mark.parametrize("count", [1, 2, 30, pytest.param(300, marks=pytest.mark.slow)])
def test_a_delay_takes_one_timer(count: int, tmp_path: Path) -> None:
    listed = ", ".join(f"{{if: n == {n}, do: n = {n + 1}}}" for n in range(count))
    chart = chart_of(
        tmp_path,
        f"chart: Many\ndata: {{n: 0..500 = {count - 1}}}\n"
        f"states: {{a: {{every: {{1s: [{listed}]}}}}}}\n",
    )
    assert timeouts_at_once(chart) == 1
    trace = INTERPRETER.run(chart, ("start 0", "run 1000", "dump"))
    assert f"t {count}" in trace


def timers(chart: Chart, state: str) -> list[list[str]]:
    """Return for each timer of a state the targets of its alternatives."""
    return [
        [chart.states[t.targets[0]].id for t in waiting]
        for waiting in chart.alternatives.values()
        if chart.states[waiting[0].source].id == state
    ]


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ("after: {1s: b}", "after: {1s: c}", [["b", "c"]]),
        ("after: {1s: b}", "after: {1000ms: c}", [["b"], ["c"]]),
        ("after: {T: b}", "after: {U: c}", [["b"], ["c"]]),
        ("after: {1s: b}", "every: {1s: c}", [["b"], ["c"]]),
        ("every: {T: [b, c]}", "every: {T: [c, b]}", [["b", "c", "c", "b"]]),
        ("transitions: [{after: T, target: b}, {on: e, target: b}, {after: T, target: c}]",
         "on: {e: c}", [["b", "c"]]),
    ],
)  # fmt: skip
def test_inherited_alternatives_come_first(
    first: str, second: str, expected: list[list[str]], tmp_path: Path
) -> None:
    (tmp_path / "base.yaml").write_text(
        "chart: Base\nconstants: {T: 1s, U: 1s}\nevents: {in: [e]}\n"
        f"initial: a\nstates: {{a: {{{first}}}, b: {{}}, c: {{}}}}\n"
    )
    chart = chart_of(tmp_path, f"chart: Derived\nextends: base.yaml\nrefine: {{a: {{{second}}}}}\n")
    assert timers(chart, "a") == expected


def test_an_inherited_alternative_is_overridden_by_its_id(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text(
        "chart: Base\ndata: {n: 0..9 = 0}\ninitial: a\nstates:\n"
        "  a: {after: {1s: [{if: n == 0, target: b, id: zero}, {target: c, id: rest}]}}\n"
        "  b: {}\n  c: {}\n"
    )
    chart = chart_of(
        tmp_path,
        "chart: Derived\nextends: base.yaml\nrefine:\n"
        "  a: {after: {1s: [{override: rest, target: a}, {first: true, if: n == 5, target: c}]}}\n",
    )
    assert timers(chart, "a") == [["c", "b", "a"]]


def test_a_copy_of_a_chart_has_the_timers_of_the_chart(tmp_path: Path) -> None:
    (tmp_path / "used.yaml").write_text(
        "chart: Used\nconstants: {T: 10ms, U: 10ms}\ndata: {n: 0..9 = 0}\ninitial: a\nstates:\n"
        "  a: {after: {T: [{if: n == 1, target: b}, {target: c}], U: c}}\n  b: {}\n  c: {}\n"
    )
    chart = chart_of(
        tmp_path,
        "chart: User\ninitial: left\nstates:\n"
        "  left: {use: used.yaml, with: {U: 10ms}}\n  right: {use: used.yaml, with: {T: 30ms}}\n",
    )
    for state in ("left", "right"):
        inner = [[f"{state}.b", f"{state}.c"], [f"{state}.c"]]
        assert timers(chart, f"{state}.a") == inner


@pytest.mark.parametrize(
    ("listed", "rules"),
    [
        ("{if: n == 0, target: b}, {if: n == 1, target: c}", {"timeout-with-guard"}),
        ("{if: n == 0, target: b}, {if: n > 0, target: c}", set()),
        ("{if: n == 0, target: b}, {if: n == 1, target: c}, {if: n == 2, target: a}", set()),
        ("{if: n == 0, target: b}, {target: c}", set()),
        ("{target: b}, {target: c}", {"dead-transition"}),
        ("{if: n > 0, target: b}, {if: n < 2, target: c}", {"nondeterministic-choice"}),
    ],
)
def test_checks_read_a_list_as_one_choice(listed: str, rules: set[str], tmp_path: Path) -> None:
    path = tmp_path / "chart.yaml"
    path.write_text(
        "chart: Checks\ndata: {n: 0..2 = 0}\nevents: {in: [x]}\ninitial: a\nstates:\n"
        f"  a: {{on: {{x: {{do: n = 1}}}}, after: {{1s: [{listed}]}}}}\n  b: {{}}\n  c: {{}}\n"
    )
    findings = Findings()
    load_with_findings(path, findings)
    found = [d.rule.name for d in findings if d.rule.name != "unread-data"]
    assert sorted(found) == sorted(rules)


def test_guards_are_tried_in_all_orders(tmp_path: Path) -> None:
    """The first true guard of three decides, whatever content of an earlier expiry changed."""
    for values in product(("true", "false"), repeat=3):
        listed = ", ".join(f"{{if: {v}, target: s{n}}}" for n, v in enumerate(values))
        chart = chart_of(
            tmp_path,
            f"chart: Three\ninitial: a\nstates: {{a: {{after: {{1s: [{listed}]}}}}, "
            "s0: {}, s1: {}, s2: {}}\n",
        )
        first = next((f"s{n}" for n, v in enumerate(values) if v == "true"), "a")
        trace = INTERPRETER.run(chart, ("start 0", "run 1000", "dump"))
        assert any(first in line for line in trace[-2:]), (values, trace)
