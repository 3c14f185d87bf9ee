"""The parts of `Steps` (see `steps`) that a chart needs, as text."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from functools import cache
from pathlib import Path
from textwrap import dedent, indent

from fsmkit.codegen.conditional import selected
from fsmkit.codegen.python.lines import Piece
from fsmkit.codegen.python.template import without_remarks

WHOLE = "Steps"
"""The base class, with the parts that all charts need."""
PARTS: Mapping[str, str] = {
    "leaves": "Leaves",
    "always": "Always",
    "order": "Order",
    "timers": "Timers",
    "history": "History",
}
"""The class of each optional part."""
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
"""The imports of each part, by module."""


@cache
def _classes() -> Mapping[str, tuple[str, tuple[Piece, ...]]]:
    """Return by class its head and its definitions, each with the lines before it."""
    text = without_remarks(Path(__file__).with_name("steps.py").read_text(encoding="utf-8"))
    lines = text.split("\n")
    found = {}
    for each in ast.parse(text).body:
        if isinstance(each, ast.ClassDef):
            start, members = each.body[0].end_lineno or 0, []
            for node in each.body[1:]:
                own = "\n".join(lines[start : node.end_lineno])
                members.append(Piece(getattr(node, "name", ""), dedent(own)))
                start = node.end_lineno or start
            head = "\n".join(lines[each.lineno - 1 : each.body[0].end_lineno])
            found[each.name] = (head, tuple(members))
    return found


def steps_text(needed: AbstractSet[str]) -> str:
    """Return the class with the needed parts, or "" without any."""
    chosen = [PARTS[name] for name in PARTS if name in needed]
    if not chosen:
        return ""
    facts = {"INPUTS": "inputs" in needed}
    bodies = []
    for name in (WHOLE, *chosen):
        members = _classes()[name][1]
        lines = selected("\n".join(member.text for member in members).split("\n"), facts)
        bodies.append(indent("\n".join(lines).strip("\n"), "    "))
    return "\n\n".join((_classes()[WHOLE][0], *bodies))
