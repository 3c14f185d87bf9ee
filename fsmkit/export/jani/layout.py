"""JSON to be read by people, too: what is short stands on one line."""

from __future__ import annotations

import json

from fsmkit.export.jani.terms import Json

WIDTH = 100
DEEPEST = 8
"""So deep are lists and objects broken into lines: down to assignments, not into expressions."""


def laid_out(value: Json) -> str:
    """Return a JSON document."""
    return _part(value, 0, "") + "\n"


def _part(value: Json, depth: int, prefix: str) -> str:
    indent = " " * depth
    line = indent + prefix + json.dumps(value, ensure_ascii=False)
    if len(line) <= WIDTH or depth >= DEEPEST:
        return line
    if isinstance(value, list):
        parts, ends = [_part(item, depth + 1, "") for item in value], "[]"
    elif isinstance(value, dict):
        found = ((f"{json.dumps(key)}: ", item) for key, item in value.items())
        parts, ends = [_part(item, depth + 1, key) for key, item in found], "{}"
    else:
        return line
    return f"{indent}{prefix}{ends[0]}\n" + ",\n".join(parts) + f"\n{indent}{ends[1]}"
