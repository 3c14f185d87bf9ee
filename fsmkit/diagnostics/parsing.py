"""Parsing of untrusted JSON."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any


def parse_json(
    text: str | bytes, *, parse_int: Callable[[str], Any] | None = None, strict: bool = True
) -> Any:
    """Return the value of a JSON text; the options are those of `json.loads`.

    Raises:
        ValueError: The text is not JSON, is not UTF-8, or nests too deeply.

    """
    try:
        return json.loads(text, parse_int=parse_int, strict=strict)
    except RecursionError as error:
        raise ValueError("it nests too deeply") from error
