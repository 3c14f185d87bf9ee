"""What a derived chart may add and override, and what it may not."""

from __future__ import annotations

from typing import Any

import pytest

from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.statements import Assign, Log
from fsmkit.document.document import Kind, Origin
from fsmkit.language import Binary, BinaryOp, IntType

BASE = """
    chart: Module
    constants: {LIMIT: 3}
    data: {n: 0..9 = 1, ready: bool = false}
    events: {in: [go, stop, jam]}
    initial: idle
    states:
      idle:
        entry: n = 0
        on:
          go: {id: begin, if: ready, target: running, do: n = 1}
          jam: [{if: n > 1, target: error}, {target: idle}]
      running:
        abstract: true
        on: {stop: idle}
      work:
        initial: w1
        on: {jam: {type: internal, target: w2}}
        states:
          w1: {on: {go: w2}}
          w2: {on: {stop: before}}
          before: {history: shallow, default: w1}
      error: {}
"""

FILLED = "running: {states: {step: {}}}"


def derived(refine: str, more: str = "") -> str:
    return f"chart: Derived\nextends: base.yaml\n{more}\nrefine:\n  {refine}\n  {FILLED}\n"


def state(chart: Chart, name: str) -> Any:
    return chart.states[chart.state_index[name]]


def leaving(chart: Chart, name: str) -> list[Transition]:
    return [chart.transitions[t] for t in state(chart, name).transitions]


def targets(chart: Chart, name: str) -> list[str]:
    return [chart.states[s].id for t in leaving(chart, name) for s in t.targets]


def test_a_derived_chart_is_a_clone(yaml: Any) -> None:
    base, clone = yaml(BASE).chart, yaml(derived("error: {doc: same}"), BASE).chart
    assert base.abstract
    assert not clone.abstract
    assert (clone.name, clone.base) == ("Derived", "Module")
    assert [s.id for s in clone.states if s.id != "step"][1:] == [s.id for s in base.states][1:]
    assert {d.origin for d in clone.data} == {Origin.INHERITED}
    assert state(clone, "idle").origin is Origin.INHERITED
    assert state(clone, "step").origin is Origin.OWN
    assert [source.name for source in clone.sources] == ["chart.yaml", "base.yaml"]


def test_a_simple_state_becomes_compound(yaml: Any) -> None:
    chart = yaml(derived("error: {initial: e2, states: {e1: {}, e2: {}}}"), BASE).chart
    error = state(chart, "error")
    assert error.kind is Kind.COMPOUND
    assert chart.transitions[error.initial].targets == (chart.state_index["e2"],)


def test_own_transitions_come_after_the_inherited(yaml: Any) -> None:
    text = "idle: {on: {stop: error, jam: {first: true, if: ready, target: work}}}"
    chart = yaml(derived(text), BASE).chart
    assert targets(chart, "idle") == ["work", "running", "error", "idle", "error"]
    assert [t.origin for t in leaving(chart, "idle")] == [
        Origin.OWN,
        Origin.INHERITED,
        Origin.INHERITED,
        Origin.INHERITED,
        Origin.OWN,
    ]


def test_override_by_trigger_keeps_what_is_not_given(yaml: Any) -> None:
    chart = yaml(derived("idle: {on: {go: {override: true, target: error}}}"), BASE).chart
    go = leaving(chart, "idle")[0]
    assert go.origin is Origin.OVERRIDDEN
    assert go.guard is not None
    assert len(go.content) == 1
    assert targets(chart, "idle")[0] == "error"


def test_super_in_guard_and_content(yaml: Any) -> None:
    text = 'idle: {on: {go: {override: begin, if: super and n < LIMIT, do: log "a"; super}}}'
    go = leaving(yaml(derived(text), BASE).chart, "idle")[0]
    assert isinstance(go.guard, Binary)
    assert go.guard.op is BinaryOp.AND
    assert [type(s) for s in go.content] == [Log, Assign]


