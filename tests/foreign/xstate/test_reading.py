"""Machines of XState as they are written: JSON, JavaScript, TypeScript, and what is rejected."""

from __future__ import annotations

import random

import pytest

pytest.importorskip("tree_sitter_typescript")

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.foreign.imports import Import
from fsmkit.foreign.xstate.reader import import_machine, machines
from fsmkit.yaml.writer import write_document

DOOR = """
import {setup, assign, raise} from 'xstate';
const MAX = 3;
const PRESSED = 'PRESS';
export const door = setup({
  types: {events: {} as {type: 'PRESS', force: number} | {type: 'user.in'} | {type: 'user.out'}},
  guards: {few: ({context}) => context.n < MAX},
  actions: {count: assign({n: ({context, event}) => context.n + event.force}), beep: () => noise()},
  delays: {LONG: 2500},
}).createMachine({
  id: 'door', initial: 'shut', context: {n: 0, owner: null as string | null},
  states: {
    shut: {
      entry: ['beep', {type: 'light', params: {on: true, level: 3}}],
      on: {[PRESSED]: [{guard: 'few', target: 'open', actions: 'count'}, 'gone'],
           'user.*': {actions: assign({owner: ({event}) => event.name})}},
    },
    open: {after: {LONG: 'shut'}, on: {PRESS: {actions: raise({type: 'user.in'})}}},
    gone: {type: 'final'},
  },
} satisfies object);
"""


def read(text: str, name: str = "door.ts") -> tuple[Import, Chart]:
    """Return the import and the chart of a program with one machine."""
    findings = Findings()
    source = Source(name, text)
    found_names = machines(source, findings)
    findings.stop_on_errors()
    (machine,) = found_names
    found = import_machine(source, machine, findings)
    findings.stop_on_errors()
    assert found is not None
    chart = elaborate((found.document,), findings)
    findings.stop_on_errors()
    assert chart is not None
    return found, chart


def rejection(text: str, name: str = "m.ts") -> str:
    """Return the message of the first error for a program; it has a location."""
    with pytest.raises(FsmkitError) as caught:
        read(text, name)
    first = caught.value.diagnostics[0]
    assert first.primary is not None
    return first.message


def test_a_program_becomes_a_chart() -> None:
    """Constants, implementations, types and delays are in the chart; code is opaque."""
    found, chart = read(DOOR)
    text = write_document(found.document)
    assert "n: int32 = 0" in text
    assert "if: n < 3, target: open, ordered: true, do: n = n + event.force" in text
    assert "2500ms: {target: shut" in text
    assert "PRESS(force int32)" in text
    assert "user_in user_out: {ordered: true, do: assign_owner()}" in text
    assert "entry: beep(); light(true, 3)" in text
    assert {one.name for one in found.opaque} == {"beep", "light", "assign_owner"}
    assert any("context.owner" in remark.message for remark in found.lost)
    assert [state.id for state in chart.states[1:]] == ["shut", "open", "gone"]


def test_conversion_is_stable() -> None:
    """The YAML of an import reads back to an equal document."""
    from fsmkit.yaml.reader import read_document

    found, _ = read(DOOR)
    text = write_document(found.document)
    findings = Findings()
    again = read_document(Source("door.yaml", text), findings)
    assert again is not None
    assert write_document(again) == text


def test_several_machines_have_different_names() -> None:
    """Machines are named after their variables; repeated names are numbered."""
    text = (
        "const a = createMachine({}); const b = setup({}).createMachine({}); f(createMachine({}));"
    )
    source = Source("m.js", text)
    assert machines(source, Findings()) == ("a", "b", "machine")


REJECTED = {
    "createMachine({context: ({input}) => ({n: 0, ...input})})": "the object that is spread here",
    "createMachine({initial: 'a', states: {a: {on: {x: {target: pick()}}}}})": "computed",
    "createMachine({initial: 'a', states: {a: {on: {x: 'b'}}}})": "not a state",
    "createMachine({initial: 'b', states: {a: {}}})": "not a child",
    "createMachine({states: {a: {}}})": "initial",
    "createMachine(config())": "not an object literal",
    "createMachine({...base, states: {}})": "computed when the program runs",
    "createMachine({[key()]: {}})": "computed when the program runs",
    "createMachine({initial: 'a', states: {a: {on: {x: {cond: 'c'}}}}})": "ignored by XState 5",
    "createMachine({entry: () => actor.send({type: 'x'})})": "posts an event",
    "createMachine({entry: enqueueActions(({enqueue}) => {})})": "decides when the program runs",
    "createMachine({entry: spawnChild('x')})": "decides when the program runs",
    "createMachine({entry: raise(({context}) => context.next)})": "computed",
    "createMachine({initial: 'a', states: {a: {always: {actions: 'x'}}}})": "only once",
    "createMachine({invoke: {src: 'x', onSnapshot: {}}})": "onSnapshot",
    "createMachine({initial: 'a', states: {a: {id: 'q'}, b: {id: 'q'}}})": "two states",
    "createMachine({type: 'odd'})": "not a type",
    "createMachine({initial: 'a', states: {a: {": "no JavaScript",
}


