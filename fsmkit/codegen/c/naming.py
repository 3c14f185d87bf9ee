"""Names for everything in a chart that are valid in C and C++, and different from each other."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from fsmkit.chart.chart import Chart, Event, State
from fsmkit.codegen.c.chosen import MADE, Chosen
from fsmkit.codegen.c.copies import member_path, structs_of
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.options import Options
from fsmkit.codegen.c.reserved import (
    COUNTED,
    FAMILIES,
    FIXED_MACROS,
    FUNCTIONS,
    GROUPS,
    HEADERS,
    INSIDE,
    INVOKING,
    KEYWORDS,
    LOCALS,
    MEMBERS,
    NUMBERED,
    TAKEN_MACROS,
    unreserved,
)
from fsmkit.codegen.c.sharing import shared_bytes
from fsmkit.diagnostics import fail
from fsmkit.document.document import Direction
from fsmkit.emit import Namer, legal, snake, transliterated
from fsmkit.emit import plain as unguarded
from fsmkit.language import DurationType, EnumType, IntType, RecordType
from fsmkit.plan import Plan
from fsmkit.plan import lower as lower_plan

LONG = 2**31
"""Each C compiler accepts smaller numbers without a suffix."""


def name_everything(plan: Plan, prefix: str | None, options: Options | None = None) -> Names:
    """Return the names for a plan; ``prefix`` instead of one made of the chart's name."""
    lower = snake(prefix or plan.chart.name)
    if _hides(lower) if prefix is None else lower in KEYWORDS:
        lower += "_machine"
    options = options or Options()
    names = _name(plan, lower, None, chosen=options.chosen)
    _choose(names, options)
    return names


def _hides(lower: str) -> bool:
    """Whether a type of that name would hide a function or a header's name, or be hidden."""
    return lower in LOCALS | HEADERS | INSIDE or COUNTED.fullmatch(lower) is not None


def require_prefix(prefix: str | None) -> None:
    """Reject a prefix that is a name within generated C, or of a header (``wrong-option``)."""
    if prefix is not None and snake(prefix) not in KEYWORDS and _hides(snake(prefix)):
        raise fail(
            "wrong-option",
            f"generated C uses the name `{snake(prefix)}` itself: it cannot be a prefix",
            help=f"use another, for instance `{snake(prefix)}_machine`",
        )


def _choose(names: Names, options: Options) -> None:
    """Set the options of a machine; the machines in its slots have all parts and the same size."""
    names.options = options
    names.shared = {} if options.is_small else shared_bytes(names.plan)
    for region, history in names.shared.items():
        del names.histories[history, region]
    for inner in names.invoked:
        extras = options.extras & {"coverage"}
        inside = replace(options, without=frozenset(), extras=extras, binding=None)
        _choose(inner, replace(inside, observes_reads=False))


