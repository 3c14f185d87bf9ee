"""Encode snapshots in the format of generated C and Python (see `plan.image`)."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from math import nan

import fsmkit.language as lang
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.document.document import Kind
from fsmkit.plan import Region
from fsmkit.plan.image import (
    FAULTS,
    MAGIC,
    SEND,
    UNKNOWN_TEXT,
    Image,
    code,
    flat,
    head,
    image_of,
    is_sealed,
    scalars,
    sealed,
)
from fsmkit.runtime.interpreter import Delayed, Occurrence, Snapshot, Timeout, Timer

HALF = 2**31
"""Deadlines differ by less, in ticks: a clock of 32 bits orders them."""


def pack(chart: Chart, snapshot: Snapshot) -> bytes:
    """Return a snapshot as bytes, timers with the time they have left.

    `FsmkitError` for a symbol that the chart does not mention: there is no number for it.
    """
    return sealed(head(chart) + pack_machine(image_of(chart), snapshot))


def pack_machine(image: Image, snapshot: Snapshot) -> bytes:
    """Return the bytes of a machine without header and checksum, for a layout that is kept."""
    writer = _Writer(image)
    writer.machine(snapshot, snapshot.now)
    return bytes(writer.data)


def unpack(chart: Chart, data: bytes, now: int) -> Snapshot:
    """Return the snapshot; raises `FsmkitError` for damaged bytes and those of another chart."""
    if not is_sealed(data) or not data.startswith(MAGIC):
        raise damaged(chart, "its checksum is wrong, or it is not a snapshot")
    if not data.startswith(head(chart)):
        raise foreign(chart)
    image = image_of(chart)
    if len(data) != image.total:
        raise damaged(chart, f"it has {len(data)} bytes, not {image.total}")
    reader = _Reader(image, data[len(head(chart)) : -4], now)
    try:
        found = reader.machine()
    except (ValueError, IndexError, StopIteration) as error:
        raise damaged(chart, error) from error
    if pack(chart, found) != data:
        raise damaged(chart, "no machine is saved like that")
    return found


def damaged(chart: Chart, why: object) -> FsmkitError:
    """Return the error for a snapshot that cannot be read."""
    return fail("foreign-snapshot", f"the snapshot of `{chart.name}` is damaged: {why}")


def foreign(chart: Chart) -> FsmkitError:
    """Return the error for a snapshot of another chart."""
    return fail(
        "foreign-snapshot",
        f"the snapshot is of another chart than `{chart.name}` as it is now",
        help="restore it with the chart that it was saved from, or start anew",
    )


def unpack_values(
    image: Image, declared: Sequence[lang.Field], data: bytes, *, takes_foreign: bool = False
) -> tuple[lang.Value, ...]:
    """Return the values; raises `ValueError` for invalid bytes.

    ``takes_foreign``: a symbol created by the host of a machine in C is returned as ``?`` and its
    number.
    """
    reader = _Reader(image, data, 0)
    reader.takes_foreign = takes_foreign
    found = reader.values(declared)
    if reader.at != len(data):
        raise ValueError(f"{len(data) - reader.at} bytes are left over")
    return found


def pack_values(
    image: Image, declared: Sequence[lang.Field], values: Sequence[lang.Value]
) -> bytes:
    """Return the bytes of values; `FsmkitError` for a symbol that the chart does not mention."""
    writer = _Writer(image)
    writer.values(declared, values)
    return bytes(writer.data)


class _Writer:
    """Bytes of a machine."""

    def __init__(self, image: Image, data: bytearray | None = None) -> None:
        self._image = image
        self._chart = image.chart
        self.data = bytearray() if data is None else data

    def _put(self, codes: str, *values: float) -> None:
        self.data += struct.pack(f"<{codes}", *values)

    def machine(self, snapshot: Snapshot, now: int) -> None:
        image = self._image
        fault = 0 if snapshot.fault is None else _fault_number(snapshot.fault)
        self._put("BB", snapshot.running + 2 * snapshot.finished, fault)
        for number in numbers_of(image, snapshot):
            self._put("H", number)
        parts = flat((*snapshot.data, *snapshot.inputs))
        types = image.value_scalars
        self._put(image.value_codes, *map(self._number, types, parts))
        if snapshot.running:
            self._events(snapshot.queue, self._chart.capacities.queue)
            if image.deferred:
                self._events(snapshot.deferred, image.deferred)
            self._timers(snapshot.timers, now)
        else:
            self.data += bytes(image.waiting)
        for inner, child in zip(image.inner, snapshot.invoked, strict=True):
            if child is None or not snapshot.running:
                self.data += bytes(inner.size)
            else:
                _Writer(inner, self.data).machine(child, now)

    def values(self, declared: Sequence[lang.Field], values: Sequence[lang.Value]) -> None:
        for field, value in zip(declared, values, strict=True):
            for type_, part in zip(scalars(field.type), flat(value), strict=True):
                self._put(code(type_), self._number(type_, part))

    def _number(self, type_: lang.Type, value: lang.Value) -> float:
        assert not isinstance(value, tuple)  # noqa: S101
        if isinstance(type_, lang.FloatType):
            return float(value) if value == value else nan  # processors have several
        if not isinstance(type_, lang.SymbolType):
            return int(value)
        if value not in self._image.texts:
            raise fail(
                "wrong-value",
                f'the machine holds "{value}", which `{self._chart.name}` nowhere mentions',
                help="save it as data for JSON, which keeps any text",
            )
        return self._image.texts.index(str(value))

    def _event(self, occurrence: Occurrence) -> None:
        event = self._chart.events[occurrence.event]
        self._put("H", event.index + 1)
        start = len(self.data)
        self.values(event.fields, occurrence.payload)
        self.data += bytes(start + self._image.payload - len(self.data))

    def _events(self, waiting: Sequence[Occurrence], room: int) -> None:
        self._put("B", len(waiting))
        for occurrence in waiting:
            self._event(occurrence)
        self.data += bytes((room - len(waiting)) * (2 + self._image.payload))

    def _timers(self, timers: Sequence[Timer], now: int) -> None:
        image = self._image
        if not image.timers:
            return
        self._put("B", len(timers))
        for timer in timers:
            what = timer.what.transition if isinstance(timer.what, Timeout) else SEND
            self._put("iH", timer.deadline - now, what)
        self.data += bytes((image.timers - len(timers)) * 6)
        sends = [timer.what for timer in timers if isinstance(timer.what, Delayed)]
        for send in sends:
            route = image.routes.index((send.destination, send.invocations))
            self._put("HHH", route, image.ids.index(send.id), image.peers.index(send.peer))
            self._event(send.occurrence)
        self.data += bytes((image.delayed - len(sends)) * (8 + image.payload))


class _Reader:
    """A machine from bytes."""

    def __init__(self, image: Image, data: bytes, now: int, at: int = 0) -> None:
        self._image = image
        self._chart = image.chart
        self._data = data
        self._now = now
        self.at = at
        self.takes_foreign = False

    def _get(self, code_: str) -> float:
        size = struct.calcsize(f"<{code_}")
        if self.at + size > len(self._data):
            raise ValueError("it ends too early")
        (value,) = struct.unpack_from(f"<{code_}", self._data, self.at)
        self.at += size
        return value  # type: ignore[no-any-return]

    def _count(self, code_: str, most: int) -> int:
        value = int(self._get(code_))
        if value > most:
            raise ValueError(f"{value} is over {most}")
        return value

    def _state(self, region: Region) -> int:
        state = int(self._get("H"))
        if state and state not in region.states:
            raise ValueError(f"{state} is not a state of region {region.index}")
        return state

    def machine(self) -> Snapshot:
        image = self._image
        status, fault = self._count("B", 3), self._count("B", len(FAULTS) - 1)
        regions = [*image.plan.regions, *(image.plan.regions[r] for _, r in image.histories)]
        numbers = [self._state(region) for region in regions]
        values = self.values(image.values)
        owned = len(image.chart.data) + len(image.chart.outputs)
        queue = self._events(self._chart.capacities.queue)
        deferred = self._events(image.deferred) if image.deferred else ()
        timers = self._timers()
        invoked = tuple(self._invoked(inner) for inner in image.inner)
        active, history = configuration_of(image, numbers, was_started=bool(status or fault))
        found = Snapshot(
            configuration=active,
            data=values[:owned],
            inputs=values[owned:],
            history=history,
            queue=queue,
            deferred=deferred,
            timers=timers,
            now=self._now,
            running=bool(status & 1),
            finished=bool(status & 2),
            fault=FAULTS[fault],
            invoked=invoked,
        )
        require_possible(image, found)
        return found

    def _invoked(self, image: Image) -> Snapshot | None:
        if not any(self._data[self.at : self.at + image.size]):
            self.at += image.size
            return None
        reader = _Reader(image, self._data, self._now, self.at)
        found = reader.machine()
        if not found.running:
            raise ValueError(f"a slot holds `{image.chart.name}`, which does not run")
        self.at = reader.at
        return found

    def values(self, declared: Sequence[lang.Field]) -> tuple[lang.Value, ...]:
        return tuple(self._value(field.type) for field in declared)

    def _value(self, type_: lang.Type) -> lang.Value:
        match type_:
            case lang.ArrayType(element, length):
                return tuple(self._value(element) for _ in range(length))
            case lang.RecordType(_, parts):
                return tuple(self._value(part.type) for part in parts)
            case _:
                return self._scalar(type_, self._get(code(type_)))

    def _scalar(self, type_: lang.Type, value: float) -> lang.Value:
        match type_:
            case lang.BoolType() if value in (0, 1):
                return bool(value)
            case lang.IntType(lo, hi) if lo <= value <= hi:
                return int(value)
            case lang.EnumType(numbers=numbers) if value in numbers:
                return int(value)
            case lang.FloatType():
                return value
            case lang.DurationType() if value <= lang.LONGEST_DURATION:
                return int(value)
            case lang.SymbolType() if value < UNKNOWN_TEXT:
                return self._image.texts[int(value)]
            case lang.SymbolType() if self.takes_foreign and value < 2 * UNKNOWN_TEXT:
                return f"?{int(value) - UNKNOWN_TEXT}"
            case _:
                raise ValueError(f"{value} is no `{type_}` of the chart")

    def _event(self) -> Occurrence | None:
        number = self._count("H", len(self._chart.events))
        end = self.at + self._image.payload
        fields = self._chart.events[number - 1].fields if number else ()
        payload = self.values(fields)
        self.at = end
        return Occurrence(number - 1, payload) if number else None

    def _events(self, room: int) -> tuple[Occurrence, ...]:
        count = self._count("B", room)
        found = [self._event() for _ in range(room)]
        if any((event is None) is (place < count) for place, event in enumerate(found)):
            raise ValueError("a queue holds fewer events than its count")
        return tuple(event for event in found if event is not None)

    def _timers(self) -> tuple[Timer, ...]:
        image = self._image
        if not image.timers:
            return ()
        count = self._count("B", image.timers)
        pairs = [(int(self._get("i")), int(self._get("H"))) for _ in range(image.timers)][:count]
        sends = self._sends()
        found = []
        for left, what in pairs:
            if what != SEND and not self._chart.transitions[what].has_timer:
                raise ValueError(f"transition {what} has no delay")
            due = next(sends) if what == SEND else Timeout(what)
            found.append(Timer(self._now + left, due))
        return tuple(found)

    def _sends(self) -> Iterator[Delayed]:
        image = self._image
        found = []
        for _ in range(image.delayed):
            route, name, peer = (int(self._get("H")) for _ in range(3))
            event = self._event()
            if event is not None:
                to, slots = image.routes[route]
                found.append(Delayed(event, to, image.ids[name], image.peers[peer], slots))
        return iter(found)


def require_possible(image: Image, snapshot: Snapshot) -> None:
    """Raise `ValueError` for a machine that no run reaches; `plan.image` lists the rules.

    Values have their types already. Machines in slots are checked separately.
    """
    has_fault = snapshot.fault is not None
    was_started = snapshot.running or snapshot.finished or has_fault
    if snapshot.running + snapshot.finished + has_fault > 1:
        raise ValueError("it runs, is finished or has a fault: only one is possible")
    if has_fault and not (image.can_stop and fault_number(snapshot.fault)):
        raise ValueError("no fault can stop it")
    numbers = numbers_of(image, snapshot)
    found = configuration_of(image, numbers, was_started=was_started)
    if found != (snapshot.configuration, snapshot.history):
        raise ValueError("its states are not those of a machine")
    if was_started is not any(numbers):
        raise ValueError("it is in no state, or was not started and was in one")
    if snapshot.finished and numbers[0] not in image.endings:
        raise ValueError("it is finished, but in no final state")
    if was_started:
        _require_legal(image, numbers, is_running=snapshot.running)
    _require_recordable(image, numbers[len(image.plan.regions) :])
    _require_room(image, snapshot)
    if snapshot.running:
        _require_armed(image.chart, snapshot)


def _require_legal(image: Image, numbers: Sequence[int], *, is_running: bool) -> None:
    """Raise `ValueError` for a configuration that no started machine has after a macrostep.

    A fault does not interrupt a microstep, so a machine that stopped is in whole states, too.
    """
    chart = image.chart
    resting = image.resting if is_running else image.resting | image.endings
    for region, owner in enumerate(image.owners):
        above = numbers[image.plan.region_of[owner]] if owner else 0
        is_active = owner in (0, above, *chart.ancestors(above))
        state = numbers[region]
        if state and not is_active:
            raise ValueError(f"region {region} is in a state, but not active")
        if is_active and not state:
            raise ValueError(f"region {region} is in no state")
        if state and state not in resting:
            raise ValueError(f"region {region} cannot rest in state {state}")


def _require_recordable(image: Image, recorded: Sequence[int]) -> None:
    """Raise `ValueError` for records of histories that no machine has."""
    for (history, _), known, state in zip(image.histories, image.recordable, recorded, strict=True):
        if state and state not in known:
            raise ValueError(f"history {history} does not record state {state}")
    for place, (entry, low, high) in enumerate(image.recorded_below):
        if entry < 0:
            own = [h == low for h, _ in image.histories]
            is_held = any(state for state, mine in zip(recorded, own, strict=True) if mine)
        else:
            is_held = low <= recorded[entry] <= high
        if is_held is not bool(recorded[place]):
            raise ValueError(f"history {image.histories[place][0]} recorded half of a state")


def _require_room(image: Image, snapshot: Snapshot) -> None:
    """Raise `ValueError` for more events or timers than the machine can hold."""
    sends = sum(isinstance(timer.what, Delayed) for timer in snapshot.timers)
    for what, count, most in (
        ("events", len(snapshot.queue), image.chart.capacities.queue),
        ("deferred events", len(snapshot.deferred), image.deferred),
        ("timers", len(snapshot.timers), image.timers),
        ("delayed sends", sends, image.delayed),
    ):
        if count > most:
            raise ValueError(f"{count} {what} are over {most}")


def _require_armed(chart: Chart, snapshot: Snapshot) -> None:
    """Raise `ValueError` for timers that no running machine has."""
    seen: set[int] = set()
    for earlier, timer in zip([None, *snapshot.timers], snapshot.timers, strict=False):
        if earlier is not None and not 0 <= timer.deadline - earlier.deadline < HALF:
            raise ValueError("timers are not in the order of their deadlines")
        if not -HALF <= timer.deadline - snapshot.now < HALF:
            raise ValueError("a deadline is too far away")
        if isinstance(timer.what, Timeout):
            transition = chart.transitions[timer.what.transition]
            if transition.index in seen:
                raise ValueError(f"transition {transition.index} has two timers")
            seen.add(transition.index)
            if not transition.has_timer or transition.source not in snapshot.configuration:
                raise ValueError(f"transition {transition.index} has no timer in these states")


def numbers_of(image: Image, snapshot: Snapshot) -> list[int]:
    """Return the states of regions, then those that histories recorded, as they are saved."""
    recorded = dict(snapshot.history)
    return [
        *_numbers(image, snapshot.configuration),
        *(
            _recorded(image, h, region, recorded.get(h, frozenset()))
            for h, region in image.histories
        ),
    ]


def fault_number(fault: str | None) -> int:
    """Return the number of a fault, 0 for none."""
    return 0 if fault is None else _fault_number(fault)


def configuration_of(
    image: Image, numbers: Sequence[int], *, was_started: bool = False
) -> tuple[frozenset[int], tuple[tuple[int, frozenset[int]], ...]]:
    """Return the active states and the recorded histories from the numbers of a saved machine.

    ``numbers``: one for each region, then one for each region of each history.
    """
    count = len(image.plan.regions)
    recorded: dict[int, set[int]] = {}
    for (history, _), state in zip(image.histories, numbers[count:], strict=True):
        if state:
            recorded.setdefault(history, set()).add(state)
    is_there = was_started or any(numbers)
    active = _configuration(image, numbers[:count]) if is_there else frozenset()
    unread = {h for state in active for h in image.plan.forgotten[state]}
    held = tuple(
        (history, _remembered(image.chart, history, states))
        for history, states in sorted(recorded.items())
        if history not in unread
    )
    return active, held


def _fault_number(fault: str) -> int:
    return FAULTS.index("error.*" if fault.startswith("error.") else fault)


def _numbers(image: Image, active: frozenset[int]) -> list[int]:
    """Return for each region the number of the deepest of some active states."""
    plan = image.plan
    found = [0] * len(plan.regions)
    for state in active - {0}:
        region = plan.region_of[state]
        found[region] = max(found[region], state)
    return found


def _configuration(image: Image, numbers: Sequence[int]) -> frozenset[int]:
    """Return the active states: in each region the deepest with all above it, and the root."""
    deepest = [number for number in numbers if number]
    above = (ancestor for state in deepest for ancestor in image.chart.ancestors(state))
    return frozenset((0, *deepest, *above))


def _recorded(image: Image, history: int, region: int, states: frozenset[int]) -> int:
    """Return the number that a history recorded in a region: of the deepest state there."""
    chart, plan = image.chart, image.plan
    parent = chart.states[history].parent or 0
    below = {a for s in states for a in (s, *chart.ancestors(s)) if chart.is_descendant(a, parent)}
    return max((s for s in below if plan.region_of[s] == region), default=0)


def _remembered(chart: Chart, history: int, states: set[int]) -> frozenset[int]:
    """Return the recorded states of a history: children if shallow, atomic states if deep."""
    if chart.states[history].kind is Kind.DEEP_HISTORY:
        return frozenset(state for state in states if chart.states[state].is_leaf)
    parent = chart.states[chart.states[history].parent or 0]
    if parent.kind is Kind.PARALLEL:  # all of them or none
        return frozenset(c for c in parent.children if not chart.states[c].is_history)
    return frozenset(states)
