"""The layout of a saved machine: equal bytes in every runtime, least significant byte first.

::

    "FSM" 1   hash of the chart (8 bytes)   the machine   CRC-32 of these bytes (4 bytes)

A machine consists of these parts, whose sizes depend only on the chart:

* status (1 byte: 1 running, 2 finished) and fault (1 byte, `FAULTS`);
* for each region its deepest active state (2); for each history and each region that it records
  the recorded state (2), 0 for none; a state is its position in document order;
* data, outputs, inputs, in the order of the chart;
* the external queue: the number of events (1), then its capacity of events;
* if some state defers: the deferred events in the same format;
* if timers are possible: their number (1), then for each the ticks left (4, signed) and its
  transition (2), or `SEND` for a delayed send;
* if delayed sends are possible: for each, in the order of the timers, its positions in ``routes``,
  ``ids`` and ``peers`` (2 each), and the event;
* the machine in each slot if it runs, else zeros.

An event is its index plus one (2), its fields, and zeros up to the longest payload of the chart. A
value takes the fewest bytes of 1, 2, 4, 8 that hold its type. A symbol is its position in ``texts``
(4); durations and floats have 4 or 8 bytes. The bytes beyond a count are zero. If the machine does
not run, its events, timers and slots are zero.

Bytes with a valid checksum may describe an impossible machine. Every runtime rejects these:

* a value outside its type, a count over its bound, a machine that both runs and is finished, or
  runs with a fault;
* a started machine with an inactive region in an active parallel state, with an active region in
  an inactive one, or in a state that must enter its initial state (a fault never interrupts a
  microstep); a running machine in a state that ends it;
* a machine that runs or has ended without an active state, or has or recorded one without being
  started; a finished machine that is not in a final state of the root; a fault that the chart
  cannot cause;
* a history with a state that it does not record, or with only some regions of a parallel state;
* a timer of an inactive state, two of one transition, one before an earlier deadline, or 2^31 ticks
  and more after it;
* bytes that would be saved differently, such as events of a machine that does not run.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import assert_never
from zlib import crc32

import fsmkit.language as lang
from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.limits import timeouts_at_once
from fsmkit.chart.statements import Destination, Send
from fsmkit.chart.walk import own_nodes
from fsmkit.document.document import Kind
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.plan.lower import lower
from fsmkit.plan.plan import Plan

MAGIC = b"FSM\x01"
SEND = 0x8000
"""The number of a delayed send's timer, in place of a transition."""
UNKNOWN_TEXT = 0x10000
"""The first number of symbols that the host of a machine in C has added."""
FAULTS = (None, "microsteps", "internal", "range", "error.*", "invoked")
"""The faults in the order of ``fsm_fault``. The bytes do not contain which error was unhandled."""
INTEGERS = (("B", 0, 2**8 - 1), ("b", -(2**7), 2**7 - 1), ("H", 0, 2**16 - 1),
            ("h", -(2**15), 2**15 - 1), ("I", 0, 2**32 - 1), ("i", -(2**31), 2**31 - 1),
            ("Q", 0, 2**64 - 1), ("q", -(2**63), 2**63 - 1))  # fmt: skip
"""The codes of `struct`, with the ranges of their values."""


def head(chart: Chart) -> bytes:
    """Return the first bytes of every saved machine of a chart."""
    return MAGIC + bytes.fromhex(fingerprint(chart))[:8]


def sealed(data: bytes) -> bytes:
    """Return bytes with their CRC-32 (IEEE 802.3, as in zlib)."""
    return data + struct.pack("<I", crc32(data))


def is_sealed(data: bytes) -> bool:
    """Whether bytes end with their CRC-32."""
    return len(data) > 4 and sealed(data[:-4]) == data


def scalars(type_: lang.Type) -> Iterator[lang.Type]:
    """Yield the types of the scalar parts of a type, in order."""
    return (scalar for _, scalar in scalars_by_path(type_))


def scalars_by_path(type_: lang.Type, path: str = "") -> Iterator[tuple[str, lang.Type]]:
    """Yield the scalar parts of a type, in order: path within it, such as ``.x[0]``, and type."""
    match type_:
        case lang.ArrayType(element, length):
            for place in range(length):
                yield from scalars_by_path(element, f"{path}[{place}]")
        case lang.RecordType(_, fields):
            for part in fields:
                yield from scalars_by_path(part.type, f"{path}." + part.name)
        case _:
            yield path, type_


