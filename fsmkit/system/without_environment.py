"""The world of a system: its machines of the environment, of which no code is written.

They are a model of what surrounds the others, so that a system can be checked. What connects them
with the others is then the host's.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from fsmkit.diagnostics import Findings
from fsmkit.system.machine import EventLink, InputLink, port_name
from fsmkit.system.system import System, part_of


@dataclass(frozen=True, slots=True)
class WithoutWorld:
    """A system without its world.

    ``outside``: ports of its machines, by number and port, that lead to others of them and led to
    the world, too.
    """

    system: System
    outside: frozenset[tuple[int, int]] = frozenset()


def without_world(system: System, findings: Findings) -> WithoutWorld:
    """Return what is left of a system, and say what is not; all of it where nothing would be left.

    The connections that lead to the world, or come from there, are told by what the host does in
    their place.
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
        f"no code is written of {_listed(m.name for m in gone)}, of the environment",
        gone[0].span,
        help="; ".join(_of_host(system, frozenset(here))) or "nothing connects it with the others",
    )
    return WithoutWorld(left, frozenset(led & within))


def _of_host(system: System, kept: frozenset[int]) -> Iterator[str]:
    """Yield what the host does in place of the connections, a text for each kind of them."""
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
            yield f"{verb} {_listed(dict.fromkeys(names))}"


def _port(system: System, link: EventLink) -> str:
    source = system.machines[link.source]
    return f"{source.name}.{port_name(source.chart, link.port)}"


def _variable(system: System, link: InputLink, kept: frozenset[int]) -> Iterator[str]:
    """Yield the input or output of the machine that is kept; of a shared variable its name."""
    is_read = link.source in kept
    number, place = (link.source, link.output) if is_read else (link.target, link.input)
    machine = system.machines[number]
    variables = machine.chart.outputs if is_read else machine.chart.inputs
    if place < len(variables):
        yield f"{machine.name}.{variables[place].name}"
    elif place - len(variables) < len(machine.shared):
        yield f"{machine.name}.{machine.shared[place - len(variables)].name}"


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)
