"""Meaning kept, not only compiled: the places of a chart that are replaced by an error, and why.

A lenient dialect keeps what cannot be evaluated as the ``error.execution`` that SCXML 5.9 and 6.4
prescribe. Such a chart compiles, but it is not the chart that was meant.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from fsmkit.chart.passes.context import REPLACING
from fsmkit.diagnostics import Diagnostic

REFUSED = "the file is no chart"
"""The cause of a file that is refused as a whole."""
CAUSES: Mapping[str, re.Pattern[str]] = {
    "a target that nothing is reached under": re.compile(r"is no target$|nothing is reached under"),
    "a service, processor or chart that is not there": re.compile(
        r"there is no (service|event processor)|names no chart$"
        r"|could not be read$|leaves the folder of the chart$"
    ),
    "an element without what SCXML demands, or of no SCXML": re.compile(
        r"`<[^>]*>` (has no `|is no executable content|follows)"
    ),
    "a call on an object": re.compile(r"cannot be called$"),
    "a name, state or operation that is not there": re.compile(
        r"unknown (name|operation|state|type)"
    ),
    "`_event.data` as a whole": re.compile(r"`_event\.data` is outside"),
    "`_event.type` and its like": re.compile(r"`_event\.\w+` is outside"),
    "a field that the event does not have": re.compile(r"(the event|event `[^`]*`) has no field"),
    "strings joined at run time": re.compile(r"strings cannot be joined|computed at run time"),
    "an object or a list that grows": re.compile(
        r"`\{` is not expected|empty list tells no type|has no (field|elements)|is no array"
    ),
    "a function, loop, class or module": re.compile(
        r"`(function|new|import|this|JSON|Date)` is outside|loop without a bound"
    ),
    "`Math`": re.compile(r"`Math\.|this power|may not be whole"),
    "types that do not agree": re.compile(r"is expected\b|one side is|does not apply|is given"),
    "text of another language, or broken": re.compile(
        r"is not expected here|is no statement|ends too early|is outside the language"
    ),
}
"""Causes in the order in which they are tried, by the message of the finding."""


@dataclass(frozen=True, slots=True)
class Cause:
    """Why places are replaced: in how many files, and how many places."""

    name: str
    files: int
    places: int


def replaced(findings: Iterable[Diagnostic]) -> tuple[str, ...]:
    """Return the cause of each place of a chart that is replaced by an error."""
    return tuple(cause(d.message) for d in findings if d.rule.name in REPLACING)


def cause(message: str) -> str:
    """Return the cause of a message, `other` where none is known."""
    return next((name for name, told in CAUSES.items() if told.search(message)), "other")


def count_causes(files: Iterable[tuple[str, ...]]) -> tuple[Cause, ...]:
    """Return the causes found in files, each given by those of its places; the commonest first."""
    in_files: Counter[str] = Counter()
    places: Counter[str] = Counter()
    for causes in files:
        places.update(causes)
        in_files.update(set(causes))
    ordered = sorted(in_files, key=lambda name: (-in_files[name], -places[name], name))
    return tuple(Cause(name, in_files[name], places[name]) for name in ordered)
