"""Several items in one text, with commas between them: ``open, fault(code in {jam, stall})``."""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.diagnostics import Text

OPENING, CLOSING = "{(", "})"


def split_items(text: Text) -> list[Text]:
    """Split at commas outside braces and parentheses; blank items are dropped."""
    parts, depth, start = [], 0, 0
    for place, char in enumerate(text.value):
        depth += (char in OPENING) - (char in CLOSING)
        if char == "," and depth == 0:
            parts.append(text.part(start, place))
            start = place + 1
    parts.append(text.part(start, len(text.value)))
    return [part for part in parts if part.value.strip()]


def join_items(items: Sequence[Text]) -> str | None:
    """Return items as one text; None if `split_items` would split it differently."""
    given = [item.value.strip() for item in items]
    text = ", ".join(given)
    whole = Text(text, items[0].span, ()) if given else None
    found = [] if whole is None else [part.value.strip() for part in split_items(whole)]
    return text if found == given else None
