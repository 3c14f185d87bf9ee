"""Model a derived chart and its base as processes over the base's view of steps.

An event is a word (`verify.properties.refinement_view`) with the outputs after it, the inputs that
were read, and, if the derived chart leaves an abstract state, the next state of the base. The base
performs all of its unobservable steps before an event together with it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.export.exporter import ExportOptions
from fsmkit.export.transition_system import too_large, too_many_choices
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.verify.properties.refinement import Inputs, Pair, Search, state_of
from fsmkit.verify.properties.refinement_view import Word
from fsmkit.verify.statespace.actions import Chooser, TooManyChoices


@dataclass(frozen=True, slots=True)
class Sight:
    """The base's view of a step, and the facts that decide how it can follow.

    ``place``: the next state of the base if the derived chart leaves an abstract state.
    """

    word: Word
    outputs: tuple[Value, ...]
    inputs: tuple[tuple[str, Value], ...]
    place: Snapshot | None


State = Snapshot | None
"""None: not started."""
Steps = dict[State, dict[tuple[Sight, Snapshot], None]]


@dataclass(frozen=True, slots=True)
class Comparison:
    """Both charts as graphs over the same sights; ``samples``: values that represent others."""

    derived: Chart
    base: Chart
    derived_steps: Steps
    base_steps: Steps
    samples: tuple[str, ...]


class _RecordingSearch(Search):
    """A search that records the inputs read in the last step."""

    def __init__(self, derived: Chart, base: Chart) -> None:
        super().__init__(derived, base)
        self.known: dict[str, Value] = {}

    def _reader(self, chooser: Chooser) -> Inputs:
        read, known = super()._reader(chooser), dict[str, Value]()
        self.known = known

        def recorded(name: str) -> Value:
            known[name] = read(name)
            return known[name]

        return recorded

    def sight(self, word: Word, after: Snapshot) -> Sight:
        """Return the base's view of the last step."""
        leaves = any(group.leaves for group in word)
        return Sight(
            word,
            self.seen.outputs(after),
            tuple(sorted((k, v) for k, v in self.known.items() if k in self.missing)),
            self.seen.seen(after) if leaves else None,
        )

    def follow(self, base: State, sight: Sight) -> Iterator[Snapshot]:
        """Yield the states of the base after a sight; inputs not in it have any value."""
        chooser, more = Chooser(), True
        given = dict(sight.inputs)
        while more:
            chooser.start_step()
            read = super()._reader(chooser)

            def known(name: str, read: Inputs = read) -> Value:
                return given[name] if name in given else read(name)

            for found in self._reached(base, sight, known):
                if self.plain.outputs(found) == sight.outputs or not found.running:
                    yield found
            more = chooser.advance()

    def _reached(self, base: State, sight: Sight, read: Inputs) -> Iterator[Snapshot]:
        if base is None:
            yield from self._started(sight.word, read)
            return
        for reached in self._match(base, sight.word, read, 0):
            after = sight.place if reached is None else reached
            assert after is not None  # noqa: S101  (it leaves an abstract state)
            yield state_of(self.base_steps, self.base, after)


def comparison(derived: Chart, base: Chart, options: ExportOptions) -> Comparison:
    """Take all steps of a derived chart, and all steps of its base with these sights.

    Raises `FsmkitError` (``export-too-large``) beyond the limits.
    """
    search = _RecordingSearch(derived, base)
    try:
        taken = _derived_steps(search, options)
        first = [sight for sight, _ in taken[None]]
        others = (s for state, to in taken.items() if state is not None for s, _ in to)
        later = list(dict.fromkeys(others))
        followed: Steps = {}
        ahead: list[State] = [None]
        while ahead:
            state = ahead.pop()
            if state in followed:
                continue
            followed[state] = {}
            for sight in first if state is None else later:
                for reached in search.follow(state, sight):
                    followed[state][sight, reached] = None
                    ahead.append(reached)
            _demand(search, options, len(taken) + len(followed))
    except TooManyChoices as error:
        raise too_many_choices(search.closed) from error
    return Comparison(derived, base, taken, followed, search.samples)


def _derived_steps(search: _RecordingSearch, options: ExportOptions) -> Steps:
    """Return the steps of the derived chart, with all inputs that the base reads on its path.

    States after a step that the base cannot follow are omitted.
    """
    taken: Steps = {}
    known: set[Pair] = set()
    ahead: list[Pair | None] = [None]
    while ahead:
        pair = ahead.pop()
        of = taken.setdefault(None if pair is None else pair.derived, {})
        for move, reached in search.moves(pair):
            of[search.sight(move.word, reached.derived), reached.derived] = None
            taken.setdefault(reached.derived, {})
            if reached.bases and reached not in known:
                known.add(reached)
                ahead.append(reached)
        options.deadline.look()
        _demand(search, options, len(known))
        if options.progress is not None and len(known) % 64 == 0:
            options.progress(len(known), search.taken)
    return taken


def _demand(search: Search, options: ExportOptions, states: int) -> None:
    if states > options.most:
        raise too_large(search.closed, options.most)
