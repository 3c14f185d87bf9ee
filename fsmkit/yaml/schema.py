"""The JSON Schema of charts for editors, generated from the table of keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fsmkit.document import keys
from fsmkit.document.keys import Form

Schema = dict[str, Any]

TEXT: Schema = {"type": ["string", "number", "boolean", "null"]}
"""Nothing is resolved, so a YAML number or `null` is also a text."""
FLAG: Schema = {"type": "boolean"}
NAMES: Schema = {"anyOf": [TEXT, {"type": "array", "items": TEXT}]}
TEXTS: Schema = {"type": "array", "items": TEXT}
TABLE: Schema = {"type": ["object", "null"], "additionalProperties": TEXT}
NOTHING: Mapping[str, Schema] = {}


def _ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _one_of(*words: str) -> Schema:
    return {"enum": list(words)}


def _some(item: Schema) -> Schema:
    return {"anyOf": [item, {"type": "array", "items": item}]}


def _table(item: Schema) -> Schema:
    return {"type": ["object", "null"], "additionalProperties": item}


TYPES = _table(
    {
        "anyOf": [
            TEXT,
            {"type": "array", "items": TEXT},
            {"type": "object", "additionalProperties": TEXT},
        ]
    }
)
FORMS: Mapping[Form, Schema] = {
    Form.FLAG: FLAG,
    Form.NAMES: NAMES,
    Form.TARGETS: NAMES,
    Form.IDS: NAMES,
    Form.STATEMENTS: NAMES,
    Form.HANDLERS: NAMES,
    Form.ARGUMENTS: TABLE,
    Form.DATA: TABLE,
}
"""The schema of the value of a form, unless it is a text."""
CODECS: dict[str, Schema] = {
    "after": _table(_ref("transitions")),
    "always": _ref("transitions"),
    "capacity": _ref("capacity"),
    "choice": _ref("transitions"),
    "constants": TABLE,
    "bind": TABLE,
    "default": _ref("initial"),
    "done": _ref("done"),
    "functions": TABLE,
    "events": _some(_ref("events")),
    "every": _table(_ref("transitions")),
    "exits": _table(_some({"anyOf": [TEXT, _ref("exit")]})),
    "entries": _table(NAMES),
    "environment": _ref("environment"),
    "properties": _table({"anyOf": [_one_of(*keys.PROPERTY), _ref("property")]}),
    "final": FLAG,
    "history": _one_of("shallow", "deep"),
    "initial": _ref("initial"),
    "invoke": _some(_ref("invoke")),
    "on": _table(_ref("transitions")),
    "operations": {"type": "array", "items": {"anyOf": [TEXT, _table(_ref("operation"))]}},
    "refine": _ref("states"),
    "regions": _ref("states"),
    "sometimes": _ref("transitions"),
    "start": TABLE,
    "states": _ref("states"),
    "transitions": {"type": "array", "items": _ref("labelled")},
    "types": TYPES,
    "use": {"anyOf": [TEXT, _ref("use")]},
    "with": TABLE,
}
"""The schema of the value of a key with a codec, unless it is a text."""


def _shape(row: keys.Key) -> Schema:
    match row.form:
        case Form.OWN:
            return CODECS.get(row.name, TEXT)
        case Form.CHOICE:
            return _one_of(*row.choices)
        case Form.MARKS:
            return {"anyOf": [_one_of(*row.choices), TEXTS]}
        case form:
            return FORMS.get(form, TEXT)


def _object(rows: keys.Keys, special: Mapping[str, Schema] = NOTHING, **more: Any) -> Schema:
    properties = {
        row.name: {"description": row.doc, **special.get(row.name, _shape(row))}
        for row in rows.values()
    }
    return {"type": "object", "properties": properties, "additionalProperties": False, **more}


def schema() -> Schema:
    """Return the schema of a chart."""
    labels = {"on": NAMES, "after": TEXT, "every": TEXT, "always": FLAG, "sometimes": FLAG}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A statechart of fsmkit",
        "$ref": "#/$defs/chart",
        "$defs": {
            "chart": _object(keys.CHART, required=["chart"]),
            "states": _table({"anyOf": [_ref("state"), {"type": "null"}]}),
            "state": _object(keys.STATE),
            "transitions": _some({"anyOf": [TEXT, _ref("transition")]}),
            "transition": _object(keys.TRANSITION),
            "labelled": _object(keys.LABELLED, labels),
            "initial": {"anyOf": [NAMES, _object(keys.INITIAL)]},
            "events": _object(keys.EVENTS, dict.fromkeys(keys.EVENTS, TEXTS)),
            "capacity": _object(keys.CAPACITY),
            "invoke": _object(keys.INVOKE, {"content": _ref("chart")}),
            "use": _object(keys.USE),
            "exit": _object(keys.EXIT),
            "done": _object(keys.DONE),
            "property": _object(
                {**keys.PROPERTY, **keys.WATCH, **keys.REQUIRED},
                {**dict.fromkeys(keys.PROPERTY, NAMES), "watch": TEXTS},
            ),
            "operation": _object(keys.OPERATION),
            "environment": _object(
                keys.OWN_ENVIRONMENT, dict.fromkeys(keys.OWN_ENVIRONMENT, TEXTS)
            ),
        },
    }
