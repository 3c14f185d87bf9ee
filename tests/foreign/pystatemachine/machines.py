"""Random machines of python-statemachine, run by the library and as charts."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from statemachine import HistoryState, State, StateChart

from devtools.random_charts.choices import Choices, SeededChoices
from fsmkit import Session
from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, FsmkitError, Severity
from fsmkit.foreign.pystatemachine.reader import import_object

EVENTS = ("a", "b", "c")
CONDITIONS = ("c0", "c1", "c2", "c0 and !c1", "c1 or not c2")


VALIDATORS = ("v0", "v1")


class RejectedError(Exception):
    """A validator rejects an event."""


@dataclass
class Outcome:
    """The result of a comparison."""

    listing: str
    rejected: str | None = None
    difference: str | None = None
    events: int = 0


class Model:
    """Records callbacks and answers conditions, whose results change by callbacks only.

    The library tries eventless transitions before each event, too, which is then of no effect.
    """

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.count = 0
        """All callbacks so far."""

    def note(self, name: str) -> None:
        """Record a callback."""
        self.lines.append(name)
        self.count += 1

    def answer(self, name: str) -> bool:
        """Return the result of a condition."""
        found = 7
        for char in f"{name} {self.count}":
            found = (found * 31 + ord(char)) % 65521
        return found % 3 != 0


class _Author:
    def __init__(self, choices: Choices) -> None:
        self.choices = choices
        self.states: list[State] = []
        self.chain: list[tuple[State, State]] = []
        """Sources and targets of transitions that exist in any case."""
        self.regions: dict[str, list[State]] = {}
        """Top-level regions whose transitions stay inside."""
        self.quiet: set[int] = set()
        """States whose transitions call nothing."""
        self.count = 0
        self.callbacks: set[str] = set()
        self.depth = choices.pick((0, 0, 1, 2))
        self.share = choices.pick((20, 40, 70))

    def machine(self) -> type[StateChart[Any]]:
        """Return a class of machines."""
        is_parallel = self.choices.chance(20)
        top = [self._parallel()] if is_parallel else self._level(self.depth)
        namespace: dict[str, Any] = {state.name: state for state in top}
        steps: dict[str, list[Any]] = {event: [] for event in EVENTS}
        for source, target in self.chain:
            step = self._between(source, target, eventless=False)
            steps[self.choices.pick(EVENTS)].append(step)
        for found in steps.values():
            fewest = 0 if found else 1
            found += [self._transition() for _ in range(self.choices.integer(fewest, 4))]
        for event, found in steps.items():
            namespace[event] = found[0]
            for step in found[1:]:
                namespace[event] = namespace[event] | step
        if self.choices.chance(30) and not self.quiet:
            self._transition(eventless=True)
        for name in ("on_transition", "before_transition", "after_transition", "before_a"):
            if self.choices.chance(15) and not self.quiet:
                self.callbacks.add(name)
        for name in self.callbacks:
            namespace[name] = _callback(name)
        for name in ("c0", "c1", "c2"):
            namespace[name] = _condition(name)
        for name in VALIDATORS:
            namespace[name] = _validator(name)
        flags = ("enable_self_transition_entries", "atomic_configuration_update")
        for flag in flags:
            namespace[flag] = self.choices.chance(70)
        namespace["catch_errors_as_events"] = False
        kind: Any = type(StateChart)
        created: type[StateChart[Any]] = kind("Machine", (StateChart,), namespace)
        return created

    def _parallel(self) -> State:
        """Return a top-level parallel state with regions that have final states."""
        regions = []
        share = self.share
        is_quiet = self.choices.chance(80)
        for number in range(2):
            before = len(self.states)
            self.share = 0 if is_quiet and number else share
            inner = self._level(self.choices.pick((0, 0, 1)))
            end = State(f"end{number}", final=True)
            end._set_id(f"end{number}")
            region = State(f"r{number}", states=[*inner, end])
            region._set_id(f"r{number}")
            self.states += [end, region]
            self.chain += pairwise([*inner, end])
            if is_quiet:
                self.regions[region.name] = [*inner, end]
                self.quiet.update(id(one) for one in self.states[before:] if number)
            regions.append(region)
        self.share = share
        found = State("all", states=regions, parallel=True, initial=True)
        found._set_id("all")
        self.states.append(found)
        return found

    def _level(self, depth: int) -> list[State]:
        found: list[State] = []
        for number in range(self.choices.integer(2, 3)):
            name = f"s{self.count}"
            self.count += 1
            options: dict[str, Any] = {"initial": number == 0}
            for key in ("enter", "exit"):
                if self.choices.chance(self.share):
                    options[key] = self._named(f"{key}_{name}")
            if depth and self.choices.chance(50):
                inner = self._level(depth - 1)
                options["states"] = inner
                options["parallel"] = self.choices.chance(30)
                if not options["parallel"] and self.choices.chance(40):
                    history = HistoryState(name=f"h{self.count}", type=self._history())
                    history._set_id(f"h{self.count}")
                    options["history"] = [history]
                    history.to(inner[0])
            elif number and self.choices.chance(20):
                options["final"] = True
            state = State(name, **options)
            state._set_id(name)
            self.states.append(state)
            found.append(state)
        return found

    def _history(self) -> str:
        return self.choices.pick(("shallow", "deep"))

    def _transition(self, *, eventless: bool = False) -> Any:
        sources = [state for state in self.states if not state.final and state.name != "all"]
        inside = [state for region in self.regions.values() for state in region]
        source = self.choices.pick([one for one in sources if one in inside] or sources)
        histories = [h for state in self.states for h in state.history]
        target = self.choices.pick([*self.states, *histories])
        if self.regions and not eventless:
            target = self.choices.pick(next(r for r in self.regions.values() if source in r))
        if eventless:
            target = self.states[-1]
            outside = [s for s in sources if s is not target and not target.is_descendant(s)]
            source = self.choices.pick(outside or sources[:1])
        return self._between(source, target, eventless=eventless)

    def _between(self, source: State, target: State, *, eventless: bool) -> Any:
        options: dict[str, Any] = {}
        if eventless:
            options["cond"] = self.choices.pick(CONDITIONS)
        elif self.choices.chance(40):
            options[self.choices.pick(("cond", "unless"))] = self.choices.pick(CONDITIONS[:3])
            if self.choices.chance(40):
                options["cond"] = self.choices.pick(CONDITIONS)
        if self.choices.chance(8) and not eventless:
            options["validators"] = self.choices.pick(VALIDATORS)
        for key in () if id(source) in self.quiet else ("before", "on", "after"):
            if self.choices.chance(self.share // 2 if key == "on" else 10):
                options[key] = self._named(f"{key}_{source.name}")
        if self.choices.chance(10) and not eventless:
            options["internal"] = target is source or target.is_descendant(source)
        return source.to(target, **options)

    def _named(self, name: str) -> str:
        self.callbacks.add(name)
        return name


def _callback(name: str) -> Any:
    def call(self: Any) -> None:
        self.model.note(name)

    call.__name__ = name
    return call


def _condition(name: str) -> Any:
    def call(self: Any) -> bool:
        found: bool = self.model.answer(name)
        return found

    call.__name__ = name
    return call


def _validator(name: str) -> Any:
    def call(self: Any) -> None:
        if not self.model.answer(name):
            raise RejectedError

    call.__name__ = name
    return call


def compare(choices: Choices, length: int) -> Outcome:
    """Run a random machine both ways."""
    try:
        kind = _Author(choices).machine()
    except Exception as error:  # noqa: BLE001  (the library rejects what it cannot run)
        return Outcome("", rejected=f"the library: {error}"[:60])
    findings = Findings()
    found = import_object(kind, "machine", findings)
    errors = [one for one in findings if one.severity is Severity.ERROR]
    if found is None:
        return Outcome("", rejected=errors[0].message)
    listing = found.document.source.text
    try:
        chart = elaborate((found.document,), findings)
        findings.stop_on_errors()
    except FsmkitError:
        chart = None
    if chart is None:
        errors = [one for one in findings if one.severity is Severity.ERROR]
        return Outcome(listing, rejected=errors[0].message)
    script = [choices.pick(EVENTS) for _ in range(length)]
    try:
        library = list(_run_library(kind, script))
    except RecursionError:
        return Outcome(listing, rejected="the library never comes to rest")
    own = list(_run_chart(chart, script))
    if own[-1] == ["fault"]:
        return Outcome(listing, rejected="the chart never comes to rest")
    for number, (one, other) in enumerate(zip(library, own, strict=False)):
        if one != other:
            event = script[number - 1] if number else "start"
            return Outcome(listing, difference=f"{number} {event}: library {one}, chart {other}")
    return Outcome(listing, events=len(own))


def _run_library(kind: type[StateChart[Any]], script: list[str]) -> Iterator[list[str]]:
    model = Model()
    machine = kind(model)
    yield [*model.lines, _active(machine)]
    for event in script:
        model.lines = []
        with suppress(RejectedError):
            machine.send(event)
        yield [*model.lines, _active(machine)]


def _active(machine: Any) -> str:
    if not machine._engine.running:
        return "ended"
    return " ".join(sorted(state.id for state in machine.configuration if state.is_atomic))


def _run_chart(chart: Chart, script: list[str]) -> Iterator[list[str]]:
    model = Model()
    operations = {
        one.name: _bound(model, one.name, is_condition=one.result is not None)
        for one in chart.operations
    }
    session = Session(chart, operations, start=False)
    session.start()
    session.run()
    yield [*model.lines, " ".join(sorted(session.active)) if session.is_running else "ended"]
    known = set(chart.event_index)
    for event in script:
        model.lines = []
        if event in known and session.is_running:
            session.post(event)
            session.run()
        if session.fault is not None:
            yield ["fault"]
            return
        yield [*model.lines, " ".join(sorted(session.active)) if session.is_running else "ended"]


def _bound(model: Model, name: str, *, is_condition: bool) -> Any:
    if is_condition:
        return lambda: model.answer(name)
    return lambda: model.note(name)


def random_outcome(seed: int, number: int, length: int) -> Outcome:
    """Return one comparison; the same for the same seed and number."""
    return compare(SeededChoices(f"python-statemachine {seed}:{number}"), length)