def test_super_reaches_through_two_bases(yaml: Any) -> None:
    middle = """
        chart: Middle
        extends: base.yaml
        abstract: true
        refine: {idle: {entry: log "middle"; super, on: {go: {override: true, if: super or n > 5}}}}
    """
    text = derived('idle: {entry: log "own"; super, on: {go: {override: true, if: not (super)}}}')
    chart = yaml(text, middle, BASE).chart
    (entry,) = state(chart, "idle").on_entry
    assert [s.label for s in entry[:2]] == ["own", "middle"]
    assert isinstance(entry[2], Assign)
    plain = yaml(
        BASE.replace("if: ready", "if: not (ready or n > 5)").replace(
            "abstract: true", "rest: true"
        )
    ).chart
    assert leaving(chart, "idle")[0].guard == leaving(plain, "idle")[0].guard


def test_constants_start_values_and_ranges(yaml: Any) -> None:
    more = "constants: {LIMIT: 2}\ndata: {n: 0..5 = 4}\ncapacity: {queue: 3}"
    chart = yaml(derived("error: {doc: same}", more), BASE).chart
    n = chart.data[0]
    assert (n.type, n.init.value, n.origin) == (IntType(0, 5), 4, Origin.OVERRIDDEN)
    assert dict(chart.constants)["LIMIT"].value == 2
    assert chart.capacities.queue == 3


def test_a_bound_by_constant_may_not_widen(yaml: Any) -> None:
    base = BASE.replace("n: 0..9", "n: 0..LIMIT")
    result = yaml(derived("error: {doc: same}", "constants: {LIMIT: 4}"), base)
    assert result.errors == ["widened-range"]


def test_regions_for_a_compound_state(yaml: Any) -> None:
    text = "work: {regions: {watch: {states: {ok: {}}}}}"
    result = yaml(derived(text), BASE)
    chart = result.chart
    work, main = state(chart, "work"), state(chart, "work.main")
    assert work.kind is Kind.PARALLEL
    assert [chart.states[c].id for c in work.children] == ["work.main", "watch"]
    assert [chart.states[c].id for c in main.children] == ["w1", "w2", "before"]
    assert chart.transitions[main.initial].targets == (chart.state_index["w1"],)
    assert "internal-of-parallel" in result.rules


def test_regions_for_a_state_that_another_derived_chart_filled(yaml: Any) -> None:
    between = derived("error: {states: {e1: {}, e2: {}}}")
    chart = yaml(
        "chart: Last\nextends: between.yaml\nrefine:\n"
        "  error: {regions: {watch: {states: {ok: {}}}}}\n",
        between,
        BASE,
    ).chart
    error, main = state(chart, "error"), state(chart, "error.main")
    assert [chart.states[c].id for c in error.children] == ["error.main", "watch"]
    assert [chart.states[c].id for c in main.children] == ["e1", "e2"]


def test_a_deep_history_stays_with_the_parallel_state(yaml: Any) -> None:
    base = BASE.replace("history: shallow", "history: deep")
    chart = yaml(derived("work: {regions: {watch: {states: {ok: {}}}}}"), base).chart
    assert state(chart, "before").parent == chart.state_index["work"]


def test_transitions_of_one_trigger_are_overridden_together(yaml: Any) -> None:
    """In their order: each keeps what is not given anew; also the alternatives of a choice."""
    jams = "[{override: true, if: n > 2}, {override: true, target: error}]"
    chart = yaml(derived(f"idle: {{on: {{jam: {jams}}}}}"), BASE).chart
    _, first, second = leaving(chart, "idle")
    assert [chart.states[s].id for t in (first, second) for s in t.targets] == ["error", "error"]
    assert "2" in str(first.guard)
    assert second.guard is None
    base = BASE.replace(
        "error: {}", "pick: {choice: [{if: n > 3, target: idle}, {target: error}]}\n      error: {}"
    )
    both = "[{override: true, if: n > 5}, {override: true, do: n = 4}]"
    chart = yaml(derived(f"pick: {{choice: {both}}}"), base).chart
    assert [chart.states[s].id for t in leaving(chart, "pick") for s in t.targets] == [
        "idle",
        "error",
    ]
    assert yaml(derived("pick: {choice: [{target: work}]}"), base).errors


