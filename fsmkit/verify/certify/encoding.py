"""Values, calls and events as bytes, as the driver in C reads and writes them (``driver.h``)."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from math import nan

import fsmkit.language as lang
from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.codegen.c.layout import reply_type
from fsmkit.codegen.c.names import Names
from fsmkit.diagnostics import fail
from fsmkit.plan.image import code, flat, scalars
from fsmkit.runtime.interpreter import snapshot as snap

CALLED, SENT = 1, 2
"""The first byte of an entry of a trace. Its machine follows, and whether the call names it."""


class Values:
    """Encodes the values of fields, one after the other."""

    def __init__(self, fields: Sequence[lang.Field], names: Names) -> None:
        """Take the fields, and the names of the machine that they belong to."""
        parts = [scalar for field in fields for scalar in scalars(field.type)]
        codes = ("H" if isinstance(part, lang.SymbolType) else code(part) for part in parts)
        self._pack = struct.Struct(f"<{''.join(codes)}").pack
        self._parts = [_encoder(part, names) for part in parts]
        self._is_flat = not any(
            isinstance(field.type, lang.ArrayType | lang.RecordType) for field in fields
        )

    def encode(self, values: Sequence[lang.Value]) -> bytes:
        """Return the bytes of the values."""
        if not self._is_flat:
            values = tuple(flat(tuple(values)))
        return self._pack(
            *(encode(value) for encode, value in zip(self._parts, values, strict=True))
        )


def _encoder(type_: lang.Type, names: Names) -> Callable[[lang.Value], float]:
    match type_:
        case lang.FloatType():
            return _float
        case lang.SymbolType():
            return lambda text: _symbol(str(text), names)
        case _:
            return int  # type: ignore[return-value]


def _float(value: lang.Value) -> float:
    assert isinstance(value, int | float)  # noqa: S101  (of such a type)
    return float(value) if value == value else nan


def _symbol(text: str, names: Names) -> int:
    if text not in names.numbers:
        raise fail(
            "not-certified",
            f'"{text}" reaches an operation, but `{names.chart.name}` mentions it nowhere',
            help="give the operation an enumeration instead of a string",
        )
    return names.numbers[text]


class Machine:
    """Encodes the events and calls of a machine, and of the machines in its slots."""

    def __init__(self, names: Names, numbers: Iterator[int]) -> None:
        """Take the names, and numbers for the machines; those in slots come first."""
        self.inner = tuple(Machine(each, numbers) for each in names.invoked)
        chart = names.chart
        self.number = next(numbers)
        self.names = names
        self._events = [Values(event.fields, names) for event in chart.events]
        self._sent = sent_events(chart)
        self._operations = {
            operation.name: (number, Values(operation.parameters, names))
            for number, operation in enumerate(chart.operations)
        }
        self._results = {
            o.name: Values((lang.Field("result", o.result),), names)
            for o in chart.operations
            if o.result is not None
        }
        reply = reply_type(chart)
        self._reply = None if reply is None else Values((lang.Field("reply", reply),), names)
        self._replies_float = isinstance(reply, lang.FloatType)

    def event(self, occurrence: snap.Occurrence) -> bytes:
        """Return an event of a request."""
        payload = self._events[occurrence.event].encode(occurrence.payload)
        return struct.pack("<H", occurrence.event + 1) + payload

    def trace(
        self, done: Sequence[snap.Macrostep], reports: Sequence[bytes] = ()
    ) -> tuple[bytes, bytes]:
        """Return the calls and outgoing events of macrosteps, and the results of the calls.

        ``reports``: what the host reported during each call, in their order.
        """
        trace, results, rest = bytearray(), bytearray(), iter(reports)
        for macrostep in done:
            for effect in macrostep.effects:
                self._add(effect, trace, results, rest)
        return bytes(trace), bytes(results)

    def _add(
        self, effect: snap.Effect, trace: bytearray, results: bytearray, reports: Iterator[bytes]
    ) -> None:
        match effect:
            case snap.Called(operation, arguments, result):
                number, values = self._operations[operation]
                trace += struct.pack("<BBBH", CALLED, self.number, 1, number)
                trace += values.encode(arguments)
                trace += next(reports, b"")
                if result is not None:
                    results += self._results[operation].encode((result,))
            case snap.Emitted(occurrence) if effect.is_leaving and occurrence.event in self._sent:
                trace += struct.pack("<BBBH", SENT, self.number, 1, occurrence.event)
                trace += self._events[occurrence.event].encode(occurrence.payload)
                trace += next(reports, b"")
            case snap.InvokedMacrostep(invocation, macrostep):
                inner = self.inner[invocation]
                for each in macrostep.effects:
                    inner._add(each, trace, results, reports)  # noqa: SLF001
            case _:
                pass

    def reply(self, value: lang.Value | None) -> bytes:
        """Return the reply to a dispatched event, 0 without one."""
        if self._reply is None:
            return b""
        found: lang.Value = 0 if value is None else value
        if isinstance(found, str):
            found = _symbol(found, self.names)
        elif self._replies_float:
            found = float(found)  # type: ignore[arg-type]
        return self._reply.encode((found,))
