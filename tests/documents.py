"""Each JSON document that a test lets a verb print has the keys of the verb's schema, no others."""

from __future__ import annotations

from functools import cache
from typing import Any

import click
import jsonschema

from fsmkit.cli.common import console
from fsmkit.cli.common.result_schemas import RESULTS, result_schema
from fsmkit.emit.lines import json_text


def strict(schema: Any) -> Any:
    """Return a schema whose objects have no other keys than those that it names."""
    if isinstance(schema, list):
        return [strict(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    found = {key: strict(value) for key, value in schema.items()}
    if "properties" in found:
        found.setdefault("additionalProperties", False)
    return found


@cache
def validator(verb: str) -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(strict(result_schema(verb)))


def checked(document: object) -> str:
    context = click.get_current_context(silent=True)
    verb = None if context is None else context.info_name
    if verb in RESULTS:
        validator(verb).validate(document)
    return json_text(document)


def check_documents() -> None:
    """Have each document of this process compared with its schema before it is printed."""
    setattr(console, "json_text", checked)  # noqa: B010  # the module does not export the name
