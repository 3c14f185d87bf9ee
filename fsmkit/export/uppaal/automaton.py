"""Compute the locations of a machine, and its reactions in each, by following all paths."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from fsmkit.export.uppaal.entries import History, Key, Path, TimerStart
from fsmkit.export.uppaal.paths import Paths
from fsmkit.export.uppaal.terms import unsupported
from fsmkit.language import Literal, Value
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.snapshot import Timeout
from fsmkit.system.shared import has_data_trigger
from fsmkit.verify.statespace.closed_system import ClosedSystem

MOST_LOCATIONS = 20_000


class Cause(Enum):
    """The cause of a machine's step (`verify.statespace.actions.Action`)."""

    START = "start"
    EVENTLESS = "eventless"
    TAKE = "take"
    FIRE = "fire"
    SPONTANEOUS = "spontaneous"
    OUTSIDE = "outside"


@dataclass(frozen=True, slots=True)
class Trigger:
    """A cause. ``event`` of TAKE, SPONTANEOUS and OUTSIDE; ``place`` of FIRE, a timer of the key.

    ``payloads``: the possible external values.
    """

    cause: Cause
    event: int = -1
    place: int = -1
    payloads: tuple[tuple[Value, ...], ...] = ()
    fair: bool = False


Ways = Mapping[History, tuple[Path, ...]]
"""The paths of a reaction, for each history that its location can be in."""


@dataclass(slots=True)
class Automaton:
    """A machine with its data as variables."""

    paths: Paths
    keys: dict[Key, list[History]] = field(default_factory=dict)
    start: tuple[Path, ...] = ()
    reactions: dict[Key, dict[Trigger, dict[History, tuple[Path, ...]]]] = field(
        default_factory=dict
    )
    recorded: dict[int, list[frozenset[int]]] = field(default_factory=dict)
    """For each history state what it may remember."""

    @property
    def starts_at_once(self) -> bool:
        """Whether starting only enters the first location."""
        return len(self.start) == 1 and not self.start[0].entries and self.start[0].target.running

    @property
    def stops(self) -> bool:
        """Whether the machine may come to an end or to a fault."""
        return any(not key.running for key in self.keys)


def build_automaton(
    closed: ClosedSystem,
    machine: int,
    queueable: frozenset[int],
    constants: Mapping[str, Literal],
    progress: Callable[[int, int], None],
) -> Automaton:
    """Return the automaton of a machine; ``queueable``: the events that its queue may hold.

    ``progress`` is called with the locations and paths so far.
    """
    found = Automaton(Paths(closed, machine, constants))
    triggers = [Trigger(Cause.TAKE, event) for event in sorted(queueable)]
    triggers += _possible(closed, machine)
    if closed.is_open or has_data_trigger(closed.system.machines[machine], closed.charts[machine]):
        triggers.insert(0, Trigger(Cause.EVENTLESS))
    found.start = tuple(found.paths.start())
    waiting: deque[tuple[Key, History]] = deque()
    for path in found.start:
        _note(found, path, (), waiting)
    count = 0
    while waiting:
        key, history = waiting.popleft()
        if not key.running:
            continue
        fires = [Trigger(Cause.FIRE, place=n) for n in _firing(closed, machine, key)]
        for trigger in [*triggers, *fires]:
            ways = _paths_by_history(found.paths, key, history, trigger)
            of_key = found.reactions.setdefault(key, {})
            of_key.setdefault(trigger, {})[history] = ways
            for path in ways:
                _note(found, path, history, waiting)
            count += len(ways)
        progress(len(found.keys), count)
        _require_few(found)
    return found


def _require_few(found: Automaton) -> None:
    if len(found.keys) > MOST_LOCATIONS:
        chart = found.paths.chart
        raise unsupported(
            f"`{chart.name}` has more than {MOST_LOCATIONS} stable configurations",
            chart.root.span,
            "split its orthogonal regions into machines of their own",
        )


def _possible(closed: ClosedSystem, machine: int) -> list[Trigger]:
    spontaneous: list[Trigger] = []
    outside: dict[tuple[int, bool], list[tuple[Value, ...]]] = {}
    for possible in closed.possible:
        if possible.machine != machine:
            continue
        if possible.spontaneous:
            spontaneous.append(Trigger(Cause.SPONTANEOUS, possible.event, fair=True))
        else:
            key = possible.event, possible.fair
            outside.setdefault(key, []).append(possible.payload)
    return [
        *spontaneous,
        *(
            Trigger(Cause.OUTSIDE, event, payloads=tuple(dict.fromkeys(payloads)), fair=fair)
            for (event, fair), payloads in outside.items()
        ),
    ]


def _firing(closed: ClosedSystem, machine: int, key: Key) -> list[int]:
    """Return the timers that can be the first to fire.

    If two timers with equal delays expire at once, the one armed first fires first. If one of them
    has expired, a pending one that was armed before it was armed at the same instant.
    """
    if closed.untimed:
        return [n for n, timer in enumerate(key.timers) if not is_silent(closed, machine, timer)]
    seen: set[int | None] = set()
    found = []
    for place, timer in enumerate(key.timers):
        if timer.is_interval or timer.greatest not in seen:
            found.append(place)
        seen.add(timer.greatest)
    return found


def is_silent(closed: ClosedSystem, machine: int, timer: TimerStart) -> bool:
    """Whether a timer is a watchdog that is assumed never to fire."""
    return isinstance(timer.what, Timeout) and closed.is_silent(machine, timer.what.transition)


def _paths_by_history(
    paths: Paths, key: Key, history: History, trigger: Trigger
) -> tuple[Path, ...]:
    match trigger.cause:
        case Cause.EVENTLESS:
            if not any(index_of(paths.chart).eventless[s] for s in key.configuration):
                return (Path((), key, (), (), took=False, happened=False),)
            return tuple(paths.eventless(key, history))
        case Cause.FIRE:
            return tuple(paths.fire(key, history, trigger.place))
        case Cause.SPONTANEOUS if not _is_answered(paths, key, trigger.event):
            return ()
        case _:
            found: tuple[Path, ...]
            if not paths.is_observed(trigger.event) and _is_ignored(paths, key, trigger.event):
                found = (Path((), key, (), (), took=False, happened=True),)
            else:
                payload = paths.open_payload(trigger.event)
                found = tuple(paths.event(key, history, trigger.event, payload))
            if trigger.cause is Cause.SPONTANEOUS:
                return tuple(path for path in found if path.took)
            if trigger.cause is Cause.OUTSIDE:
                return () if all(path.is_idle(key) for path in found) else found
            return found


def _is_ignored(paths: Paths, key: Key, event: int) -> bool:
    """Whether a configuration ignores an event, and eventless guards stay false."""
    eventless = index_of(paths.chart).eventless
    answers = _is_answered(paths, key, event) or any(eventless[s] for s in key.configuration)
    return not answers and not paths.chart.events[event].name.startswith("error.")


def _is_answered(paths: Paths, key: Key, event: int) -> bool:
    return any(event in index_of(paths.chart).by_event[s] for s in key.configuration)


def _note(
    found: Automaton, path: Path, history: History, waiting: deque[tuple[Key, History]]
) -> None:
    after: History = ()
    if path.target.running:
        held = {**dict(history), **dict(path.written)}
        after = tuple(sorted((h, value) for h, value in held.items() if value is not None))
    for state, value in path.written:
        known = found.recorded.setdefault(state, [])
        if value is not None and value not in known:
            known.append(value)
    histories = found.keys.setdefault(path.target, [])
    if after not in histories:
        histories.append(after)
        waiting.append((path.target, after))
