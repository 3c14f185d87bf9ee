"""Literal ``content`` elements as expressions (SCXML 5.6, B.2.8.1)."""

from __future__ import annotations

import json

from fsmkit.diagnostics import Text
from fsmkit.diagnostics.parsing import parse_json


def content_value(text: Text) -> Text:
    """Return the expression for a literal content.

    JSON gives its value. Other text gives a string with normalized white space.
    """
    try:
        parse_json(text.value)
    except ValueError:
        return string(" ".join(text.value.split()), text)
    return text.strip()


def string(value: str, at: Text) -> Text:
    """Return the literal of a string, at a location."""
    return at.with_value(json.dumps(value, ensure_ascii=False))


def members(text: Text) -> dict[str, Text] | None:
    """Return the members of a JSON object; None for other texts."""
    try:
        value = parse_json(text.value)
    except ValueError:
        return None
    if not isinstance(value, dict):
        return None
    return {name: text.with_value(json.dumps(v)) for name, v in value.items()}
