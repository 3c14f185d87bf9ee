"""The C names of everything in a chart."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Container, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import PurePath
from typing import ClassVar

from fsmkit.chart.analysis.effects import can_stop
from fsmkit.chart.chart import Chart, Event, Operation, State
from fsmkit.codegen.c.chosen import MADE, Chosen
from fsmkit.codegen.c.copies import Structs, spelt, structs_of
from fsmkit.codegen.c.expressions.fragments import AND, Fragment
from fsmkit.codegen.c.ir import OWN, OWN_UPPER
from fsmkit.codegen.c.mechanisms import Mechanisms, mechanisms_of
from fsmkit.codegen.c.options import Options
from fsmkit.codegen.c.reactions.forms import Form, form_of
from fsmkit.codegen.c.reactions.sharing import shared_bytes
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
    TO_INVOKE,
    unreserved,
)
from fsmkit.diagnostics import Span, fail
from fsmkit.document.document import Direction
from fsmkit.emit import Namer, legal, snake, transliterated
from fsmkit.emit import plain as unguarded
from fsmkit.emit.c import comment
from fsmkit.language import DurationType, EnumType, FunctionBody, IntType, RecordType
from fsmkit.plan import Plan
from fsmkit.plan import lower as lower_plan

NARROW = 255
"""The greatest number in a byte."""
LONG = 2**31
"""What every C takes as a number without a mark is less."""
NOTING = frozenset({"failed", "end_block", "holds", "guard_holds", "clamp", "clamp_u", "clamp_f"})
"""What operators and helpers that look at ``failed`` are noted as."""
NO_STATE = 65535
"""The greatest number in two bytes."""


@dataclass(frozen=True, slots=True)
class Declared:
    """A name of the chart that a host reads in C: its kind, its C text, its C text by default."""

    kind: str
    name: str
    text: str
    wanted: str


@dataclass
class Names:
    """C names by index or name of what they stand for."""

    plan: Plan
    prefix: str
    upper: str
    variables: dict[str, str]
    states: tuple[str, ...]
    events: tuple[str, ...]
    event_names: tuple[str, ...]
    """In lower case, for functions."""
    payloads: tuple[str, ...]
    operations: dict[str, str]
    functions: dict[str, str]
    """Of functions of the chart, which are static."""
    records: dict[str, str]
    members: dict[str, tuple[str, ...]]
    """The constants of each enumeration."""
    enumerations: dict[str, str]
    regions: tuple[str, ...]
    histories: dict[tuple[int, int], str]
    """By history and region: the members that have nothing else to tell."""
    constants: dict[str, str]
    """The macros of whole numbers and durations."""
    timers: dict[int, str]
    """By transition: the constant of its timer."""
    fields: dict[str, str]
    """Of records, payloads and operations alike."""
    symbols: list[str] = field(default_factory=lambda: [""])
    numbers: dict[str, int] = field(default_factory=lambda: {"": 0})
    """Numbers of the interned strings."""
    used: set[str] = field(default_factory=set)
    """Helpers that the printed expressions call."""
    marks: dict[str, int] = field(default_factory=dict)
    """Numbers of the ids of delayed sends, from 1."""
    state_names: tuple[str, ...] = ()
    """In lower case, for functions."""
    path: tuple[str, ...] = ()
    """The ids of the slots in which the machine lies, outermost first."""
    outermost: str = ""
    """The prefix of the machine that a host runs: this one or the one that holds it."""
    slots: tuple[str, ...] = ()
    """By invocation: the member that holds the machine."""
    invoked: tuple[Names, ...] = ()
    """By invocation: the names of the machine."""
    options: Options = field(default_factory=Options)
    shared: dict[int, int] = field(default_factory=dict)
    """By region: the history whose record its byte holds (`codegen.c.reactions.sharing`)."""
    structs: Structs | None = None
    """The structs that hold what is in copies of used charts; None where there are none."""
    reached: dict[tuple[int, ...], int] = field(default_factory=dict)
    """Numbers of the sets of slots that events are sent to."""
    own: ClassVar[str] = OWN
    """What stands for the prefix in a source that is not spelt yet (`codegen.c.ir`)."""
    own_upper: ClassVar[str] = OWN_UPPER
    """The same for the prefix of macros and constants."""

    passed: ClassVar[str] = ""
    """What calls of blocks and guards pass beside the machine (`small.together`)."""
    taken: ClassVar[str] = ""
    """The parameter for that."""
    varied: ClassVar[Container[int]] = ()
    """States that stand for one of each copy."""

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.plan.chart

    @cached_property
    def does(self) -> Mechanisms:
        """What the machine does at all."""
        is_family = bool(self.slots or self.invoking or self.is_invoked)
        return mechanisms_of(
            self.plan, self.options, is_family=is_family, has_slots=bool(self.slots)
        )

    @cached_property
    def facts(self) -> dict[str, bool]:
        """What the conditions of pieces ask for (`codegen.c.pieces`)."""
        chart, features = self.chart, self.plan.features
        return {
            **self.does.facts,
            "SINGLE": self.plan.is_single,
            "TIMED": features.timeouts or self.does.delays,
            "SAMPLES": features.samples_inputs,
            "HISTORIES": bool(self.histories),
            "PREEMPTS": self.plan.selection.is_general,
            "FAULTY": any(t.guard is not None and can_stop(t.guard) for t in chart.transitions),
            "SHARED_DEFERRAL": any(self.plan.shared_deferral),
            "SLOTS": bool(self.slots),
            "INVOKING": bool(self.invoking),
            "INVOKED": self.is_invoked,
            "TELLS_END": self.is_invoked and chart.done is not None,
            "PLAIN": False,
            "SPECIAL_STEPS": False,
        }

    @property
    def has_timers(self) -> bool:
        """Whether there are timeouts."""
        return self.plan.features.timeouts

    @property
    def running(self) -> str:
        """The test whether the machine runs."""
        return "m->fsm.running" if self.does.running else f"m->{self.regions[0]} != 0u"

    @property
    def stopped(self) -> str:
        """The test whether it does not."""
        return "!m->fsm.running" if self.does.running else f"m->{self.regions[0]} == 0u"

    @property
    def rejects_posts(self) -> str:
        """The test whether no event can be posted: not started yet, ended, or stopped by a fault.

        An operation may post in the middle of a step, when the number of the active state is 0.
        """
        within = self.does.guarded and not self.does.running
        return f"{self.stopped} && !m->fsm.busy" if within else self.stopped

    @property
    def refuses(self) -> str:
        """The test whether a step does nothing: it is called within another, or after the end."""
        return f"m->fsm.busy || {self.stopped}" if self.does.guarded else self.stopped

    def hook(self, verb: str) -> str:
        """Return the macro that notes ENTER of a state or TAKE of a transition."""
        is_counted = "coverage" in self.options.extras
        return f"FSM_{self.own_upper}_{verb}" if is_counted else f"FSM_HOOK_{verb}"

    @property
    def is_invoked(self) -> bool:
        """Whether the machine lives in a slot of another."""
        return bool(self.path)

    @cached_property
    def invoking(self) -> tuple[int, ...]:
        """The states that invoke something."""
        return tuple(state.index for state in self.chart.states if state.invokes)

    def to_invoke(self, state: int) -> tuple[str, int]:
        """Return the member that holds the bit of a state that invokes something, and the bit."""
        place = self.invoking.index(state)
        return f"m->fsm.{TO_INVOKE}[{place // 8}]", 1 << place % 8

    def slot_set(self, slots: tuple[int, ...]) -> int:
        """Return the number of a set of slots that an event is sent to."""
        return self.reached.setdefault(slots, len(self.reached))

    def symbol(self, text: str) -> int:
        """Return the number of an interned string."""
        number = self.numbers.setdefault(text, len(self.symbols))
        if number == len(self.symbols):
            self.symbols.append(text)
        return number

    def mark(self, name: str | None) -> int:
        """Return the number of the id of a delayed send, 0 for none."""
        return 0 if name is None else self.marks.setdefault(name, len(self.marks) + 1)

    @property
    def can_fail(self) -> bool:
        """Whether something notes that it failed; known when all content is printed."""
        return not self.used.isdisjoint(NOTING) or any(u.startswith("guarded ") for u in self.used)

    def failure(self) -> str:
        """Return the address at which an operator notes that it failed."""
        self.used.add("failed")
        return "&m->fsm.failed"

    def operation(self, name: str) -> Operation:
        """Return the declaration of an operation."""
        return next(o for o in self.chart.operations if o.name == name)

    def constant(self, name: str | None) -> str:
        """Return the macro of a constant of the chart, "" for what is none; its name may be ""."""
        return "" if name is None else self.constants.get(name, "")

    def field(self, name: str) -> str:
        """Return the C name of a field of a record or payload."""
        return self.fields[name]

    @property
    def form(self) -> Form:
        """Which form its code has."""
        return self._small_form if self.options.is_small else form_of(self.plan, is_small=False)

    @cached_property
    def _small_form(self) -> Form:
        return Form.TABLES if self.options.is_tabled else form_of(self.plan, is_small=True)

    @cached_property
    def taken_type(self) -> str:
        """The C type that holds every number by which a transition is taken, and one more.

        A transition has one; in tables it may have one for each of its events (`small.plain`).
        """
        most = sum(max(1, len(transition.events)) for transition in self.chart.transitions)
        return "uint16_t" if most < NO_STATE else "uint32_t"

    @property
    def region_type(self) -> str:
        """The C type that holds how many regions there are."""
        return "uint8_t" if len(self.plan.regions) <= NARROW else "uint16_t"

    def number_type(self, region: int) -> str:
        """Return the C type of the member that holds the number of a region's active state.

        Functions that read tables take all regions alike, so there all have the widest.
        """
        is_one_type = self.options.is_small and not self.plan.is_single
        regions = self.plan.regions if is_one_type else self.plan.regions[region : region + 1]
        most = max(each.states[-1] if each.states else 0 for each in regions)
        return "uint8_t" if most <= NARROW else "uint16_t"

    def number(self, state: int) -> str:
        """Return the constant of a state as a region holds it; nothing is active in the root."""
        return self.states[state] if state else "0u"

    def note(self, state: int) -> str:
        """Return a comment that tells which state is meant."""
        return self.remark(self.chart.states[state].id)

    def remark(self, text: str) -> str:
        """Return a comment."""
        return f"/* {comment(text)} */"

    def function(self, verb: str, state: int) -> str:
        """Return the name of the function of a state: ``enter``, ``exit`` or ``at``."""
        return f"{self.own}_{verb}_{self.state_names[state]}"

    def event(self, index: int) -> str:
        """Return the number of an event."""
        return self.events[index]

    def event_constant(self, index: int) -> str:
        """Return an event as what hosts call it, for which C++ wants the type of that."""
        return self.events[index]

    def timer(self, transition: int) -> str:
        """Return the number of the timer of a transition."""
        return self.timers[transition]

    def variable(self, name: str, machine: str) -> str:
        """Return a variable of the chart as an lvalue; ``machine`` is a pointer to the machine."""
        return f"{machine}->{self.variables[name]}"

    def input_number(self, name: str) -> str:
        """Return the number of an input."""
        return f"{[declared.name for declared in self.chart.inputs].index(name)}u"

    def stand_in(self, name: str) -> str:
        """Return the number for which a variable of no block stands (`small.together`)."""
        raise AssertionError(name)

    def marked(self, name: str | None) -> str:
        """Return the number of the id of a delayed send."""
        return f"{self.mark(name)}u"

    def sending(self, event: int, arguments: Sequence[str]) -> str:
        """Return the call by which the host delivers an event."""
        return f"{self.own}_send_{self.event_names[event]}({', '.join(('m', *arguments))})"

    def calling(self, verb: str, operation: str, arguments: Sequence[str], machine: str) -> str:
        """Return the call of an operation; ``verb``: of the function for it."""
        name = f"{self.own}_{verb}{self.operations[operation]}"
        return f"{name}({', '.join((machine, *arguments))})"

    def computing(self, function: FunctionBody, arguments: Sequence[str], machine: str) -> str:
        """Return the call of a function of the chart."""
        name = f"{self.own}_{self.functions[function.name]}"
        return f"{name}({', '.join((machine, *arguments))})"

    def of_text(self, text: str, line: Callable[[str], str]) -> list[str]:
        """Return the statement that tells a text of the chart to a trace."""
        return [line(text)]

    def in_state(self, machine: str, state: int) -> Fragment:
        """Return the test whether a state is active."""
        plan = self.plan
        if state == 0:
            test = "fsm.running" if self.does.running else f"{self.regions[0]} != 0u"
            return Fragment(f"{machine}->{test}", "bool", AND)
        variable = f"{machine}->{self.regions[plan.region_of[state]]}"
        text = self._within(variable, state, plan.last_below[state], plan.region_of[state])
        return Fragment(text, "bool", AND)

    def _within(self, variable: str, first: int, last: int, region: int) -> str:
        """Return the test whether a number of a region lies between those of two states."""
        states = self.plan.regions[region].states
        if first == last:
            return f"{variable} == {self.number(first)}"
        if last == states[-1] and region not in self.shared:
            return f"{variable} >= {self.number(first)}"
        if first == states[0]:
            return f"{variable} != 0u && {variable} <= {self.number(last)}"
        return f"{variable} >= {self.number(first)} && {variable} <= {self.number(last)}"

    def recorded(self, history: int, region: int) -> str:
        """Return the member with what a history recorded of a region, 0 for nothing."""
        return self.histories.get((history, region), self.regions[region])

    @cached_property
    def declared(self) -> tuple[Declared, ...]:
        """The names of the chart that a host reads in C."""
        return tuple(self._declared())

    def _declared(self) -> Iterator[Declared]:
        chart, p, upper = self.chart, self.prefix, self.upper
        for kind, names in (("type", self.enumerations), ("record", self.records)):
            for name, c in names.items():
                yield Declared(kind, name, c, f"{p}_{snake(name)}")
        for operation in chart.operations:
            c, plain = self.operations[operation.name], snake(operation.name)
            yield Declared("operation", operation.name, f"{p}_{c}", f"{p}_{plain}")
        called = _event_names(chart)
        for place, event in enumerate(chart.events):
            post = f"{p}_post_{snake(called[place])}"
            yield Declared("event", event.name, f"{p}_post_{self.event_names[place]}", post)
            wanted = f"{upper}_EVENT_{legal(called[place])}".upper()
            yield Declared("event", event.name, self.events[place], wanted)
        for state, c in zip(chart.states[1:], self.states[1:], strict=True):
            yield Declared("state", state.id, c, f"{upper}_STATE_{legal(state.id)}".upper())
        for variable in (*chart.inputs, *chart.outputs, *chart.data):
            c = self.variables[variable.name]
            wanted = f"{c.partition('.')[0]}.{unguarded(variable.name)}"
            yield Declared("variable", variable.name, c, wanted)
        for name, c in self.fields.items():
            yield Declared("field", name, c, unguarded(name))
        for name, c in self.constants.items():
            yield Declared("constant", name, c, f"{upper}_{snake(name).upper()}")
        for type_ in chart.types:
            if isinstance(type_, EnumType):
                for name, c in zip(type_.members, self.members[type_.name], strict=True):
                    wanted = f"{upper}_{snake(type_.name)}_{legal(name)}".upper()
                    yield Declared("member", name, c, wanted)

    @property
    def renamed(self) -> tuple[Declared, ...]:
        """Names of the chart that are different in C, or are written in other letters."""
        is_chosen = self.options.chosen.is_chosen
        return tuple(
            each
            for each in self.declared
            if (each.text != each.wanted or not each.name.isascii())
            and not is_chosen(each.kind, each.name)
        )

    def place(self, span: Span) -> str:
        """Return where something was written, as a comment says it: file and line."""
        name = span.source.name.rpartition("/")[2]
        return f"{name}:{span.source.position(span.start)[0]}"


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
    """Whether a type of that name would hide what functions or headers call so, or be hidden."""
    return lower in LOCALS | HEADERS | INSIDE or COUNTED.fullmatch(lower) is not None


def require_prefix(prefix: str | None) -> None:
    """Refuse a prefix that is a name within generated C, or of a header (``wrong-option``)."""
    if prefix is not None and snake(prefix) not in KEYWORDS and _hides(snake(prefix)):
        raise fail(
            "wrong-option",
            f"generated C uses the name `{snake(prefix)}` itself: it cannot be a prefix",
            help=f"use another, for instance `{snake(prefix)}_machine`",
        )


def _choose(names: Names, options: Options) -> None:
    """Keep the options of a machine; those in its slots are whole, and as small."""
    names.options = options
    names.shared = {} if options.is_small else shared_bytes(names.plan)
    for region, history in names.shared.items():
        del names.histories[history, region]
    for inner in names.invoked:
        extras = options.extras & {"coverage"}
        inside = replace(options, without=frozenset(), extras=extras, binding=None)
        _choose(inner, replace(inside, tells_reads=False))


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
    called = tuple(chosen.word("event", name) for name in _event_names(chart))
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
        names.variables |= {name: spelt(way) for name, way in names.structs.ways.items()}
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
    begin = f"{upper}_STATE_"
    wanted = {
        t.index: f"{upper}_TIMER_{states[t.source].removeprefix(begin)}_"
        + (snake(t.delay_name) if t.delay_name else t.trigger.value).upper()
        for t in timed
    }
    count = Counter(wanted.values())
    for t in timed:
        if count[wanted[t.index]] > 1:
            target = states[t.targets[0]].removeprefix(begin) if t.targets else ""
            wanted[t.index] += f"_TO_{target}" if target else "_STAYING"
    return {t.index: constants.name(wanted[t.index]) for t in timed}


def free_of(names: Names, operations: dict[str, str]) -> frozenset[str]:
    """Return what types of copies cannot be called: as functions and other types are."""
    types = [*names.enumerations.values(), *names.records.values()]
    taken = {name.removeprefix(f"{names.prefix}_") for name in types} | {*operations.values()}
    return frozenset(taken) | FUNCTIONS | {"event", "delayed", "state", "event_name"}


def _event_names(chart: Chart) -> tuple[str, ...]:
    """Return how events are called: what a host posts as it is, others of that name by origin."""
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

    No other name of the chart may begin as those of that machine do.
    """
    types = [t for t in chart.types if isinstance(t, EnumType | RecordType)]
    others = {snake(x.name) for x in (*types, *chart.operations)}

    def is_free(name: str) -> bool:
        if name in FUNCTIONS | INVOKING or FAMILIES.fullmatch(name) or NUMBERED.fullmatch(name):
            return False
        # so begin constants, and functions of states and events
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


def file_name(source: str) -> str:
    """Return the last part of a path."""
    return PurePath(source).name
