"""The multisets of a symmetric system: local states of some machines, in any order.

All machines are alike, and only share variables. A view holds the local states of ``width``
different machines; each has its copy of the shared variables. A shared number of a machine is seen
by each machine as its own, that of another one, or none. The set of views is closed under all
steps: a step of a machine of a view, and a step of one more machine, if all views of the greater
multiset are in the set. So it contains each choice of ``width`` machines in each reachable state of
every system with at least ``width`` machines.

Conserved sums have a weight for each private local state, and a total for each value of the shared
variables, such as one working machine while the lock is taken.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from itertools import combinations, combinations_with_replacement

from fsmkit.diagnostics import fail
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.verify.any_number.cells import OWN, Facts, Ring
from fsmkit.verify.any_number.claims import Claim, Instance, Instances
from fsmkit.verify.any_number.conserved import Cell, Weights, conserved_weights
from fsmkit.verify.any_number.family import RULE
from fsmkit.verify.any_number.windows import MOST_WINDOWS, TooManyViewsError
from fsmkit.verify.statespace.actions import FAULT, FULL, Action, Mover, Outcome, Step
from fsmkit.verify.statespace.global_steps import LocalState

View = tuple[int, ...]
"""Canonical local states, sorted."""
PRIVATE, VALUES = 0, 1
"""The kinds of parts with a weight: private local states, and values of shared variables."""


class Multisets:
    """The closed set of views of a width."""

    method = "multisets"

    def __init__(self, ring: Ring, width: int) -> None:
        """Compute the set. Raises `TooManyViewsError`, and `FsmkitError` for other systems."""
        self.ring, self.width = ring, width
        self.weights: tuple[Weights, ...] = ()
        self.least = max(width, ring.family.ends.length)
        self.marks: set[tuple[int, int]] = set()
        self.known: set[View] = set()
        self._more: dict[View, set[int]] = {}
        self._todo: list[View] = []
        self._tried: set[View] = set()
        if any(len(members) != 1 for members in ring.members) or ring.closed.system.event_links:
            raise fail(RULE, "machines that share variables have connections or free inputs, too")
        self._parts: dict[tuple[int, Hashable], int] = {}
        self._changes: dict[tuple[tuple[Cell, int], ...], None] = {}
        if len(ring.family.ids) > 1:
            raise fail(RULE, "several shared variables hold numbers of machines")
        self._require_silent_start()
        self._close()
        starts = ring.initial()
        self.weights = self._sums() if len(starts) == 1 == len(set(starts[0])) else ()

    @property
    def count(self) -> int:
        """The number of views."""
        return len(self.known)

    def _require_silent_start(self) -> None:
        """Reject machines that write shared variables when they start, one after the other."""
        local = self.ring.steps.local_steps
        for machine in range(self.ring.length):
            before = local.settled(machine, local.initial(machine))
            step = Step(Action.START, machine)
            if any(one.messages for one in local.explore(machine, before, step, Mover.INTERNAL)):
                raise fail(
                    RULE,
                    "machines write a shared variable when they start",
                    self.ring.closed.system.machines[machine].span,
                    help="give the variable its value under `shared`",
                )

    # --- the closure -----------------------------------------------------------------------------

    def _close(self) -> None:
        for state in self.ring.initial():
            cells = sorted({self.ring.numbers.contents[cell][0] for cell in state})
            for view in combinations_with_replacement(cells, self.width):
                self._add(view)
        while self._todo:
            view = self._todo.pop()
            self._steps(view)
            for cell in self._extensions(view):
                whole = tuple(sorted((*view, cell)))
                if whole not in self._tried:
                    self._tried.add(whole)
                    self._steps_of_one(whole)

    def _add(self, view: View) -> None:
        view = tuple(sorted(view))
        if view in self.known:
            return
        if len(self.known) > MOST_WINDOWS or len(self._tried) > MOST_WINDOWS:
            raise TooManyViewsError
        self.known.add(view)
        for n in range(self.width):
            rest = view[:n] + view[n + 1 :]
            self._more.setdefault(rest, set()).add(view[n])
        self._todo.append(view)

    def _extensions(self, view: View) -> set[int]:
        """Return the local states of one more machine for which all views are in the set."""
        parts = [view[:n] + view[n + 1 :] for n in range(self.width)]
        return set.intersection(*(self._more.get(part, set()) for part in parts))

    def _steps(self, view: View) -> None:
        """Add the views after a step of a machine of a view, and after a unit of time."""
        for mover in range(self.width):
            for after in self._after(view, mover):
                self._add(after)
        states = self._placed(view)
        if self.ring.closed.unit and not any(
            self._fact(machine, local).busy for machine, local in enumerate(states)
        ):
            steps = self.ring.steps
            passed = [steps.elapsed(machine, local) for machine, local in enumerate(states)]
            later = self._view(passed)
            for old, new in zip(view, later, strict=True):
                self._note(old, new)
            self._add(later)

    def _steps_of_one(self, whole: View) -> None:
        """Add the views of the others after a step of one machine."""
        for mover in range(self.width + 1):
            if mover and whole[mover] == whole[mover - 1]:
                continue
            for after in self._after(whole, mover):
                self._add(after[:mover] + after[mover + 1 :])

    def _view(self, states: list[int]) -> View:
        return tuple(self.ring.canonical(machine, local) for machine, local in enumerate(states))

    def _placed(self, cells: View) -> list[int]:
        """Return the local states of the first machines of the system, by number.

        The owner of a shared number that none of them has is the last machine.
        """
        owned = [self.ring.owned(cell) for cell in cells]
        owner = owned.index(OWN) if OWN in owned else self.ring.length - 1
        return [self.ring.placed(machine, cell, owner) for machine, cell in enumerate(cells)]

    def _is_consistent(self, cells: View) -> bool:
        """Return whether all machines see the same values of the shared variables."""
        if len({self.ring.shared_values(cell) for cell in cells}) > 1:
            return False
        return sum(self.ring.owned(cell) == OWN for cell in cells) <= 1

    def _after(self, cells: View, mover: int) -> Iterator[View]:
        """Yield some local states, in their order, after each step of one of them."""
        if not self._is_consistent(cells):
            return
        states = self._placed(cells)
        steps = self.ring.steps
        facts = [self._fact(machine, local) for machine, local in enumerate(states)]
        answers = any(fact.answers for fact in facts)
        waiting = sum(fact.waiting for fact in facts)
        own = [(outcome, False) for outcome in steps.own_steps(mover, states[mover])]
        free = [(outcome, True) for outcome in steps.open_steps(mover, states[mover])]
        for outcome, is_open in (*own, *free):
            if answers and not facts[mover].answers:
                continue
            if is_open and (answers or waiting > self.ring.closed.max_pending):
                continue
            after = self._reached(states, mover, outcome)
            if after is not None:
                view = self._view(after)
                self._note(cells[mover], view[mover])
                yield view

    def _reached(self, states: list[int], mover: int, outcome: Outcome) -> list[int] | None:
        notes = {note for note in outcome.notes if note in (FULL, FAULT)}
        if notes:
            self.marks |= {(mover, note) for note in notes}
            return None
        found = list(states)
        found[mover] = self.ring.steps.intern(mover, outcome.after)
        for message in outcome.messages:
            target = message.target
            if target < len(found):
                found[target], is_full = self.ring.steps.delivered(target, found[target], message)
                if is_full:
                    self.marks.add((target, FULL))
                    return None
        return found

    def _fact(self, machine: int, local: int) -> Facts:
        steps = self.ring.steps
        steps.own_steps(machine, local)
        steps.open_steps(machine, local)
        state: LocalState = steps.local_states[machine][local]
        answers = self.ring.environment[machine] and state.view.waiting > 0
        is_stuck = not (
            state.view.waiting
            or state.view.awaited
            or state.view.faulted
            or state.busy
            or state.fair
        )
        return Facts(state.view.waiting, answers, state.busy, is_stuck, state.view.at_rest)

    # --- claims ----------------------------------------------------------------------------------

    def instances(self, instances: Instances) -> Iterator[tuple[Instance, Mapping[int, Snapshot]]]:
        """Yield the body of a claim for the first machine, with all of its states."""
        first = instances.first
        for cell in {cell for view in self.known for cell in view} if first is not None else ():
            assert first is not None  # noqa: S101  (tested above)
            yield first, self._snapshots(cell)

    def _snapshots(self, cell: int) -> dict[int, Snapshot]:
        local = self._placed((cell,))[0]
        return {0: self.ring.steps.local_states[0][local].snapshot}

    def bounds(self, instances: Instances, claim: Claim) -> bool:
        """Return whether at most so many machines of a view satisfy a body.

        If more machines of a system did, they would be a view of the set.
        """
        if claim.most >= self.width:
            return False
        counted = {
            next(iter(self._cells_of(snapshots)))
            for instance, snapshots in self.instances(instances)
            if instances.holds(instance, snapshots)
        }
        return not any(
            all(cell in counted for cell in chosen)
            for view in self.known
            for chosen in combinations(view, claim.most + 1)
        )

    def _cells_of(self, snapshots: Mapping[int, Snapshot]) -> Iterator[int]:
        for machine, snapshot in snapshots.items():
            yield self.ring.canonical(machine, self.ring.steps.intern(machine, snapshot))

    def may_deadlock(self) -> bool:
        """Return whether machines without a next step form views, so that it may be a deadlock.

        If so, a sum that is conserved may show that another machine has a next step.
        """
        blocked: dict[tuple[Value, ...], set[int]] = {}
        for view in self.known:
            facts = [self._fact(n, local) for n, local in enumerate(self._placed(view))]
            if all(fact.stuck for fact in facts):
                values = self.ring.shared_values(view[0])
                blocked.setdefault(values, set()).update(view)
        return any(
            not all(self._fact(0, self._placed((cell,))[0]).at_rest for cell in cells)
            and not self._needs_another(values, cells)
            for values, cells in blocked.items()
        )

    def _needs_another(self, values: tuple[Value, ...], cells: set[int]) -> bool:
        """Return whether a machine in another state exists while the variables have values."""
        total = (VALUES, self._part((VALUES, values)))
        parts = [(PRIVATE, self._part((PRIVATE, self.ring.private(cell)))) for cell in cells]
        return any(
            weights.at(*total) > 0 and not any(weights.at(*part) for part in parts)
            for weights in self.weights
        )

    # --- conserved sums --------------------------------------------------------------------------

    def _part(self, key: tuple[int, Hashable]) -> int:
        return self._parts.setdefault(key, len(self._parts))

    def _note(self, before: int, after: int) -> None:
        """Note how a step of a machine changes its private state and the shared variables."""
        row: dict[Cell, int] = {}
        for cell, sign in ((after, 1), (before, -1)):
            private = (PRIVATE, self._part((PRIVATE, self.ring.private(cell))))
            values = (VALUES, self._part((VALUES, self.ring.shared_values(cell))))
            row[private] = row.get(private, 0) + sign
            row[values] = row.get(values, 0) - sign
        self._changes[tuple(sorted(row.items()))] = None

    def _sums(self) -> tuple[Weights, ...]:
        """Return the sums over private states that the shared variables determine."""
        cells = {cell for row in self._changes for cell, _ in row}
        first = self.ring.numbers.contents[self.ring.initial()[0][0]][0]
        zero = [
            (PRIVATE, self._part((PRIVATE, self.ring.private(first)))),
            (VALUES, self._part((VALUES, self.ring.shared_values(first)))),
        ]
        return tuple(conserved_weights(map(dict, self._changes), cells, zero, ()))
