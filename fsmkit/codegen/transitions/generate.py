"""A chart as a module for the library: a model class, and the configuration of a machine."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from fsmkit.analysis.effects import Effects, done_event
from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.content import all_statements, conditions
from fsmkit.chart.statements import Destination, Log, Send
from fsmkit.codegen.python import template
from fsmkit.codegen.python.expressions import spell
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.names import distinct, identifier, members_of
from fsmkit.codegen.python.relations import describe
from fsmkit.codegen.python.sending import annotation
from fsmkit.codegen.transitions.content import ContentPrinter, has_peer
from fsmkit.codegen.transitions.expressions import ModelPrinter
from fsmkit.codegen.transitions.limits import is_raised
from fsmkit.codegen.transitions.names import ModelNames, model_names, text
from fsmkit.codegen.transitions.order import Order
from fsmkit.document.document import Kind, Trigger
from fsmkit.language import ArrayType, EnumType, Field, RecordType
from fsmkit.language.walk import subexpressions
from fsmkit.texts import printing
from fsmkit.texts.python import docstring, paragraph

WIDTH = 90
"""Columns of a transition on one line."""
HEADER = '''\
"""{doc}

Made by fsmkit from {source}: change that, not this. It needs the library `transitions` (0.9).
"""

from __future__ import annotations

{imports}

from transitions.extensions import HierarchicalMachine
from transitions.extensions.nesting import NestedState
'''


@dataclass(frozen=True, slots=True)
class Entry:
    """A transition of the configuration; ``index`` is that in the chart, None for the start."""

    trigger: str
    source: str
    dest: str | None
    index: int | None
    condition: str | None = None
    callback: str | None = None
    place: str = "before"


@printing
def module_text(chart: Chart) -> str:
    """Return the text of the module: the same for the same chart."""
    names = model_names(chart)
    model = _model(chart, names)
    helpers = _helpers(model)
    pieces = (
        _header(chart, f"{helpers}\n{model}"),
        *_enumerations(chart, names),
        helpers,
        model,
        _state_class(names),
        _configuration(chart, names),
        _machine(chart, names),
    )
    return "\n\n\n".join(piece.strip("\n") for piece in pieces if piece.strip()) + "\n"


def has_start(chart: Chart) -> bool:
    """Whether something is done when a chart starts: the library enters initial states silently."""
    order = Order(chart)
    initial = _initial(chart)
    entered = order.entries(initial)
    return bool(chart.script or initial.content) or any(
        any(state.on_entry) or order.entry_effects[state.index] != Effects() for state in entered
    )


def entries(chart: Chart, names: ModelNames) -> Iterator[Entry]:
    """Yield the transitions in the order of the configuration: by state and priority."""
    order = Order(chart)
    if has_start(chart):
        initial = _initial(chart)
        callback = "begin" if chart.script or initial.content else None
        dest = names.paths[initial.targets[0]]
        yield Entry(names.start, names.initial, dest, None, callback=callback)
    for state in chart.states:
        for index in state.transitions:
            transition = chart.transitions[index]
            name = names.names.transitions[index]
            for event in dict.fromkeys(transition.events):
                if is_raised(chart, event):
                    yield Entry(
                        chart.events[event].name,
                        names.paths[transition.source],
                        names.paths[transition.targets[0]] if transition.targets else None,
                        index,
                        None if transition.guard is None else f"guard_{name}",
                        f"do_{name}" if transition.content else None,
                        order.place_of_content(transition) or "before",
                    )


def _initial(chart: Chart) -> Transition:
    assert chart.root.initial is not None  # noqa: S101  (a chart is sound)
    return chart.transitions[chart.root.initial]


# --- parts of the module ----------------------------------------------------------------------


def _header(chart: Chart, body: str) -> str:
    imports = [
        f"import {name}"
        for name in ("logging", "math", "struct")
        if re.search(rf"(?<![\w.]){name}\.", body)
    ]
    if any(isinstance(type_, EnumType) for type_ in chart.types):
        imports.append("from enum import IntEnum")
    imports.append("from typing import Any")
    source = re.split(r"[/\\]", chart.sources[0].name)[-1] if chart.sources else "a chart"
    doc = chart.doc or "The machine " + chart.name + "."
    return HEADER.format(
        doc=paragraph(doc),
        source=docstring(source),
        imports="\n".join(imports),
    )


def _enumerations(chart: Chart, names: ModelNames) -> Iterator[str]:
    taken = {f"{names.names.machine}{part}" for part in ("Model", "State", "Machine")}
    for type_ in chart.types:
        if isinstance(type_, EnumType):
            (named,) = distinct([identifier(type_.name)], taken)
            taken.add(named)
            out = Lines()
            with out.suite(f"class {named}(IntEnum):"):
                out.line('"""An enumeration of the chart."""')
                out.line()
                for member, number in zip(members_of(type_), type_.numbers, strict=True):
                    out.line(f"{member} = {number}")
            yield out.finish()


def _helpers(model: str) -> str:
    """Return the functions for what Python's operators mean something else by."""
    functions = _starting("def ", model)
    return "\n\n\n".join((*_starting("class ", "\n".join(functions)), *functions))


