"""The C names of everything in a chart."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import PurePath

from fsmkit.emit import Namer, legal, snake
from fsmkit.expressions import EnumType, RecordType
from fsmkit.model.chart import Chart, Operation
from fsmkit.model.document import Direction, Trigger
from fsmkit.plan import Plan


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


KEYWORDS = _words(
    "alignas alignof and and_eq asm auto bitand bitor bool break case catch char class compl const "
    "constexpr continue decltype default delete do double else enum explicit export extern false "
    "float for friend goto if inline int long mutable namespace new noexcept not not_eq nullptr "
    "operator or or_eq private protected public register restrict return short signed sizeof "
    "static struct switch template this throw true try typedef typeid typename typeof union "
    "unsigned using virtual void volatile wchar_t while xor xor_eq m linux unix"
)
"""Of C and C++ both, since the header is read by either; ``m`` is the machine everywhere."""

LOCALS = KEYWORDS | _words(
    "e i result NULL int8_t int16_t int32_t int64_t uint8_t uint16_t uint32_t uint64_t"
)
"""And what a parameter cannot be called: what the functions that take it name themselves."""

MEMBERS = _words(
    "now timers queue deferred internal delayed event fault failed budget timer_count queue_count "
    "deferred_count internal_count delayed_count running finished busy "
    "reply asked unhandled rejected spare_"
)
"""Members of the struct that no variable may be called."""

FUNCTIONS = _words(
    "init start post run dispatch next_deadline in finished fault active rebase state event symbol "
    "state_name event_name event_text delayed step_event step_timer step_eventless count stop "
    "take_out has_room raise error end_block send holds guard_holds clamp clamp_u clamp_f "
    "truncate_f fault_i fault_u fault_f arm delay undelay cancel add selection conflict "
    "remove_conflicts microstep take take_eventless react settle begin macrostep unhandled leave "
    "act enter record domain emit is_deferred select_event select_eventless event_symbol "
    "no_event last_below source_of"
)
"""What follows the prefix in the names of functions and types that every machine has."""

FAMILIES = re.compile(
    r"(enter|leave|on|always|guard|block|select_event|select_eventless)_\d+|(call|post|send)_.*"
)
"""And of those that are made by number or by name."""


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
    records: dict[str, str]
    members: dict[str, tuple[str, ...]]
    """The constants of each enumeration."""
    enumerations: dict[str, str]
    regions: tuple[str, ...]
    histories: dict[tuple[int, int], str]
    """By history and region."""
    fields: dict[str, str]
    """Of records, payloads and operations alike."""
    symbols: list[str] = field(default_factory=lambda: [""])
    numbers: dict[str, int] = field(default_factory=lambda: {"": 0})
    """Numbers of the interned strings."""
    used: set[str] = field(default_factory=set)
    """Helpers that the printed expressions call."""
    marks: dict[str, int] = field(default_factory=dict)
    """Numbers of the ids of delayed sends, from 1."""

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.plan.chart

    @property
    def delays(self) -> bool:
        """Whether events are sent later; known when all content is printed."""
        return "delay" in self.used

    @property
    def has_timers(self) -> bool:
        """Whether there are timeouts."""
        timed = (Trigger.AFTER, Trigger.EVERY)
        return any(t.trigger in timed for t in self.chart.transitions)

    @property
    def defers(self) -> bool:
        """Whether some state keeps events for later."""
        return any(state.defer for state in self.chart.states)

    def symbol(self, text: str) -> int:
        """Return the number of an interned string."""
        number = self.numbers.setdefault(text, len(self.symbols))
        if number == len(self.symbols):
            self.symbols.append(text)
        return number

    def mark(self, name: str | None) -> int:
        """Return the number of the id of a delayed send, 0 for none."""
        return 0 if name is None else self.marks.setdefault(name, len(self.marks) + 1)

    def operation(self, name: str) -> Operation:
        """Return the declaration of an operation."""
        return next(o for o in self.chart.operations if o.name == name)

    def field(self, name: str) -> str:
        """Return the C name of a field of a record or payload."""
        return self.fields[name]

    def note(self, state: int) -> str:
        """Return a comment that tells which state is meant."""
        return f"/* {comment(self.chart.states[state].id)} */"

    def in_state(self, machine: str, state: int) -> str:
        """Return the test whether a state is active."""
        plan = self.plan
        if state == 0:
            return f"{machine}->running"
        variable = f"{machine}->{self.regions[plan.region_of[state]]}"
        first, last = plan.number[state], plan.last_number[state]
        if first == last:
            return f"{variable} == {first}u"
        if last == len(plan.regions[plan.region_of[state]].states):
            return f"{variable} >= {first}u"
        if first == 1:
            return f"({variable} != 0u && {variable} <= {last}u)"
        return f"({variable} >= {first}u && {variable} <= {last}u)"

    def place(self, span: object) -> str:
        """Return where something was written, as a comment says it."""
        return _place(span)


def _place(span: object) -> str:
    name, _, rest = str(span).rpartition("/") if "/" in str(span) else ("", "", str(span))
    del name
    return ":".join(rest.split(":")[:2])


def name_everything(plan: Plan, prefix: str | None) -> Names:
    """Return the names for a plan; ``prefix`` instead of one made of the chart's name."""
    chart = plan.chart
    lower = snake(prefix or chart.name)
    if lower in KEYWORDS:
        lower += "_machine"
    upper = lower.upper()
    members = Namer(KEYWORDS | MEMBERS)
    variables = {v.name: members.name(v.name) for v in (*chart.inputs, *chart.outputs, *chart.data)}
    constants = Namer()
    states = tuple(
        constants.name(f"{upper}_STATE_{s.id if s.index else 'ROOT'}".upper()) for s in chart.states
    )
    events = tuple(constants.name(f"{upper}_EVENT_{e.name}".upper()) for e in chart.events)
    functions = Namer()
    event_names = tuple(functions.name(snake(e.name)) for e in chart.events)
    payloads = tuple(
        f"{name}_" if name in KEYWORDS or name == "none" else name for name in event_names
    )
    own = Namer()
    operations = {o.name: own.name(_free(snake(o.name), "_operation")) for o in chart.operations}
    enumerations = {
        t.name: f"{lower}_{own.name(_free(snake(t.name), '_kind'))}"
        for t in chart.types
        if isinstance(t, EnumType)
    }
    return Names(
        plan=plan,
        prefix=lower,
        upper=upper,
        variables=variables,
        states=states,
        events=events,
        event_names=event_names,
        payloads=payloads,
        operations=operations,
        records={
            t.name: f"{lower}_{own.name(_free(snake(t.name), '_record'))}"
            for t in chart.types
            if isinstance(t, RecordType)
        },
        members={
            t.name: tuple(
                constants.name(f"{upper}_{snake(t.name)}_{member}".upper()) for member in t.members
            )
            for t in chart.types
            if isinstance(t, EnumType)
        },
        enumerations=enumerations,
        regions=tuple(
            members.name("active" if r.index == 0 else f"active_{chart.states[r.top].id}")
            for r in plan.regions
        ),
        histories={
            (s.index, region): members.name(f"was_{s.id}_{region}" if region else f"was_{s.id}")
            for s in chart.states
            for region in plan.recorded_regions[s.index]
        },
        fields=_fields(chart),
    )


