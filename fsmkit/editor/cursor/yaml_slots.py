"""Map enclosing keys in YAML to the slot."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fsmkit.codegen.existing_c.keys import BINDING, CONTEXT
from fsmkit.document import keys
from fsmkit.document.keys import Form, Key, Keys
from fsmkit.editor.cursor.slots import Slot, What
from fsmkit.editor.cursor.yaml_frames import ITEM, Frame, Frames
from fsmkit.editor.index.files import Kind
from fsmkit.system.board import board_kinds
from fsmkit.system.deployment.carrier import foreign_carriers, link_carriers
from fsmkit.system.deployment.keys import foreign_keys, link_keys, node_keys

MAPS = {
    ("chart", "states"): "states",
    ("chart", "refine"): "refined",
    ("state", "states"): "states",
    ("state", "regions"): "states",
    ("chart", "initial"): "initial",
    ("state", "initial"): "initial",
    ("state", "default"): "initial",
    ("chart", "events"): "events",
    ("chart", "capacity"): "capacity",
    ("chart", "types"): "names",
    ("chart", "constants"): "values",
    ("chart", "operations"): "signatures",
    ("state", "on"): "on",
    ("state", "after"): "delays",
    ("state", "every"): "delays",
    ("state", "always"): "transition",
    ("state", "choice"): "transition",
    ("state", "sometimes"): "transition",
    ("state", "transitions"): "labelled",
    ("state", "invoke"): "invoke",
    ("state", "done"): "done",
    ("invoke", "content"): "chart",
    ("chart", "properties"): "properties",
    ("chart", "environment"): "own_environment",
    ("system", "machines"): "machines",
    ("system", "connect"): "wires",
    ("system", "environment"): "environment",
    ("environment", "freezes"): "freezes",
    ("system", "schedule"): "schedule",
    ("system", "properties"): "properties",
    ("system", "shared"): "variables",
    ("deployment", "nodes"): "nodes",
    ("deployment", "links"): "links",
    ("links", "foreign"): "foreign_nodes",
    ("board", "bind"): "bind",
    ("board", "use"): "devices",
    ("board", "off"): "off",
    ("suite", "cases"): "cases",
    ("suite", "before"): "steps",
    ("steps", "steps"): "steps",
    ("step", "expect"): "expect",
    ("binding", "context"): "context",
}
"""The node under each key, by its parent node."""
NAMED = {
    "states": "state",
    "refined": "state",
    "on": "transition",
    "delays": "transition",
    "machines": "machine",
    "properties": "property",
    "nodes": "node",
    "freezes": "freeze",
    "foreign_nodes": "foreign_node",
    "devices": "device",
    "bind": "bound",
    "bound": "formula",
    "wires": "connection",
    "cases": "steps",
}
"""The node under the names of a map."""
SUITE = {
    name: Key(name, doc)
    for name, doc in {
        "tests": "the name of the tests",
        "req": "ids of the requirements that the cases test",
        "chart": "the file of the chart under test",
        "system": "the file of the system under test",
        "before": "steps at the start of each case",
        "cases": "the cases: a name, and steps, or `req` and `steps`",
    }.items()
}
EXPECTED = {
    name: Key(name, doc)
    for name, doc in {
        "in": "states that are active",
        "not in": "states that are not active",
        "called": "operations that were called, in this order",
        "not called": "operations that were not called",
        "sent": "events that were sent, in this order",
        "not sent": "events that were not sent",
        "fault": "the fault that occurred, or none",
        "that": "conditions that hold",
        "only": "true: nothing else was called or sent",
    }.items()
}


def _board_tables() -> dict[str, Keys]:
    """Return the keys of files of boards, and of the parts of these that have keys."""
    rows = {key: row for kind in board_kinds().values() for key, row in kind.board_keys.items()}
    return {"board": rows, "device": rows["use"].rows, "off": rows["off"].rows}


TABLES: dict[str, Keys] = {
    "chart": keys.CHART,
    "state": keys.STATE,
    "transition": keys.TRANSITION,
    "labelled": keys.LABELLED,
    "initial": keys.INITIAL,
    "events": keys.EVENTS,
    "capacity": keys.CAPACITY,
    "invoke": keys.INVOKE,
    "done": keys.DONE,
    "system": keys.SYSTEM,
    "machine": keys.MACHINE,
    "connection": keys.CONNECTION,
    "environment": keys.ENVIRONMENT,
    "own_environment": keys.OWN_ENVIRONMENT,
    "freeze": keys.FREEZE,
    "schedule": keys.SCHEDULE,
    "deployment": keys.DEPLOYMENT,
    "links": link_keys(),
    "node": node_keys(),
    "foreign_node": {key: row for rows in foreign_keys().values() for key, row in rows.items()},
    **_board_tables(),
    "suite": SUITE,
    "step": {"expect": Key("expect", "expected effects since the last check")},
    "expect": EXPECTED,
    "binding": BINDING,
    "context": CONTEXT,
}
ROOTS = {
    Kind.CHART: "chart",
    Kind.SYSTEM: "system",
    Kind.DEPLOYMENT: "deployment",
    Kind.BOARD: "board",
    Kind.SUITE: "suite",
    Kind.BINDING: "binding",
}
FILES = {
    ("chart", "extends"): (".yaml", ".yml", ".scxml"),
    ("invoke", "src"): (".yaml", ".yml", ".scxml"),
    ("state", "use"): (".yaml", ".yml", ".scxml"),
    ("machine", "chart"): (".yaml", ".yml", ".scxml"),
    ("deployment", "system"): (".yaml", ".yml"),
    ("board", "deployment"): (".yaml", ".yml"),
    ("suite", "chart"): (".yaml", ".yml", ".scxml"),
    ("suite", "system"): (".yaml", ".yml"),
    ("binding", "chart"): (".yaml", ".yml", ".scxml"),
    ("binding", "extends"): (".yaml", ".yml"),
}
TESTED = {
    "in": What.TESTED_STATE,
    "not in": What.TESTED_STATE,
    "called": What.TESTED_CALL,
    "not called": What.TESTED_CALL,
    "sent": What.TESTED_EVENT,
    "not sent": What.TESTED_EVENT,
    "that": What.TESTED_CONDITION,
}


@dataclass(frozen=True, slots=True)
class _Place:
    """A node of the tree, with the information collected on its path."""

    name: str
    key: str = ""
    state: str = ""
    events: tuple[str, ...] | None = None
    machine: str = ""


def yaml_slot(frames: Frames, kind: Kind) -> Slot:
    """Return the slot at a position."""
    place = _Place(ROOTS.get(kind, ""))
    if not place.name:
        return Slot(What.NOTHING, frames.text)
    for frame in frames.path:
        place = _child_place(place, frame)
    if frames.is_key and _takes_keys(place, frames):
        return _key(place, frames)
    return _value(place, frames.text)


def _takes_keys(place: _Place, frames: Frames) -> bool:
    """Return whether keys are permitted here, or the continuation of a value."""
    if frames.path and frames.path[-1].name == ITEM:
        return place.name in TABLES
    return place.name in TABLES or place.name in (*NAMED, "values", "variables", "names", "with")


def _child_place(place: _Place, frame: Frame) -> _Place:
    """Return the node under a key of `place`."""
    name = frame.name
    if name == ITEM:
        return replace(place, name="step") if place.name == "steps" else place
    if place.name in ("variables", "values", "names", "with"):
        return replace(place, name=f"{place.name}:value", key=name)
    if place.name in NAMED and (place.name, name) not in MAPS:
        inner = NAMED[place.name]
        if inner == "state":
            return _Place("state", state=name)
        if place.name == "on":
            return replace(place, name=inner, key="", events=tuple(name.replace(",", " ").split()))
        if inner in ("machine", "bound", "node"):
            return _Place(inner, key=name, machine=name)
        return replace(place, name=inner, key=name)
    if place.name == "labelled" and name in keys.LABEL:
        return replace(place, name=f"labelled:{name}", key=name)
    found = MAPS.get((place.name, name))
    if found is not None:
        return replace(place, name=found, key=name)
    row = TABLES.get(place.name, {}).get(name)
    if row is not None and row.form is Form.DATA:
        return replace(place, name="variables", key=name)
    if name == "with":
        return replace(place, name="with", key=name)
    if (place.name, name) == ("machine", "start"):
        return replace(place, name="values", key=name)
    if place.name == "labelled" and "on" in frame.values:
        events = tuple(frame.values["on"].strip("[]").replace(",", " ").split())
        place = replace(place, events=events)
    return replace(place, name=f"{place.name}:{name}", key=name)


def _key(place: _Place, frames: Frames) -> Slot:
    """Return the slot of a key in a mapping."""
    given = frames.siblings
    match place.name:
        case "refined":
            return Slot(What.INHERITED_STATE, frames.text, given=given)
        case "on":
            return Slot(What.EVENT, frames.text, state=place.state)
        case "delays":
            return Slot(What.DELAY, frames.text)
        case "with":
            return Slot(What.CONSTANT, frames.text, given=given, machine=place.machine)
        case "bind":
            return Slot(What.MACHINE, frames.text, given=given)
        case "bound":
            return Slot(What.PORT, frames.text, machine=place.machine)
        case "property":
            return Slot(What.WORD, frames.text, words=(*_properties(), *keys.REQUIRED))
        case "states" | "machines" | "properties" | "devices" | "values" | "variables":
            return Slot(What.NOTHING, frames.text)
        case "names" | "cases" | "nodes" | "foreign_nodes" | "freezes":
            return Slot(What.NOTHING, frames.text)
        case "wires":
            return Slot(What.WIRE, frames.text)
        case name:
            is_target = name == "transition" and not given and not frames.values
            table = TABLES[name]
            slot = Slot(What.KEY, frames.text, table=table, given=given, state=place.state)
            return replace(slot, words=("target",) if is_target else ())


def _properties() -> tuple[str, ...]:
    from fsmkit.system.properties.kinds import kinds

    return tuple(kinds())


def _value(place: _Place, text: str) -> Slot:
    """Return the slot of a value."""
    outer, _, key = place.name.partition(":")
    row = TABLES.get(outer, {}).get(key)
    base = Slot(
        What.NOTHING,
        text,
        state=place.state,
        events=place.events,
        machine=place.machine,
        row=row,
    )
    suffixes = FILES.get((outer, key))
    if suffixes is not None:
        return replace(base, what=What.FILE, suffixes=suffixes)
    match outer, key:
        case ("links", "kind"):
            return replace(base, what=What.WORD, words=tuple(link_carriers()))
        case ("node", "foreign"):
            return replace(base, what=What.WORD, words=tuple(foreign_carriers()))
        case ("machine", ""):
            return replace(base, what=What.FILE, suffixes=FILES["machine", "chart"])
        case ("transition", "") | (_, "target"):
            return replace(base, what=What.STATE)
        case ("initial", ""):
            return replace(base, what=What.INITIAL)
        case ("variables", "value"):
            return replace(base, what=What.TYPE)
        case ("signatures", _) | ("events", _):
            return replace(base, what=What.SIGNATURE)
        case ("values", "value") | ("with", "value") | ("names", "value"):
            return replace(base, what=What.EXPRESSION)
        case ("labelled", "on"):
            return replace(base, what=What.EVENT)
        case ("labelled", "after" | "every") | ("capacity", "tick"):
            return replace(base, what=What.DELAY)
        case (_, "override") if outer in ("transition", "labelled"):
            return replace(base, what=What.OVERRIDE)
        case ("wires", ""):
            return replace(base, what=What.WIRE)
        case ("environment", _) | ("freeze", "silent"):
            return replace(base, what=What.POSSIBLE)
        case ("property", key) if key != "req":
            return replace(base, what=What.CONDITION)
        case ("freeze", "within" | "continues"):
            return replace(base, what=What.DELAY)
        case ("schedule", "cyclic") | ("nodes", _) | ("node" | "freeze", "" | "machines"):
            return replace(base, what=What.MACHINE)
        case ("formula", _):
            return replace(base, what=What.CONDITION)
        case ("step" | "steps", ""):
            return replace(base, what=What.STEP)
        case ("expect", _):
            return replace(base, what=TESTED.get(key, What.NOTHING))
        case ("board", "board"):
            return base
        case _:
            what, words = _of_form(row)
            return replace(base, what=what, words=words)


def _of_form(row: Key | None) -> tuple[What, tuple[str, ...]]:
    """Return the kind of value of a key with a usual form, and the words of a choice."""
    if row is None:
        return What.NOTHING, ()
    match row.form:
        case Form.FLAG:
            return What.WORD, ("true", "false")
        case Form.CHOICE | Form.MARKS:
            return What.WORD, tuple(row.choices)
        case Form.STATEMENTS | Form.HANDLERS:
            return What.STATEMENTS, ()
        case Form.TARGETS:
            return What.STATE, ()
        case Form.NAMES if row.name == "defer":
            return What.EVENT, ()
        case Form.TEXT:
            return What.EXPRESSION, ()
        case Form.OWN if row.name == "history":
            return What.WORD, ("shallow", "deep")
        case Form.OWN if row.name == "final":
            return What.WORD, ("true", "false")
        case _:
            return What.NOTHING, ()
