"""The windows of a ring: sequences of adjacent cells that occur in a ring of any length.

The set of windows is closed under all steps that a window, with the cells next to it, can take. It
contains the windows of each reachable state of every ring with at least `Windows.least` positions:

* A step changes its own cell and cells at most `Ring.reach` away. A window therefore changes by a
  step inside of it, or by a step of one of the next `reach` cells. In the second case the window
  and those cells are a longer sequence, and all windows of that sequence are in the set.
* Which step a cell takes depends on the cell alone, but for conditions on all machines: machines of
  the environment react first, external events wait, time passes if no machine is busy. These are
  tested on the known cells only, so more steps are possible than in a ring, never fewer.
* A long ring has a position in the middle, and positions at the ends. Sequences without an end are
  placed in the middle of one system that is long enough, sequences with an end at that end.

The certificate is plain data: for each placement the set of windows, each a tuple of cells.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fsmkit.diagnostics import fail
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.verify.any_number.cells import Move, Ring
from fsmkit.verify.any_number.claims import Claim, Instance, Instances
from fsmkit.verify.any_number.conserved import Weights
from fsmkit.verify.any_number.family import RULE
from fsmkit.verify.statespace.actions import FULL

Window = tuple[int, ...]
MIDDLE = 0
"""The placement of windows without a position at an end."""
MOST_WINDOWS = 200_000
MOST_SEQUENCES = 60_000
"""Windows with cells beside them that are tried."""


class TooManyViewsError(Exception):
    """The set has more windows than `MOST_WINDOWS`, or needs more than `MOST_SEQUENCES`."""


@dataclass(frozen=True, slots=True)
class Segment:
    """Consecutive cells from a position on; each window of it is in the set."""

    start: int
    cells: Window


class Windows:
    """The closed set of windows of a width."""

    method = "windows"

    def __init__(
        self,
        ring: Ring,
        width: int,
        weights: Sequence[Weights] = (),
    ) -> None:
        """Compute the set; windows with a greater sum of some ``weights`` are excluded.

        Raises `TooManyViewsError`.
        """
        self.ring, self.width, self.weights = ring, width, weights
        ends = ring.family.ends
        self.special = ends.low + ends.high
        self.reach = max(1, ring.reach)
        self.least = max(width + 2 * self.reach, self.special + width + self.reach, ends.length)
        count = 1 + self.special + width - 1
        run = ring.length - self.special
        self.starts = [ends.low + (run - width) // 2]
        first = ring.length - ends.high - (width - 1)
        self.starts += [(first + n) % ring.length for n in range(count - 1)]
        self.known: list[set[Window]] = [set() for _ in self.starts]
        self.marks: set[tuple[int, int]] = set()
        self._heads: list[dict[Window, list[int]]] = [{} for _ in self.starts]
        self._tails: list[dict[Window, list[int]]] = [{} for _ in self.starts]
        self._todo: list[tuple[int, Window]] = []
        self._close()

    @staticmethod
    def longest(family_special: int, width: int, reach: int) -> int:
        """Return a length of a ring in which all placements of windows up to a width differ."""
        return family_special + 2 * (width + reach) + 2 * reach + 2

    @property
    def count(self) -> int:
        """The number of windows."""
        return sum(map(len, self.known))

    def following(self, place: int) -> tuple[int, ...]:
        """Return the placements one position to the right."""
        if place == MIDDLE:
            return (MIDDLE, 1)
        return ((place + 1) % len(self.starts),)

    def preceding(self, place: int) -> tuple[int, ...]:
        """Return the placements one position to the left."""
        if place == MIDDLE:
            return (MIDDLE, len(self.starts) - 1)
        return (place - 1,)

    def start_of(self, places: Sequence[int]) -> int:
        """Return the position of a segment, given the placements of its windows."""
        for n, place in enumerate(places):
            if place != MIDDLE:
                return self.starts[place] - n
        return self.starts[MIDDLE]

    # --- the closure -----------------------------------------------------------------------------

    def _close(self) -> None:
        for state in self.ring.initial():
            self._add_initial(state)
        tried = 0
        while self._todo:
            place, window = self._todo.pop()
            self._steps_within(place, window)
            for size in range(1, self.reach + 1):
                for places, cells in self._around(place, window, size):
                    tried += 1
                    if tried > MOST_SEQUENCES:
                        raise TooManyViewsError
                    self._steps_beside(places, cells, size)

    def _add_initial(self, state: Window) -> None:
        """Add the windows of an initial state; all machines in the middle must be alike."""
        length = self.ring.length
        ends = self.ring.family.ends
        middle = state[ends.low : length - ends.high]
        if len(set(middle)) > 1:
            raise fail(
                RULE,
                "the machines in the middle of the array start in different states",
                help="give them equal start values, or a number of machines",
            )
        for place, start in enumerate(self.starts):
            self._add(place, tuple(state[(start + n) % length] for n in range(self.width)))

    def _add(self, place: int, window: Window) -> None:
        if window in self.known[place] or not self._is_possible(self.starts[place], window):
            return
        self.known[place].add(window)
        self._heads[place].setdefault(window[:-1], []).append(window[-1])
        self._tails[place].setdefault(window[1:], []).append(window[0])
        self._todo.append((place, window))
        if len(self._todo) > MOST_WINDOWS or len(self.known[place]) > MOST_WINDOWS:
            raise TooManyViewsError

    def _is_possible(self, start: int, cells: Window) -> bool:
        return all(
            sum(weights.at(self.ring.kind(start + n), cell) for n, cell in enumerate(cells))
            <= weights.total
            for weights in self.weights
        )

    def _rights(self, place: int, window: Window) -> Iterator[tuple[int, int]]:
        """Yield the placement one to the right, and the cell there."""
        for after in self.following(place):
            for cell in tuple(self._heads[after].get(window[1:], ())):
                yield after, cell

    def _lefts(self, place: int, window: Window) -> Iterator[tuple[int, int]]:
        for before in self.preceding(place):
            for cell in tuple(self._tails[before].get(window[:-1], ())):
                yield before, cell

    def _around(
        self, place: int, window: Window, size: int
    ) -> Iterator[tuple[tuple[int, ...], Window]]:
        """Yield the sequences with ``size`` more cells that contain a window, with placements."""
        found: list[tuple[tuple[int, ...], Window]] = [((place,), window)]
        for lefts in range(size + 1):
            chains = found
            for _ in range(size - lefts):
                chains = [
                    ((*places, after), (*cells, cell))
                    for places, cells in chains
                    for after, cell in self._rights(places[-1], cells[-self.width :])
                ]
            for _ in range(lefts):
                chains = [
                    ((before, *places), (cell, *cells))
                    for places, cells in chains
                    for before, cell in self._lefts(places[0], cells[: self.width])
                ]
            yield from chains

    def _steps_within(self, place: int, window: Window) -> None:
        start = self.starts[place]
        for n in range(self.width):
            for move in self.possible_moves(start, window, n):
                after = self.after(start, window, n, move)
                if after is not None:
                    self._add(place, after)
        if self.ring.closed.unit:
            facts = [self.ring.facts(start + n, cell) for n, cell in enumerate(window)]
            if not any(each.busy for each in facts):
                passed = (self.ring.elapsed(start + n, cell) for n, cell in enumerate(window))
                self._add(place, tuple(passed))

    def _steps_beside(self, places: tuple[int, ...], cells: Window, size: int) -> None:
        """Add the windows after steps of the first and of the last of some cells."""
        start = self.start_of(places)
        if not self._is_possible(start, cells):
            return
        for mover, place, shift in ((0, places[-1], size), (len(cells) - 1, places[0], 0)):
            own = cells[shift : shift + self.width]
            for move in self.possible_moves(start, cells, mover):
                if any(shift <= mover + distance < shift + self.width for distance, _ in move.sent):
                    after = self.after(start, cells, mover, move)
                    changed = None if after is None else after[shift : shift + self.width]
                    if changed is not None and changed != own:
                        self._add(place, changed)

    def possible_moves(self, start: int, cells: Window, mover: int) -> Iterator[Move]:
        """Yield the steps of one of some consecutive cells that the others permit."""
        facts = [self.ring.facts(start + n, cell) for n, cell in enumerate(cells)]
        answers = any(each.answers for each in facts)
        waiting = sum(each.waiting for each in facts)
        for move in self.ring.moves(start + mover, cells[mover]):
            if answers and not move.answers:
                continue
            if move.is_open and (answers or waiting > self.ring.closed.max_pending):
                continue
            yield move

    def after(self, start: int, cells: Window, mover: int, move: Move) -> Window | None:
        """Return some consecutive cells after a step of one of them.

        A step that overflows a queue or faults is noted in ``marks``, and None is returned: if the
        final set has no such step, no ring has one, so nothing follows from it.
        """
        if move.marks:
            self.marks.update(move.marks)
            return None
        found = list(cells)
        found[mover] = move.after
        for distance, messages in move.sent:
            place = mover + distance
            if 0 <= place < len(cells):
                found[place], is_full = self.ring.deliver(start + place, found[place], messages)
                if is_full:
                    self.marks.add((messages[0].target, FULL))
                    return None
        return tuple(found)

    # --- claims ----------------------------------------------------------------------------------

    def instances(self, instances: Instances) -> Iterator[tuple[Instance, Mapping[int, Snapshot]]]:
        """Yield the bodies of a claim, each with all states of the machines that it reads."""
        for start, known in zip(self.starts, self.known, strict=True):
            found = [instance for instance in instances.all if instance.start == start]
            for window in known if found else ():
                snapshots = self.ring.snapshots(start, window)
                for instance in found:
                    yield instance, snapshots

    def bounds(self, instances: Instances, claim: Claim) -> bool:
        """Return whether a conserved sum bounds the machines for which a body holds."""
        if instances.width > 1:
            return False
        ring = self.ring
        counted = [
            (ring.kind(start), window[0])
            for start, known in zip(self.starts, self.known, strict=True)
            for instance in instances.all
            if instance.start == start
            for window in known
            if instances.holds(instance, ring.snapshots(start, window[:1]))
        ]
        return not counted or any(
            weights.total < min(weights.at(*cell) for cell in counted) * (claim.most + 1)
            for weights in self.weights
        )

    # --- results ---------------------------------------------------------------------------------

    def segments(self, size: int) -> Iterator[Segment]:
        """Yield all sequences of ``size`` cells whose windows are in the set."""
        more = max(0, size - self.width)
        for place, windows in enumerate(self.known):
            for window in windows:
                chains: list[tuple[tuple[int, ...], Window]] = [((place,), window)]
                for _ in range(more):
                    chains = [
                        ((*places, after), (*cells, cell))
                        for places, cells in chains
                        for after, cell in self._rights(places[-1], cells[-self.width :])
                    ]
                for places, cells in chains:
                    start = self.start_of(places)
                    if self._is_possible(start, cells):
                        yield Segment(start, cells)

    def may_deadlock(self) -> bool:
        """Return whether windows without a next step form a ring, so that it may be a deadlock.

        A walk through all placements starts and ends with the same window. Its machines at the ends
        occur once. The sums of the weights must be those of a ring.
        """
        stuck = [{w for w in known if self._is_stuck(place, w)}
                 for place, known in enumerate(self.known)]  # fmt: skip
        heads: list[dict[Window, list[Window]]] = []
        for windows in stuck:
            by_head: dict[Window, list[Window]] = {}
            for window in windows:
                by_head.setdefault(window[:-1], []).append(window)
            heads.append(by_head)
        return any(self._returns(first, heads) for first in stuck[1])

    def _returns(self, first: Window, heads: list[dict[Window, list[Window]]]) -> bool:
        sums, blocks = self._weight_of(1, first)
        seen = {(1, first, sums, blocks)}
        todo = list(seen)
        while todo:
            place, window, sums, blocks = todo.pop()
            for after in self.following(place):
                for to in heads[after].get(window[1:], ()):
                    if after == 1 and place == MIDDLE:
                        is_total = all(
                            total == weights.total
                            for total, weights in zip(sums, self.weights, strict=True)
                        )
                        if to == first and blocks and is_total:
                            return True
                        continue
                    more, is_blocked = self._weight_of(after, to)
                    total = tuple(a + b for a, b in zip(sums, more, strict=True))
                    if any(t > w.total for t, w in zip(total, self.weights, strict=True)):
                        continue
                    state = (after, to, total, blocks or is_blocked)
                    if state not in seen:
                        seen.add(state)
                        todo.append(state)
        return False

    def _weight_of(self, place: int, window: Window) -> tuple[tuple[int, ...], bool]:
        """Return the weights of the first cell of a window, and whether it must not wait."""
        start = self.starts[place]
        kind = self.ring.kind(start)
        weights = tuple(weights.at(kind, window[0]) for weights in self.weights)
        return weights, not self.ring.facts(start, window[0]).at_rest

    def _is_stuck(self, place: int, window: Window) -> bool:
        start = self.starts[place]
        return all(self.ring.facts(start + n, cell).stuck for n, cell in enumerate(window))
