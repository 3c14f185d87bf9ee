"""Map source lines to states, transitions and blocks of statements.

An inherited state is at a line of its base. A line of a base can belong to several machines.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.chart.statements import Statement
from fsmkit.diagnostics import Source, Span
from fsmkit.language.statements.tree import ForEach, If
from fsmkit.system.system import System


@dataclass(frozen=True, slots=True, order=True)
class Target:
    """The element at a location, where a breakpoint stops (see `breakpoints.KINDS`)."""

    machine: int
    on: str
    what: int


@dataclass(frozen=True, slots=True)
class Place:
    """A line and column (from 1, in characters) of a file, and its elements."""

    line: int
    column: int
    targets: tuple[Target, ...]


def real_path(name: str) -> str:
    """Return the path by which two names of one file are the same."""
    return os.path.normcase(os.path.realpath(name))


class Places:
    """All places of a system, by file."""

    def __init__(self, system: System) -> None:
        self.sources: dict[str, Source] = {}
        """By real path, in the order of the machines: as they were read last."""
        self.read(system)

    def read(self, system: System) -> None:
        """Take the places of a system in place of all there were."""
        self.system = system
        self.sources |= {
            real_path(source.name): source
            for machine in system.machines[::-1]
            for source in machine.chart.sources
        }
        found: dict[str, dict[tuple[int, int], dict[Target, None]]] = {}
        paths: dict[int, str] = {}
        for number, machine in enumerate(system.machines):
            for span, target in _places_of(machine.chart, number):
                source = span.source
                path = paths.setdefault(id(source), real_path(source.name))
                at = source.position(span.start)
                found.setdefault(path, {}).setdefault(at, {})[target] = None
        self._found = {
            path: [Place(*at, tuple(sorted(targets))) for at, targets in sorted(places.items())]
            for path, places in found.items()
        }

    def of(self, path: str) -> Sequence[Place]:
        """Return the places of a file in order; none of a file that no machine has."""
        return self._found.get(real_path(path), ())

    def at(self, path: str, line: int, column: int | None = None) -> Place | None:
        """Return the place of a line, or the next one below it; None below the last.

        With a column, return the first place from it on; otherwise the first of the line.
        """
        wanted = (line, column or 1)
        return next((p for p in self.of(path) if (p.line, p.column) >= wanted), None)


def _places_of(chart: Chart, machine: int) -> Iterator[tuple[Span, Target]]:
    """Yield spans and their elements, without transitions that no trace shows."""
    initial = {state.initial for state in chart.states}
    for state in chart.states[1:]:
        entered = Target(machine, "entered", state.index)
        if not state.is_history:
            yield state.span, entered
        for block in (*state.on_entry, *state.invokes):
            yield from ((span, entered) for span in _spans(block))
        for block in state.on_exit:
            left = Target(machine, "left", state.index)
            yield from ((span, left) for span in _spans(block))
    for transition in chart.transitions:
        taken = Target(machine, "taken", transition.index)
        if transition.index not in initial:
            yield transition.span, taken
        yield from ((span, taken) for span in _spans(transition.content))


def _spans(statements: Iterable[Statement]) -> Iterator[Span]:
    """Yield the places of statements, of those within others as well."""
    for statement in statements:
        yield statement.span
        match statement:
            case If(branches=branches):
                for branch in branches:
                    yield from _spans(branch.body)
            case ForEach(body=body):
                yield from _spans(body)
            case _:
                pass
