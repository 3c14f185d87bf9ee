"""Translate a closed system to a network: one template for each machine, with data as variables.

Dense time, as in zones: clocks for timers, invariants until they must fire. If the system is closed
untimed, an armed timer may fire at any time.
"""

from __future__ import annotations

from collections.abc import Callable

from fsmkit.export.uppaal.automaton import Automaton, build_automaton
from fsmkit.export.uppaal.data import Data
from fsmkit.export.uppaal.entries import Output, Path, QueuedEvent
from fsmkit.export.uppaal.layout import lay_out
from fsmkit.export.uppaal.machine import Builder
from fsmkit.export.uppaal.network import Network
from fsmkit.export.uppaal.pace import Pace
from fsmkit.export.uppaal.queries import MANY, Queries
from fsmkit.export.uppaal.space import Space
from fsmkit.export.uppaal.tchecker import for_tchecker
from fsmkit.export.uppaal.terms import unsupported
from fsmkit.language import InState
from fsmkit.language.walk import nodes
from fsmkit.system.machine import OBSERVED
from fsmkit.verify.statespace.closed_system import ClosedSystem


def translate(
    closed: ClosedSystem,
    *,
    flat: bool = False,
    paced: bool = False,
    draw: bool = True,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> Network:
    """Return the network of a system.

    ``flat``: without functions, and with expressions that TChecker reads. ``paced``: without an
    urgent channel (`pace`). ``draw``: compute positions. ``progress`` is called with the locations
    and paths so far. Raises `FsmkitError` (``not-in-uppaal``) for features that UPPAAL cannot
    express.
    """
    _require_supported(closed)
    space = Space(closed, flat, paced)
    automata: list[Automaton] = []
    for machine in range(len(closed.charts)):
        before = sum(len(automaton.keys) for automaton in automata)

        def show(locations: int, paths: int, before: int = before) -> None:
            progress(before + locations, paths)

        events, constants = space.queueable(machine), space.known_inputs(machine)
        automata.append(build_automaton(closed, machine, events, constants, show))
    space.declare_queues({n for n, automaton in enumerate(automata) if automaton.stops})
    machines = closed.system.machines
    order = sorted(range(len(machines)), key=lambda m: not machines[m].environment)
    starting = [m for m in order if not automata[m].starts_at_once]
    _require_start_order(closed, [automata[m].start for m in order], order)
    flags = _flags(closed, automata)
    builders = []
    for machine, automaton in enumerate(automata):
        data = Data(space, machine, automaton, flags[machine])
        boot = (starting.index(machine), len(starting)) if machine in starting else None
        builders.append(Builder(space, machine, automaton, data, boot))
    templates = [builder.template() for builder in builders]
    if space.pace is not None:
        rests = [builder.rests() for builder in builders]
        lengths = [queue.length for queue in space.queues.values()]
        if lengths or any(any(resting.values()) for resting in rests):
            templates = list(map(space.pace.moving, templates, rests))
            templates.append(space.pace.time(lengths))
        else:
            space.pace = None
    if flat:
        templates = list(map(for_tchecker, templates))
    has_steps = bool(starting) or any(builder.takes_steps for builder in builders)
    queries = Queries(space, builders, has_steps)
    return Network(
        tuple(_remark(closed, space.pace)),
        templates=tuple(lay_out(one) for one in templates) if draw else tuple(templates),
        queries=tuple(queries.all_queries()),
        declarations=space.declarations(len(starting)),
    )


def _remark(closed: ClosedSystem, pace: Pace | None) -> list[str]:
    time = "any armed timer may fire at any time" if closed.untimed else "dense, in ticks"
    tick = closed.charts[0].capacities.tick
    found = [
        f"{closed.system.name}, written by fsmkit export.",
        f"Time is {time}" + ("." if closed.untimed else f"; a tick is {tick} microseconds."),
        "A location is a stable configuration, named after its active leaves; a macrostep goes",
        "through committed locations, so that no other machine moves meanwhile.",
    ]
    if pace is not None:
        found.append(f"There is no urgent channel: time passes in {pace.instance}.later")
        found.append("only, which is entered where nothing waits and left with every step.")
    if closed.silent:
        found.append("Watchdogs are assumed never to fire.")
    if closed.samples:
        found.append(f"Not every external value is tried: {', '.join(closed.samples)}.")
    return found


def _require_supported(closed: ClosedSystem) -> None:
    """Reject unsupported features, each with its location."""
    schedule = closed.system.schedule
    if schedule is not None:
        way_out = "export it with `schedule: interleaved`"
        raise unsupported("a cyclic schedule is not translated", schedule.span, way_out)
    for freezer in closed.system.freezers:
        raise unsupported(
            f"`freezes` is not translated: the node `{freezer.machine.name}` may freeze",
            freezer.machine.span,
            "export the system without `freezes`",
        )
    for chart in closed.charts:
        for invocation in chart.invocations:
            raise unsupported(
                f"`{invocation.id}` is invoked by `{chart.name}`, which is not translated",
                invocation.span,
                "make it a machine of its own in a system",
            )
        for state in chart.states:
            if state.defer:
                raise unsupported(
                    f"`{state.id}` defers events, which is not translated",
                    state.span,
                    "keep them in data: a latch for each",
                )


def _require_start_order(
    closed: ClosedSystem, starts: list[tuple[Path, ...]], order: list[int]
) -> None:
    """Reject a start whose messages would arrive in another order than in the explorer."""
    receivers: set[int] = set()
    for machine, paths in zip(order, starts, strict=True):
        for path in paths:
            posts = any(isinstance(entry, QueuedEvent) for entry in path.entries)
            if posts and machine in receivers:
                raise unsupported(
                    f"`{closed.system.machines[machine].name}` sends itself an event while starting"
                    ", after others have sent it some",
                    closed.charts[machine].root.span,
                    "send it later",
                )
            for entry in path.entries:
                if isinstance(entry, Output) and entry.port < OBSERVED:
                    receivers |= {
                        link.target for link in closed.system.event_links if link.source == machine
                    }


def _flags(closed: ClosedSystem, automata: list[Automaton]) -> list[dict[int, str]]:
    """Return, for each machine, the states with a variable: queries test them in many locations."""
    found: list[dict[int, str]] = [{} for _ in automata]
    tested: set[tuple[int, int]] = set()
    for property_ in closed.system.properties:
        atoms = [*property_.atoms, *(property_.goal.atoms if property_.goal else ())]
        tested |= {(atom.machine, atom.state) for _, atom in atoms if atom.state is not None}
        if property_.owner is not None:
            tests = (n for n in nodes(property_.condition) if isinstance(n, InState))
            tested |= {(property_.owner, test.state) for test in tests}
    for machine, state in tested:
        automaton = automata[machine]
        count = sum(state in key.configuration for key in automaton.keys)
        if count > MANY:
            found[machine][state] = ""
    return found
