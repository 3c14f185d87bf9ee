"""Export messages of the protocol `fsmkit.live` to files of other viewers.

An exporter is a plug-in in a folder. It receives `Hello` first, then the charts and the steps.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import BinaryIO, Protocol, runtime_checkable

from msgspec import UnsetType

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.runtime.live.messages import AnyMessage, ChartOf, Hello, State, Step


@runtime_checkable
class MessageExporter(Protocol):
    """Writes one format."""

    name: str
    suffix: str

    def export_messages(self, messages: Iterable[AnyMessage], out: BinaryIO) -> None:
        """Write messages; raises `FsmkitError` (``missing-package``) without the library."""
        ...


@dataclass(frozen=True, slots=True)
class Format:
    """An exporter implemented by the module ``writing`` of its folder, imported when used."""

    name: str
    suffix: str
    package: str

    def export_messages(self, messages: Iterable[AnyMessage], out: BinaryIO) -> None:
        """Write messages; raises `FsmkitError` (``missing-package``) without the library."""
        import_module(f"{self.package}.writing").write(messages, out)


def missing(package: str, format_: str, error: ImportError) -> FsmkitError:
    """Return the error for a library that is not installed."""
    del error
    return fail(
        "missing-package", f"{format_} needs the package {package}, which is not installed",
        help="pip install 'fsmkit[trace]'",
    )  # fmt: skip


@dataclass(slots=True)
class Scene:
    """Lookup tables of exporters: machines, their charts, the length of a tick, the time."""

    tick_us: int = 1
    name: str = ""
    hashes: dict[str, str] = field(default_factory=dict)
    """By machine: the hash of its chart."""
    charts: dict[str, ChartOf] = field(default_factory=dict)
    """By hash."""
    latest: int = 0
    first: int | None = None

    def take(self, message: AnyMessage) -> None:
        """Learn from a message."""
        if isinstance(message, Hello):
            self.tick_us, self.name = message.tick_us, message.name
            self.hashes.update({each.m: each.chart for each in message.machines})
        elif isinstance(message, ChartOf):
            self.charts[message.chart] = message

    def chart(self, machine: str) -> ChartOf | None:
        """Return the chart of a machine, or None before its message."""
        return self.charts.get(self.hashes.get(machine, ""))

    def microseconds(self, at: int) -> int:
        """Return a time in microseconds since the first; never less than one before."""
        self.first = at if self.first is None else self.first
        self.latest = max(self.latest, (at - self.first) * self.tick_us)
        return self.latest

    def leaves(self, machine: str, on: Iterable[str]) -> list[str]:
        """Return the active states without an active child."""
        active, chart = list(on), self.chart(machine)
        if chart is None:
            return active
        parents = {state["id"]: state["parent"] for state in chart.states}
        above = {parents.get(state) for state in active}
        return [state for state in active if state not in above]


def active_of(message: AnyMessage) -> Iterable[str] | None:
    """Return the active states in a message, or None if it contains none."""
    if isinstance(message, State | Step) and not isinstance(message.on, UnsetType):
        return message.on
    return None


def values_of(message: AnyMessage) -> Iterator[tuple[str, object]]:
    """Yield the data, inputs and outputs in a message."""
    parts: list[Mapping[str, object]] = []
    if isinstance(message, State):
        parts = [message.data, message.inputs, message.outputs] if message.known else []
    elif isinstance(message, Step) and not isinstance(message.set, UnsetType):
        parts = [message.set]
    for part in parts:
        yield from part.items()


def event_of(message: AnyMessage) -> str:
    """Return the event that caused a step; empty for another cause."""
    if isinstance(message, Step) and message.cause[0] in ("event", "delayed"):
        return str(message.cause[1])
    return ""
