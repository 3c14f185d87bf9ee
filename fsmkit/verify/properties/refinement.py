"""Decide whether a derived chart refines its base: every trace of it is a trace of the base.

The two run side by side, untimed. Each step of the derived chart is read as a word over the events
and calls that the base declares (`verify.properties.refinement_view`). With the same events, inputs
and results of operations, the base must be able to produce the same word, and then has the same
outputs. The search keeps all states that the base can be in after the observed word (subset
construction), so its unobservable steps and its timeouts are free choices.

* An event that the base handles in its state must be handled alike.
* One that it discards there, or does not know, must show nothing; it may change unobservable data.
* An event that the derived chart discards shows nothing: refusal is allowed.
* A free group may show anything, unless the base handles its stimulus. If it leaves the abstract
  state, the base continues in the state of the derived chart after the step.

Source: trace refinement of CSP (A. W. Roscoe, The Theory and Practice of Concurrency, 1997).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from fsmkit.chart.analysis.partition import Partition, Place
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import fail
from fsmkit.language import Value, default_value
from fsmkit.runtime.interpreter.macrostep import step
from fsmkit.runtime.interpreter.snapshot import Macrostep, Occurrence, Snapshot
from fsmkit.system.of_one_chart import system_of
from fsmkit.verify.properties.refinement_view import Shown, Word, Words, shown_in, without
from fsmkit.verify.resources.deadline import Deadline, Stage, TimeUp
from fsmkit.verify.statespace.actions import MOST_RUNS, Action, Chooser, Step, TooManyChoices
from fsmkit.verify.statespace.closed_system import MAX_PENDING_BEFORE_INPUT, ClosedSystem, close
from fsmkit.verify.statespace.local_steps import LocalSteps

PAUSE = 64
"""Pairs between two looks at progress and deadline."""
MOST_UNSEEN = 64
"""Steps in a row that a base is let take unseen before it must show something."""

Inputs = Callable[[str], Value]


class _LazyInputs(tuple[Value, ...]):  # noqa: SLOT001  (a tuple cannot have any)
    """Inputs, each chosen when it is read first."""

    names: tuple[str, ...]
    read: Inputs

    def __getitem__(self, place: object) -> Value:  # type: ignore[override]
        """Return the value of an input."""
        assert isinstance(place, int)  # noqa: S101  (the interpreter reads one at a time)
        return self.read(self.names[place])


def _lazy(chart: Chart, read: Inputs) -> tuple[Value, ...]:
    found = _LazyInputs(default_value(declared.type) for declared in chart.inputs)
    found.names = tuple(declared.name for declared in chart.inputs)
    found.read = read
    return found


class _Different(Exception):  # noqa: N818  (not an error: the base does something else)
    pass


class _Follower:
    """The host of a base: it accepts the same calls, and returns the same results."""

    def __init__(self, expected: Iterator[Shown]) -> None:
        self._expected = expected

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Return the result that the derived chart got. Raises `_Different` for another call."""
        for shown in self._expected:
            if not shown.is_operation:
                continue
            if (shown.name, shown.values) != (operation, arguments):
                break
            return shown.result
        raise _Different


@dataclass(frozen=True, slots=True)
class Move:
    """A step of the derived chart on the path to a violation: its stimulus and its word."""

    done: Macrostep
    word: Word


@dataclass(frozen=True, slots=True)
class Refinement:
    """The result of a comparison.

    ``path``: a shortest path to a step that the base cannot take. ``bases``: the possible states of
    the base before it. ``doubt``: why there may be a violation although none was found.
    """

    derived: Chart
    base: Chart
    pairs: int
    steps: int
    seconds: float
    path: tuple[Move, ...] = ()
    bases: tuple[Snapshot, ...] = ()
    doubt: str = ""

    @property
    def violated(self) -> bool:
        """Whether the derived chart has a trace that the base does not have."""
        return bool(self.path)


@dataclass(frozen=True, slots=True)
class Pair:
    """A state of the derived chart, and the possible states of the base after the same word."""

    derived: Snapshot
    bases: tuple[Snapshot, ...]


