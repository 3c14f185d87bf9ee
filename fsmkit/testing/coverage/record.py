"""Record the coverage of charts as counts, in JSON files that can be added."""

from __future__ import annotations

import os
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import msgspec

from fsmkit.chart.analysis.decisions import Outcomes, Shape, shape_of
from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.format import format_trigger
from fsmkit.diagnostics import Span, fail
from fsmkit.document.document import Origin
from fsmkit.emit import plain
from fsmkit.language import Environment, Expr, Value, format_expression
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.runtime.interpreter.snapshot import Entered, InvokedMacrostep, Macrostep, Taken
from fsmkit.testing.coverage.decisions import is_whole, numbers, observe, stored_outcomes

FOLDER = ".fsmkit-coverage"
FIRST = "run the tests with `fsmkit test --cov` or `pytest --fsmkit-cov` first"


@dataclass(frozen=True, slots=True)
class Place:
    """The location of an item: a file and a line, counted from 1."""

    file: str
    line: int


@dataclass(frozen=True, slots=True)
class Item:
    """A state or a transition as text, and how often it was entered or taken."""

    number: int
    text: str
    at: Place
    inherited: bool
    count: int


@dataclass(frozen=True, slots=True)
class Decision:
    """A guard: its conditions in words, and the outcomes that it had with how often."""

    transition: int
    text: str
    at: Place
    shape: Shape
    conditions: tuple[str, ...]
    true: int
    false: int
    seen: tuple[tuple[Outcomes, int], ...]


@dataclass(frozen=True, slots=True)
class ChartCoverage:
    """All items of a chart with their counts."""

    name: str
    file: str
    fingerprint: str
    states: tuple[Item, ...]
    transitions: tuple[Item, ...]
    decisions: tuple[Decision, ...]


@dataclass(slots=True)
class Counts:
    """The counts of a chart: by state and transition, by guard and its outcomes."""

    chart: Chart
    states: Counter[int] = field(default_factory=Counter)
    transitions: Counter[int] = field(default_factory=Counter)
    outcomes: dict[int, Counter[Outcomes]] = field(default_factory=dict)
    decided: Counter[tuple[int, bool]] = field(default_factory=Counter)
    shapes: dict[int, tuple[Shape, tuple[Expr, ...]]] = field(default_factory=dict)


class Recorder:
    """Counts the steps of machines: `guard` watches guards, `observer` observes a session."""

    def __init__(self) -> None:
        """Start without counts."""
        self._counts: dict[str, Counts] = {}
        self._by_chart: dict[int, Counts] = {}
        self._charts: list[Chart] = []

    def add(self, chart: Chart) -> Counts:
        """Take notice of a chart, of which nothing needs to be reached."""
        counts = self._by_chart.get(id(chart))
        if counts is None:
            counts = self._counts.setdefault(fingerprint(chart), Counts(chart))
            self._by_chart[id(chart)] = counts
            self._charts.append(chart)  # keeps its id unique
            for invocation in chart.invocations:
                self.add(invocation.chart)
        return counts

    def guard(self, chart: Chart, transition: Transition, environment: Environment) -> Value:
        """Evaluate a guard, and count the outcomes of its conditions."""
        counts = self.add(chart)
        number, guard = transition.index, transition.guard
        assert guard is not None  # noqa: S101  (checked by the caller)
        if number not in counts.shapes:
            counts.shapes[number] = shape_of(guard)
        value, outcomes = observe(*counts.shapes[number], environment)
        counts.outcomes.setdefault(number, Counter()).update(stored_outcomes(outcomes))
        counts.decided[number, value] += 1
        return value

    def observer(self, *charts: Chart) -> Callable[[int, tuple[Macrostep, ...]], None]:
        """Return an observer of macrosteps of machines, by the number of their chart here."""

        def observe(machine: int, done: tuple[Macrostep, ...]) -> None:
            for macrostep in done:
                self.done(charts[machine], macrostep)

        return observe

    def done(self, chart: Chart, macrostep: Macrostep) -> None:
        """Count the states entered and transitions taken, including invoked machines."""
        counts = self.add(chart)
        for microstep in macrostep.microsteps:
            for effect in microstep.effects:
                match effect:
                    case Entered(state):
                        counts.states[state] += 1
                    case Taken(transition):
                        counts.transitions[transition] += 1
                    case InvokedMacrostep(slot, within):
                        self.done(chart.invocations[slot].chart, within)
                    case _:
                        pass

    def coverage(self) -> tuple[ChartCoverage, ...]:
        """Return the present coverage."""
        return tuple(coverage_of(counts) for counts in self._counts.values())


