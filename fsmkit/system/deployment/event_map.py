"""The event map of a deployment: its nodes, and every message and level that crosses them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import fsmkit.language as lang
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.emit import guard, telling
from fsmkit.language.values import from_python, to_python

LEVELS = 0
"""The number of the message with all levels of its sender; events are numbered from 1."""


@dataclass(frozen=True, slots=True)
class End:
    """One end of a connection: a machine and its port."""

    machine: str
    name: str

    def __post_init__(self) -> None:
        guard(self, "machine", "name")

    @telling
    def __str__(self) -> str:
        return f"{self.machine}.{self.name}"


@dataclass(frozen=True, slots=True)
class MessageType:
    """A connection of events between nodes.

    ``fields`` have the names of the receiver and the types of the sender; ``sender`` and
    ``receiver`` are indices of nodes.
    """

    number: int
    sender: int
    receiver: int
    source: End
    target: End
    fields: tuple[lang.Field, ...]

    @property
    @telling
    def name(self) -> str:
        """The connection in the notation of the system file."""
        return f"{self.source} -> {self.target}"


@dataclass(frozen=True, slots=True)
class LevelType:
    """An output that is connected to an input on another node."""

    sender: int
    receiver: int
    source: End
    target: End
    type: lang.Type

    @property
    @telling
    def name(self) -> str:
        """The connection in the notation of the system file."""
        return f"{self.source} -> {self.target}"


@dataclass(frozen=True)
class EventMap:
    """The messages and levels between nodes. Programs are compatible if the hashes are equal."""

    system: str
    nodes: tuple[str, ...]
    messages: tuple[MessageType, ...]
    levels: tuple[LevelType, ...]
    endpoints: tuple[str, ...] = field(default=(), compare=False)
    """Where each node publishes, if the deployment says so; no part of the hash."""
    is_insecure: bool = field(default=False, compare=False)
    """Whether endpoints beyond this computer may go without keys; no part of the hash."""
    foreign: tuple[str, ...] = field(default=(), compare=False)
    """By node: the kind of a foreign one, "" for one of fsmkit; no part of the hash."""

    def __post_init__(self) -> None:
        guard(self, "system", "nodes", "endpoints")

    @property
    def own_nodes(self) -> tuple[int, ...]:
        """The nodes that run machines of fsmkit, and exchange frames."""
        return tuple(n for n in range(len(self.nodes)) if not (self.foreign and self.foreign[n]))

    @cached_property
    def hash(self) -> int:
        """Return the first four bytes of the SHA-256 of the map, little-endian."""
        text = json.dumps(self._shape(), sort_keys=True, separators=(",", ":"))
        return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "little")

    @cached_property
    def by_name(self) -> Mapping[str, MessageType]:
        """The messages by their names."""
        return {message.name: message for message in self.messages}

    def levels_of(self, node: int) -> tuple[LevelType, ...]:
        """Return the levels that a node publishes, in the order of its payload."""
        return tuple(level for level in self.levels if level.sender == node)

    def node(self, name: str) -> int:
        """Return the index of the node of that name. Raises `ValueError` for an unknown name."""
        if name not in self.nodes:
            raise ValueError(f"there is no node `{name}`, only {', '.join(self.nodes)}")
        return self.nodes.index(name)

    def message(self, name: str, /, **payload: object) -> Message:
        """Return a message with these Python values. Raises `ValueError` if they do not fit."""
        if name not in self.by_name:
            raise ValueError(f"no message `{name}` crosses nodes")
        type_ = self.by_name[name]
        names = [part.name for part in type_.fields]
        if set(names) != set(payload):
            raise ValueError(f"`{name}` carries ({', '.join(names)}), not ({', '.join(payload)})")
        values = []
        for part in type_.fields:
            try:
                values.append(from_python(payload[part.name], part.type))
            except ValueError as error:
                raise ValueError(f"`{part.name}` of `{name}` {error}") from error
        return Message(type_, tuple(values))

    def _ends(self, wire: MessageType | LevelType) -> dict[str, Any]:
        return {
            "from": self.nodes[wire.sender],
            "to": self.nodes[wire.receiver],
            "source": [wire.source.machine, wire.source.name],
            "target": [wire.target.machine, wire.target.name],
        }

    def _shape(self) -> dict[str, Any]:
        return {
            "system": self.system,
            "nodes": list(self.nodes),
            "messages": [
                {
                    "number": message.number,
                    **self._ends(message),
                    "fields": _fields_as_json(message.fields),
                }
                for message in self.messages
            ],
            "levels": [
                {**self._ends(level), "type": type_as_json(level.type)} for level in self.levels
            ],
        }

    def as_json(self) -> str:
        """Return the map as JSON, which `from_json` reads back."""
        shape = {
            **self._shape(),
            "endpoints": list(self.endpoints),
            "insecure": self.is_insecure,
            **({"foreign": list(self.foreign)} if any(self.foreign) else {}),
            "hash": f"{self.hash:08x}",
        }
        return json.dumps(shape, indent=2) + "\n"

    @staticmethod
    def from_json(text: str) -> EventMap:
        """Parse a map. Raises `ValueError` if it is not a map, or if its hash does not match."""
        try:
            found = parse_json(text)
            nodes = tuple(str(name) for name in found["nodes"])

            def ends(part: Mapping[str, Any]) -> tuple[int, int, End, End]:
                sender, receiver = nodes.index(part["from"]), nodes.index(part["to"])
                return sender, receiver, End(*part["source"]), End(*part["target"])

            made = EventMap(
                str(found["system"]),
                nodes,
                tuple(
                    MessageType(
                        int(part["number"]),
                        *ends(part),
                        tuple(
                            lang.Field(f["name"], type_from_json(f["type"])) for f in part["fields"]
                        ),
                    )
                    for part in found["messages"]
                ),
                tuple(
                    LevelType(*ends(part), type_from_json(part["type"])) for part in found["levels"]
                ),
                tuple(str(endpoint) for endpoint in found.get("endpoints", ())),
                found.get("insecure", False) is True,
                tuple(str(kind) for kind in found.get("foreign", ())),
            )
            is_whole = f"{made.hash:08x}" == found["hash"]
        except (KeyError, TypeError, AttributeError, OverflowError) as error:
            raise ValueError(f"this is not an event map: {error!r}") from error
        if not is_whole:
            raise ValueError("this event map was changed: its hash does not match")
        return made


@dataclass(frozen=True, slots=True)
class Message:
    """A message with its values, as the machines hold them."""

    type: MessageType
    values: tuple[lang.Value, ...] = ()

    @property
    @telling
    def name(self) -> str:
        """The connection in the notation of the system file."""
        return self.type.name

    @property
    def machine(self) -> str:
        """The machine that receives the event."""
        return self.type.target.machine

    @property
    def event(self) -> str:
        """The received event."""
        return self.type.target.name

    @property
    def payload(self) -> dict[str, object]:
        """The values by the receiver's names, as Python values."""
        return {
            part.name: to_python(value, part.type)
            for part, value in zip(self.type.fields, self.values, strict=True)
        }


