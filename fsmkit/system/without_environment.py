"""Remove the environment's machines from a system: no code is generated for them.

They model the surroundings of the others, so that a system can be checked. In generated code the
host takes the place of their connections.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fsmkit.diagnostics import Findings
from fsmkit.system.connections import format_names
from fsmkit.system.machine import EventLink, InputLink, port_name
from fsmkit.system.system import System, part_of


@dataclass(frozen=True, slots=True)
class WithoutWorld:
    """A system without the machines of its environment.

    ``outside``: ports, by machine and number, that were connected to both a remaining machine and
    the environment.
    """

    system: System
    outside: frozenset[tuple[int, int]] = frozenset()


def without_world(system: System, findings: Findings) -> WithoutWorld:
    """Return a system without its environment, or all of it if nothing would remain.

    A warning lists the omitted connections and the host's calls in their place.
    """
    kept = tuple(n for n, machine in enumerate(system.machines) if not machine.environment)
    if not kept or len(kept) == len(system.machines):
        return WithoutWorld(system)
    left = part_of(system, kept)
    here = {number: place for place, number in enumerate(kept)}
    led = {
        (here[link.source], link.port)
        for link in system.event_links
        if link.source in here and link.target not in here
    }
    within = {(link.source, link.port) for link in left.event_links}
    gone = [machine for machine in system.machines if machine.environment]
    findings.add(
        "world-left-out",
        f"no code is written of {format_names(m.name for m in gone)}, of the environment",
        gone[0].span,
        help="; ".join(_host_replacements(system, frozenset(here)))
        or "nothing connects it with the others",
    )
    return WithoutWorld(left, frozenset(led & within))


def _host_replacements(system: System, kept: frozenset[int]) -> Iterator[str]:
    """Yield the host's replacements of the connections, a text for each kind of connection."""
    out: list[str] = []
    came: list[str] = []
    written: list[str] = []
    read: list[str] = []
    links: tuple[EventLink | InputLink, ...] = (*system.event_links, *system.input_links)
    for link in links:
        if (link.source in kept) is (link.target in kept):
            continue
        match link:
            case EventLink() if link.source in kept:
                out.append(_port(system, link))
            case EventLink():
                target = system.machines[link.target]
                came.append(f"{target.name}.{target.chart.events[link.event].name}")
            case InputLink():
                (written if link.target in kept else read).extend(_variable(system, link, kept))
    for verb, names in (
        ("the host implements", out),
        ("it posts", came),
        ("it writes", written),
        ("it reads", read),
    ):
        if names:
            yield f"{verb} {format_names(dict.fromkeys(names))}"


def _port(system: System, link: EventLink) -> str:
    source = system.machines[link.source]
    return f"{source.name}.{port_name(source.chart, link.port)}"


def _variable(system: System, link: InputLink, kept: frozenset[int]) -> Iterator[str]:
    """Return the input or output of the remaining machine; for a shared variable its name."""
    is_read = link.source in kept
    number, place = (link.source, link.output) if is_read else (link.target, link.input)
    machine = system.machines[number]
    variables = machine.chart.outputs if is_read else machine.chart.inputs
    if place < len(variables):
        yield f"{machine.name}.{variables[place].name}"
    elif place - len(variables) < len(machine.shared):
        yield f"{machine.name}.{machine.shared[place - len(variables)].name}"