def _starting(word: str, text: str) -> list[str]:
    """Return the functions, or the classes, that a text needs."""
    return [each for each in template.arithmetic(text) if each.startswith(word)]


def _model(chart: Chart, names: ModelNames) -> str:
    out = Lines()
    printer = ContentPrinter(chart, names)
    with out.suite(f"class {names.names.machine}Model:"):
        out.line('"""Data, guards and content. A subclass has the operations of the host."""')
        out.line()
        out.line("state: Any")
        out.line("trigger: Any")
        out.line(f"machine: {names.names.machine}Machine")
        with out.method("__init__", "Give data, inputs and outputs their start values."):
            for variable in (*chart.data, *chart.inputs, *chart.outputs):
                is_parts = isinstance(variable.type, ArrayType | RecordType)
                value = spell(variable.init.value, variable.type, mutable=is_parts)
                attribute = names.names.variables[variable.name]
                out.line(f"self.{attribute}: {annotation(variable.type)} = {value}")
            if not (chart.data or chart.inputs or chart.outputs):
                out.line("return")
        _host(out, chart, names)
        _guards(out, chart, names)
        _content(out, chart, names, printer)
        _given(out, chart)
    return out.finish()


def _host(out: Lines, chart: Chart, names: ModelNames) -> None:
    for operation in chart.operations:
        passed = _parameters(operation.parameters)
        result = "None" if operation.result is None else annotation(operation.result)
        name = names.names.operations[operation.name]
        with out.method(name, "Operation `" + operation.name + "` of the host.", passed, result):
            _require_own(out, name, names)
    sent = {
        statement.event
        for statement in all_statements(chart)
        if isinstance(statement, Send) and statement.destination is Destination.PORT
    }
    for event in sorted(sent):
        declared = chart.events[event]
        passed = _parameters(declared.fields)
        if has_peer(chart, event):
            passed = f"{passed}, peer: str | None" if passed else "peer: str | None"
        doc = "Event `" + declared.name + "` leaves the machine."
        name = f"send_{names.names.events[event]}"
        with out.method(name, doc, passed):
            _require_own(out, name, names)


def _require_own(out: Lines, method: str, names: ModelNames) -> None:
    """Write the body of a method that is the host's: who meets the error learns where it goes."""
    model = f"{names.names.machine}Model"
    out.line(f'raise NotImplementedError("define `{method}` in a subclass of `{model}`")')


def _parameters(fields: tuple[Field, ...]) -> str:
    chosen = distinct([identifier(part.name) for part in fields], {"self", "peer"})
    each = zip(chosen, fields, strict=True)
    return ", ".join(f"{name}: {annotation(part.type)}" for name, part in each)


def _guards(out: Lines, chart: Chart, names: ModelNames) -> None:
    for transition in _taken(chart):
        if transition.guard is None:
            continue
        doc = f"The guard of {describe(chart, transition)}."
        name = f"guard_{names.names.transitions[transition.index]}"
        with out.method(name, doc, "event: Any", "bool"):
            printer = ModelPrinter(names.names, _payload(chart, transition), model=names)
            out.line(f"held: bool = {printer.print(transition.guard)}")
            out.line("return held")


def _content(out: Lines, chart: Chart, names: ModelNames, printer: ContentPrinter) -> None:
    plain = ModelPrinter(names.names, {}, model=names)
    initial = _initial(chart)
    if chart.script or initial.content:
        with out.method("begin", "What is done before all states.", "event: Any"):
            printer.block(out, (*chart.script, *initial.content), plain)
    for transition in _taken(chart):
        if transition.content:
            doc = f"The content of {describe(chart, transition)}."
            name = f"do_{names.names.transitions[transition.index]}"
            with out.method(name, doc, "event: Any"):
                own = ModelPrinter(names.names, _payload(chart, transition), model=names)
                printer.block(out, transition.content, own)
    for state in chart.states:
        name, done = names.names.bare[state.index], done_event(chart, state)
        if any(state.on_entry) or done is not None:
            with out.method(f"enter_{name}", "The entry of `" + state.id + "`.", "event: Any"):
                for block in state.on_entry:
                    printer.block(out, block, plain)
                if done is not None:
                    out.line(f"self.trigger({text(chart.events[done].name)})")
        if any(state.on_exit):
            with out.method(f"exit_{name}", "The exit of `" + state.id + "`.", "event: Any"):
                for block in state.on_exit:
                    printer.block(out, block, plain)