def coverage_of(counts: Counts) -> ChartCoverage:
    """Return all items of a chart with the given counts."""
    chart = counts.chart
    file = chart.sources[0].name if chart.sources else ""
    return ChartCoverage(
        chart.name,
        file,
        fingerprint(chart),
        tuple(
            Item(s.index, s.id, place_of(s.span), _inherited(s.origin), counts.states[s.index])
            for s in chart.states[1:]
            if not s.is_history
        ),
        tuple(
            Item(
                t.index, transition_text(chart, t), place_of(t.span), _inherited(t.origin),
                counts.transitions[t.index],
            )
            for t in _transitions(chart)
        ),
        tuple(
            _decision(counts, transition)
            for transition in _transitions(chart)
            if transition.guard is not None
        ),
    )  # fmt: skip


def _decision(counts: Counts, transition: Transition) -> Decision:
    chart, number, guard = counts.chart, transition.index, transition.guard
    assert guard is not None  # noqa: S101  (checked by the caller)
    shape, conditions = shape_of(guard)
    tick = chart.capacities.tick
    return Decision(
        number,
        format_expression(guard, tick),
        place_of(transition.span),
        shape,
        tuple(format_expression(condition, tick) for condition in conditions),
        counts.decided[number, True],
        counts.decided[number, False],
        _sorted(counts.outcomes.get(number, {})),
    )


def _transitions(chart: Chart) -> list[Transition]:
    """Return the selectable transitions; initial ones are covered by their states."""
    return [chart.transitions[t] for state in chart.states for t in state.transitions]


def transition_text(chart: Chart, transition: Transition) -> str:
    """Return a transition in words: its source, its trigger and its targets."""
    source = chart.states[transition.source].id or chart.name
    targets = ", ".join(chart.states[t].id for t in transition.targets)
    goes = f" -> {targets}" if targets else ""
    return " ".join(f"{source} {format_trigger(transition, chart)}{goes}".split())


def place_of(span: Span) -> Place:
    """Return the file and line of a place."""
    return Place(span.source.name, span.source.position(span.start)[0])


def _inherited(origin: Origin) -> bool:
    return origin is Origin.INHERITED


# --- adding up --------------------------------------------------------------------------------


def add_coverage(runs: Iterable[Iterable[ChartCoverage]]) -> tuple[ChartCoverage, ...]:
    """Add the coverage of several runs; raises `FsmkitError` if a file has changed its chart.

    One run may have several charts with one name and file: invoked ones that are written inline.
    """
    found: dict[str, ChartCoverage] = {}
    before: dict[tuple[str, str], list[ChartCoverage]] = {}
    for run in map(tuple, runs):
        for part in run:
            known = found.get(part.fingerprint)
            others = before.get((part.file, part.name), ())
            if known is None and others and not any(_is_instance(part, o) for o in others):
                raise fail(
                    "other-chart",
                    f"the chart `{part.name}` of `{part.file}` has changed between two runs",
                    help="erase the counts with `fsmkit coverage --erase`, and run all tests again",
                )
            found[part.fingerprint] = part if known is None else _sum(known, part)
        for part in run:
            before.setdefault((part.file, part.name), []).append(part)
    return tuple(found.values())


def _is_instance(one: ChartCoverage, other: ChartCoverage) -> bool:
    """Whether two are the same text, read with other constants (`with` of a system)."""
    return [(s.text, s.at) for s in one.states] == [(s.text, s.at) for s in other.states] and [
        t.at for t in one.transitions
    ] == [t.at for t in other.transitions]