def flat(value: lang.Value) -> Iterator[lang.Value]:
    """Yield the scalar parts of a value, in order."""
    if isinstance(value, tuple):
        for part in value:
            yield from flat(part)
    else:
        yield value


def code(type_: lang.Type) -> str:
    """Return the `struct` code of a scalar type."""
    match type_:
        case lang.BoolType():
            return "B"
        case lang.IntType(lo, hi):
            return next(text for text, low, high in INTEGERS if low <= lo and hi <= high)
        case lang.EnumType():
            return code(lang.IntType(*type_.bounds))
        case lang.FloatType(bits):
            return "f" if bits == 32 else "d"
        case lang.SymbolType() | lang.DurationType():
            return "I"
        case lang.ArrayType() | lang.RecordType():
            raise AssertionError(type_)
        case _:
            assert_never(type_)


def codes(declared: tuple[lang.Field, ...]) -> str:
    """Return the `struct` codes of all scalar parts of fields."""
    return "".join(code(part) for each in declared for part in scalars(each.type))


def size_of(text: str) -> int:
    """Return the size of `struct` codes in bytes, without padding."""
    return struct.calcsize(f"<{text}")


@dataclass(frozen=True)
class Image:
    """The parts of the saved machine of a chart."""

    plan: Plan
    is_inner: bool = False
    """Whether another machine invokes it."""

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.plan.chart

    @cached_property
    def values(self) -> tuple[lang.Field, ...]:
        """The data, outputs and inputs."""
        chart = self.chart
        return tuple(
            lang.Field(v.name, v.type) for v in (*chart.data, *chart.outputs, *chart.inputs)
        )

    @cached_property
    def value_scalars(self) -> tuple[lang.Type, ...]:
        """The scalar parts of the data, outputs and inputs."""
        return tuple(part for each in self.values for part in scalars(each.type))

    @cached_property
    def value_codes(self) -> str:
        """The `struct` codes of `value_scalars`."""
        return codes(self.values)

    @cached_property
    def payload(self) -> int:
        """The bytes of the longest payload."""
        return max((size_of(codes(event.fields)) for event in self.chart.events), default=0)

    @cached_property
    def histories(self) -> tuple[tuple[int, int], ...]:
        """A pair of history and region for each recorded number."""
        recorded = self.plan.recorded_regions
        return tuple(
            (s.index, r) for s in self.chart.states if s.is_history for r in recorded[s.index]
        )

    @cached_property
    def resting(self) -> frozenset[int]:
        """The states that can be the deepest of their region while the machine runs."""
        states = self.chart.states
        return frozenset(
            s.index
            for s in states
            if (s.is_leaf or self._is_parallel(s.index)) and s.index not in self.endings
        )

    @cached_property
    def owners(self) -> tuple[int, ...]:
        """For each region the parallel state that owns it, or the root."""
        return tuple(region.owner or 0 for region in self.plan.regions)

    @cached_property
    def recordable(self) -> tuple[frozenset[int], ...]:
        """For each entry of `histories` its recordable states."""
        return tuple(frozenset(self._recordable(*each)) for each in self.histories)

    @cached_property
    def recorded_below(self) -> tuple[tuple[int, int, int], ...]:
        """For each entry of `histories` when it holds a state, as an entry and two states.

        The condition is that this entry holds a state between the two: the parallel state with the
        region, and its last descendant. The entry -1 means that any entry of its history holds a
        state.
        """
        return tuple(self._recorded_below(*each) for each in self.histories)

    def _recorded_below(self, history: int, region: int) -> tuple[int, int, int]:
        owner, plan = self.owners[region], self.plan
        parent = self.chart.states[self.chart.states[history].parent or 0]
        if not parent.index < owner <= parent.last_descendant:
            return -1, history, history
        above = self.histories.index((history, plan.region_of[owner]))
        return above, owner, plan.last_below[owner]

    @cached_property
    def endings(self) -> frozenset[int]:
        """The final states of the machine."""
        return frozenset(
            s.index for s in self.chart.states if s.kind is Kind.FINAL and s.parent == 0
        )

    @cached_property
    def can_stop(self) -> bool:
        """Whether a fault can stop the machine."""
        features = self.plan.features
        is_family = self.is_inner or bool(self.chart.invocations)
        return is_family or features.raises or features.fails or features.eventless

    def _recordable(self, history: int, region: int) -> Iterator[int]:
        states = self.chart.states
        parent = states[states[history].parent or 0]
        for state in self.plan.regions[region].states:
            if states[history].kind is not Kind.DEEP_HISTORY:
                is_recorded = state in parent.children
            else:
                is_below = parent.index < state <= parent.last_descendant
                is_recorded = is_below and (states[state].is_leaf or self._is_parallel(state))
            if is_recorded:
                yield state

    def _is_parallel(self, state: int) -> bool:
        return self.chart.states[state].kind is Kind.PARALLEL

    @cached_property
    def _sends(self) -> tuple[Send, ...]:
        found = (s for s in all_statements(self.chart) if isinstance(s, Send))
        return tuple(s for s in found if s.delay is not None)

    @cached_property
    def routes(self) -> tuple[tuple[Destination, tuple[int, ...]], ...]:
        """The distinct targets of delayed sends."""
        return tuple(dict.fromkeys((s.destination, s.invocations) for s in self._sends))

    @cached_property
    def ids(self) -> tuple[str | None, ...]:
        """The distinct ids of delayed sends, after None."""
        return tuple(dict.fromkeys([None, *(s.id for s in self._sends)]))

    @cached_property
    def peers(self) -> tuple[str | None, ...]:
        """The distinct peers of delayed sends, after None."""
        return tuple(dict.fromkeys([None, *(s.peer for s in self._sends)]))

    @cached_property
    def delayed(self) -> int:
        """The greatest number of pending delayed sends."""
        return self.chart.capacities.delayed if self._sends else 0

    @cached_property
    def timers(self) -> int:
        """The greatest number of armed timers."""
        return timeouts_at_once(self.chart) + self.delayed

    @cached_property
    def deferred(self) -> int:
        """The greatest number of deferred events."""
        return self.chart.capacities.queue if any(s.defer for s in self.chart.states) else 0

    @cached_property
    def stores_symbols(self) -> bool:
        """Whether some variable or field is a symbol."""
        lists = (self.values, *(event.fields for event in self.chart.events))
        every = (part for each in lists for field in each for part in scalars(field.type))
        return any(isinstance(type_, lang.SymbolType) for type_ in every)

    @cached_property
    def texts(self) -> tuple[str, ...]:
        """The symbols of the chart in alphabetical order, after the empty one."""
        if not self.stores_symbols:
            return ("",)
        chart = self.chart
        found = {"", *_symbols(chart), *(event.name for event in chart.events)}
        if any(isinstance(node, lang.EventType) for node in own_nodes(chart)):
            found |= {event.type for event in chart.events}
        return tuple(sorted(found))

    @cached_property
    def inner(self) -> tuple[Image, ...]:
        """The images of the machines in the slots."""
        return tuple(Image(lower(each.chart), is_inner=True) for each in self.chart.invocations)

    @cached_property
    def size(self) -> int:
        """The bytes of a machine without header and CRC."""
        found = 2 + 2 * (len(self.plan.regions) + len(self.histories)) + size_of(codes(self.values))
        return found + self.waiting + sum(image.size for image in self.inner)

    @cached_property
    def waiting(self) -> int:
        """The bytes of all events and timers of a machine."""
        event = 2 + self.payload
        found = 1 + event * self.chart.capacities.queue
        found += 1 + event * self.deferred if self.deferred else 0
        found += 1 + 6 * self.timers if self.timers else 0
        return found + (6 + event) * self.delayed

    @property
    def total(self) -> int:
        """The bytes of a saved machine."""
        return len(MAGIC) + 8 + self.size + 4


def image_of(chart: Chart) -> Image:
    """Return the layout for a chart."""
    return Image(lower(chart))


def _symbols(chart: Chart) -> Iterator[str]:
    """Yield the strings in the expressions of a chart; machines in slots have their own."""
    for node in own_nodes(chart):
        if isinstance(node, lang.Literal):
            pairs = zip(flat(node.value), scalars(node.type), strict=True)
            yield from (str(part) for part, of in pairs if isinstance(of, lang.SymbolType))
