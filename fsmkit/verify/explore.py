"""Explore a closed system by one of the two engines, and judge what was found."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import closing
from dataclasses import KW_ONLY, dataclass, replace

from fsmkit.diagnostics import Findings, fail
from fsmkit.diagnostics.nearest import nearest
from fsmkit.verify.closed import Closed, close
from fsmkit.verify.counterexample import Counterexample, ReplayError, write
from fsmkit.verify.dense import cycle_place, temporal_answers
from fsmkit.verify.engine import CEngine, compiler
from fsmkit.verify.exploration import DEADLOCK, Exploration, Trail
from fsmkit.verify.oracle import explore_in_python
from fsmkit.verify.storage import Storage
from fsmkit.verify.system import JUDGED_AT_STATES, PropertyKind, System
from fsmkit.verify.verdict import Report, conclude

DEAD = "dead"
"""The reduction that resets data which nothing can read any more (`verify.dead_variables`)."""
SLEEP = "sleep"
"""The one that takes only one of the orders of steps that do not see each other (core/sleep.h)."""
REDUCTIONS = (DEAD, SLEEP)
"""The names of all reductions."""

Progress = Callable[[int, int, int], None]
"""Called now and then with states, transitions and depth."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What an exploration may use: bytes of memory, seconds (0: no limit), cores (0: all of them).

    What is found does not depend on the cores, unless states are missed (`Manner.storage`).
    """

    memory: int = 4 << 30
    seconds: float = 0
    cores: int = 1

    @property
    def threads(self) -> int:
        """How many cores this process may use, unless fewer are asked for."""
        if self.cores:
            return self.cores
        if hasattr(os, "sched_getaffinity"):
            return len(os.sched_getaffinity(0))
        return os.cpu_count() or 1


@dataclass(frozen=True, slots=True)
class Manner:
    """How to explore. ``engine``: ``c``, ``python``, or empty for C where there is a compiler."""

    engine: str = ""
    _: KW_ONLY
    untimed: bool = False
    silent: bool = False
    """Transitions marked ``watchdog`` never fire; needs ``untimed``."""
    limits: Limits = Limits()
    zones: bool = False
    """Time is dense; the engine in Python, which has no zones, lets it pass by units instead."""
    covers: bool = False
    """A way to each transition and each state is kept, for `verify.cover`."""
    without: frozenset[str] = frozenset()
    """Reductions (of `REDUCTIONS`) that are switched off; verdicts do not depend on them."""
    storage: Storage = Storage.EXACT
    """What is kept of a state; if not all, some may be missed, and it is told how likely."""

    def __post_init__(self) -> None:
        """Refuse reductions that there are not."""
        for name in sorted(self.without - set(REDUCTIONS)):
            raise fail(
                "no-such-reduction",
                f"there is no reduction `{name}`",
                help=f"use one of {', '.join(REDUCTIONS)}",
            )

    def closed(self, system: System, *, zones: bool) -> Closed:
        """Return a system closed to be explored in this manner; ``zones`` as the engine has it."""
        return close(
            system,
            untimed=self.untimed,
            silent=self.silent,
            zones=zones,
            covers=self.covers,
            keeps_dead=DEAD in self.without,
        )


def check(
    system: System,
    findings: Findings,
    *,
    manner: Manner | None = None,
    names: frozenset[str] = frozenset(),
    progress: Progress | None = None,
) -> Report:
    """Explore a system and return the verdicts; ``names`` limits the properties that are judged."""
    manner = manner or Manner()
    _demand_known(system, names)
    engine = manner.engine or ("c" if compiler() is not None else "python")
    zones = manner.zones and engine == "c"
    closed = manner.closed(system, zones=zones)
    _demand_stored(manner.storage, engine, closed)
    if not manner.engine and engine == "python":
        findings.add(
            "no-compiler",
            "there is no C compiler: exploring in Python, which is slow",
            None,
            help="install `cc`, or name a compiler in the environment variable CC",
        )
    until = _awaited(closed, names)
    if engine == "python":
        found, trail_of = explore_in_python(
            closed,
            traps=closed.is_open,
            timeout=manner.limits.seconds,
            progress=progress,
            until=until,
        )
        return conclude(closed, found, _shower(closed, trail_of), names, findings)
    with closing(CEngine(closed, findings)) as built:
        limits = manner.limits
        found = _searched(built, manner, progress, until)
        if closed.zones:
            answers = temporal_answers(
                built, closed, found, limits.memory, limits.seconds, progress, names
            )
            found = replace(found, temporal=answers)
        show = _shower(closed, built.trail, built.confirm)
        return conclude(closed, found, show, names, findings)


def _searched(
    built: CEngine,
    manner: Manner,
    progress: Progress | None,
    until: frozenset[int] = frozenset(),
) -> Exploration:
    limits, sleeps = manner.limits, SLEEP not in manner.without
    memory, seconds, cores = limits.memory, limits.seconds, limits.threads
    return built.explore(memory, seconds, progress, until, cores, manner.storage, sleeps=sleeps)


def _demand_stored(storage: Storage, engine: str, closed: Closed) -> None:
    """Refuse what is not exact where there is no such storage."""
    if storage is Storage.EXACT or (engine != "python" and not closed.zones):
        return
    what, way_out = "zones are kept", "use `--time discrete` or `--time untimed`"
    if engine == "python":
        what, way_out = "the engine in Python keeps states", "use the engine in C"
    raise fail(
        "no-such-storage",
        f"there is no storage `{storage.value}` here: {what} exactly",
        help=f"{way_out}, or leave `--storage` out",
    )


def _shower(
    closed: Closed,
    trail_of: Callable[[tuple[int, ...]], Trail],
    confirm: Callable[[Counterexample, tuple[int, ...]], Counterexample] | None = None,
) -> Callable[[tuple[int, ...], tuple[int, ...]], Counterexample]:
    def show(path: tuple[int, ...], cycle: tuple[int, ...]) -> Counterexample:
        whole = (*path, *cycle)
        trail = trail_of(whole)
        split = (
            cycle_place(trail, sum(n >= 0 for n in cycle))
            if closed.zones
            else len(trail) - len(cycle)
        )
        try:
            found = write(closed, trail[:split], trail[split:])
        except ReplayError as error:
            return Counterexample((), trail, None, (), str(error))
        return found if confirm is None else confirm(found, whole)

    return show


def _awaited(closed: Closed, names: frozenset[str]) -> frozenset[int]:
    """Return the marks that decide all properties asked for by name; none if some have no mark."""
    found = set()
    for number, property_ in enumerate(closed.system.properties):
        if property_.name not in names:
            continue
        if property_.kind is PropertyKind.DEADLOCK_FREE and not closed.is_open:
            found.add(DEADLOCK)
        elif property_.is_of_steps and closed.zones:
            return frozenset()
        elif property_.kind in JUDGED_AT_STATES and not property_.unexplored:
            found.add(1 + number)
        else:
            return frozenset()
    return frozenset(found)


def asking_only(system: System, names: frozenset[str]) -> System:
    """Return a system of which only the named properties are asked, and their monitors watch.

    None named: all. Raises `FsmkitError` (``no-such-property``).
    """
    if not names:
        return system
    _demand_known(system, names)
    return replace(
        system,
        properties=tuple(p for p in system.properties if p.name in names),
        monitors=tuple(m for m in system.monitors if m.property in names),
    )


def _demand_known(system: System, names: frozenset[str]) -> None:
    known = {property_.name for property_ in system.properties}
    for name in sorted(names - known):
        near = nearest(name, known)
        meant = "" if near is None else f"did you mean `{near}`? "
        raise fail(
            "no-such-property",
            f"`{system.name}` has no property `{name}`",
            None,
            help=f"{meant}there are {', '.join(sorted(known))}" if known else "it has none",
        )


def explored(
    system: System, findings: Findings, manner: Manner, progress: Progress | None = None
) -> Exploration:
    """Return what an exploration finds, without judging it."""
    zones = manner.zones and manner.engine != "python"
    closed = manner.closed(system, zones=zones)
    _demand_stored(manner.storage, manner.engine, closed)
    if manner.engine == "python":
        found, _ = explore_in_python(
            closed, traps=closed.is_open, timeout=manner.limits.seconds, progress=progress
        )
        return found
    with closing(CEngine(closed, findings)) as built:
        return _searched(built, manner, progress)
