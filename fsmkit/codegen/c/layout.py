"""The members of the struct, in an order that leaves no undefined byte between them.

The groups ``in``, ``out`` and ``data`` belong to the chart, ``fsm`` to the machine. Machines in
slots have no group.
"""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.limits import timeouts_at_once
from fsmkit.chart.statements import Reply
from fsmkit.codegen.c.copies import Part, Struct
from fsmkit.codegen.c.expressions.types import computed, enumeration_of
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.reserved import TO_INVOKE
from fsmkit.codegen.c.sharing import RECORDED
from fsmkit.codegen.c.storage import storage
from fsmkit.language import INT64, UINT64, ArrayType, FloatType, IntType, Type

OWN = "fsm"
"""The group of the machine's own members."""
GROUPS = (OWN, "in", "out", "data", "")
"""The groups in the order of the struct, unless alignment requires another."""

WIDTH = {"uint8_t": 1, "uint16_t": 2, "uint32_t": 4}
"""The bytes of each type of numbers."""


def narrowest(most: int, least: str = "uint8_t") -> str:
    """Return the narrowest C type, from ``least`` on, that holds all numbers up to ``most``."""
    types = [ctype for ctype, width in WIDTH.items() if width >= WIDTH[least]]
    return next(ctype for ctype in types if most < 2 ** (8 * WIDTH[ctype]))


@dataclass(frozen=True, slots=True)
class Member:
    """A member: its type and name, size and alignment in bytes, its comment, its group."""

    ctype: str
    name: str
    size: int
    alignment: int
    note: str = ""
    group: str = OWN
    lengths: tuple[int, ...] = ()
    """The lengths of an array, outermost first."""

    @property
    def text(self) -> str:
        """The declaration of the member."""
        return f"{self.ctype} {self.name}" + "".join(f"[{length}]" for length in self.lengths)

    @property
    def path(self) -> str:
        """The path of the member in the machine's struct: ``fsm.now``."""
        return f"{self.group}.{self.name}" if self.group else self.name


@dataclass(frozen=True, slots=True)
class Group:
    """Members in their order. A group without a name holds members of the struct itself."""

    name: str
    members: tuple[Member, ...]

    @property
    def alignment(self) -> int:
        """The alignment of the group, in bytes."""
        return max(member.alignment for member in self.members)

    @property
    def size(self) -> int:
        """The size of the group in bytes, a multiple of its alignment."""
        return sum(member.size for member in self.members)


@dataclass(frozen=True, slots=True)
class Needs:
    """The members that the functions of the machine use."""

    remembered: int
    reply: str
    event_size: int
    event_alignment: int
    inside: tuple[tuple[int, int], ...] = ()
    """Size and alignment of the machine in each slot."""


def timers_needed(names: Names) -> int:
    """Return the greatest number of timers armed at once, those of delayed sends included."""
    delayed = names.chart.capacities.delayed if names.does.delays else 0
    return timeouts_at_once(names.chart) + delayed


def groups(names: Names, needs: Needs) -> list[Group]:
    """Return the groups in the order of the struct: by descending alignment, as their members."""
    found = _members(names, needs)
    grouped = []
    for name in GROUPS:
        inside = [member for member in found if member.group == name]
        if inside and name:
            grouped.append(Group(name, _ordered(inside)))
        grouped += [Group("", (slot,)) for slot in inside if not name]
    grouped.sort(key=lambda group: -group.alignment)
    total, largest = sum(group.size for group in grouped), grouped[0].alignment
    spare = _spare(total, largest, "")
    return [*grouped, *(Group("", (member,)) for member in spare)]


def _ordered(inside: list[Member]) -> tuple[Member, ...]:
    """Return members by alignment, single ones before arrays: a small offset takes less code."""
    inside = sorted(inside, key=lambda m: (-m.alignment, m.lengths > ()))
    total, largest = sum(member.size for member in inside), inside[0].alignment
    return (*inside, *_spare(total, largest, inside[0].group))


def _spare(total: int, alignment: int, group: str) -> list[Member]:
    """Return a member for the padding bytes that the compiler would add."""
    count = -total % alignment
    note = "so that no byte is undefined"
    return [Member("uint8_t", "spare_", count, 1, note, group, (count,))] if count else []