class Search:
    """Takes the steps of a derived chart, and follows them in its base."""

    def __init__(self, derived: Chart, base: Chart) -> None:
        """Match the names of both; reject charts that cannot be compared."""
        for chart in (derived, base):
            for invocation in chart.invocations:
                raise fail(
                    "not-explored-yet",
                    f"`{invocation.id}` is invoked by `{chart.name}`: refinement is not decided",
                    invocation.span,
                    help="compare the invoked charts by themselves",
                )
        self.derived, self.base = derived, base
        self.closed, self.steps = _prepare(derived)
        _, self.base_steps = _prepare(base)
        self.seen = Words(derived, base)
        self.plain = Words(base, base)
        self.taken = 0
        partition = Partition([derived], observed=True)
        self.values = {
            i.name: partition.values(i.type, Place(0, "variable", i.name)).values
            for i in derived.inputs
        }
        self.missing = {i.name: default_value(i.type) for i in base.inputs}
        self.samples = tuple(self.closed.samples)

    # --- inputs --------------------------------------------------------------------------------

    def _reader(self, chooser: Chooser) -> Inputs:
        known: dict[str, Value] = {}

        def read(name: str) -> Value:
            if name not in self.values:
                return self.missing[name]
            if name not in known:
                values = self.values[name]
                known[name] = values[chooser.choose(len(values))]
            return known[name]

        return read

    # --- the derived chart ---------------------------------------------------------------------

    def moves(self, pair: Pair | None) -> Iterator[tuple[Move, Pair]]:
        """Yield the steps of a pair, None before the start; the successor pair, or no bases."""
        for what in self._possible(pair):
            chooser = Chooser(self.closed.results[0])
            runs, more = 0, True
            while more:
                runs += 1
                found = self._take(pair, what, chooser)
                if found is not None:
                    self.taken += 1
                    yield found
                more = chooser.advance()
                if runs == MOST_RUNS:
                    raise TooManyChoices

    def _possible(self, pair: Pair | None) -> Iterator[Step]:
        if pair is None:
            yield Step(Action.START)
            return
        view = self.steps.view(0, pair.derived)
        if not view.running:
            return
        yield Step(Action.EVENTLESS)
        if view.waiting:
            yield Step(Action.TAKE)
        if not view.waiting:
            yield from (Step(Action.FIRE, 0, place) for place in range(len(pair.derived.timers)))
            yield from _spontaneous_steps(self.closed)
        if view.waiting <= MAX_PENDING_BEFORE_INPUT:
            for number, possible in enumerate(self.closed.possible):
                if not possible.spontaneous:
                    yield Step(Action.OCCUR, 0, number)

    def _take(self, pair: Pair | None, what: Step, chooser: Chooser) -> tuple[Move, Pair] | None:
        before = self.steps.initial(0) if pair is None else pair.derived
        chooser.start_step()
        read = self._reader(chooser)
        done = self.steps.perform(
            0, replace(before, inputs=_lazy(self.derived, read)), what, chooser
        )
        if done is None or (what.action is Action.EVENTLESS and not done.microsteps):
            return None
        after = state_of(self.steps, self.derived, done.after)
        word = self.seen.word(done)
        bases = self._started(word, read) if pair is None else self._follow(pair, word, after, read)
        wanted = self.seen.outputs(after)
        bases = tuple(b for b in bases if self.plain.outputs(b) == wanted or not b.running)
        return Move(done, word), Pair(after, bases)

    # --- the base ------------------------------------------------------------------------------

    def _started(self, word: Word, read: Inputs) -> tuple[Snapshot, ...]:
        """Start the base."""
        before = replace(self.base_steps.initial(0), inputs=_lazy(self.base, read))
        shown = [s for group in word for s in group.shown]
        try:
            done = self.base_steps.perform(
                0, before, Step(Action.START), _ReplayChooser(iter(shown))
            )
        except _Different:
            return ()
        if done is None or shown_in(self.plain.word(done)) != tuple(shown):
            return ()
        return (state_of(self.base_steps, self.base, done.after),)

    def _follow(
        self, pair: Pair, word: Word, after: Snapshot, read: Inputs
    ) -> tuple[Snapshot, ...]:
        found: dict[Snapshot, None] = {}
        for base in pair.bases:
            for reached in self._match(base, word, read, 0):
                resynced = self.seen.seen(after) if reached is None else reached
                found[state_of(self.base_steps, self.base, resynced)] = None
        return tuple(found)

    def _match(
        self, base: Snapshot, word: Word, read: Inputs, unseen: int
    ) -> Iterator[Snapshot | None]:
        """Yield the states of the base after a word; None: the state of the derived chart."""
        if not word:
            yield base
            return
        first, rest = word[0], word[1:]
        if first.stimulus is not None:
            done = self._answer(base, first.stimulus.event, word, read)
            if done is not None:
                yield from self._on(done, word, read)
                return
            first = replace(first, stimulus=None)
        if first.free:
            if first.leaves:
                yield None
            else:
                yield from self._match(base, rest, read, unseen)
        elif not first.shown:
            yield from self._match(base, rest, read, unseen)
        elif unseen < MOST_UNSEEN:
            yield from self._spontaneous(base, (first, *rest), read, unseen)

    def _answer(
        self, base: Snapshot, event: Occurrence, word: Word, read: Inputs
    ) -> Macrostep | None:
        """Return the reaction of the base to an event; None if it has none.

        If its word is not the observed one, the reaction has no microsteps.
        """
        before = replace(base, inputs=_lazy(self.base, read))
        try:
            done = step(self.base, before, event, _Follower(iter(shown_in(word))))
        except _Different:
            return Macrostep(base, event, (), base, 0)
        answered = bool(done.microsteps) and bool(done.microsteps[0].transitions)
        return done if answered else None

    def _on(self, done: Macrostep, word: Word, read: Inputs) -> Iterator[Snapshot | None]:
        """Continue after a step of the base, if the word starts with its effects."""
        rest = without(word, self.plain.word(done)) if done.microsteps else None
        if rest is not None:
            after = state_of(self.base_steps, self.base, done.after)
            yield from self._match(after, rest, read, 0)

    def _spontaneous(
        self, base: Snapshot, word: Word, read: Inputs, unseen: int
    ) -> Iterator[Snapshot | None]:
        steps = [Step(Action.EVENTLESS)]
        steps += [Step(Action.TAKE)] if base.queue or base.deferred else []
        steps += [Step(Action.FIRE, 0, place) for place in range(len(base.timers))]
        steps += _spontaneous_steps(self.base_steps.closed)
        for what in steps:
            before = replace(base, inputs=_lazy(self.base, read))
            try:
                following = _ReplayChooser(iter(shown_in(word)))
                done = self.base_steps.perform(0, before, what, following)
            except _Different:
                continue
            if done is None or not done.microsteps:
                continue
            if self.plain.word(done):
                yield from self._on(done, word, read)
            else:
                after = state_of(self.base_steps, self.base, done.after)
                if after != base:
                    yield from self._match(after, word, read, unseen + 1)


