from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from fsmkit.document.document import Direction, DocTransition, Kind, Trigger
from fsmkit.language.statements.tree import Assign, DocSend, Log, Raise, Super

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    Chart = Callable[[str], Any]

HEAD = "chart: T\ninitial: a\nstates:\n  a: {}\n"


def state_of(chart: Chart, body: str) -> Any:
    lines = "\n".join("    " + line for line in body.splitlines())
    return chart(f"chart: T\nstates:\n  a:\n{lines}\n").state("a")


def transitions_of(chart: Chart, body: str) -> tuple[DocTransition, ...]:
    found: tuple[DocTransition, ...] = state_of(chart, body).transitions
    return found


def targets(transition: DocTransition) -> list[str]:
    return [target.value for target in transition.targets]


def test_declarations(chart: Chart) -> None:
    document = chart("""
        chart: Feeder
        extends: module.yaml
        abstract: true
        doc: |
          Presses.
        datamodel: ecmascript
        binding: late
        types:
          Fault: [none, lost]
          Point: {x: 0..9, "y": bool}
        constants: {T_PUSH: 1600ms}
        data:
          retries: 0..3 = 0
          samples: uint8[4] = 0
        inputs: {position: 0..4000}
        outputs: {setpoint: 0..4000 = 0}
        operations:
          - goto(position 0..4000, speed 0..100)
          - at_limit() -> bool
        events:
          in: [arrived, fault(code Fault)]
          out: [pushed]
          internal: [again]
        capacity: {queue: 12, tick: 100us}
        script: retries = 1
        states: {}
        """).document
    assert (document.name.value, document.extends.value) == ("Feeder", "module.yaml")
    assert (document.abstract, document.doc) == (True, "Presses.")
    assert (document.datamodel, document.late_binding) == ("ecmascript", True)
    assert [m.name.value for m in document.types[0].members] == ["none", "lost"]
    assert [(f.name.value, f.type.value) for f in document.types[1].fields] == [
        ("x", "0..9"), ("y", "bool"),
    ]  # fmt: skip
    assert [(c.name.value, c.value.value) for c in document.constants] == [("T_PUSH", "1600ms")]
    assert [(d.name.value, d.type.value, d.init.value) for d in document.data] == [
        ("retries", "0..3", "0"), ("samples", "uint8[4]", "0"),
    ]  # fmt: skip
    assert (document.inputs[0].type.value, document.inputs[0].init) == ("0..4000", None)
    assert document.outputs[0].init.value == "0"
    assert [o.name.value for o in document.operations] == ["goto", "at_limit"]
    assert [(e.name.value, e.direction) for e in document.events] == [
        ("arrived", Direction.IN), ("fault", Direction.IN),
        ("pushed", Direction.OUT), ("again", Direction.INTERNAL),
    ]  # fmt: skip
    assert [(c.name.value, c.value.value) for c in document.capacities] == [
        ("queue", "12"), ("tick", "100us"),
    ]  # fmt: skip
    assert isinstance(document.script[0], Assign)


def test_events_in_any_order(chart: Chart) -> None:
    document = chart(HEAD + "events: [{in: [a]}, {out: [b]}, {in: [c]}]").document
    assert [e.name.value for e in document.events] == ["a", "b", "c"]


@pytest.mark.parametrize(
    ("body", "kind"),
    [
        ("{}", Kind.ATOMIC),
        ("states: {b: {}}", Kind.COMPOUND),
        ("regions: {b: {}, c: {}}", Kind.PARALLEL),
        ("final: true", Kind.FINAL),
        ("final: false", Kind.ATOMIC),
        ("history: shallow\ndefault: b", Kind.SHALLOW_HISTORY),
        ("history: deep\ndefault: {target: b, do: x = 1}", Kind.DEEP_HISTORY),
        ("choice: [{if: x, target: b}, c]", Kind.CHOICE),
    ],
)
def test_kinds(chart: Chart, body: str, kind: Kind) -> None:
    assert state_of(chart, body).kind is kind


