"""The building blocks of schemas."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from fsmkit.document.keys import Form, Key, Keys

Schema = dict[str, Any]
TEXT: Schema = {"type": ["string", "number", "boolean", "null"]}
"""Scalars are not resolved, so numbers and `null` are strings, too."""
FLAG: Schema = {"type": "boolean"}
TEXTS: Schema = {"type": ["array", "null"], "items": TEXT}
NAMES: Schema = {"anyOf": [TEXT, TEXTS]}
"""One name, several words in one text, or a list."""
NOTHING: Mapping[str, Schema] = MappingProxyType({})


def table(item: Schema) -> Schema:
    """Return the schema of a mapping whose keys are names."""
    return {"type": ["object", "null"], "additionalProperties": item}


def either(*schemas: Schema) -> Schema:
    """Return the schema that accepts any of the given ones."""
    return {"anyOf": [*schemas]}


def record(rows: Keys, special: Mapping[str, Schema] = NOTHING, **more: Any) -> Schema:
    """Return the schema of a mapping with the keys of a table; ``special``: other than texts."""
    properties = {
        row.name: {"description": row.doc, **special.get(row.name, TEXT)} for row in rows.values()
    }
    return {"type": "object", "properties": properties, "additionalProperties": False, **more}


def record_of(rows: Keys, special: Mapping[str, Schema] = NOTHING) -> Schema:
    """Return the schema of a mapping by the forms of its keys; ``special``: other than these."""
    return record(rows, {row.name: _of_form(row) for row in rows.values()} | {**special})


def _of_form(row: Key) -> Schema:
    match row.form:
        case Form.FLAG:
            return FLAG
        case Form.TABLE:
            return table(TEXT)
        case Form.RECORD:
            return record_of(row.rows)
        case Form.RECORDS:
            return table(either(TEXT, record_of(row.rows)))
        case _:
            return TEXT