def _name(
    plan: Plan, lower: str, holder: Names | None, slot: str = "", chosen: Chosen = MADE
) -> Names:
    """Return the names of a machine, and of those in its slots: they share the strings."""
    chart = plan.chart
    upper = lower.upper()
    own_types = [snake(t.name) for t in chart.types if isinstance(t, EnumType | RecordType)]
    types = {f"{lower}_{word}" for word in ("event", "delayed", *own_types)}
    members = Namer(KEYWORDS | types)  # in C++ no member may be called as a type
    own_members = Namer(MEMBERS)
    is_invoking = holder is not None or any(state.invokes for state in chart.states)
    copied = {name for copy in chart.copies for name, _ in copy.variables}

    def member(kind: str, name: str) -> str:
        return members.name(unreserved(chosen.word(kind, name)), "_value", source=name)

    variables = {
        v.name: f"{group}.{member(kind, v.name)}"
        for group, kind, of in (
            ("in", "input", chart.inputs),
            ("out", "output", chart.outputs),
            ("data", "data", chart.data),
        )
        for v in of
        if v.name not in copied
    }
    constants = Namer()

    def state_word(state: State) -> str:
        return chosen.word("state", state.id)

    states = tuple(
        constants.name(
            (f"{upper}_STATE_" + (transliterated(state_word(s)) if s.index else "ROOT")).upper(),
            source=s.id,
        )
        for s in chart.states
    )
    called = tuple(chosen.word("event", name) for name in event_words(chart))
    events = tuple(
        constants.name((f"{upper}_EVENT_" + transliterated(name)).upper(), source=name)
        for name in called
    )
    functions = Namer({"by_name"})
    event_names = tuple(functions.name(snake(name), "_event", source=name) for name in called)
    unions = Namer(KEYWORDS | {"none"})
    payloads = tuple(unions.name(name, "_", source=name) for name in event_names)
    by_state = Namer()
    state_names = tuple(
        by_state.name(snake(state_word(s)) if s.index else "root") for s in chart.states
    )
    verbs = {f"{verb}_{name}" for verb in ("enter", "exit", "at") for name in state_names}
    own = Namer()
    verbs |= {f"{verb}_{name}" for verb in ("on", "post", "send") for name in event_names}
    verbs |= {f"call_{snake(o.name)}" for o in chart.operations}

    def behind_prefix(kind: str, name: str, suffix: str) -> str:
        wanted = chosen.behind(lower, kind, name)
        free = _free(wanted, suffix, taken=verbs, is_invoking=is_invoking)
        return own.name(free, source=name)

    operations = {
        o.name: behind_prefix("operation", o.name, "_operation") for o in chart.operations
    }
    enumerations = {
        t.name: f"{lower}_{behind_prefix('type', t.name, '_kind')}"
        for t in chart.types
        if isinstance(t, EnumType)
    }
    fields = Namer(LOCALS | {lower})
    names = Names(
        plan=plan,
        prefix=lower,
        upper=upper,
        variables=variables,
        states=states,
        events=events,
        event_names=event_names,
        payloads=payloads,
        operations=operations,
        functions={f.name: own.name(f"fn_{snake(f.name)}") for f in chart.functions},
        records={
            t.name: f"{lower}_{behind_prefix('type', t.name, '_record')}"
            for t in chart.types
            if isinstance(t, RecordType)
        },
        members={
            t.name: tuple(
                constants.name(
                    chosen.whole("member", f"{unguarded(t.name)}.{unguarded(word)}")
                    or _member(upper, t.name, word),
                    source=f"{unguarded(t.name)}.{unguarded(word)}",
                )
                for word in t.members
            )
            for t in chart.types
            if isinstance(t, EnumType)
        },
        enumerations=enumerations,
        constants={
            name: constants.name(chosen.whole("constant", name) or _macro(upper, name), source=name)
            for name, literal in chart.constants
            if chosen.exports_constants
            and isinstance(literal.type, IntType | DurationType)
            and isinstance(literal.value, int)
            and abs(literal.value) < LONG
        },
        timers=_timers(chart, upper, states, constants),
        regions=tuple(
            "fsm."
            + own_members.name("active" if r.index == 0 else "active_" + chart.states[r.top].id)
            for r in plan.regions
        ),
        histories={
            (s.index, region): "fsm."
            + own_members.name("was_" + s.id + (f"_{region}" if region else ""))
            for s in chart.states
            for region in plan.recorded_regions[s.index]
        },
        fields=_fields(chart, fields, chosen),
        state_names=state_names,
        outermost=lower,
    )
    if chart.copies:
        kinds = Namer(free_of(names, operations))
        names.structs = structs_of(chart, lower, names.records, kinds)
        names.variables |= {name: member_path(path) for name, path in names.structs.paths.items()}
    if holder is not None:
        names.path = (*holder.path, slot)
        names.outermost = holder.outermost
        names.symbols, names.numbers = holder.symbols, holder.numbers
    if is_invoking:
        names.slots = _slots(chart, Namer(KEYWORDS | types | GROUPS))
        names.invoked = tuple(
            _name(lower_plan(i.chart), f"{lower}_{names.slots[i.index]}", names, i.id)
            for i in chart.invocations
        )
    return names