@pytest.mark.parametrize(
    ("refine", "rule"),
    [
        ("idel: {rest: true}", "override-of-nothing"),
        ("idle: {on: {stop: {override: true, target: error}}}", "override-of-nothing"),
        ("idle: {on: {go: {override: begun, target: error}}}", "override-of-nothing"),
        ("idle: {on: {jam: {override: true, target: error}}}", "ambiguous-override"),
        ("idle: {on: {stop: {override: begin, target: error}}}", "forbidden-change"),
        ("idle: {entry: n = 2}", "unmarked-override"),
        ("work: {initial: w2}", "unmarked-override"),
        ("error: {states: {idle: {}}}", "redefines-inherited"),
        ("error: {states: {wrapper: {states: {w1: {}}}}}", "redefines-inherited"),
        ("error: {final: true}", "forbidden-change"),
        ("error: {states: {e: {on: {go: {override: true, target: e}}}}}", "override-of-nothing"),
        ("error: {exit: super}", None),
    ],
)
def test_forbidden_changes(yaml: Any, refine: str, rule: str | None) -> None:
    result = yaml(derived(refine), BASE)
    assert result.errors == ([] if rule is None else [rule])
    if rule is not None:
        assert result.one(rule).help


def test_both_places_are_shown(yaml: Any) -> None:
    finding = yaml(derived("idle: {entry: n = 2}"), BASE).one("unmarked-override")
    assert finding.primary.span.source.name == "chart.yaml"
    assert finding.secondary[0].span.source.name == "base.yaml"


@pytest.mark.parametrize(
    "more",
    ["types: {T: [a]}", "operations: [act()]", "events: {in: [go]}"],
)
def test_declarations_are_not_repeated(yaml: Any, more: str) -> None:
    base = BASE.replace("constants:", "types: {T: [a]}\n    operations: [act()]\n    constants:")
    assert yaml(derived("error: {doc: same}", more), base).errors == ["redefines-inherited"]


def test_an_abstract_state_must_be_refined(yaml: Any) -> None:
    text = "chart: Derived\nextends: base.yaml\n"
    result = yaml(text, BASE)
    assert result.errors == ["abstract-state-left"]
    assert yaml(text + "abstract: true\n", BASE).chart.abstract


def test_marked_overrides_replace(yaml: Any) -> None:
    text = 'idle: {override: [entry], entry: log "x"}\n  work: {override: [initial], initial: w2}'
    chart = yaml(derived(text), BASE).chart
    (entry,) = state(chart, "idle").on_entry
    assert [type(s) for s in entry] == [Log]
    assert state(chart, "idle").origin is Origin.OVERRIDDEN
    initial = chart.transitions[state(chart, "work").initial]
    assert initial.targets == (chart.state_index["w2"],)


def test_the_default_of_a_history_is_replaced_where_marked(yaml: Any) -> None:
    result = yaml(derived("before: {default: w2}"), BASE)
    assert result.errors == ["unmarked-override"]
    assert "override: [default]" in (result.one("unmarked-override").help or "")
    chart = yaml(derived("before: {override: [default], default: w2}"), BASE).chart
    default = chart.transitions[state(chart, "before").initial]
    assert default.targets == (chart.state_index["w2"],)


def test_a_change_of_the_base_propagates(yaml: Any) -> None:
    base = BASE.replace("error: {}", "error: {on: {go: idle}}")
    assert targets(yaml(derived("error: {doc: same}"), base).chart, "error") == ["idle"]


def test_an_invariant_is_replaced_where_marked(yaml: Any) -> None:
    base = "chart: B\ndata: {n: 0..9 = 0}\nstates: {s: {invariant: n < 9}}"
    refine = "chart: D\nextends: base.yaml\nrefine: {s: {invariant: n < 5%s}}"
    assert yaml(refine % "", base).errors == ["unmarked-override"]
    chart = yaml(refine % ", override: [invariant]", base).chart
    assert state(chart, "s").invariant.right.value == 5
