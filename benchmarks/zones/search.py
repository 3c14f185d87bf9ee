"""A simple zone search of networks of timed automata.

It is the textbook's forward search (Bengtsson and Yi 2004): breadth first, with difference bound
matrices. A zone included in a stored one of the same locations and data is skipped. Extrapolation
is Extra+LU with bounds of each location (Behrmann, Bouyer, Larsen and Pelanek 2006), which also
removes clocks that are reset before they are read. It shares no code with the explorer.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

Data = tuple[int, ...]
Zone = list[int]
"""Row by row the bounds of x_i - x_j; x_0 is 0. "At most c" is 2c + 1, "less than c" is 2c."""
Test = tuple[int, str, int]
"""A clock (from 1), one of < <= >= >, a constant."""
FREE = 1 << 40
NEVER = -FREE


@dataclass(frozen=True, slots=True)
class Edge:
    """A step of one automaton; with a channel ``c!`` together with one ``c?`` of another one."""

    source: str
    target: str
    guard: tuple[Test, ...] = ()
    resets: tuple[int, ...] = ()
    channel: str = ""
    when: Callable[[Data], bool] = lambda _: True
    do: Callable[[Data], Data] = lambda data: data


@dataclass(frozen=True)
class Automaton:
    """An automaton; in ``committed`` locations no time passes, and only their edges are taken."""

    initial: str
    edges: tuple[Edge, ...]
    invariants: Mapping[str, tuple[Test, ...]] = field(default_factory=dict)
    committed: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Network:
    """Automata with clocks 1 to ``clocks`` and common data."""

    automata: tuple[Automaton, ...]
    clocks: int
    data: Data = ()


@dataclass(frozen=True, slots=True)
class Found:
    """The numbers of locations with data, of stored zones, and of steps."""

    discrete: int
    zones: int
    steps: int


def search(network: Network) -> Found:
    """Explore all reachable states of a network."""
    space = _Space(network)
    start = tuple(a.initial for a in network.automata), network.data
    zone = space.settled([1] * space.size**2, start[0])
    kept: dict[tuple[tuple[str, ...], Data], list[Zone]] = {start: [zone] if zone else []}
    waiting = deque((start, each) for each in kept[start])
    steps = 0
    while waiting:
        state, zone = waiting.popleft()
        if not any(zone is other for other in kept[state]):
            continue
        for after, reached in space.successors(*state, zone):
            steps += 1
            family = kept.setdefault(after, [])
            if any(_includes(other, reached) for other in family):
                continue
            family[:] = [other for other in family if not _includes(reached, other)]
            family.append(reached)
            waiting.append((after, reached))
    return Found(len(kept), sum(map(len, kept.values())), steps)


def _includes(big: Zone, small: Zone) -> bool:
    return all(b >= s for b, s in zip(big, small, strict=True))


def _sum(a: int, b: int) -> int:
    return FREE if a == FREE or b == FREE else a + b - ((a | b) & 1)


class _Space:
    def __init__(self, network: Network) -> None:
        self._network = network
        self.size = network.clocks + 1
        self._limits = [_limits(each, network.clocks) for each in network.automata]

    def successors(
        self, locations: tuple[str, ...], data: Data, zone: Zone
    ) -> Iterator[tuple[tuple[tuple[str, ...], Data], Zone]]:
        """Yield where each step leads, with time passed as far as it may."""
        for parts in self._steps(locations, data):
            reached: Zone | None = list(zone)
            after, values = list(locations), data
            for _, edge in parts:
                reached = reached and self._cut(reached, edge.guard)
            if reached is None:
                continue
            for number, edge in parts:
                after[number], values = edge.target, edge.do(values)
                for clock in edge.resets:
                    self._reset(reached, clock)
            settled = self.settled(reached, tuple(after))
            if settled is not None:
                yield (tuple(after), values), settled

    def _steps(
        self, locations: tuple[str, ...], data: Data
    ) -> Iterator[tuple[tuple[int, Edge], ...]]:
        automata = self._network.automata
        hurry = {n for n, a in enumerate(automata) if locations[n] in a.committed}
        ready = [
            (n, e)
            for n, a in enumerate(automata)
            for e in a.edges
            if e.source == locations[n] and e.when(data)
        ]
        for number, edge in ready:
            found: list[tuple[tuple[int, Edge], ...]]
            if not edge.channel:
                found = [((number, edge),)]
            elif edge.channel.endswith("!"):
                found = [
                    ((number, edge), (other, its))
                    for other, its in ready
                    if other != number and its.channel == edge.channel[:-1] + "?"
                ]
            else:
                continue
            yield from (s for s in found if not hurry or any(n in hurry for n, _ in s))

    def settled(self, zone: Zone, locations: tuple[str, ...]) -> Zone | None:
        """Return a zone within the invariants, after time passed, extrapolated; None if empty."""
        automata = list(zip(self._network.automata, locations, strict=True))
        tests = [t for a, at in automata for t in a.invariants.get(at, ())]
        settled = self._cut(zone, tests)
        if settled is None:
            return None
        if not any(at in a.committed for a, at in automata):
            for clock in range(1, self.size):
                settled[clock * self.size] = FREE
            settled = self._cut(settled, tests)
        return settled and self._extrapolated(settled, locations)

    def _cut(self, zone: Zone, tests: tuple[Test, ...] | list[Test]) -> Zone | None:
        for clock, sign, constant in tests:
            weak = "=" in sign
            i, j, bound = (
                (clock, 0, 2 * constant + weak) if "<" in sign else (0, clock, -2 * constant + weak)
            )
            size = self.size
            if bound >= zone[i * size + j]:
                continue
            if _sum(bound, zone[j * size + i]) < 1:
                return None
            for k in range(size):
                to = _sum(zone[k * size + i], bound)
                for m in range(size):
                    through = _sum(to, zone[j * size + m])
                    if through < zone[k * size + m]:
                        zone[k * size + m] = through
        return zone

    def _reset(self, zone: Zone, clock: int) -> None:
        for k in range(self.size):
            zone[clock * self.size + k] = zone[k]
            zone[k * self.size + clock] = zone[k * self.size]
        zone[clock * self.size + clock] = 1

    def _extrapolated(self, zone: Zone, locations: tuple[str, ...]) -> Zone:
        size, found = self.size, list(zone)
        own = [limits[at] for limits, at in zip(self._limits, locations, strict=True)]
        lower = [0, *(max(each[0][c] for each in own) for c in range(1, size))]
        upper = [0, *(max(each[1][c] for each in own) for c in range(1, size))]
        least = [-(zone[i] >> 1) for i in range(size)]
        for i in range(size):
            for j in range(1, size) if i == 0 else range(size):
                if (
                    i != j
                    and i > 0
                    and (
                        zone[i * size + j] >> 1 > lower[i]
                        or least[i] > lower[i]
                        or least[j] > upper[j]
                    )
                ):
                    found[i * size + j] = FREE
                elif i == 0 and least[j] > upper[j]:
                    found[j] = 1 if upper[j] == NEVER else -2 * upper[j]
        if found != zone:
            for k in range(size):
                for i in range(size):
                    to = found[i * size + k]
                    for j in range(size) if to != FREE else ():
                        through = _sum(to, found[k * size + j])
                        if through < found[i * size + j]:
                            found[i * size + j] = through
        return found


Limits = Mapping[str, tuple[list[int], list[int]]]
"""By location, of each clock the greatest constant of its lower bounds, and of its upper ones."""


def _limits(automaton: Automaton, clocks: int) -> Limits:
    """Return the constants that a clock may be compared with before it is reset."""
    places = {automaton.initial, *(e.source for e in automaton.edges)}
    places |= {e.target for e in automaton.edges}
    found = {place: ([NEVER] * (clocks + 1), [NEVER] * (clocks + 1)) for place in places}

    def note(place: str, tests: tuple[Test, ...]) -> None:
        for clock, sign, constant in tests:
            side = found[place]["<" in sign]
            side[clock] = max(side[clock], constant)

    for place, tests in automaton.invariants.items():
        note(place, tests)
    for edge in automaton.edges:
        note(edge.source, edge.guard)
    for _ in places:
        for edge in automaton.edges:
            for side, beyond in zip(found[edge.source], found[edge.target], strict=True):
                for clock in range(1, clocks + 1):
                    if clock not in edge.resets:
                        side[clock] = max(side[clock], beyond[clock])
    return found
