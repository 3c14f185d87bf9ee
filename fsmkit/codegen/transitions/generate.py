"""A chart as a module for the library: a model class, and the configuration of a machine."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.analysis.effects import done_event
from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.content import all_statements, conditions
from fsmkit.chart.statements import Destination, Log, Send
from fsmkit.codegen.python import template
from fsmkit.codegen.python.expressions import spell
from fsmkit.codegen.python.lines import Lines, Piece
from fsmkit.codegen.python.linking import linked, resolve_links
from fsmkit.codegen.python.names import distinct, identifier, members_of
from fsmkit.codegen.python.relations import describe
from fsmkit.codegen.python.sending import annotation
from fsmkit.codegen.transitions.content import ModelContentPrinter, has_peer
from fsmkit.codegen.transitions.expressions import ModelPrinter
from fsmkit.codegen.transitions.moves import Entry, Moves, moves_of
from fsmkit.codegen.transitions.names import ModelNames, text
from fsmkit.codegen.transitions.parts import IMPORTS, steps_text
from fsmkit.document.document import Kind, Trigger
from fsmkit.emit import printing
from fsmkit.emit.python import docstring, paragraph, source_name
from fsmkit.language import ArrayType, EnumType, Field, RecordType
from fsmkit.language.walk import subexpressions

WIDTH = 90
"""The width in columns of a transition on one line."""
OWN = (
    *("Any", "Callable", "ClassVar", "HierarchicalMachine", "IntEnum", "Iterator", "MachineError"),
    *("NestedEventData", "NestedState", "STATES", "Steps", "TRANSITIONS"),
)
"""The names that the module uses, which enumerations may not have."""
HEADER = '''\
"""{doc}