def _sum(one: ChartCoverage, other: ChartCoverage) -> ChartCoverage:
    return replace(
        one,
        states=_sum_items(one.states, other.states),
        transitions=_sum_items(one.transitions, other.transitions),
        decisions=tuple(
            replace(a, true=a.true + b.true, false=a.false + b.false, seen=_sum_seen(a, b))
            for a, b in zip(one.decisions, other.decisions, strict=True)
        ),
    )


def _sum_items(one: Sequence[Item], other: Sequence[Item]) -> tuple[Item, ...]:
    return tuple(replace(a, count=a.count + b.count) for a, b in zip(one, other, strict=True))


def _sum_seen(*decisions: Decision) -> tuple[tuple[Outcomes, int], ...]:
    total: Counter[Outcomes] = Counter()
    for decision in decisions:
        for outcomes, count in decision.seen:
            total[outcomes] += count
    return _sorted(total)


def _sorted(seen: Mapping[Outcomes, int]) -> tuple[tuple[Outcomes, int], ...]:
    return tuple(sorted(seen.items(), key=lambda pair: [str(value) for value in pair[0]]))


# --- files --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _File:
    format: Literal["fsmkit coverage 1"]
    charts: tuple[ChartCoverage, ...]


def save(coverage: Iterable[ChartCoverage], folder: Path) -> Path:
    """Write counts to a file of their own in a folder; return its path.

    `FsmkitError` (``unwritable-output``) where it cannot be written.
    """
    content = msgspec.json.encode(_File("fsmkit coverage 1", tuple(coverage)), enc_hook=plain)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix="run-", suffix=".json", dir=folder)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
    except OSError as error:
        raise fail(
            "unwritable-output",
            f"the counts cannot be written to `{folder}`: {error.strerror}",
            help="name another folder",
        ) from error
    return Path(name)


def erase(folder: Path) -> None:
    """Remove the counts of a folder; `FsmkitError` (``unwritable-output``) where that fails."""
    try:
        for path in _folder(folder).glob("run-*.json"):
            path.unlink(missing_ok=True)
    except OSError as error:
        raise fail(
            "unwritable-output", f"the counts in `{folder}` cannot be removed: {error.strerror}"
        ) from error


def load(path: Path) -> tuple[ChartCoverage, ...]:
    """Return the counts of a file, or of all files of a folder, added up.

    `FsmkitError` (``unreadable-file``, ``broken-coverage``, ``other-chart``) where that fails.
    """
    paths = sorted(_folder(path).glob("run-*.json")) if path.is_dir() else [path]
    if not paths:
        raise fail("unreadable-file", f"`{path}` holds no counts", help=FIRST)
    return add_coverage(_load(one) for one in paths)


def _folder(path: Path) -> Path:
    """Return the folder of counts for a folder that may be the one in which tests ran."""
    inner = path / FOLDER
    return inner if inner.is_dir() else path


def _load(path: Path) -> tuple[ChartCoverage, ...]:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise fail(
            "unreadable-file", f"`{path}` cannot be read: {error.strerror}", help=FIRST
        ) from error
    try:
        found = msgspec.json.decode(content, type=_File).charts
        if not all(_is_sound(decision) for chart in found for decision in chart.decisions):
            raise ValueError("the outcomes of a decision do not fit its conditions")
    except (ValueError, RecursionError) as error:
        raise fail(
            "broken-coverage", f"`{path}` holds no counts of coverage: {error}",
            help="remove the file, and run the tests again",
        ) from error  # fmt: skip
    return found


def _is_sound(decision: Decision) -> bool:
    """Whether the parts of a decision, which a file may hold in any form, fit each other."""
    count = len(decision.conditions)
    return (
        list(numbers(decision.shape)) == list(range(count))
        and is_whole(decision.shape)
        and all(len(outcomes) == count for outcomes, _ in decision.seen)
    )