def test_parts_of_a_state(chart: Chart) -> None:
    state = state_of(
        chart,
        """\
doc: Waits.
rest: true
abstract: true
initial: {target: b, do: x = 1}
entry: super; log "in", x
exit:
  - x = 1
  - x = 2; x = 3
defer: [stop, pause]
data: {n: 0..3 = 0}
invariant: x < 3
override: [entry, initial]
done: {with: {code: x}}
invoke: {id: child, src: other.scxml, autoforward: true, with: {n: "1"}, names: [x]}
states: {b: {}}
""",
    )
    assert (state.doc, state.rest, state.abstract) == ("Waits.", True, True)
    assert targets(state.initial) == ["b"]
    assert len(state.initial.content) == 1
    ((first, second),) = state.entry
    assert isinstance(first, Super)
    assert isinstance(second, Log)
    assert [len(block) for block in state.exit] == [1, 2]  # one text, one handler
    assert [event.value for event in state.defer] == ["stop", "pause"]
    assert state.data[0].name.value == "n"
    assert state.invariant.value == "x < 3"
    assert state.overrides == {"entry", "initial"}
    assert state.done_data[0].name.value == "code"
    (invoke,) = state.invokes
    assert (invoke.id.value, invoke.src.value, invoke.autoforward) == ("child", "other.scxml", True)
    assert (invoke.arguments[0].value.value, invoke.name_list[0].value) == ("1", "x")
    assert invoke.finalize is None


def test_a_chart_inside_a_chart(chart: Chart) -> None:
    state = state_of(chart, "invoke: {content: {chart: Inner, states: {c: {}}}}")
    assert state.invokes[0].content.root.children[0].id.value == "c"


def test_transitions(chart: Chart) -> None:
    found = transitions_of(
        chart,
        """\
always: {if: x, target: b}
on:
  go stop: b
  "*":
    - {if: x > 1, target: [b, c], do: "raise e(v = 1); send f after 2s", type: internal}
    - b c
    - {}
after:
  T_PUSH: {target: error, watchdog: true, id: late}
  2s: b
every: {10ms: {do: x += 1, ordered: true}}
sometimes: [b]
""",
    )
    assert [t.trigger.value for t in found] == [
        "eventless", "event", "event", "event", "event", "after", "after", "every", "sometimes",
    ]  # fmt: skip
    assert [e.value for e in found[1].events] == ["go", "stop"]
    assert [targets(t) for t in found] == [
        ["b"], ["b"], ["b", "c"], ["b", "c"], [], ["error"], ["b"], [], ["b"],
    ]  # fmt: skip
    assert found[2].internal
    assert found[2].content is not None
    raised, sent = found[2].content
    assert isinstance(raised, Raise)
    assert isinstance(sent, DocSend)
    assert found[4].content is None
    assert [str(t.delay) for t in found[5:8]] == ["T_PUSH", "2s", "10ms"]
    assert (found[5].watchdog, str(found[5].id), found[7].ordered) == (True, "late", True)


def test_transitions_keep_the_order_written(chart: Chart) -> None:
    found = transitions_of(chart, "after: {1s: b}\non: {e: c}\nalways: d")
    assert [targets(t) for t in found] == [["b"], ["c"], ["d"]]
    found = transitions_of(
        chart,
        """\
transitions:
  - {on: a b, target: c}
  - {always: true, if: x, target: d}
  - {on: a, do: x = 1}
  - {after: 1s, target: e}
  - {every: T, target: f}
  - {sometimes: true, target: g}
""",
    )
    assert [t.trigger for t in found] == [
        Trigger.EVENT, Trigger.EVENTLESS, Trigger.EVENT,
        Trigger.AFTER, Trigger.EVERY, Trigger.SOMETIMES,
    ]  # fmt: skip
    assert [[e.value for e in t.events] for t in found[:3]] == [["a", "b"], [], ["a"]]
    assert str(found[4].delay) == "T"


def test_a_list_of_statements_is_one_block(chart: Chart) -> None:
    (transition,) = transitions_of(chart, "on: {e: {do: [x = 1, y = 2]}}")
    assert transition.content is not None
    assert len(transition.content) == 2
    (transition,) = transitions_of(chart, 'on: {e: {override: true, do: ""}}')
    assert transition.content == ()  # the base's statements are replaced by none


def test_refinements(chart: Chart) -> None:
    read = chart("""
        chart: D
        extends: b.yaml
        refine:
          again: {default: late}
          running:
            on: {e: {override: begin, if: super and x}}
            states: {more: {}}
        """)
    assert targets(read.state("again").initial) == ["late"]
    assert read.state("again").kind is Kind.ATOMIC
    (transition,) = read.state("running").transitions
    assert (str(transition.override), str(transition.guard)) == ("begin", "super and x")
    assert read.state("more").kind is Kind.ATOMIC
    assert read.document.root.children == ()


