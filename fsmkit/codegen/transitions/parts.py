"""The parts of `Steps` (see `steps`) that a chart needs, as text."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from collections.abc import Set as AbstractSet
from functools import cache
from pathlib import Path

PART = re.compile(r"\n    # --- (\w+)\n")
CONDITION = re.compile(r"  # if (\w+)$")
IMPORTS: Mapping[str, Mapping[str, str]] = {
    "always": {
        "typing": "ClassVar",
        "transitions": "MachineError",
        "transitions.extensions.nesting": "NestedEventData",
    },
    "timers": {"collections.abc": "Callable"},
    "history": {"typing": "ClassVar"},
    "leaves": {"collections.abc": "Iterator"},
}
"""What each part imports, by module."""


@cache
def _source() -> str:
    text = Path(__file__).with_name("steps.py").read_text(encoding="utf-8")
    return re.sub(r"  # noqa.*", "", text)


def steps_text(needed: AbstractSet[str]) -> str:
    """Return the class with the parts that are needed; nothing if none is."""
    text = _source()
    head, *parts = PART.split(text[text.index("class Steps") :])
    names, bodies = parts[::2], parts[1::2]
    chosen = [body for name, body in zip(names, bodies, strict=True) if name in needed]
    kept = "\n".join(_lines("\n\n".join(part.strip("\n") for part in (head, *chosen)), needed))
    return kept if chosen else ""


def _lines(text: str, needed: AbstractSet[str]) -> Iterator[str]:
    for line in text.splitlines():
        condition = CONDITION.search(line)
        if condition is None:
            yield line
        elif condition[1] in needed:
            yield line[: condition.start()]