def _timers(chart: Chart, upper: str, states: tuple[str, ...], constants: Namer) -> dict[int, str]:
    """Return a constant for each timer: by its state and delay, and where it leads, if need be."""
    timed = [t for t in chart.transitions if t.has_timer]
    state_prefix = f"{upper}_STATE_"
    names = {
        t.index: f"{upper}_TIMER_{states[t.source].removeprefix(state_prefix)}_"
        + (snake(t.delay_name) if t.delay_name else t.trigger.value).upper()
        for t in timed
    }
    count = Counter(names.values())
    for t in timed:
        if count[names[t.index]] > 1:
            target = states[t.targets[0]].removeprefix(state_prefix) if t.targets else ""
            names[t.index] += f"_TO_{target}" if target else "_STAYING"
    return {t.index: constants.name(names[t.index]) for t in timed}


def free_of(names: Names, operations: dict[str, str]) -> frozenset[str]:
    """Return the names that types of copies cannot have: those of functions and other types."""
    types = [*names.enumerations.values(), *names.records.values()]
    taken = {name.removeprefix(f"{names.prefix}_") for name in types} | {*operations.values()}
    return frozenset(taken) | FUNCTIONS | {"event", "delayed", "state", "event_name"}


def event_words(chart: Chart) -> tuple[str, ...]:
    """Return the words for events: their names, with the origin where a host posts another."""
    count = Counter(event.name for event in chart.events)

    def called(event: Event) -> str:
        if count[event.name] == 1:
            return event.name
        if event.invocation is not None:
            return f"{event.name}_from_{chart.invocations[event.invocation].id}"
        return event.name if event.directions - {Direction.INTERNAL} else f"{event.name}_internal"

    return tuple(map(called, chart.events))


def _fields(chart: Chart, namer: Namer, chosen: Chosen) -> dict[str, str]:
    """Return the names of all fields, which SCXML lets be any text; none hides the machine."""
    found = {
        part.name
        for fields in (
            *(t.fields for t in chart.types if isinstance(t, RecordType)),
            *(event.fields for event in chart.events),
            *(operation.parameters for operation in chart.operations),
        )
        for part in fields
    }
    plain = sorted(name for name in found if legal(name) == name)
    others = sorted(name for name in found if legal(name) != name)
    return {
        name: namer.name(unreserved(chosen.word("field", name)), "_", source=name)
        for name in (*plain, *others)
    }


def _member(upper: str, type_: str, member: str) -> str:
    """Return the constant of a member of an enumeration; none has the name of a fixed macro."""
    found = (f"{snake(type_)}_" + transliterated(member)).upper()
    return f"{upper}_{found}_VALUE" if FIXED_MACROS.fullmatch(found) else f"{upper}_{found}"


def _macro(upper: str, constant: str) -> str:
    """Return the macro of a constant of the chart; none is as those of every machine are."""
    name = snake(constant).upper()
    return f"{upper}_{name}_VALUE" if TAKEN_MACROS.fullmatch(name) else f"{upper}_{name}"


def _slots(chart: Chart, members: Namer) -> tuple[str, ...]:
    """Return a name for each slot: of the member, and in the prefix of the machine in it.

    No other name of the chart may start as those of that machine do.
    """
    types = [t for t in chart.types if isinstance(t, EnumType | RecordType)]
    others = {snake(x.name) for x in (*types, *chart.operations)}

    def is_free(name: str) -> bool:
        if name in FUNCTIONS | INVOKING or FAMILIES.fullmatch(name) or NUMBERED.fullmatch(name):
            return False
        # constants, and functions of states and events, start so
        if name.startswith(("state_", "event_", "to_", "enter_", "exit_", "at_", "on_")):
            return False
        return not any(f"{o}_".startswith(f"{name}_") or name.startswith(f"{o}_") for o in others)

    found = []
    for invocation in chart.invocations:
        name = snake(invocation.id)[:60].strip("_") or "slot"  # files are called by it
        wanted = name if is_free(name) else f"invoked_{name}"
        found.append(members.name(wanted, source=invocation.id))
    return tuple(found)


def _free(name: str, suffix: str, *, taken: set[str], is_invoking: bool) -> str:
    """Return a name that no function of the machine has."""
    is_taken = name in FUNCTIONS or name in taken or FAMILIES.fullmatch(name)
    if is_invoking:
        is_taken = is_taken or name in INVOKING or NUMBERED.fullmatch(name)
    if not is_taken:
        return name
    name = f"{name}{suffix}"
    while name in taken:
        name = f"{name}{suffix}"
    return name