class _ReplayChooser(_Follower, Chooser):
    """A follower in place of the explorer's source of choices."""

    def __init__(self, expected: Iterator[Shown]) -> None:
        Chooser.__init__(self)
        _Follower.__init__(self, expected)


def _spontaneous_steps(closed: ClosedSystem) -> list[Step]:
    """Return the steps that take a ``sometimes`` transition of a chart."""
    possible = enumerate(closed.possible)
    return [Step(Action.OCCUR, 0, number) for number, each in possible if each.spontaneous]


def _prepare(chart: Chart) -> tuple[ClosedSystem, LocalSteps]:
    """Return a chart alone, untimed, whose inputs are chosen when they are read."""
    closed = close(system_of(chart), untimed=True, keeps_dead=True, observed=True)
    alone = replace(closed.system, is_open=False, properties=())
    ready = replace(closed, system=alone, free_inputs=(), kept_inputs=frozenset())
    return ready, LocalSteps(ready)


def state_of(steps: LocalSteps, chart: Chart, snapshot: Snapshot) -> Snapshot:
    """Return the part of a snapshot that is state of a chart."""
    inputs = tuple(declared.init.value for declared in chart.inputs)
    return replace(steps.settled(0, replace(snapshot, inputs=inputs)), inputs=inputs)


def refines(
    derived: Chart,
    base: Chart,
    *,
    seconds: float = 0,
    progress: Callable[[int, int, int], None] | None = None,
    deadline: Deadline | None = None,
) -> Refinement:
    """Decide whether a chart refines another.

    The search stops at the ``deadline``; without one, after ``seconds`` (0: never).
    """
    began = time.monotonic()
    deadline = deadline or Deadline(seconds)
    origins: dict[Pair, tuple[Pair | None, Move | None]] = {}
    at, doubt = 0, ""

    def result(path: Sequence[Move] = (), bases: tuple[Snapshot, ...] = ()) -> Refinement:
        spent = time.monotonic() - began
        return Refinement(
            derived, base, len(origins), search.taken, spent, tuple(path), bases, doubt
        )

    def compare() -> Iterator[Refinement | bool]:
        """Yield a violation; True where there is more to compare; False when that is all."""
        nonlocal at
        waiting: list[Pair | None] = [None]
        while at < len(waiting):
            pair = waiting[at]
            at += 1
            for move, reached in search.moves(pair):
                if not reached.bases:
                    bases = () if pair is None else pair.bases
                    yield result((*_path_to(origins, pair), move), bases)
                if reached not in origins:
                    origins[reached] = pair, move
                    waiting.append(reached)
            if at % PAUSE == 0:
                yield True
        yield False

    try:
        search = deadline.cut_off(Stage.GENERATING, lambda: Search(derived, base))
    except TimeUp:
        return Refinement(derived, base, 0, 0, 0.0, doubt=deadline.why())
    found = compare()
    try:
        while told := deadline.cut_off(Stage.EXPLORING, lambda: next(found)):
            if isinstance(told, Refinement):
                return told
            if progress is not None:
                progress(len(origins), search.taken, 0)
    except TimeUp:
        doubt = f"{deadline.why()} after {at} pairs"
    except TooManyChoices:
        doubt = f"too many combinations of choices in one step, after {at} pairs"
    except KeyboardInterrupt:
        doubt = f"the comparison was interrupted after {at} pairs"
    if not doubt and search.samples:
        doubt = f"samples only of {', '.join(search.samples)}"
    return result()


def _path_to(origins: dict[Pair, tuple[Pair | None, Move | None]], pair: Pair | None) -> list[Move]:
    found: list[Move] = []
    while pair is not None:
        pair, move = origins[pair]
        if move is not None:
            found.append(move)
    return found[::-1]
