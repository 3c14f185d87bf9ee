"""From a tree of states to a Chart: numbers, kinds, defaults, targets."""

from __future__ import annotations

from typing import Any

import pytest

from fsmkit.document.document import Kind, Trigger

NESTED = """
    chart: Nested
    events: {in: [go, back]}
    initial: a
    states:
      a: {on: {go: b}}
      b:
        initial: b2
        on: {back: again}
        states:
          b1: {}
          b2:
            regions:
              left: {initial: l1, states: {l1: {on: {go: l2}}, l2: {final: true}}}
              right: {initial: r1, states: {r1: {on: {go: r2}}, r2: {final: true}}}
          again: {history: deep, default: b1}
"""


def test_states_are_numbered_in_document_order(yaml: Any) -> None:
    chart = yaml(NESTED).chart
    assert [s.id for s in chart.states] == [
        *("Nested", "a", "b", "b1", "b2", "left", "l1", "l2", "right", "r1", "r2", "again")
    ]
    b = chart.states[chart.state_index["b"]]
    assert (b.kind, b.parent, b.depth, b.last_descendant) == (Kind.COMPOUND, 0, 1, 11)
    assert [chart.states[c].id for c in b.children] == ["b1", "b2", "again"]
    assert chart.states[4].kind is Kind.PARALLEL
    assert chart.states[4].initial is None


def test_initial_and_history_are_transitions(yaml: Any) -> None:
    chart = yaml(NESTED).chart
    for state, target in (("Nested", "a"), ("b", "b2"), ("again", "b1"), ("left", "l1")):
        index = chart.states[chart.state_index[state]].initial
        transition = chart.transitions[index]
        assert transition.trigger is Trigger.INITIAL
        assert transition.source == chart.state_index[state]
        assert [chart.states[t].id for t in transition.targets] == [target]


def test_the_first_child_is_the_default(yaml: Any) -> None:
    chart = yaml("chart: M\nevents: {in: [go]}\nstates: {a: {on: {go: b}}, b: {}}\n").chart
    assert chart.transitions[chart.root.initial].targets == (1,)


def test_the_root_yields_its_name_to_a_state(yaml: Any) -> None:
    chart = yaml("chart: same\nstates: {same: {}}\n").chart
    assert [s.id for s in chart.states] == ["<root>", "same"]


def test_platform_events_follow_the_declared(yaml: Any) -> None:
    chart = yaml(NESTED).chart
    assert [e.name for e in chart.events] == [
        "go",
        "back",
        "error.execution",
        "error.range",
        "error.communication",
        "done.state.b2",
        "done.state.left",
        "done.state.right",
    ]
    assert not chart.events[2].directions
    assert [e.index for e in chart.events] == list(range(8))


def test_descriptors_match_by_tokens(yaml: Any) -> None:
    chart = yaml(
        """
        chart: M
        events: {in: [foo, foo.bar, foobar]}
        states:
          a: {on: {foo: b}}
          b: {on: {foo.*: c}}
          c: {on: {"*": a, foobar: b}}
        """
    ).chart
    matched = [t.events for t in chart.transitions if t.trigger is Trigger.EVENT]
    assert matched == [(0, 1), (0, 1), (0, 1, 2, 3, 4, 5), (2,)]


@pytest.mark.parametrize(
    ("states", "rule"),
    [
        ("{a: {on: {go: nowhere}}}", "unknown-name"),
        ("{a: {}, b: {states: {a: {}}}}", "duplicate-state"),
        ("{a: {initial: b, states: {c: {}}}, b: {}}", "initial-outside"),
        ("{a: {regions: {r: {final: true}}}}", "state-not-allowed"),
        ("{a: {final: true, on: {go: a}}}", "transition-not-allowed"),
        ("{a: {states: {b: {}, h: {history: deep}}}}", "history-without-default"),
        (
            "{a: {states: {b: {states: {c: {}}}, h: {history: shallow, default: c}}}}",
            "history-default-outside",
        ),
        ("{a: {choice: [{if: 1 < 2, target: b}]}, b: {}}", "choice-without-default"),
        ("{a: {on: {go: {target: [b, c]}}}, b: {}, c: {}}", "targets-exclude-each-other"),
        (
            (
                "{a: {on: {go: {target: [h, d]}}}, p: {regions: "
                "{h: {history: shallow, initial: [b, c]}, d: {history: deep, initial: [b, c]}, "
                "b: {}, c: {}}}}"
            ),
            "targets-exclude-each-other",
        ),
        ("{a: {on: {went: a}}}", "unknown-name"),
        ("{a: {defer: went}}", "unknown-name"),
        ("{a: {every: {0ms: a}}}", "bad-delay"),
    ],
)
def test_wrong_structure_is_an_error(yaml: Any, states: str, rule: str) -> None:
    result = yaml(f"chart: M\nevents: {{in: [go]}}\nstates: {states}\n")
    assert result.maybe is None
    assert result.errors == [rule]
    assert result.one(rule).primary is not None
    assert result.one(rule).help


@pytest.mark.parametrize(
    "inside",
    [
        '<history id="h" type="deep"><transition target="h"/></history>',
        (
            '<history id="h" type="deep"><transition target="g"/></history>'
            '<history id="g" type="deep"><transition target="h"/></history>'
        ),
        '<initial><transition target="h"/></initial><history id="h"/>',
        (
            '<initial><transition target="h"/></initial>'
            '<history id="h"><transition target="a"/></history>'
        ),
    ],
)
def test_a_history_that_leads_back_to_itself(scxml: Any, inside: str) -> None:
    result = scxml(
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M">'
        f'<state id="a">{inside}<state id="b"/></state></scxml>'
    )
    assert set(result.errors) == {"history-default-outside"}


def test_a_history_that_a_state_begins_with(scxml: Any) -> None:
    result = scxml(
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M">'
        '<state id="a" initial="h"><history id="h"><transition target="b"/></history>'
        '<state id="b"/></state></scxml>'
    )
    assert not result.errors


def test_regions_are_entered_together(yaml: Any) -> None:
    chart = yaml(
        """
        chart: M
        events: {in: [go]}
        states:
          a: {on: {go: {target: [l2, r2]}}}
          p:
            regions:
              l: {states: {l1: {}, l2: {}}}
              r: {states: {r1: {}, r2: {}}}
        """
    ).chart
    (go,) = [t for t in chart.transitions if t.trigger is Trigger.EVENT]
    assert [chart.states[t].id for t in go.targets] == ["l2", "r2"]


def test_a_misspelt_target_suggests_one(yaml: Any) -> None:
    result = yaml("chart: M\nevents: {in: [go]}\nstates: {idle: {on: {go: idel}}}\n")
    assert result.one("unknown-name").help == "did you mean `idle`?"


def test_scxml_history_without_default_is_lenient(scxml: Any) -> None:
    result = scxml(
        """
        <scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M">
          <state id="a"><transition event="go" target="h"/></state>
          <state id="b"><state id="b1"/><state id="b2"/><history id="h"/></state>
        </scxml>
        """
    )
    chart = result.chart
    assert "history-without-default" in result.rules
    history = chart.states[chart.state_index["h"]]
    assert chart.transitions[history.initial].targets == (chart.state_index["b1"],)
