"""The options and the results of a symbolic search (``core/symbolic/symbolic_main.c``)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from fsmkit.system.properties.property import AtStates
from fsmkit.verify.report.verdict import ENDS, MANY_COMBINATIONS
from fsmkit.verify.statespace.actions import FAULT, FULL
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import DEADLOCK
from fsmkit.verify.statespace.symbolic_search import Diagram, Search


def symbolic_options(
    closed: ClosedSystem, search: Search, order: Sequence[int], until: frozenset[int]
) -> list[str]:
    """Return the options for a search that stores states as a diagram."""
    ways = ",".join(map(str, sorted(until) or _shown(closed)))
    ordered = ["--order", ",".join(map(str, order))] if order else []
    return ["--search", search.value, "--ways", ways, *ordered]


def _shown(closed: ClosedSystem) -> Iterator[int]:
    """Yield the marks to evaluate, each of which gets a path."""
    yield DEADLOCK
    for number, property_ in enumerate(closed.system.properties):
        if isinstance(property_.kind.decided, AtStates) and not property_.is_of_steps:
            yield 1 + number
    for machine in range(len(closed.system.machines)):
        first = closed.first_marks[machine]
        yield from (first + FULL, first + FAULT)


def why_unknown(record: Mapping[str, Any]) -> str:
    """Return why the answer to a temporal property is unknown; empty if memory ran out."""
    if record.get("unknown") == "combinations":
        return MANY_COMBINATIONS
    return {end.value: text for end, text in ENDS.items()}.get(record.get("unknown", ""), "")


def read_diagram(record: Mapping[str, Any] | None) -> Diagram | None:
    """Return the diagram at the end of a search, if there is one."""
    if record is None or record["engine"] != Search.SYMBOLIC.value:
        return None
    return Diagram(
        nodes=record["nodes"],
        peak=record["peak"],
        bytes=record["bytes"],
        events=record["events"],
        order=tuple(record["order"]),
        found_by=record["from"],
        made=record["made"],
        unknown=frozenset(record["unknown"]),
    )
