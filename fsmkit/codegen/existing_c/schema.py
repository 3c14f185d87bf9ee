"""The JSON Schema of bindings for editors, generated from the tables of keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fsmkit.codegen.existing_c import keys
from fsmkit.codegen.existing_c.model import Exports
from fsmkit.document.keys import Keys

Schema = dict[str, Any]

TEXT: Schema = {"type": ["string", "number", "boolean", "null"]}
"""The schema of a text: YAML scalars are not resolved, so numbers and `null` are texts, too."""
TABLE: Schema = {"type": ["object", "null"], "additionalProperties": TEXT}


def _object(rows: Keys, special: Mapping[str, Schema], **more: Any) -> Schema:
    properties = {
        row.name: {"description": row.doc, **special.get(row.name, TEXT)} for row in rows.values()
    }
    return {"type": "object", "properties": properties, "additionalProperties": False, **more}


def _entries(record: Schema) -> Schema:
    return {"type": ["object", "null"], "additionalProperties": {"anyOf": [TEXT, record]}}


def schema() -> Schema:
    """Return the schema of a binding."""
    trusted: dict[str, Schema] = {"trusted": {"type": "boolean"}}
    type_ = _object(keys.TYPE, {"members": TABLE, "fields": TABLE}, required=["type"])
    kinds = "|".join(keys.KINDS)
    special: dict[str, Schema] = {
        "include": {"anyOf": [TEXT, {"type": "array", "items": TEXT}]},
        "context": _object(keys.CONTEXT, {}, required=["type"]),
        "constants": TABLE,
        "types": {"type": ["object", "null"], "additionalProperties": type_},
        "operations": _entries(_object(keys.OPERATION, trusted, required=["call"])),
        "sends": TABLE,
        "inputs": _entries(_object(keys.INPUT, trusted, required=["get"])),
        "outputs": _entries(_object(keys.OUTPUT, {}, required=["set"])),
        "names": {
            "type": ["object", "null"],
            "patternProperties": {f"^({kinds})\\s+\\S": TEXT},
            "additionalProperties": False,
        },
        "exports": {"enum": [each.value for each in Exports]},
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A binding of a chart of fsmkit to existing C",
        **_object(keys.BINDING, special, required=["binding", "chart"]),
    }
