"""Compute the states that a step of the library exits and enters, and compare with a chart.

The library (0.9, `NestedTransition._resolve_transition`) exits everything below the deepest active
ancestor of the destination, or below the state whose description contains the transition. SCXML
exits the states below the least common compound ancestor of source and destination.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

from fsmkit.foreign.pytransitions.spec import Callbacks, Machine, Path, State, Step


@dataclass(frozen=True)
class Moves:
    """The tree of a machine and the steps in it."""

    machine: Machine

    @cached_property
    def states(self) -> dict[Path, State]:
        """Return the states by path, in order."""
        return {state.path: state for state in self.machine.walk()}

    @cached_property
    def order(self) -> dict[Path, int]:
        """Return the place of each state in document order."""
        return {path: place for place, path in enumerate(self.states)}

    def is_parallel(self, path: Path) -> bool:
        """Whether a state is entered with several children."""
        return path != () and self.states[path].is_parallel

    def is_orthogonal(self, a: Path, b: Path) -> bool:
        """Whether two states lie in different regions of one parallel state."""
        common = meeting(a, b)
        return common not in (a, b) and self.is_parallel(common)

    def domain(self, step: Step) -> Path | None:
        """Return the state below which the transition of the chart leaves and enters."""
        source, dest = step.source, step.dest
        if dest is None:
            return None
        if is_below(dest, source):
            return source  # an internal transition
        common = dest[:-1] if dest == source or is_below(source, dest) else meeting(source, dest)
        while self.is_parallel(common):
            common = common[:-1]
        return common

    def difference(self, step: Step) -> str | None:
        """Return the difference of a chart's transition, or None."""
        source, dest, scope = step.source, step.dest, step.scope
        domain = self.domain(step)
        if dest is None or domain is None:
            return None
        common = dest[:-1] if dest == source or is_below(source, dest) else meeting(source, dest)
        if self.is_parallel(common):
            return "changes one region of a parallel state from a state outside it"
        if is_below(dest, source) and len(dest) > len(source) + 1:
            return "keeps the active states on its path, and enters the others"
        between = [dest[:length] for length in range(len(domain) + 1, len(dest))]
        if any(self.is_parallel(path) for path in between):
            return "enters one region of a parallel state and not the others"
        if not scope:
            return None
        if dest[len(scope)] == scope[0]:
            return "has a destination that the library resolves from the root"
        for length in range(len(scope) + 1, len(domain) + 1):
            state = self.states[domain[:length]]
            if state.is_parallel or _is_noticed(state):
                name = self.machine.separator.join(state.path)
                return f"exits and enters `{name}` too, because it is in the description above"
        return None

    # --- exits and entries --------------------------------------------------------------------

    def exits(self, step: Step) -> tuple[State, ...]:
        """Return every state that a step may leave, in document order."""
        domain = self.domain(step)
        if domain is None:
            return ()
        return tuple(
            state
            for path, state in self.states.items()
            if is_below(path, domain) and self._together(path, step.source)
        )

    def is_certain(self, state: State, step: Step) -> bool:
        """Whether a step leaves a state in any case."""
        return state.path == step.source or is_below(step.source, state.path)

    def entries(self, step: Step) -> tuple[State, ...]:
        """Return the states that a step enters, in the order of the library."""
        domain = self.domain(step)
        if domain is None or step.dest is None:
            return ()
        return self.entered(domain, step.dest)

    def entered(self, above: Path, dest: Path) -> tuple[State, ...]:
        """Return the states from below one down to another and its defaults, level by level."""
        found = [dest[:length] for length in range(len(above) + 1, len(dest) + 1)]
        level = [dest]
        while level:
            level = [(*path, name) for path in level for name in self.states[path].initial]
            found += level
        return tuple(self.states[path] for path in found)

    def initial_states(self) -> tuple[State, ...]:
        """Return the initial states of the machine."""
        return tuple(s for path in self.machine.initial for s in self.entered((), path))

    def _together(self, a: Path, b: Path) -> bool:
        return meeting(a, b) in (a, b) or self.is_orthogonal(a, b)

    # --- the end ------------------------------------------------------------------------------

    def finals(self, state: State) -> Callbacks:
        """Return the callbacks of a final state's entry, including states that end with it."""
        if not state.final or state.initial:
            return ()
        found, above = [*state.on_final], state.path[:-1]
        while above and not self.is_parallel(above):
            found += self.states[above].on_final
            above = above[:-1]
        if not above:
            found += self.machine.general["on_final"]
        return tuple(found)

    def region_finals(self, state: State) -> Callbacks:
        """Return the callbacks when all regions around a final state have ended."""
        if not state.final:
            return ()
        around = [state.path[:length] for length in range(1, len(state.path))]
        outer = [length for length, path in enumerate(around) if self.is_parallel(path)]
        if not outer:
            return ()
        ended = around[: outer[-1] + 1]
        return (
            *(name for path in ended for name in self.states[path].on_final),
            *self.machine.general["on_final"],
        )

    # --- where a state rests --------------------------------------------------------------------

    @cached_property
    def resting(self) -> frozenset[Path]:
        """Return the states with children that can be active without one."""
        reached: set[Path] = set()
        for entered in (self.initial_states(), *map(self.entries, self.machine.steps)):
            above = {state.path[:-1] for state in entered}
            reached |= {state.path for state in entered} - above
        return frozenset(
            path
            for path, state in self.states.items()
            if state.children and not state.initial and path in reached
        )

    # --- several steps on one trigger -----------------------------------------------------------

    def pairs(self) -> Iterator[tuple[Step, Step]]:
        """Yield steps of different sources that one trigger can make, in document order."""
        by_trigger: dict[str, list[Step]] = {}
        for step in self.machine.steps:
            by_trigger.setdefault(step.trigger.value, []).append(step)
        for steps in by_trigger.values():
            ordered = sorted(steps, key=lambda step: self.order[step.source])
            for one, two in combinations(ordered, 2):
                if one.source != two.source:
                    yield one, two

    def stays_in_region(self, step: Step, other: Path) -> bool:
        """Return whether a step exits no state outside its region of a parallel state."""
        domain = self.domain(step)
        return domain is None or is_below(domain, meeting(step.source, other))

    def is_parallel_between(self, ancestor: Path, descendant: Path) -> bool:
        """Return whether the path between two states contains a parallel state."""
        lengths = range(len(ancestor), len(descendant))
        return any(self.is_parallel(descendant[:length]) for length in lengths)


def meeting(a: Path, b: Path) -> Path:
    """Return the least common ancestor of two states, each of which may be it."""
    length = 0
    while length < min(len(a), len(b)) and a[length] == b[length]:
        length += 1
    return a[:length]


def is_below(path: Path, ancestor: Path) -> bool:
    """Whether a state lies strictly below another."""
    return len(path) > len(ancestor) and path[: len(ancestor)] == ancestor


def _is_noticed(state: State) -> bool:
    return bool(state.on_enter or state.on_exit or state.on_final or state.timeout)