Made by fsmkit from {source}: change that, not this. It needs the library `transitions` (0.9).
"""

from __future__ import annotations

{imports}
'''


@printing
def module_text(chart: Chart) -> str:
    """Return the text of the module. The same chart has the same text."""
    moves = moves_of(chart)
    names = moves.names
    model = _model(moves)
    helpers = template.arithmetic(linked(model))
    pieces = (
        _header(moves, helpers),
        *_enumerations(chart, names),
        *(helper.text for helper in helpers),
        model,
        _state_class(names),
        _configuration(moves),
        steps_text(moves.facts),
        _machine(moves),
    )
    return resolve_links(
        "\n\n\n".join(piece.strip("\n") for piece in pieces if piece.strip()) + "\n"
    )


# --- parts of the module ----------------------------------------------------------------------


def _header(moves: Moves, helpers: list[Piece]) -> str:
    chart = moves.chart
    source = source_name(chart.sources[0].name) if chart.sources else "a chart"
    return HEADER.format(
        doc=paragraph(chart.doc or "The machine " + chart.name + "."),
        source=source,
        imports="\n".join(_imports(moves, helpers)),
    )


def _imports(moves: Moves, helpers: list[Piece]) -> Iterator[str]:
    """Yield the imports of the helpers, of the parts of `Steps`, and of the types."""
    used = {name for helper in helpers for name in helper.outside}
    found = {
        "typing": {"Any"},
        "transitions.extensions": {"HierarchicalMachine"},
        "transitions.extensions.nesting": {"NestedState"},
    }
    if any(isinstance(type_, EnumType) for type_ in moves.chart.types):
        found["enum"] = {"IntEnum"}
    for part in sorted(moves.facts & IMPORTS.keys()):
        for module, name in IMPORTS[part].items():
            found.setdefault(module, set()).add(name)
    needed = {"logging": _logs(moves.chart), "math": "math" in used, "struct": "struct" in used}
    yield from (f"import {module}" for module, is_used in needed.items() if is_used)
    own: list[str] = []
    library: list[str] = []
    for module, names in sorted(found.items()):
        to = library if module.startswith("transitions") else own
        to.append(f"from {module} import {', '.join(sorted(names))}")
    yield from (*own, "", *library)


def _enumerations(chart: Chart, names: ModelNames) -> Iterator[str]:
    own = (f"{names.names.machine}{part}" for part in ("Model", "State", "Machine"))
    taken = {*OWN, *own}
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


def _model(moves: Moves) -> str:
    chart, names = moves.chart, moves.names
    out = Lines()
    printer = ModelContentPrinter(chart, names)
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
        _guards(out, moves)
        _content(out, moves, printer)
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
    """Print the body of a method that the host overrides: an error that names the method."""
    model = f"{names.names.machine}Model"
    out.line(f'raise NotImplementedError("define `{method}` in a subclass of `{model}`")')


def _parameters(fields: tuple[Field, ...]) -> str:
    chosen = distinct([identifier(part.name) for part in fields], {"self", "peer"})
    each = zip(chosen, fields, strict=True)
    return ", ".join(f"{name}: {annotation(part.type)}" for name, part in each)


def _guards(out: Lines, moves: Moves) -> None:
    chart, names = moves.chart, moves.names
    for transition in moves.taken():
        if transition.guard is None:
            continue
        doc = f"The guard of {describe(chart, transition)}."
        name = f"guard_{names.names.transitions[transition.index]}"
        with out.method(name, doc, "event: Any", "bool"):
            printer = ModelPrinter(names.names, _payload(moves, transition), model=names)
            out.line(f"held: bool = {printer.print(transition.guard)}")
            out.line("return held")


def _content(out: Lines, moves: Moves, printer: ModelContentPrinter) -> None:
    chart, names, initial = moves.chart, moves.names, moves.initial
    plan = moves.order.plan
    plain = ModelPrinter(names.names, {}, model=names)
    if chart.script or initial.content:
        with out.method("begin", "What is done before all states.", "event: Any"):
            printer.handler(out, (*chart.script, *initial.content), plain)
    for transition in moves.taken():
        if transition.content:
            doc = f"The content of {describe(chart, transition)}."
            name = f"do_{names.names.transitions[transition.index]}"
            with out.method(name, doc, "event: Any"):
                own = ModelPrinter(names.names, _payload(moves, transition), model=names)
                printer.handler(out, transition.content, own)
    for state in chart.states:
        _handlers(out, moves, state, printer, plain)
    for history in moves.histories:
        name = names.names.bare[history.index]
        doc = (
            "Let `" + chart.states[plan.parents[history.index]].id + "` resume its recorded states."
        )
        with out.method(f"recall_{name}", doc, "event: Any"):
            out.line(f"self.machine.recall({text(history.id)})")
        with out.method(
            f"forget_{name}", "Let states use their initial states again.", "event: Any"
        ):
            out.line("self.machine.forget()")


def _handlers(
    out: Lines, moves: Moves, state: State, printer: ModelContentPrinter, plain: ModelPrinter
) -> None:
    """Print the handlers of entering and exiting a state."""
    chart, name = moves.chart, moves.names.names.bare[state.index]
    if _is_entered(moves, state):
        with out.method(f"enter_{name}", "The entry of `" + state.id + "`.", "event: Any"):
            for transition in moves.order.timers(state.index):
                trigger = text(moves.names.timed[transition.index])
                parts = [f"{transition.index}, {transition.delay}, self.trigger, {trigger}"]
                if transition.trigger is Trigger.EVERY:
                    parts.append(f"period={transition.delay}")
                out.line(f"self.machine.arm({', '.join(parts)})")
            for block in state.on_entry:
                printer.handler(out, block, plain)
            done = done_event(chart, state)
            if done is not None:
                out.line(f"self.trigger({text(chart.events[done].name)})")
            if moves.order.clears(state):
                out.line("self.machine.deadlines.clear()")
    if _is_left(moves, state):
        with out.method(f"exit_{name}", "The exit of `" + state.id + "`.", "event: Any"):
            timers = moves.order.timers(state.index)
            if timers:
                numbers = ", ".join(str(transition.index) for transition in timers)
                out.line(f"self.machine.disarm({numbers})")
            for history in _histories(moves, state):
                out.line(f"self.machine.remember({text(history.id)})")
            for block in state.on_exit:
                printer.handler(out, block, plain)


def _is_entered(moves: Moves, state: State) -> bool:
    has_timers = bool(moves.order.timers(state.index)) or moves.order.clears(state)
    return any(state.on_entry) or has_timers or done_event(moves.chart, state) is not None


def _is_left(moves: Moves, state: State) -> bool:
    is_timed = bool(moves.order.timers(state.index))
    return any(state.on_exit) or is_timed or bool(_histories(moves, state))


def _histories(moves: Moves, state: State) -> list[State]:
    return [h for h in moves.histories if h.index in moves.order.plan.histories[state.index]]


def _payload(moves: Moves, transition: Transition) -> dict[str, int]:
    """Return the positions of the current event's fields among its arguments."""
    occurring = (event for event in transition.events if event in moves.order.occurring)
    event = next(occurring, None)
    fields = () if event is None else moves.chart.events[event].fields
    return {part.name: number for number, part in enumerate(fields)}


def _given(out: Lines, chart: Chart) -> None:
    """Print the methods of the model that its other methods call."""
    from fsmkit.language import InState

    parts = (part for guard in conditions(chart) for part in subexpressions(guard))
    if any(isinstance(part, InState) for part in parts):
        with out.method("is_in", "Whether a state is active.", "state: str", "bool"):
            asking = "self.machine.is_state(state, self, allow_substates=True)"
            out.line(f"return bool({asking})")
    if _logs(chart):
        doc = "Log a label and values with the logger of this module."
        with out.method("log", doc, "label: str, *values: Any"):
            out.line('logging.getLogger(__name__).info("%s %s", label, values)')


def _logs(chart: Chart) -> bool:
    return any(isinstance(statement, Log) for statement in all_statements(chart))


def _state_class(names: ModelNames) -> str:
    out = Lines()
    with out.suite(f"class {names.names.machine}State(NestedState):"):
        out.line(f'"""A state; `parent{names.separator}child` is the name of a nested one."""')
        out.line()
        out.line(f"separator = {text(names.separator)}")
    return out.finish()


