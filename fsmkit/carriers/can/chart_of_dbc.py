"""The chart of a node in a DBC file: a machine of the environment with its possible messages.

Signals of a message with a cycle are outputs, set in each cycle to a value that the explorer
chooses; a message without one is an event. With ``may_fall_silent`` the node may stop, as after
bus-off, and signal that by ``<message>_silent`` once 2.5 cycles have passed without the message.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import yaml

from fsmkit.carriers.can.dbc import RESERVED, Dbc, Message, Signal, word
from fsmkit.diagnostics import fail
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.emit import Namer, plain
from fsmkit.language import BoolType, EnumType, FloatType

SILENT_AFTER = 2.5
"""Cycles without a message until it counts as silent."""
LEAST_PAUSE = 10
"""Milliseconds between two messages that have no cycle, at least, unless ``GenMsgDelayTime``."""
MOST_PAUSE = 1000
LEAST_SILENCE = 100
"""Milliseconds until a node that fell silent may send again: never at once, queues would fill."""


def names_of_levels(dbc: Dbc, node: str) -> dict[tuple[str, str], str]:
    """Return the names of the levels that a node sends and receives, by message and signal.

    It is the signal's name if that is unique in its kind, else prefixed by the message's.
    """
    cyclic = [m for m in dbc.messages if m.is_levels and node in m.senders | m.receivers]
    names = [signal.name for message in cyclic for signal in message.signals]
    unique = Namer(name for name in names if names.count(name) == 1)
    return {
        (message.name, signal.name): signal.name
        if names.count(signal.name) == 1
        else unique.name(f"{message.name}_{signal.name}")
        for message in cyclic
        for signal in message.signals
    }


def names_of_silence(dbc: Dbc) -> dict[str, str]:
    """Return the names of the timeout events of messages with a cycle, by message."""
    names = Namer(message.name for message in dbc.messages)
    return {m.name: names.name(f"{m.name}_silent") for m in dbc.messages if m.is_levels}


def node_named(dbc: Dbc, name: str) -> str:
    """Return the node of a file with this name, ignoring case. Raises `FsmkitError` for none."""
    found = [node for node in dbc.nodes if word(node) == word(name)]
    if not found:
        raise fail(
            "unknown-name",
            f"`{dbc.source.name}` has no node `{name}`",
            help=suggest(name, dbc.nodes, f"name one of {', '.join(dbc.nodes) or 'its nodes'}"),
        )
    return found[0]


def chart_of(dbc: Dbc, node: str, *, may_fall_silent: bool = False, jitter: int = 10) -> str:
    """Return the chart, in YAML, of a node of a DBC file.

    Args:
        dbc: The file.
        node: One of its nodes.
        may_fall_silent: Whether the node may stop sending, as after bus-off.
        jitter: The maximum deviation of a cycle, in percent of it, 0 to 100.

    Raises:
        FsmkitError: ``unknown-name`` for an unknown node.

    """
    return _Chart(dbc, node_named(dbc, node), may_fall_silent, jitter).text()


class _Chart:
    def __init__(self, dbc: Dbc, node: str, may_fall_silent: bool, jitter: int) -> None:
        self.dbc = dbc
        self.node = node
        self.may_fall_silent = may_fall_silent
        self.jitter = jitter
        self.sent = [m for m in dbc.messages if node in m.senders]
        self.received = [m for m in dbc.messages if node in m.receivers - m.senders]
        self.levels = names_of_levels(dbc, node)
        self.silence = names_of_silence(dbc)
        self._states_taken = Namer({*RESERVED, "running"})
        self.types: dict[tuple[str, ...], str] = {}
        self._names = Namer(RESERVED)
        self.operations: list[str] = []

    def text(self) -> str:
        cyclic = [message for message in self.sent if message.is_levels]
        regions = {
            self._states_taken.name(m.name): self._cycle(m) if m.is_levels else self._event(m)
            for m in self.sent
        }
        state: dict[str, Any] = {}
        heard = [message for message in self.received if not message.is_levels]
        if heard:
            state["on"] = {message.name: {} for message in heard}
        if len(regions) == 1:
            (region,) = regions.values()
            state |= region
        elif regions:
            state["regions"] = regions
        ports = {
            "in": [self._ported(message) for message in heard],
            "out": [self._ported(message) for message in self.sent if not message.is_levels]
            + [self.silence[message.name] for message in cyclic if self.may_fall_silent],
        }
        chart: dict[str, Any] = {
            "chart": "".join(part.capitalize() for part in word(self.node).split("_")),
            "doc": f"The node {self.node} of a bus, as its DBC file has it.",
        }
        inputs = self._variables(m for m in self.received if m.is_levels)
        outputs = self._variables(cyclic)
        if self.types:
            chart["types"] = {name: list(members) for members, name in self.types.items()}
        if self.operations:
            chart["operations"] = self.operations
        if inputs:
            chart["inputs"] = {name: type_ for name, (type_, _) in inputs.items()}
        if outputs:
            chart["outputs"] = {name: f"{t} = {first}" for name, (t, first) in outputs.items()}
        if any(ports.values()):
            chart["events"] = {way: names for way, names in ports.items() if names}
        chart |= {"initial": "running", "states": {"running": state}}
        return yaml.safe_dump(chart, sort_keys=False, allow_unicode=True, width=100)

    def _variables(self, messages: Any) -> dict[str, tuple[str, str]]:
        return {
            self.levels[message.name, signal.name]: (self._type(signal), self._first(signal))
            for message in messages
            for signal in message.signals
        }

    def _ported(self, message: Message) -> str:
        fields = ", ".join(f"{signal.name} {self._type(signal)}" for signal in message.signals)
        return f"{message.name}({fields})" if fields else message.name

    def _type(self, signal: Signal) -> str:
        if not isinstance(signal.type, EnumType):
            return str(signal.type)
        members = tuple(map(plain, signal.type.members))
        if members not in self.types:
            name = "".join(part.capitalize() for part in signal.name.split("_"))
            self.types[members] = self._names.name(name)
        return self.types[members]

    def _first(self, signal: Signal) -> str:
        match signal.type:
            case BoolType():
                return "false"
            case EnumType(_, members):
                return f"{self._type(signal)}.{plain(members[0])}"
            case FloatType():
                return "0.0"
            case _:
                lo, hi = signal.bounds
                return str(min(max(0, lo), hi))

    def _any(self, name: str, signal: Signal) -> str:
        operation = f"any_{name}"
        self.operations.append(f"{operation}() -> {self._type(signal)}")
        return f"{operation}()"

    def _cycle(self, message: Message) -> dict[str, Any]:
        def set_of(signal: Signal) -> str:
            name = self.levels[message.name, signal.name]
            return f"{name} = {self._any(name, signal)}"

        talking, quiet, gone = self._states(message, "talking", "quiet", "gone")
        off = message.cycle * 1000 * self.jitter // 100
        least, most = message.cycle * 1000 - off, message.cycle * 1000 + off
        move: dict[str, Any] = {"target": talking}
        if message.signals:
            move["do"] = "; ".join(set_of(signal) for signal in message.signals)
        states: dict[str, Any] = {talking: {"after": {_interval(least, most): move}}}
        if self.may_fall_silent:
            limit = int(SILENT_AFTER * message.cycle * 1000)
            silent = {"target": gone, "do": f"send {self.silence[message.name]}"}
            states[talking]["sometimes"] = [quiet]
            states[quiet] = {"after": {_interval(limit - most, limit): silent}}
            again = max(LEAST_SILENCE * 1000, most)
            states[gone] = {"after": {_interval(again, 10 * again): talking}}
        return {"initial": talking, "states": states}

    def _event(self, message: Message) -> dict[str, Any]:
        (waiting,) = self._states(message, "waiting")
        names = Namer()
        own = [names.name(f"{message.name}_{signal.name}") for signal in message.signals]
        values = ", ".join(
            f"{signal.name} = {self._any(name, signal)}"
            for name, signal in zip(own, message.signals, strict=True)
        )
        sent = f"send {message.name}({values})" if values else f"send {message.name}"
        pause = _interval(LEAST_PAUSE * 1000, MOST_PAUSE * 1000)
        return {
            "initial": waiting,
            "states": {waiting: {"after": {pause: {"target": waiting, "do": sent}}}},
        }

    def _states(self, message: Message, *names: str) -> Iterator[str]:
        """Yield names of states: those of a single message are short."""
        is_alone = len(self.sent) == 1
        for name in names:
            yield self._states_taken.name(name if is_alone else f"{message.name}_{name}")


def _interval(least: int, most: int) -> str:
    """Return an interval of microseconds in the notation of charts."""
    return f"{_duration(least)}..{_duration(most)}" if least != most else _duration(least)


def _duration(microseconds: int) -> str:
    for unit, size in (("s", 1_000_000), ("ms", 1000)):
        if microseconds and microseconds % size == 0:
            return f"{microseconds // size}{unit}"
    return f"{microseconds}us"
