"""The vocabulary: namespaces, and the attributes and children of each element.

SCXML 1.0 has the elements and attributes of its recommendation. The others are in one extension
namespace, by convention with the prefix ``fk``, so that other SCXML tools can ignore them.
"""

from __future__ import annotations

from fsmkit.document import keys
from fsmkit.document.keys import Keys
from fsmkit.language.statements.tree import HANDLER_KEYWORDS

SCXML = "http://www.w3.org/2005/07/scxml"
EXTENSION = "urn:fsmkit:scxml"
PREFIX = "fk"
XINCLUDE = "http://www.w3.org/2001/XInclude"
XML = "http://www.w3.org/XML/1998/namespace"

STATES = ("state", "parallel", "final", "history")


def _plain(rows: Keys) -> str:
    """Return the attributes of SCXML that keys have."""
    return " ".join(r.scxml for r in rows.values() if r.scxml is not None and r.scxml.isalpha())


def _extended(rows: Keys) -> str:
    """Return the attributes of the extension that keys have."""
    words = (row.scxml or "" for row in rows.values())
    return " ".join(word[3:] for word in words if word.startswith(f"{PREFIX}:"))


_STATE = "id"
ATTRIBUTES = {
    name: frozenset(attributes.split())
    for name, attributes in {
        "scxml": f"name initial datamodel version {_plain(keys.CHART)}",
        "state": f"{_STATE} initial",
        "parallel": _STATE,
        "final": _STATE,
        "history": f"{_STATE} type",
        "initial": "",
        "transition": f"event {_plain(keys.TRANSITION)}",
        "onentry": "",
        "onexit": "",
        "datamodel": "",
        "data": "id expr src type",
        "donedata": "",
        "assign": "location expr",
        "raise": "event",
        "if": "cond",
        "elseif": "cond",
        "else": "",
        "foreach": "array item index",
        "log": "label expr",
        "script": "src",
        "send": "event eventexpr target targetexpr delay delayexpr id idlocation type typeexpr "
        "namelist",
        "cancel": "sendid sendidexpr",
        "invoke": _plain(keys.INVOKE),
        "finalize": "",
        "param": "name expr location",
        "content": "expr",
    }.items()
}
"""The attributes of each element of SCXML, and ``data@type``, which real files have."""

_OF_STATE = f"doc kind for {_extended(keys.STATE)}"
EXTENSION_ATTRIBUTES = {
    name: frozenset(attributes.split())
    for name, attributes in {
        "scxml": f"doc {_extended(keys.CHART)}",
        "state": _OF_STATE,
        "parallel": _OF_STATE,
        "final": _OF_STATE,
        "history": _OF_STATE,
        "transition": f"after every sometimes {_extended(keys.TRANSITION)}",
        "data": "type",
    }.items()
}
"""The attributes of the extension namespace on elements of SCXML."""

EXTENSION_ELEMENTS = {
    name: frozenset(attributes.split())
    for name, attributes in {
        "doc": "",
        "type": "name members is",
        "field": "name type",
        "constant": "name expr",
        "input": "id type expr",
        "output": "id type expr",
        "operation": f"signature {_extended(keys.OPERATION)}",
        "function": "signature",
        "event": "direction signature",
        "capacity": " ".join(keys.CAPACITY),
        "refine": f"state initial {_OF_STATE}",
        "use": f"initial {_extended(keys.USE)}",
        "with": "name expr",
        "start": "name expr",
        "bind": "name to",
        "exit": f"name {_extended(keys.EXIT)}",
        "entry": "name target",
        "property": f"name time then {' '.join((*keys.PROPERTY, *keys.WATCH, *keys.REQUIRED))}",
        "environment": " ".join(keys.OWN_ENVIRONMENT),
        "param": "name expr",
        "super": "",
        **dict.fromkeys(HANDLER_KEYWORDS, "expr"),
        "call": "expr",
        "unreadable": "reason",
    }.items()
}
"""The elements of the extension namespace, with their attributes, which have no prefix."""

CONTENT = ("assign", "raise", "if", "foreach", "log", "script", "send", "cancel")
"""Executable content (SCXML 4)."""
EXTENSION_CONTENT = ("super", *HANDLER_KEYWORDS, "call", "unreadable")

_PARTS = {"transition", "onentry", "onexit", "datamodel", "invoke", "initial", *STATES}
CHILDREN = {
    "scxml": {"datamodel", "script", "initial", *STATES},
    "state": _PARTS,
    "parallel": _PARTS - {"initial"},
    "final": {"onentry", "onexit", "donedata"},
    "history": {"transition"},
    "refine": {*_PARTS, "donedata"},
    "datamodel": {"data"},
}
EXTENSION_CHILDREN = {
    "scxml": {"doc", "type", "constant", "input", "output", "operation", "event", "capacity"}
    | {"refine", "entry", "function", "property", "environment"},
    "datamodel": {"type", "constant", "input", "output"},
    "use": {"with", "start", "bind", "exit"},
    **{name: {"doc", "use"} for name in (*STATES, "refine")},
}


def known_children(name: str) -> tuple[str, ...]:
    """Return the children an element takes, by their words."""
    ours = (f"{PREFIX}:{child}" for child in EXTENSION_CHILDREN.get(name, ()))
    return (*CHILDREN.get(name, ()), *ours)


PLAIN_TYPES = {
    "int": "int32",
    "integer": "int32",
    "uint": "uint32",
    "long": "int64",
    "short": "int16",
    "byte": "uint8",
    "char": "int8",
    "boolean": "bool",
    "float": "float64",
    "double": "float64",
    "number": "float64",
    "real": "float64",
    "string": "symbol",
    "str": "symbol",
    **{name: name for name in ("bool", "float32", "float64")},
    **{f"{sign}int{bits}": f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)},
}
"""The types in ``data@type`` of real files, and their equivalents."""