def _configuration(moves: Moves) -> str:
    chart, names = moves.chart, moves.names
    out = Lines()
    with out.block("STATES: list[Any] = [", "]"):
        if moves.has_start:
            out.line(f"{text(names.initial)},")
        for child in moves.order.plan.substates[0]:
            _state(out, moves, chart.states[child])
    out.line("TRANSITIONS: list[dict[str, Any]] = [")
    with out.indented():
        told = None
        for entry in moves.entries():
            if entry.index is not None and entry.index != told:
                comment = describe(chart, chart.transitions[entry.index])
                out.line(f"# {docstring(comment)}")
                told = entry.index
            _transition(out, names, entry)
    out.line("]")
    return out.finish()


def _state(out: Lines, moves: Moves, state: State) -> None:
    chart, names = moves.chart, moves.names
    name = names.names.bare[state.index]
    fields = {"name": text(state.id)}
    if _is_entered(moves, state):
        fields["on_enter"] = text(f"enter_{name}")
    if _is_left(moves, state):
        fields["on_exit"] = text(f"exit_{name}")
    # not `final`: the library (0.9.3) fails in `_final_check` where the last region has ended
    defaults = [text(chart.states[child].id) for child in moves.order.defaults(state.index)]
    if defaults:
        many = f"[{', '.join(defaults)}]"
        fields["initial"] = many if state.kind is Kind.PARALLEL else defaults[0]
    shown = ", ".join(f'"{key}": {value}' for key, value in fields.items())
    children = moves.order.plan.substates[state.index]
    if not children:
        out.line(f"{fields['name']}," if len(fields) == 1 else f"{{{shown}}},")
        return
    with out.block("{", "},"):
        out.line(f"{shown},")
        with out.block('"children": [', "],"):
            for child in children:
                _state(out, moves, chart.states[child])


def _transition(out: Lines, names: ModelNames, entry: Entry) -> None:
    dest = "None" if entry.dest is None else text(entry.dest)
    fields = {"trigger": text(entry.trigger), "source": text(entry.source), "dest": dest}
    if entry.condition is not None:
        fields["conditions"] = text(entry.condition)
    before: list[str] = []
    after: list[str] = []
    if entry.callback is not None:
        (before if entry.place == "before" else after).append(entry.callback)
    if entry.recall is not None:
        name = names.names.bare[entry.recall]
        before.append(f"recall_{name}")
        after.insert(0, f"forget_{name}")
    for place, called in (("before", before), ("after", after)):
        if called:
            shown = [text(each) for each in called]
            fields[place] = shown[0] if len(shown) == 1 else f"[{', '.join(shown)}]"
    parts = [f'"{key}": {value}' for key, value in fields.items()]
    if sum(len(part) + 2 for part in parts) <= WIDTH:
        out.line(f"{{{', '.join(parts)}}},")
        return
    with out.block("{", "},"):
        out.lines(f"{part}," for part in parts)


def _machine(moves: Moves) -> str:
    names, facts = moves.names, moves.facts
    out = Lines()
    initial = names.initial if moves.has_start else names.paths[moves.order.dest(moves.initial)]
    started = f" Then `model.{names.start}()` starts it." if moves.has_start else ""
    name = names.names.machine
    base = "Steps" if facts - {"inputs"} else "HierarchicalMachine"
    with out.suite(f"class {name}Machine({base}):"):
        out.line(f'"""The machine of a model, which it gives its triggers.{started}"""')
        out.line()
        out.line(f"state_cls = {name}State")
        _facts(out, moves)
        passed, doc = f"model: {name}Model", "Make the machine of a model"
        if "timers" in facts:
            passed, doc = f"{passed}, now: int = 0", f"{doc}, at a time in ticks"
        with out.method("__init__", f"{doc}.", passed):
            out.line("model.machine = self")
            if base == "Steps":
                out.line("self.subject = model")
            if "timers" in facts:
                out.line("self.now, self.age, self.deadlines = now, 0, []")
            if "history" in facts:
                out.line("self.was, self.changed = {}, []")
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


def _facts(out: Lines, moves: Moves) -> None:
    """Print the tables that `Steps` reads."""
    chart, names = moves.chart, moves.names
    if "always" in moves.facts:
        out.line(f"always = {text(names.always)}")
        out.line(f"microsteps = {chart.capacities.microsteps}")
    if "history" in moves.facts:
        with out.block("histories = {", "}"):
            for history in moves.histories:
                assert history.initial is not None  # noqa: S101  (it has a default)
                targets = chart.transitions[history.initial].targets
                default = ", ".join(names.quoted(target) for target in targets)
                is_deep = history.kind is Kind.DEEP_HISTORY
                above = names.quoted(moves.order.plan.parents[history.index])
                out.line(f"{text(history.id)}: ({above}, {is_deep}, [{default}]),")
