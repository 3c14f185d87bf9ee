"""A system: machines, the wires between them, their environment, and required properties.

Machines are numbered in the order of the file, properties likewise.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from fsmkit.chart.analysis.partition import Use
from fsmkit.diagnostics import Source, Span, Text
from fsmkit.emit import guard
from fsmkit.system.machine import EventLink, FreeInput, InputLink, Machine, Monitor, Possible
from fsmkit.system.properties.property import Property


@dataclass(frozen=True, slots=True)
class Schedule:
    """The machines that run once a period, in this order; see `system.schedule`.

    ``period`` and ``jitter`` are ticks: a period starts late by at most the jitter.
    """

    order: tuple[int, ...]
    period: int
    jitter: int = 0
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Freezer:
    """A node that may freeze: the machine that keeps its state, and the machines on it.

    ``silent``: the events, by machine and number, by which others notice it. ``within``: the
    minimum and maximum ticks until then. ``continues``: ticks during which it may continue; None:
    it never does. See `system.freezes`.
    """

    machine: Machine
    frozen: tuple[int, ...]
    silent: tuple[tuple[int, int], ...] = ()
    within: tuple[int, int] = (0, 0)
    continues: int | None = None
    number: int = 0
    """The number of its machine, by which properties name it; see `system.freezes`."""


@dataclass(frozen=True)
class System:
    """A closed system. ``is_open``: one chart alone, with an unrestricted environment."""

    name: str
    machines: tuple[Machine, ...]
    event_links: tuple[EventLink, ...] = ()
    input_links: tuple[InputLink, ...] = ()
    possible: tuple[Possible, ...] = ()
    properties: tuple[Property, ...] = ()
    is_open: bool = False
    of_chart: bool = False
    """It is one chart alone, open or not: a chart is compiled, not a system."""
    free_inputs: tuple[FreeInput, ...] = ()
    sampled: tuple[tuple[str, Use], ...] = ()
    """Sources in these two whose relevant values are not all included, and why."""
    replaced: tuple[tuple[str, str], ...] = ()
    """Machines that run another chart than the file says, with the path of that chart."""
    parameters: tuple[tuple[str, str], ...] = ()
    """The parameters of the file, with their values in this system."""
    monitors: tuple[Monitor, ...] = ()
    """Those that are no machines yet: nothing but an exploration has any use for them."""
    schedule: Schedule | None = None
    """None: interleaved."""
    freezers: tuple[Freezer, ...] = ()
    """Nodes that may freeze: no machines yet, as nothing but an exploration uses them."""
    wires: tuple[str, ...] = ()
    """Files of the wires that narrow its environment (see `system.board.with_boards`)."""
    assumed: tuple[str, ...] = ()
    """On what else, in words, a proof of it rests."""
    source: Source | None = field(default=None, compare=False, repr=False)
    req: tuple[Text, ...] = field(default=(), compare=False, repr=False)
    """The requirements that the system as a whole implements."""

    def __post_init__(self) -> None:
        guard(self, "name")


def state_properties(system: System) -> tuple[Property, ...]:
    """Return the properties that states of its machines decide.

    Those of monitors, and of nodes that may freeze, have a meaning in an exploration only.
    """
    nodes = {freezer.number for freezer in system.freezers}
    return tuple(
        each
        for each in system.properties
        if each.condition is not None and nodes.isdisjoint(atom.machine for _, atom in each.atoms)
    )


def part_of(system: System, numbers: tuple[int, ...]) -> System:
    """Return some machines of a system as a system, with their wires and external events."""
    here = {number: place for place, number in enumerate(numbers)}
    events = (
        replace(link, source=here[link.source], target=here[link.target])
        for link in system.event_links
        if link.source in here and link.target in here
    )
    inputs = (
        replace(link, source=here[link.source], target=here[link.target])
        for link in system.input_links
        if link.source in here and link.target in here
    )
    possible = (
        replace(each, machine=here[each.machine])
        for each in system.possible
        if each.machine in here
    )
    return System(
        system.name,
        tuple(system.machines[number] for number in numbers),
        tuple(events),
        tuple(inputs),
        tuple(possible),
        source=system.source,
    )