@pytest.mark.parametrize(
    ("text", "rule", "place", "help_"),
    [
        ("states: {}", "missing-key", "s", "start with `chart: A`"),
        ("chart: ''\nstates: {}", "missing-key", "''", "start with `chart: A`"),
        ("[a]", "unexpected-shape", "[a]", "key: value"),
        ("just text", "unexpected-shape", "just text", "key: value"),
        ("system: Cell\nmachines: {}", "not-a-chart", "system", "machines"),
        (HEAD + "inputz: {}", "unknown-key", "inputz", "did you mean `inputs`?"),
        (HEAD + "regions: {}", "unknown-key", "regions", "belongs to a state"),
        (HEAD + "  b: {constants: {}}", "unknown-key", "constants", "left margin"),
        (HEAD + "abstract: maybe", "unexpected-value", "maybe", "write false or true"),
        (HEAD + "datamodel: xpath", "unexpected-value", "xpath", "ecmascript"),
        (HEAD + "types: {F: {}}", "unexpected-shape", "{}", "list the members"),
        (HEAD + "types: {F: []}", "unexpected-shape", "[]", "list the members"),
        (HEAD + "operations: {goto: x}", "unexpected-shape", "{goto: x}", "- "),
        (HEAD + "events: {inn: [x]}", "unknown-key", "inn", "did you mean `in`?"),
        (HEAD + "events: {in: [fault(code Fault, n 0..3)]}", "lost-text", "fault", "quote it"),
        (HEAD + "capacity: {que: 3}", "unknown-key", "que", "did you mean `queue`?"),
        (HEAD + "data: {x: [1]}", "unexpected-shape", "[1]", "quote it"),
        (HEAD + "  b: [c]", "unexpected-shape", "[c]", "key: value"),
        (HEAD + "  b: {entri: x = 1}", "unknown-key", "entri", "did you mean `entry`?"),
        (HEAD + "  b: {states: {c: {}}, final: true}", "unexpected-shape", "final", "choose one"),
        (HEAD + "  b: {history: far}", "unexpected-value", "far", "shallow or deep"),
        (HEAD + "  b: {regions: {}, default: c}", "unexpected-shape", "default", "initial"),
        (HEAD + "  b: {override: [on]}", "unexpected-value", "on", "entry"),
        (HEAD + "  b: {on: {e: {goto: c}}}", "unknown-key", "goto", "target"),
        (HEAD + "  b: {on: {e: {type: inner}}}", "unexpected-value", "inner", "internal"),
        (HEAD + "  b: {invoke: {id: ''}}", "unexpected-shape", "''", "remove it"),
        (HEAD + '  b: {on: {"": c}}', "unexpected-shape", '""', "name it"),
        (HEAD + '  "": {}', "unexpected-shape", '""', "write it"),
        (HEAD + "  b: {transitions: [{target: c}]}", "missing-key", "{target: c}", "always"),
        (HEAD + "  b: {transitions: [{on: c, after: 1s}]}", "unexpected-shape", "after", "one of"),
        (HEAD + "  b:\n    entry:\n      raise f(x: 1)", "lost-text", "raise", '"raise'),
        (HEAD + "  b:\n    entry: raise f(x: 1)", "broken-yaml", ":", '`entry: "raise f(x: 1)"`'),
    ],
)
def test_findings(chart: Chart, text: str, rule: str, place: str, help_: str) -> None:
    read = chart(text)
    diagnostic = read.one(rule)
    assert read.maybe is None
    assert read.at(diagnostic).startswith(place)
    assert help_ in (diagnostic.help or "")


def test_a_name_has_no_space_around_it(chart: Chart) -> None:
    assert chart("chart: ' Lamp '\nstates: {a: {}}").document.name.value == "Lamp"


def test_findings_inside_statements_point_at_the_word(chart: Chart) -> None:
    read = chart(HEAD + "  b:\n    entry: |\n      x = 1\n      while y\n")
    (diagnostic,) = read.found
    assert read.at(diagnostic).startswith("while")


def test_all_findings_are_told(chart: Chart) -> None:
    read = chart(HEAD + "  b: {entri: x = 1, finall: true}\ndat: {}\n")
    assert read.errors == ["unknown-key"] * 3