@pytest.mark.parametrize(("text", "part"), REJECTED.items())
def test_what_no_chart_expresses_is_rejected_with_its_location(text: str, part: str) -> None:
    """Each reason has a message and a location."""
    assert part in rejection(f"const machine = {text};")


def test_nothing_is_executed_and_constants_do_not_explode() -> None:
    """A program that would write a file, or whose constants double 40 times, only gets findings."""
    doubling = "const a0 = ['x'];" + "".join(
        f"const a{n + 1} = [...a{n}, ...a{n}];" for n in range(40)
    )
    message = rejection(f"{doubling} createMachine({{entry: a40}});")
    assert "values" in message
    cyclic = "const a = b; const b = a; const m = createMachine(a);"
    assert "nested" in rejection(cyclic)
    deep = "createMachine({initial: " + "[" * 5_000 + "]" * 5_000 + "})"
    assert "nested" in rejection(deep)


def test_hostile_names_stay_text() -> None:
    """Names of states, events, actions and context that are words or code become identifiers."""
    names = ["if", "a-b", "1", "ünï", "*/", "__proto__", "a b", "x;y", "true", "", "." * 3]
    states = ", ".join(
        f"{name!r}: {{on: {{'e{number}': {{actions: [{name + '!'!r}], target: '#n{number}'}}}},"
        f" id: 'n{number}'}}"
        for number, name in enumerate(names)
    )
    context = ", ".join(f"{name!r}: 0" for name in names)
    _, chart = read(
        f"createMachine({{initial: 'if', context: {{{context}}}, states: {{{states}}}}})"
    )
    assert len(chart.states) == len(names) + 1


def test_cut_and_changed_programs_are_read_or_rejected() -> None:
    """A thousandth of the campaign on damaged programs: no exception but findings."""
    draw = random.Random(5)
    for _ in range(150):
        text = DOOR[: draw.randrange(len(DOOR))] if draw.random() < 0.5 else DOOR
        for _ in range(draw.randrange(6)):
            place = draw.randrange(len(text) + 1)
            text = text[:place] + draw.choice("{}[]()'\"`,:;*\\/\0é=>") + text[place + 1 :]
        findings = Findings()
        source = Source("door.ts", text)
        try:
            for name in machines(source, findings):
                import_machine(source, name, findings)
        except FsmkitError as error:
            assert error.diagnostics  # noqa: PT017


def test_json_and_the_program_are_equal() -> None:
    """The same configuration as JSON gives the same chart."""
    config = (
        '{"initial": "a", "states": {"a": {"entry": ["beep"], "on": {"GO": "b", "*": {"actions": '
        '"other"}}}, "b": {"type": "parallel", "states": {"x": {"initial": "y", "states": {"y": '
        '{"on": {"GO": {"target": "#z"}}}}}, "w": {"id": "z"}}}}}'
    )
    one, _ = read(config, "m.json")
    other, _ = read(f"const m = createMachine({config});", "m.js")
    assert write_document(one.document) == write_document(other.document)
    assert [each.rule for each in one.rewritten] == ["R8", "R9", "R9"]


@pytest.mark.slow
def test_large_machines_are_read_in_seconds() -> None:
    """Thousands of states, and wildcards beside hundreds of timers, do not multiply."""
    chain = ", ".join(f"s{n}: {{on: {{e{n % 100}: 's{n // 2}'}}}}" for n in range(1_500))
    _, chart = read(f"const m = createMachine({{initial: 's0', states: {{{chain}}}}});")
    assert len(chart.states) == 1_501
    caught = ", ".join(
        f"p{n}: {{type: 'parallel', after: {{{n + 1}: 'p0'}}, states: {{"
        f"x{n}: {{on: {{'*': {{actions: 'a'}}}}}}, y{n}: {{}}}}}}"
        for n in range(60)
    )
    found, _ = read(f"const m = createMachine({{initial: 'p0', states: {{{caught}}}}});")
    assert sum(each.rule == "R12" for each in found.rewritten) == 60


def test_an_escaped_character_of_json_may_have_two_halves() -> None:
    text = r'{"initial": "\ud83d\ude80", "states": {"\ud83d\ude80": {"description": "\\ud83d"}}}'
    _, chart = read(text, "rocket.json")
    assert chart.states[1].doc == r"\ud83d"
    assert "half a character" in rejection(r'{"initial": "\ud83d", "states": {}}', "half.json")


def test_a_rejected_part_is_omitted_and_the_rest_is_kept() -> None:
    """With errors in its content only, an import still has the rest of the machine."""
    text = (
        "const m = createMachine({initial: 'a', states: {a: {entry: ['x', spawnChild('y')], on: "
        "{go: 'b'}}, b: {}}});"
    )
    findings = Findings()
    found = import_machine(Source("m.ts", text), "m", findings)
    assert findings.has_errors
    assert found is not None
    assert "entry: x()" in write_document(found.document)