def _members(names: Names, needs: Needs) -> list[Member]:
    chart, capacities = names.chart, names.chart.capacities
    found = []
    structs = names.structs
    if structs is not None:
        for group, parts in structs.members.items():
            found += [struct_member(part, names, group) for part in parts]
    for variable in (*chart.inputs, *chart.outputs, *chart.data):
        if structs is not None and variable.name in structs.copied:
            continue
        group, _, name = names.variables[variable.name].partition(".")
        found.append(_variable(variable.type, name, names, group))
    does = names.does
    event = f"{names.prefix}_event"
    size, alignment = needs.event_size, needs.event_alignment
    queue, internal = capacities.queue, capacities.internal
    if does.queued:
        found.append(Member(event, "queue", size * queue, alignment, lengths=(queue,)))
    if does.raises:
        found.append(Member(event, "internal", size * internal, alignment, lengths=(internal,)))
    if does.event:
        found.append(Member(event, "event", size, alignment, "the current event of a step"))
    if does.defers:
        found.append(Member(event, "deferred", size * queue, alignment, lengths=(queue,)))
        found.append(Member("uint8_t", "deferred_count", 1, 1))
    if does.delays:
        wider = max(alignment, 2)
        each = size + size % 2 + 4
        each += -each % wider
        many = capacities.delayed
        found.append(
            Member(f"{names.prefix}_delayed", "delayed", each * many, wider, lengths=(many,))
        )
        found.append(Member("uint8_t", "delayed_count", 1, 1))
    timers = timers_needed(names)
    if timers:
        found.append(Member("fsm_timer", "timers", 8 * timers, 4, "by deadline", lengths=(timers,)))
        found.append(Member("uint8_t", "timer_count", 1, 1))
    for region in names.plan.regions:
        ctype = names.number_type(region.index)
        size = WIDTH[ctype]
        top = chart.states[region.top].id if region.index else chart.name
        note = "deepest active state of " + top
        if region.index in names.shared:
            held = chart.states[names.shared[region.index]].id
            note += ", or recorded by " + held + f", with {RECORDED} more"
        name = names.regions[region.index].removeprefix(f"{OWN}.")
        found.append(Member(ctype, name, size, size, note))
    for (history, region_), path in names.histories.items():
        name = path.removeprefix(f"{OWN}.")
        ctype = names.number_type(region_)
        size = WIDTH[ctype]
        note = "recorded by " + chart.states[history].id
        found.append(Member(ctype, name, size, size, note))
    for invocation, (inner, aligned) in zip(chart.invocations, needs.inside, strict=True):
        slot, inside = names.slots[invocation.index], names.invoked[invocation.index].prefix
        note = "slot `" + invocation.id + "`: invoked by " + chart.states[invocation.state].id
        found.append(Member(inside, slot, inner, aligned, note, ""))
    if names.invoking:
        count = (len(names.invoking) + 7) // 8
        found.append(
            Member("uint8_t", TO_INVOKE, count, 1, "entered, to invoke yet", lengths=(count,))
        )
    if needs.remembered:
        found.append(Member("uint8_t", "asked", needs.remembered, 1, lengths=(needs.remembered,)))
    if needs.reply:
        found.append(Member(needs.reply, "reply", 8, 8))
    if does.now:
        found.append(Member("uint32_t", "now", 4, 4))
    if does.loops:
        found.append(Member("uint16_t", "budget", 2, 2, "microsteps left in this macrostep"))
    if does.counted:
        note = "events that enabled nothing; stops at 65535"
        found.append(Member("uint16_t", "unhandled", 2, 2, note))
    if does.counted and does.queued:
        note = "events that found a queue full; stops at 65535"
        found.append(Member("uint16_t", "rejected", 2, 2, note))
    if does.queued:
        found.append(Member("uint8_t", "queue_count", 1, 1))
    if does.raises:
        found.append(Member("uint8_t", "internal_count", 1, 1))
    if does.stops:
        found.append(Member("uint8_t", "fault", 1, 1, "fsm_fault"))
    if names.can_fail:
        found.append(Member("uint8_t", "failed", 1, 1))
    if does.running:
        found.append(Member("bool", "running", 1, 1))
    if does.ends:
        found.append(Member("bool", "finished", 1, 1))
    if does.guarded:
        found.append(Member("bool", "busy", 1, 1))
    return found


def _variable(type_: Type, name: str, names: Names, group: str) -> Member:
    """Return the member of a variable of the chart."""
    stored, lengths, inner = storage(type_, names.records), [], type_
    while isinstance(inner, ArrayType):
        lengths.append(inner.length)
        inner = inner.element
    note = enumeration_of(type_, names)
    ctype, size, alignment = stored.text, stored.size, stored.alignment
    return Member(ctype, name, size, alignment, note, group, tuple(lengths))


def struct_member(part: Part, names: Names, group: str) -> Member:
    """Return a member of a struct of a copy: a variable, or a struct in it."""
    if part.variable is not None:
        return _variable(part.variable.type, part.name, names, group)
    assert part.struct is not None  # noqa: S101  (a part is one of the two)
    inside = struct_members(part.struct, names)
    return Member(
        part.struct.name,
        part.name,
        sum(member.size for member in inside) * (part.count or 1),
        max(member.alignment for member in inside),
        "",
        group,
        (part.count,) if part.count else (),
    )


def struct_members(struct: Struct, names: Names) -> tuple[Member, ...]:
    """Return the members of a struct of a copy, ordered so that no byte is undefined."""
    return _ordered([struct_member(part, names, "") for part in struct.parts])


def reply_type(chart: Chart) -> Type | None:
    """Return a type that holds every reply, or None without replies."""
    types = [s.value.type for s in all_statements(chart) if isinstance(s, Reply)]
    if not types:
        return None
    if any(isinstance(type_, FloatType) for type_ in types):
        return FloatType(64)
    is_wide = any(isinstance(t, IntType) and computed(t) == "uint64_t" for t in types)
    return UINT64 if is_wide else INT64
