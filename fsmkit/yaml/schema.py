"""The JSON Schema of charts for editors, made from the tables of keys that the reader uses.

``python -m fsmkit.yaml.schema`` prints it; a test keeps ``schema.json`` beside this file equal.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fsmkit.yaml import keys

PATH = Path(__file__).with_name("schema.json")
Schema = dict[str, Any]

TEXT: Schema = {"type": ["string", "number", "boolean", "null"]}
"""Nothing is resolved, so whatever YAML takes for a number or `null` is a text too."""
FLAG: Schema = {"type": "boolean"}
NAMES: Schema = {"anyOf": [TEXT, {"type": "array", "items": TEXT}]}
TEXTS: Schema = {"type": "array", "items": TEXT}
TABLE: Schema = {"type": ["object", "null"], "additionalProperties": TEXT}
OVERRIDES: Schema = {"anyOf": [{"enum": ["entry", "exit", "initial", "default"]}, TEXTS]}


def _ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _one_of(*words: str) -> Schema:
    return {"enum": list(words)}


def _some(item: Schema) -> Schema:
    return {"anyOf": [item, {"type": "array", "items": item}]}


def _table(item: Schema) -> Schema:
    return {"type": ["object", "null"], "additionalProperties": item}


TYPES = _table(
    {"anyOf": [{"type": "array", "items": TEXT}, {"type": "object", "additionalProperties": TEXT}]}
)
SHAPES: dict[str, Schema] = {
    "abstract": FLAG,
    "after": _table(_ref("transitions")),
    "always": _ref("transitions"),
    "autoforward": FLAG,
    "binding": _one_of("early", "late"),
    "capacity": _ref("capacity"),
    "choice": _ref("transitions"),
    "constants": TABLE,
    "data": TABLE,
    "datamodel": _one_of("fsmkit", "ecmascript", "null"),
    "default": _ref("initial"),
    "defer": NAMES,
    "do": NAMES,
    "done": _ref("done"),
    "entry": NAMES,
    "events": _some(_ref("events")),
    "every": _table(_ref("transitions")),
    "exit": NAMES,
    "final": FLAG,
    "finalize": NAMES,
    "first": FLAG,
    "history": _one_of("shallow", "deep"),
    "initial": _ref("initial"),
    "inputs": TABLE,
    "invoke": _some(_ref("invoke")),
    "names": NAMES,
    "on": _table(_ref("transitions")),
    "operations": TEXTS,
    "ordered": FLAG,
    "outputs": TABLE,
    "refine": _ref("states"),
    "regions": _ref("states"),
    "rest": FLAG,
    "script": NAMES,
    "sometimes": _ref("transitions"),
    "states": _ref("states"),
    "target": NAMES,
    "transitions": {"type": "array", "items": _ref("labelled")},
    "type": TEXT,
    "types": TYPES,
    "watchdog": FLAG,
    "with": TABLE,
}
"""What stands under a key, where that is not a text."""


def _object(table: Mapping[str, str], special: Mapping[str, Schema], **more: Any) -> Schema:
    properties = {
        key: {"description": text, **special.get(key, SHAPES.get(key, TEXT))}
        for key, text in table.items()
    }
    return {"type": "object", "properties": properties, "additionalProperties": False, **more}


def schema() -> Schema:
    """Return the schema of a chart."""
    internal = {"type": _one_of("internal", "external")}
    transition = _object(keys.TRANSITION, internal)
    labels = {"on": NAMES, "after": TEXT, "every": TEXT, "always": FLAG, "sometimes": FLAG}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A statechart of fsmkit",
        "$ref": "#/$defs/chart",
        "$defs": {
            "chart": _object(keys.CHART, {}, required=["chart"]),
            "states": _table({"anyOf": [_ref("state"), {"type": "null"}]}),
            "state": _object(keys.STATE, {"override": OVERRIDES}),
            "transitions": _some({"anyOf": [TEXT, _ref("transition")]}),
            "transition": transition,
            "labelled": _object(keys.LABELLED, {**internal, **labels}),
            "initial": {"anyOf": [NAMES, _object(keys.INITIAL, {})]},
            "events": _object(keys.EVENTS, dict.fromkeys(keys.EVENTS, TEXTS)),
            "capacity": _object(keys.CAPACITY, {"internal": TEXT}),
            "invoke": _object(keys.INVOKE, {"content": _ref("chart")}),
            "done": _object(keys.DONE, {}),
        },
    }


def text() -> str:
    """Return the schema as it stands in ``schema.json``."""
    return json.dumps(schema(), indent=2) + "\n"


if __name__ == "__main__":
    sys.stdout.write(text())
