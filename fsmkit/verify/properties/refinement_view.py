"""The observable word of a derived chart's step, in terms of its base.

A macrostep is a word of groups, one for each microstep. A group shows the called operations and the
sent events that the base declares. It omits the entry and exit actions of states that the derived
chart adds inside an abstract state of the base. A group starts with a *stimulus* if it handles an
event that enters the base. It is *free* if a transition in it starts in such a state.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Chart, Transition
from fsmkit.document.document import Direction, Trigger
from fsmkit.language import Value
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.index import index_of


@dataclass(frozen=True, slots=True)
class Shown:
    """An observable effect: a called operation or a sent event, with its values."""

    is_operation: bool
    name: str
    values: tuple[Value, ...]
    result: Value | None = None


@dataclass(frozen=True, slots=True)
class Stimulus:
    """A handled event of the base, by its number there."""

    event: snap.Occurrence


@dataclass(frozen=True, slots=True)
class Group:
    """The effects of one microstep. ``leaves``: it continues in another state of the base."""

    stimulus: Stimulus | None
    shown: tuple[Shown, ...]
    free: bool = False
    leaves: bool = False


Word = tuple[Group, ...]


class Words:
    """Reads the steps of a chart as words of its base."""

    def __init__(self, chart: Chart, base: Chart) -> None:
        """Match the names of both."""
        self.chart, self.base = chart, base
        self._operations = {o.name for o in base.operations}
        self._events = {event.name: event for event in base.events}
        self._leaves = frozenset(
            chart.state_index[s.id]
            for s in base.states[1:]
            if s.abstract and s.is_leaf and s.id in chart.state_index
        )
        self._own = tuple(map(self._is_own, chart.transitions))

    def _leaf_of(self, state: int) -> int | None:
        """Return the abstract state, filled by this chart, that contains a state, or None."""
        around = (state, *self.chart.ancestors(state))
        return next((s for s in around if s in self._leaves), None)

    def _is_own(self, transition: Transition) -> bool:
        leaf = self._leaf_of(transition.source)
        if leaf is None or transition.trigger is Trigger.INITIAL:
            return False
        if transition.source != leaf:
            return True
        source = self.base.state_index[self.chart.states[leaf].id]
        return not any(
            t.source == source and _written(self.base, t) == _written(self.chart, transition)
            for t in self.base.transitions
        )

    def word(self, done: snap.Macrostep) -> Word:
        """Return the word of a macrostep, without groups that have no effect and no stimulus."""
        groups = (self._group(small) for small in done.microsteps)
        return tuple(g for g in groups if g.stimulus is not None or g.shown or g.leaves)

    def _group(self, small: snap.Microstep) -> Group:
        own = [self._leaf_of(self.chart.transitions[t].source)
               for t in small.transitions if self._own[t]]  # fmt: skip
        answered = isinstance(small.event, snap.Occurrence) and bool(small.transitions)
        return Group(
            self._stimulus(small.event) if answered else None,
            tuple(self._shown(small)),
            bool(own),
            any(leaf in small.exited for leaf in own),
        )

    def _stimulus(self, event: object) -> Stimulus | None:
        assert isinstance(event, snap.Occurrence)  # noqa: S101  (called for occurrences only)
        if event.event >= len(self.chart.events):
            return None  # a `sometimes` transition: `without_spontaneous` adds its event
        declared = self.chart.events[event.event]
        known = self._events.get(declared.name)
        if known is None or Direction.IN not in known.directions:
            return None
        given = {f.name: v for f, v in zip(declared.fields, event.payload, strict=True)}
        blank = index_of(self.base).blank[known.index]
        payload = tuple(
            given.get(field.name, value) for field, value in zip(known.fields, blank, strict=True)
        )
        return Stimulus(snap.Occurrence(known.index, payload))

    def _shown(self, small: snap.Microstep) -> Iterator[Shown]:
        inside = False
        for effect in small.effects:
            match effect:
                case snap.Entered(state) | snap.Exited(state):
                    inside = self._leaf_of(state) not in (None, state)
                case snap.Taken():
                    inside = False
                case snap.Called() | snap.Emitted() if inside:
                    pass
                case snap.Called(operation, arguments, result) if operation in self._operations:
                    yield Shown(True, operation, arguments, result)
                case snap.Emitted(snap.Occurrence(number, payload)):
                    declared = self.chart.events[number]
                    known = self._events.get(declared.name)
                    if known is not None and Direction.OUT in known.directions:
                        names = [field.name for field in known.fields]
                        values = zip(declared.fields, payload, strict=True)
                        yield Shown(
                            False, known.name, tuple(v for f, v in values if f.name in names)
                        )
                case _:
                    pass

    # --- the same state of the base ------------------------------------------------------------

    def outputs(self, snapshot: snap.Snapshot) -> tuple[Value, ...]:
        """Return the outputs that the base has."""
        slots = index_of(self.chart).slots
        return tuple(snapshot.data[slots[o.name]] for o in self.base.outputs if o.name in slots)

    def seen(self, snapshot: snap.Snapshot) -> snap.Snapshot:
        """Return the corresponding state of the base: states and data of the same names."""
        base, numbers = self.base, self.base.state_index
        ids = {self.chart.states[s].id for s in snapshot.configuration}
        active = frozenset({0} | {numbers[i] for i in ids if i in numbers})
        slots, blank = index_of(self.chart).slots, index_of(base).initial
        data = tuple(
            snapshot.data[slots[v.name]] if slots.get(v.name, -1) >= 0 else value
            for v, value in zip((*base.data, *base.outputs), blank.data, strict=True)
        )
        return replace(
            blank,
            configuration=active,
            data=data,
            history=tuple(self._history(snapshot)),
            timers=tuple(self._timers(active)),
            running=snapshot.running,
            finished=snapshot.finished,
            fault=snapshot.fault,
        )

    def _history(self, snapshot: snap.Snapshot) -> Iterator[tuple[int, frozenset[int]]]:
        for state, kept in snapshot.history:
            number = self.base.state_index.get(self.chart.states[state].id)
            around = {a for s in kept for a in (s, *self.chart.ancestors(s))}
            known = {self.base.state_index.get(self.chart.states[s].id) for s in around}
            wanted = {s for s in known if s is not None and s != 0}
            if number is None:
                continue
            parent = self.base.states[number].parent
            inside = {s for s in wanted if parent in self.base.ancestors(s)}
            deepest = {s for s in inside if self.base.states[s].is_leaf}
            yield number, frozenset(deepest or inside)

    def _timers(self, active: frozenset[int]) -> Iterator[snap.Timer]:
        for transition in self.base.transitions:
            if transition.has_timer and transition.source in active:
                yield snap.Timer(0, snap.Timeout(transition.index))


def _written(chart: Chart, t: Transition) -> tuple[object, ...]:
    targets = tuple(chart.states[target].id for target in t.targets)
    return t.trigger, t.descriptors, t.delay, targets


def shown_in(word: Word) -> tuple[Shown, ...]:
    """Return all effects in a word."""
    return tuple(shown for group in word for shown in group.shown)


def without(word: Word, done: Word) -> Word | None:
    """Return the rest of a word after a step of the base; None if they differ."""
    left = list(word)
    for place, group in enumerate(done):
        while left and left[0].free and place and not _agree(left[0], group):
            left.pop(0)
        if not left or not _agree(left[0], group):
            return None
        shown = left[0].shown[len(group.shown) :]
        left[0] = Group(None, shown, left[0].free, left[0].leaves)
        if not shown or left[0].free:
            left.pop(0)
    return tuple(left)


def _agree(given: Group, wanted: Group) -> bool:
    if wanted.stimulus is not None and given.stimulus != wanted.stimulus:
        return False
    return given.shown[: len(wanted.shown)] == wanted.shown
