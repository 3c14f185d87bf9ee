"""Place callbacks in a chart: as handlers of states if that keeps the library's order.

The library calls ``before``, exits, entries, ``after``; a chart executes exits, content, entries.
A callback of leaving a state can be its exit handler if no step that leaves the state has an
earlier callback; likewise for entries. Otherwise it becomes content of each transition, in the
order of the library, if the exited states are known in advance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import combinations

from fsmkit.foreign.pytransitions.moves import Moves
from fsmkit.foreign.pytransitions.spec import Callbacks, Path, State, Step


@dataclass(frozen=True, slots=True)
class Placement:
    """The places of a machine's callbacks in the chart."""

    moves: Moves
    exits_in_content: frozenset[Path]
    entries_in_content: frozenset[Path]
    confused: tuple[Step, ...]
    """Steps that exit states in another order than the library, or before earlier callbacks."""

    def on_entry(self, state: State) -> Callbacks:
        """Return the entry handler of a state."""
        if state.path in self.entries_in_content:
            return ()
        return (*state.on_enter, *self.moves.finals(state))

    def on_exit(self, state: State) -> Callbacks:
        """Return the exit handler of a state."""
        return () if state.path in self.exits_in_content else state.on_exit

    def content(self, step: Step) -> Callbacks:
        """Return the content of a transition."""
        left = (
            name
            for state in reversed(self.moves.exits(step))
            if state.path in self.exits_in_content
            for name in state.on_exit
        )
        inside = [s for s in self.moves.entries(step) if s.path in self.entries_in_content]
        entered = (name for state in inside for name in state.on_enter)
        ended = (name for state in inside for name in self.moves.finals(state))
        return (*before(self.moves, step), *left, *entered, *ended, *after(self.moves, step))


def before(moves: Moves, step: Step) -> Callbacks:
    """Return the callbacks before any exit, as far as a chart can call them."""
    general = moves.machine.general
    prepared = () if step.is_conditional else (*general["prepare_event"], *step.prepare)
    return (*prepared, *general["before_state_change"], *step.before)


def after(moves: Moves, step: Step) -> Callbacks:
    """Return the callbacks after all entries."""
    return (*step.after, *moves.machine.general["after_state_change"])


def place(moves: Moves) -> Placement:
    """Return where the callbacks of a machine go."""
    steps = [step for step in moves.machine.steps if moves.domain(step) is not None]
    leaving = {i: [s for s in moves.exits(t) if s.on_exit] for i, t in enumerate(steps)}
    entering = {i: [s for s in moves.entries(t) if _entry(moves, s)] for i, t in enumerate(steps)}

    is_late = {i for i, t in enumerate(steps) if leaving[i] and before(moves, t)}
    is_late |= {i for i, found in leaving.items() if _is_other_order(moves, found, _is_left_other)}
    groups = _groups(leaving.values())
    in_content: set[Path] = set()
    for group in groups:
        mine = {i for i, found in leaving.items() if any(s.path in group for s in found)}
        certain = all(moves.is_certain(s, steps[i]) for i in mine for s in leaving[i])
        if certain and is_late & mine:
            in_content |= group
    confused = tuple(
        steps[i] for i in sorted(is_late) if any(s.path not in in_content for s in leaving[i])
    )

    begun = {state.path for state in moves.initial_states() if _entry(moves, state)}
    is_early = {i for i, t in enumerate(steps) if entering[i] and after(moves, t)}
    is_early |= {i for i, f in entering.items() if _is_other_order(moves, f, _is_entered_other)}
    entered: set[Path] = set()
    for group in _groups([*entering.values(), [moves.states[path] for path in begun]]):
        mine = {i for i, found in entering.items() if any(s.path in group for s in found)}
        if is_early & mine or begun & group:
            entered |= group
    return Placement(moves, frozenset(in_content), frozenset(entered), confused)


def _entry(moves: Moves, state: State) -> Callbacks:
    return (*state.on_enter, *moves.finals(state))


def _is_other_order(
    moves: Moves, found: list[State], is_other: Callable[[Moves, State, State], bool]
) -> bool:
    return any(is_other(moves, one, two) for one, two in combinations(found, 2))


def _is_left_other(moves: Moves, early: State, late: State) -> bool:
    """Whether the library leaves the later of two states, in document order, after the earlier."""
    is_apart = moves.is_orthogonal(early.path, late.path)
    return is_apart and len(early.path) >= len(late.path)


def _is_entered_other(moves: Moves, first: State, second: State) -> bool:
    """Whether the library enters two states against their order in the document."""
    return moves.order[first.path] > moves.order[second.path] or bool(moves.finals(first))


def _groups(sets: Iterable[list[State]]) -> list[set[Path]]:
    """Return states in groups: two are in one where some step leaves, or enters, both."""
    groups: list[set[Path]] = []
    for states in sets:
        joined = {state.path for state in states}
        if not joined:
            continue
        apart = []
        for group in groups:
            if group & joined:
                joined |= group
            else:
                apart.append(group)
        groups = [*apart, joined]
    return groups
