"""The formats of file parts: order of keys, flow style, expressions.

A part is a name in a table. The tables follow the key tables of the readers, so a new key of a
usual form needs no row here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from fsmkit.codegen.existing_c.keys import BINDING
from fsmkit.document import keys
from fsmkit.document.keys import Form, Keys
from fsmkit.system.board import board_kinds
from fsmkit.system.deployment.keys import link_keys


class Scalar(Enum):
    """The texts of a part."""

    PLAIN = "as written"
    CODE = "an expression, statements or a declaration"
    SIGNATURE = "a name with fields, of which the name is left alone"
    PROSE = "a description"


@dataclass(frozen=True, slots=True)
class Shape:
    """A part: its keys, the parts below it, and the style of its scalars and lists.

    Attributes:
        order: The keys in their written order; others keep their position.
        ordered: Keys whose order matters; they keep their relative order.
        keys: The parts under keys.
        each: The part under any other key.
        items: The part of a list item; by default that of the list.
        text: The kind of its scalars.
        short_mapping: Whether short mappings get flow style.
        short_list: Whether short lists get flow style.

    """

    order: tuple[str, ...] = ()
    ordered: frozenset[str] = frozenset()
    keys: Mapping[str, str] = field(default_factory=dict)
    each: str = "plain"
    items: str = ""
    text: Scalar = Scalar.PLAIN
    short_mapping: bool = False
    short_list: bool = False


FORMS: Mapping[Form, str] = {
    Form.TEXT: "code",
    Form.PROSE: "prose",
    Form.MARKS: "names",
    Form.NAMES: "names",
    Form.TARGETS: "names",
    Form.IDS: "names",
    Form.STATEMENTS: "code",
    Form.HANDLERS: "code",
    Form.ARGUMENTS: "pairs",
    Form.DATA: "pairs",
}
CODECS: Mapping[str, str] = {
    "after": "triggers",
    "always": "transition",
    "bind": "plain",
    "capacity": "capacity",
    "choice": "transition",
    "constants": "pairs",
    "content": "chart",
    "default": "initial",
    "done": "done",
    "entries": "entries",
    "events": "events",
    "every": "triggers",
    "exits": "exits",
    "functions": "functions",
    "initial": "initial",
    "invoke": "invoke",
    "on": "triggers",
    "operations": "operations",
    "refine": "states",
    "regions": "states",
    "sometimes": "transition",
    "start": "pairs",
    "states": "states",
    "transitions": "labelled",
    "types": "types",
    "use": "use",
    "with": "pairs",
}
"""The parts under keys that have a codec."""
TRANSITIONS = frozenset(("on", "always", "after", "every", "sometimes", "choice", "transitions"))
"""Keys of a state whose order is the priority of its transitions."""


def _table(
    rows: Keys,
    *,
    ordered: frozenset[str] = frozenset(),
    short_mapping: bool = False,
    short_list: bool = False,
) -> Shape:
    parts = {
        row.name: CODECS.get(row.name, "plain") if row.form is Form.OWN else FORMS.get(row.form)
        for row in rows.values()
    }
    own = {name: part for name, part in parts.items() if part}
    return Shape(tuple(rows), ordered, own, short_mapping=short_mapping, short_list=short_list)


def _named(rows: Iterable[str], **parts: str) -> Shape:
    """Return the shape of keys without a form: those with a part are given."""
    return Shape(tuple(rows), keys={"doc": "prose", **{k.rstrip("_"): p for k, p in parts.items()}})


SHAPES: Mapping[str, Shape] = {
    "plain": Shape(),
    "prose": Shape(text=Scalar.PROSE),
    "code": Shape(text=Scalar.CODE),
    "names": Shape(short_list=True),
    "pairs": Shape(each="code"),
    "signatures": Shape(each="plain", text=Scalar.SIGNATURE),
    # charts
    "operations": Shape(each="operation", text=Scalar.SIGNATURE),
    "operation": _table(keys.OPERATION, short_mapping=True),
    "chart": _table(keys.CHART),
    "types": Shape(each="type"),
    "type": Shape(each="plain", short_mapping=True, short_list=True),
    "functions": Shape(each="code"),
    "events": Shape(keys=dict.fromkeys(keys.EVENTS, "signatures")),
    "capacity": Shape(tuple(keys.CAPACITY), short_mapping=True),
    "entries": Shape(each="names"),
    "states": Shape(each="state"),
    "state": _table(keys.STATE, ordered=TRANSITIONS),
    "triggers": Shape(each="transition"),
    "transition": _table(keys.TRANSITION, short_mapping=True),
    "labelled": _table(keys.LABELLED, short_mapping=True),
    "initial": _table(keys.INITIAL, short_mapping=True, short_list=True),
    "use": _table(keys.USE, short_mapping=True),
    "exits": Shape(each="exit"),
    "exit": _table(keys.EXIT, short_mapping=True),
    "done": _table(keys.DONE),
    "invoke": _table(keys.INVOKE),
    # systems
    "system": _named(
        keys.SYSTEM, parameters="pairs", machines="machines", environment="environment",
        schedule="schedule", properties="properties", req="names",
    ),
    "machines": Shape(each="machine"),
    "machine": _named(keys.MACHINE, with_="pairs"),
    "environment": _named(keys.ENVIRONMENT, freezes="freezes"),
    "freezes": Shape(each="freeze"),
    "freeze": _named(keys.FREEZE),
    "schedule": _named(keys.SCHEDULE),
    "properties": Shape(each="property"),
    "property": Shape(
        keys=dict.fromkeys(("never", "invariant", "reachable", "recoverable"), "code")
        | {"req": "names"},
    ),
    # other files
    "deployment": _named(keys.DEPLOYMENT, links="links"),
    "links": _named(link_keys()),
    **{key: _named(kind.board_keys) for key, kind in board_kinds().items()},
    "binding": _named(BINDING),
    "tests": _named(("tests", "doc", "req", "chart", "system", "results", "before", "cases")),
}  # fmt: skip
"""All parts by name."""
KINDS = {
    **{key: key for key in board_kinds()},
    "binding": "binding",
    "cases": "tests",
    "nodes": "deployment",
    "system": "system",
}
"""The part that a whole file is, by a key it has at the left margin; others are charts."""


def shape_of(names: Iterable[str]) -> str | None:
    """Return the part of a file by its keys, or None for another kind of file."""
    found = frozenset(names)
    for key, shape in KINDS.items():
        if key in found:
            return shape
    return "chart" if "chart" in found else None
