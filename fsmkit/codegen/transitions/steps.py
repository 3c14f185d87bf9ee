"""The text of `Steps`, of which a generated module holds the parts that its chart needs.

Nothing imports it. A part is the body of a class (`parts.PARTS`), which the generated `Steps` holds
itself; `codegen.conditional` reads the condition on `INPUTS`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, ClassVar

from transitions import MachineError
from transitions.extensions import HierarchicalMachine
from transitions.extensions.nesting import NestedEventData


class Steps(HierarchicalMachine):
    """The steps of a statechart that the library lacks, for the single model of a machine."""

    subject: Any
    """The model."""


class Leaves(Steps):
    """The innermost states in the library's nested lists."""

    def _leaves(self, states: Any) -> Iterator[str]:
        if isinstance(states, list):
            for state in states:
                yield from self._leaves(state)
        else:
            yield states


class Always(Leaves):
    """Transitions without an event."""

    always: ClassVar[str]
    """The trigger of the transitions without an event."""
    microsteps: ClassVar[int]
    """The greatest number of consecutive steps without an event."""

    def _trigger_event(self, event_data: Any, trigger: str) -> Any:
        """Take the transitions of an event, then those without an event."""
        result = super()._trigger_event(event_data, trigger)
        self.settle()
        return result

    def settle(self) -> None:
        """Take the transitions without an event until none is enabled."""
        for _ in range(self.microsteps):
            if not self._take_always():
                return
        raise MachineError(f"more than {self.microsteps} steps without an event")

    def _take_always(self) -> bool:
        """Take a transition without an event; return whether one was enabled."""
        event = NestedEventData(None, None, self, self.subject, (), {})
        with self():
            return bool(self._trigger_event_nested(event, self.always, None))


class Order(Always):
    """Regions as one step."""

    def _trigger_event_nested(self, event_data: Any, trigger: str, _state_tree: Any) -> Any:
        """Take the transitions of an event in all regions as one step (SCXML, Appendix D).

        The order is guards, exits, then ``after`` of each transition, entries. The library takes
        one transition after the other.
        """
        if trigger not in self.events:
            return None
        event_data.event = self.events[trigger]
        before = self.subject.state
        exits, entries = [], []
        taken = self._select(event_data)
        for transition in taken:
            self.callbacks(transition.before, event_data)
            if transition.dest:
                tree, left, entered = transition._resolve_transition(event_data)  # noqa: SLF001
                exits += left
                entries += entered
                transition._update_model(event_data, tree)  # noqa: SLF001
        after, self.subject.state = self.subject.state, before
        for leave in sorted(exits, key=self._place, reverse=True):
            leave()
        for transition in taken:
            self.callbacks(transition.after, event_data)
        self.subject.state = after
        for enter in sorted(entries, key=self._place):
            enter()
        return bool(taken)

    def _select(self, event_data: Any) -> list[Any]:
        """Return the enabled transitions; of two that exit one state only the first."""
        results: dict[int, bool] = {}
        chosen: list[Any] = []
        separator = self.state_cls.separator
        for leaf in self._active():
            path, found = leaf, self._first(leaf, event_data, results)
            while found is None and separator in path:
                path = path.rpartition(separator)[0]
                found = self._first(path, event_data, results)
            if found is None or found in chosen:
                continue
            left = self._left(found, event_data)
            rivals = [other for other in chosen if left & self._left(other, event_data)]
            if all(path.startswith(other.source + separator) for other in rivals):
                chosen = [*(other for other in chosen if other not in rivals), found]
        return chosen

    def _first(self, path: str, event_data: Any, results: dict[int, bool]) -> Any:
        """Return the first enabled transition of a state; each guard is evaluated once."""
        for transition in event_data.event.transitions.get(path, ()):
            if id(transition) not in results:
                results[id(transition)] = transition._eval_conditions(event_data)  # noqa: SLF001
            if results[id(transition)]:
                return transition
        return None

    def _left(self, transition: Any, event_data: Any) -> set[int]:
        """Return the states that a transition exits, by their positions."""
        exits = transition._resolve_transition(event_data)[1] if transition.dest else ()  # noqa: SLF001
        return {self._place(leave) for leave in exits}

    def _place(self, move: Any) -> int:
        """Return the position in document order of a state that is exited or entered."""
        return self._places()[id(move.func.__self__)]

    def _places(self) -> dict[int, int]:
        found: dict[int, int] = {}
        level = list(self.states.values())
        while level:
            state = level.pop(0)
            found[id(state)] = len(found)
            level = [*state.states.values(), *level]
        return found

    def _active(self) -> list[str]:
        """Return the paths of the innermost active states, in document order."""
        places = self._places()
        return sorted(self._leaves(self.subject.state), key=lambda s: places[id(self.get_state(s))])


class Timers(Order):
    """Timers."""

    now: int
    deadlines: list[tuple[int, int, Any, int | None, Callable[..., object], tuple[Any, ...]]]
    """The deadline, the order, the name, the period, and the call with its arguments."""
    age: int

    def arm(
        self,
        name: int | str | None,
        delay: int,
        call: Callable[..., object],
        *arguments: Any,
        period: int | None = None,
    ) -> None:
        """Schedule a call after some ticks, and then after each period, if given."""
        self.age += 1
        self.deadlines.append((self.now + delay, self.age, name, period, call, arguments))

    def disarm(self, *names: int | str) -> None:
        """Cancel the calls with the given names."""
        self.deadlines = [due for due in self.deadlines if due[2] not in names]

    def next_deadline(self) -> int | None:
        """Return the time of the next call, or None."""
        return min(self.deadlines)[0] if self.deadlines else None

    def run(self, now: int) -> None:
        """Run the calls with deadlines up to a time in ticks, each at its own, the oldest first."""
        # if INPUTS
        self.now = now
        self.settle()
        # endif
        self.wait(now)

    def wait(self, now: int) -> None:
        """Advance the time; `run` first takes the transitions that inputs have enabled."""
        while self.deadlines and min(self.deadlines)[0] <= now:
            self.fire()
        self.now = now

    def fire(self) -> None:
        """Run the first call at its deadline."""
        due = min(self.deadlines)
        self.deadlines.remove(due)
        self.now, _, name, period, call, arguments = due
        if period is not None:
            self.arm(name, period, call, *arguments, period=period)
        call(*arguments)


class History(Timers):
    """Histories."""

    histories: ClassVar[dict[str, tuple[str, bool, list[str]]]]
    """For each history its parent, whether it is deep, and its default."""
    was: dict[str, list[str]]
    changed: list[tuple[Any, Any]]

    def remember(self, history: str) -> None:
        """Record the active states below a history's parent, which is being exited."""
        within = self.histories[history][0] + self.state_cls.separator
        active = list(self._leaves(self.subject.state))
        self.was[history] = [path for path in active if path.startswith(within)]

    def recall(self, history: str) -> None:
        """Let the parent of a history enter the recorded states, the next time it is entered."""
        self.forget()
        above, is_deep, default = self.histories[history]
        known = self.was.get(history)
        depth = above.count(self.state_cls.separator) + 1
        end = None if is_deep or known is None else depth + 1
        for path in default if known is None else known:
            state = self.get_state(above)
            for name in path.split(self.state_cls.separator)[depth:end]:
                if not isinstance(state.initial, list):
                    self.changed.append((state, state.initial))
                    state.initial = name
                state = state.states[name]

    def forget(self) -> None:
        """Restore the initial states that `recall` replaced."""
        while self.changed:
            state, initial = self.changed.pop()
            state.initial = initial
