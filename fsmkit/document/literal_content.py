"""What the text of a ``content`` element means as an expression (SCXML 5.6, B.2.8.1)."""

from __future__ import annotations

import json

from fsmkit.diagnostics import Text
from fsmkit.diagnostics.parsing import parse_json


def content_value(text: Text) -> Text:
    """Return the expression a literal content stands for.

    JSON is that value; anything else a string, its white space made single blanks.
    """
    try:
        parse_json(text.value)
    except ValueError:
        return string(" ".join(text.value.split()), text)
    return text.strip()


def string(value: str, at: Text) -> Text:
    """Return the literal of a string, at the place of what it stands for."""
    return at.with_value(json.dumps(value, ensure_ascii=False))


def members(text: Text) -> dict[str, Text] | None:
    """Return the members of an object written in JSON, None where it is none."""
    try:
        value = parse_json(text.value)
    except ValueError:
        return None
    if not isinstance(value, dict):
        return None
    return {name: text.with_value(json.dumps(v)) for name, v in value.items()}