def _fields(chart: Chart) -> dict[str, str]:
    """Return the names of all fields, which SCXML lets be any text."""
    found = {
        part.name
        for fields in (
            *(t.fields for t in chart.types if isinstance(t, RecordType)),
            *(event.fields for event in chart.events),
            *(operation.parameters for operation in chart.operations),
        )
        for part in fields
    }
    plain = sorted(name for name in found if name not in LOCALS and legal(name) == name)
    namer = Namer(LOCALS)
    given = {name: namer.name(name) for name in plain}
    others = sorted(found - given.keys())
    return given | {n: namer.name(f"{n}_" if n in LOCALS else n) for n in others}


def _free(name: str, suffix: str) -> str:
    """Return a name that no function of the machine has."""
    return f"{name}{suffix}" if name in FUNCTIONS or FAMILIES.fullmatch(name) else name


def comment(text: str) -> str:
    """Return a text as it can stand in a comment: no name ends it, or begins a line."""
    plain = "".join(char if char.isprintable() else " " for char in text)
    return plain.replace("*/", "* /").replace("/*", "/ *")


def posted_events(chart: Chart) -> tuple[int, ...]:
    """Return the events that a host may post: those declared ``in``, or all of a lenient chart."""
    return tuple(
        e.index
        for e in chart.events
        if Direction.IN in e.directions or (chart.lenient and e.directions)
    )


def file_name(source: str) -> str:
    """Return the last part of a path."""
    return PurePath(source).name