def _fields_as_json(fields: tuple[lang.Field, ...]) -> list[dict[str, Any]]:
    return [{"name": part.name, "type": type_as_json(part.type)} for part in fields]


def type_as_json(type_: lang.Type) -> dict[str, Any]:
    """Return the JSON of a scalar type. Raises `ValueError` for other types."""
    match type_:
        case lang.BoolType():
            return {"kind": "bool"}
        case lang.IntType(lo, hi):
            return {"kind": "int", "lo": lo, "hi": hi}
        case lang.FloatType(bits):
            return {"kind": "float", "bits": bits}
        case lang.EnumType(name, members):
            numbers = {} if type_.is_counted else {"numbers": list(type_.numbers)}
            return {"kind": "enum", "name": name, "members": list(members), **numbers}
        case lang.DurationType():
            return {"kind": "duration"}
        case _:
            raise ValueError(f"`{type_}` does not cross nodes")


def type_from_json(found: Mapping[str, Any]) -> lang.Type:
    """Return the type that `type_as_json` wrote."""
    match found["kind"]:
        case "bool":
            return lang.BOOL
        case "int":
            return lang.IntType(int(found["lo"]), int(found["hi"]))
        case "float":
            return lang.FloatType(int(found["bits"]))
        case "enum":
            numbers = tuple(map(int, found.get("numbers", ())))
            return lang.EnumType(str(found["name"]), tuple(map(str, found["members"])), numbers)
        case "duration":
            return lang.DURATION
        case _:
            raise ValueError(f"there is no kind of type `{found['kind']}`")