def _taken(chart: Chart) -> Iterator[Transition]:
    """Yield the transitions that an event can trigger."""
    for transition in chart.transitions:
        occurring = any(is_raised(chart, event) for event in transition.events)
        if transition.trigger is Trigger.EVENT and occurring:
            yield transition


def _payload(chart: Chart, transition: Transition) -> dict[str, int]:
    """Return where the fields of the event at hand are among its arguments."""
    event = next(event for event in transition.events if is_raised(chart, event))
    return {part.name: number for number, part in enumerate(chart.events[event].fields)}


def _given(out: Lines, chart: Chart) -> None:
    """Print what the model offers to its own methods."""
    from fsmkit.language import InState

    asked = (part for guard in conditions(chart) for part in subexpressions(guard))
    if any(isinstance(part, InState) for part in asked):
        with out.method("is_in", "Whether a state is active.", "state: str", "bool"):
            asking = "self.machine.is_state(state, self, allow_substates=True)"
            out.line(f"return bool({asking})")
    if any(isinstance(statement, Log) for statement in all_statements(chart)):
        doc = "Tell the log of this module a label and values."
        with out.method("log", doc, "label: str, *values: Any"):
            out.line('logging.getLogger(__name__).info("%s %s", label, values)')


def _state_class(names: ModelNames) -> str:
    out = Lines()
    with out.suite(f"class {names.names.machine}State(NestedState):"):
        out.line(f'"""A state; `parent{names.separator}child` is the name of a nested one."""')
        out.line()
        out.line(f"separator = {text(names.separator)}")
    return out.finish()


def _configuration(chart: Chart, names: ModelNames) -> str:
    out = Lines()
    with out.block("STATES: list[Any] = [", "]"):
        if has_start(chart):
            out.line(f"{text(names.initial)},")
        for child in chart.root.children:
            _state(out, chart, names, chart.states[child])
    out.line("TRANSITIONS: list[dict[str, Any]] = [")
    with out.indented():
        told = None
        for entry in entries(chart, names):
            if entry.index is not None and entry.index != told:
                comment = describe(chart, chart.transitions[entry.index])
                out.line(f"# {docstring(comment)}")
                told = entry.index
            _transition(out, entry)
    out.line("]")
    return out.finish()


def _state(out: Lines, chart: Chart, names: ModelNames, state: State) -> None:
    name = names.names.bare[state.index]
    fields = {"name": text(state.id)}
    if any(state.on_entry) or done_event(chart, state) is not None:
        fields["on_enter"] = text(f"enter_{name}")
    if any(state.on_exit):
        fields["on_exit"] = text(f"exit_{name}")
    # not `final`: the library (0.9.3) fails in `_final_check` where the last region has ended
    defaults = [text(chart.states[child].id) for child in Order(chart).defaults(state.index)]
    if defaults:
        many = f"[{', '.join(defaults)}]"
        fields["initial"] = many if state.kind is Kind.PARALLEL else defaults[0]
    shown = ", ".join(f'"{key}": {value}' for key, value in fields.items())
    if not state.children:
        out.line(f"{fields['name']}," if len(fields) == 1 else f"{{{shown}}},")
        return
    with out.block("{", "},"):
        out.line(f"{shown},")
        with out.block('"children": [', "],"):
            for child in state.children:
                _state(out, chart, names, chart.states[child])


def _transition(out: Lines, entry: Entry) -> None:
    dest = "None" if entry.dest is None else text(entry.dest)
    fields = {"trigger": text(entry.trigger), "source": text(entry.source), "dest": dest}
    if entry.condition is not None:
        fields["conditions"] = text(entry.condition)
    if entry.callback is not None:
        fields[entry.place] = text(entry.callback)
    parts = [f'"{key}": {value}' for key, value in fields.items()]
    if sum(len(part) + 2 for part in parts) <= WIDTH:
        out.line(f"{{{', '.join(parts)}}},")
        return
    with out.block("{", "},"):
        out.lines(f"{part}," for part in parts)


def _machine(chart: Chart, names: ModelNames) -> str:
    out = Lines()
    initial = names.initial if has_start(chart) else names.paths[_initial(chart).targets[0]]
    begins = f" Then `model.{names.start}()` begins." if has_start(chart) else ""
    name = names.names.machine
    with out.suite(f"class {name}Machine(HierarchicalMachine):"):
        out.line(f'"""The machine of a model, which it gives its triggers.{begins}"""')
        out.line()
        out.line(f"state_cls = {name}State")
        with out.method("__init__", "Make the machine of a model.", f"model: {name}Model"):
            out.line("model.machine = self")
            with out.block("super().__init__(", ")"):
                out.lines(
                    (
                        "model,",
                        "states=STATES,",
                        "transitions=TRANSITIONS,",
                        f"initial={text(initial)},",
                        "queued=True,  # an event that content raises is taken after the step",
                        "send_event=True,",
                        "auto_transitions=False,",
                        "ignore_invalid_triggers=True,",
                    )
                )
    return out.finish()
