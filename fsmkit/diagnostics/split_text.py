"""Split texts at separators outside quotes and brackets."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.diagnostics.source import Text


def split_outside(text: Text, separator: str) -> Iterator[Text]:
    """Yield the parts of `text` between separators outside quotes and brackets, at least one."""
    depth, start, quote = 0, 0, ""
    for place, char in enumerate(text.value):
        if quote:
            quote = "" if char == quote else quote
        elif char in "\"'":
            quote = char
        elif char in "([{":
            depth += 1
        elif char in ")]}":
            depth -= 1
        elif char == separator and depth <= 0:
            yield text.part(start, place)
            start = place + 1
    yield text.part(start, len(text.value))
