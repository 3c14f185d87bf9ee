"""Read the bounds of a machine."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from fsmkit.chart.chart import Capacities
from fsmkit.chart.limits import CAPACITIES
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.fixes import replace_text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import DocCapacity, Document
from fsmkit.document.walk import states, structure
from fsmkit.language import Scope, read_duration
from fsmkit.language.statements.tree import Block, DocSend, Raise

LOOSE_MICROSTEPS = 1000
LONGEST_TICK = 3_600_000_000
"""Microseconds: an hour."""


def read_capacities(document: Document, findings: Findings) -> Capacities:
    """Return the capacities, with the default for each one that the document does not set.

    SCXML has no bounds, and its charts run longer macrosteps than those written for a controller.
    Their queues have room for the events that one handler raises or sends.
    """
    values = {}
    if document.datamodel != "fsmkit":
        values = {"microsteps": LOOSE_MICROSTEPS} | _bursts(document)
    for capacity in document.capacities:
        name = capacity.name.value
        value = _tick(capacity, findings) if name == "tick" else _count(capacity, findings)
        if value is not None:
            values[name] = value
    return Capacities(**values)


def _bursts(document: Document) -> dict[str, int]:
    """Return how many events one handler puts into each queue at most, if that is many.

    A handler in a loop may put more; a chart that needs more declares it.
    """
    most = {"internal": 0, "queue": 0}
    for block in _blocks(document):
        put = Counter(type(part) for part in structure(block))
        most["internal"] = max(most["internal"], put[Raise])
        most["queue"] = max(most["queue"], put[DocSend])
    usual = Capacities()
    return {name: count for name, count in most.items() if count > getattr(usual, name)}


def _blocks(document: Document) -> Iterator[Block]:
    for state in states(document.root):
        yield from (*state.entry, *state.exit)
        for transition in (*state.transitions, *filter(None, (state.initial,))):
            yield transition.content or ()


def _count(capacity: DocCapacity, findings: Findings) -> int | None:
    name, text = capacity.name.value, capacity.value.value.strip()
    if name not in CAPACITIES:
        known = [*CAPACITIES, "tick"]
        findings.add(
            "unknown-name",
            f"there is no capacity `{name}`",
            capacity.name,
            help=suggest(name, known, f"use one of {', '.join(known)}"),
        )
        return None
    low, high = CAPACITIES[name]
    if not (text.isascii() and text.isdigit() and len(text) < 20 and low <= int(text) <= high):
        findings.add(
            "bad-capacity",
            f"the capacity `{name}` is a whole number from {low} to {high}, not `{text}`",
            capacity.value,
            help=f"write such a number, for instance `{name}: {max(low, 8)}`",
            fixes=replace_text(capacity.value, str(max(low, 8))),
        )
        return None
    return int(text)


def _tick(capacity: DocCapacity, findings: Findings) -> int | None:
    value = read_duration(capacity.value, Scope(tick=1), findings)
    if value is not None and not 1 <= value <= LONGEST_TICK:
        findings.add(
            "bad-capacity",
            f"a tick lasts from 1us to 1h, not `{capacity.value}`",
            capacity.value,
            help="write for instance `tick: 1ms`",
            fixes=replace_text(capacity.value, "1ms"),
        )
        return None
    return value
