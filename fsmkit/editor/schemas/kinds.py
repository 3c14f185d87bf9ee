"""The kinds of files that have a schema."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from fsmkit.codegen.existing_c.schema import schema as binding_schema
from fsmkit.editor.schemas.models import deployment_schema, system_schema
from fsmkit.editor.schemas.others import campaign_schema, project_schema, tests_schema
from fsmkit.emit.lines import json_text
from fsmkit.yaml.schema import schema as chart_schema

FOLDER = Path(__file__).with_name("files")
DRAFT = "https://json-schema.org/draft/2020-12/schema"
KINDS: Mapping[str, Callable[[], dict[str, Any]]] = {
    "binding": binding_schema,
    "campaign": campaign_schema,
    "chart": chart_schema,
    "deployment": deployment_schema,
    "project": project_schema,
    "system": system_schema,
    "tests": tests_schema,
}
"""Functions that return the schemas, by kind."""


def schema_of(kind: str, version: str) -> dict[str, Any]:
    """Return the schema of a kind of file.

    Args:
        kind: A name of `KINDS`.
        version: The version of fsmkit, which is part of the identifier ``$id``.

    """
    return identified(KINDS[kind](), kind, version)


def identified(schema: Mapping[str, Any], kind: str, version: str) -> dict[str, Any]:
    """Return a schema with its dialect, and an identifier that names kind and version."""
    rest = {key: value for key, value in schema.items() if key != "$schema"}
    return {"$schema": DRAFT, "$id": f"urn:fsmkit:schema:{version}:{kind}", **rest}


def text_of(kind: str, version: str) -> str:
    """Return the schema of a kind of file as JSON."""
    return json_text(schema_of(kind, version))
