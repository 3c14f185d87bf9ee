"""Derive verdicts and findings from an exploration."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import assert_never

from fsmkit.chart.analysis.delays import delays_of
from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.walk import charts_within
from fsmkit.diagnostics import Findings, Severity, Span
from fsmkit.document.document import Trigger
from fsmkit.language.units import duration_text
from fsmkit.language.values import show
from fsmkit.runtime.endless_steps import cycle_text, traced_transitions
from fsmkit.system.freezes import freezer_text
from fsmkit.system.properties.kinds.monitor import error_states
from fsmkit.system.properties.property import AtStates, Builtin, Kind, OverGraph, Property
from fsmkit.system.schedule import schedule_text
from fsmkit.system.system import System
from fsmkit.verify.report.counterexample import Counterexample, TraceStep
from fsmkit.verify.report.figures import count_text
from fsmkit.verify.report.spread import report_spread
from fsmkit.verify.report.vacuity import vacuous
from fsmkit.verify.statespace.actions import FAULT, FULL, UNHANDLED
from fsmkit.verify.statespace.closed_system import UNLIMITED, ClosedSystem
from fsmkit.verify.statespace.exploration import (
    DEADLOCK,
    UNFINISHED,
    Answer,
    End,
    Exploration,
    Mark,
)
from fsmkit.verify.statespace.storage import NEEDS_EXACT, omission_probability

Show = Callable[[tuple[int, ...], tuple[int, ...]], Counterexample | None]
"""Makes a counterexample of a path and a cycle; None where no time is left for it."""


class Verdict(Enum):
    """The verdict on a property."""

    HOLDS = "holds"
    VIOLATED = "violated"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Result:
    """A property, requested or built in, and its verdict.

    ``trace``: a counterexample; for a reachable state, a path to it.
    """

    name: str
    kind: Kind | None
    text: str
    verdict: Verdict
    reason: str = ""
    trace: Counterexample | None = None
    span: Span | None = None

    @property
    def claim(self) -> str:
        """Return what is proved or refuted, such as ``never: gate.In(stuck)``."""
        if self.kind is None or isinstance(self.kind.decided, Builtin):
            return self.text
        return f"{self.kind.key}: {self.text}"


@dataclass(frozen=True)
class Report:
    """The result of a check."""

    closed: ClosedSystem
    exploration: Exploration
    results: tuple[Result, ...]
    findings: Findings
    assumptions: tuple[str, ...]
    spent: Mapping[str, float] = field(default_factory=dict)
    """Wall seconds of each stage: reading, generating, compiling, exploring, replaying."""
    interrupted: bool = False
    """The user ended it, at any of its stages."""

    @property
    def verdict(self) -> Verdict:
        """The worst of all verdicts; a finding that is an error counts as violated."""
        verdicts = {result.verdict for result in self.results}
        errors = any(f.severity is Severity.ERROR for f in self.findings)
        if Verdict.VIOLATED in verdicts or errors:
            return Verdict.VIOLATED
        ends = (End.COMPLETE, End.DECIDED)
        if Verdict.UNDECIDED in verdicts or self.exploration.end not in ends:
            return Verdict.UNDECIDED
        return Verdict.HOLDS


ENDS = {
    End.DECIDED: "the exploration ended when all requested properties were decided",
    End.MEMORY: "the memory limit was reached",
    End.TIME: "the time limit was reached",
    End.INTERRUPTED: "the exploration was interrupted",
    End.FAILED: "the exploration was given up",
}


SAMPLED = 'narrow its range; or name values in a system: `may: ["pump.set(power in {0, 50})"]`'
MEMORY_RAN_OUT = "memory ran out"
MANY_COMBINATIONS = (
    "the symbolic search evaluates at most 1,000,000 combinations of a property's values; try "
    "`--search explicit`, or properties that each read fewer machines"
)
BY_LOSS = "the path loses an event, because external events do not wait"
NO_WAY = (
    "it is not shown: memory or time for its path ran out; allow more with `--memory` or "
    "`--timeout`"
)
NO_RUN = f"the diagram has a run that violates it, but {NO_WAY}"


def conclude(
    closed: ClosedSystem, found: Exploration, show: Show, names: frozenset[str], findings: Findings
) -> Report:
    """Return the verdicts on the properties in ``names`` (empty: all)."""
    verdicts = _Verdicts(closed, found, show, findings)
    results = list(verdicts.builtin_results())
    if names:  # of properties that were not requested, report violations only
        results = [result for result in results if result.verdict is Verdict.VIOLATED]
    for index, property_ in enumerate(closed.system.properties):
        if not names or property_.name in names:
            results.append(verdicts.property(index, property_))
            verdicts.report_vacuous(index, property_, results[-1])
    results = [_without_lost_events(closed, result) for result in results]
    verdicts.add_findings()
    report = Report(closed, found, tuple(results), findings, tuple(assumptions(closed)))
    for result in results:
        add_finding(result, findings)
    return report


def add_finding(result: Result, findings: Findings) -> None:
    """Add the findings of a verdict."""
    if result.trace is not None and result.trace.differs:
        message = f"the path for `{result.name}` runs differently: {result.trace.differs}"
        findings.add("replay-differs", message, None)
    if result.verdict is Verdict.UNDECIDED:
        message = f"`{result.name}` is undecided: {result.reason}"
        findings.add("undecided", message, result.span)
    elif result.verdict is Verdict.VIOLATED and result.kind is not None:
        message = f"`{result.name}` {result.kind.refuted}: {result.claim}"
        findings.add("violated-property", message, result.span)


def _with_reason(result: Result) -> Result:
    """Return the verdict on a mark that was seen; if no path is shown, with the reason."""
    return result if result.trace is not None else replace(result, reason=NO_WAY)


def _without_lost_events(closed: ClosedSystem, result: Result) -> Result:
    """Return the verdict, or an undecided one if the run loses an event.

    A shortest run may lose an event although a longer one does not, so it decides nothing.
    """
    if not closed.can_lose_events or result.trace is None or not result.trace.loses:
        return result
    return replace(result, verdict=Verdict.UNDECIDED, reason=BY_LOSS)


@dataclass(frozen=True)
class _Verdicts:
    """The verdicts on an explored system."""

    closed: ClosedSystem
    exploration: Exploration
    show: Show
    findings: Findings

    @property
    def _uncertainty(self) -> str:
        """Why an unseen mark may still exist; empty if it does not."""
        return "; ".join(doubt for doubt in (self._unexplored, self._risk) if doubt)

    @property
    def _uncertainty_of_graph(self) -> str:
        """Why properties of the whole graph are unknown; empty if they are known."""
        return self._unexplored or (NEEDS_EXACT if self.exploration.table is not None else "")

    @property
    def _risk(self) -> str:
        """The states that a complete search may have missed."""
        table, found = self.exploration.table, self.exploration
        if table is None or found.end is not End.COMPLETE:
            return ""
        missed = omission_probability(table.match_probability, found.depth)
        return (
            f"nothing found in {found.states:,} states, but {table.storage.value} storage misses "
            f"any one state with probability at most {missed:.2g}"
        )

    @property
    def _unexplored(self) -> str:
        """Why the search is incomplete; empty if it is complete."""
        if self.exploration.end is not End.COMPLETE:
            why = f" ({self.exploration.why})" if self.exploration.why else ""
            states = count_text(self.exploration.states)
            return f"{ENDS[self.exploration.end]}{why} after {states} states"
        if self.closed.samples:
            return f"samples only of {', '.join(self.closed.samples)}"
        return ""

    def _absent(
        self, name: str, kind: Kind | None, text: str, span: Span | None, doubt: str
    ) -> Result:
        """Return the verdict on a fault that was not seen."""
        verdict = Verdict.UNDECIDED if doubt else Verdict.HOLDS
        return Result(name, kind, text, verdict, doubt, span=span)

    def _seen(self, mark: Mark) -> Counterexample | None:
        trace = self._trace(mark.path)
        return trace and replace(trace, is_longer=mark.is_longer)

    def _trace(self, path: tuple[int, ...], cycle: tuple[int, ...] = ()) -> Counterexample | None:
        """Return the counterexample of a path; None if memory or time for it ran out."""
        return self.show(path, cycle) if path else None

    # --- requested properties --------------------------------------------------------------------

    def property(self, index: int, property_: Property) -> Result:
        """Return the verdict on a property of the system file."""
        match property_.kind.decided:
            case Builtin.DEADLOCK:
                return self._deadlock(property_.name, property_.kind, property_.span)
            case Builtin.LIVELOCK:
                return self._livelock(property_.name, property_.kind, property_.span)
            case OverGraph() as decided:
                return self._temporal(index, property_, decided)
            case AtStates():
                return self._at_states(index, property_)
            case _ as never:
                assert_never(never)

    def _at_states(self, index: int, property_: Property) -> Result:
        """Return the verdict on a property that marked states decide."""
        name, kind, text, span = property_.name, property_.kind, property_.text, property_.span
        if property_.is_of_steps and self.closed.zones:
            reason = "`occurs` is not evaluated by zones; try `--time discrete` or `--time untimed`"
            return Result(name, kind, text, Verdict.UNDECIDED, reason, span=span)
        diagram = self.exploration.diagram
        if diagram is not None and 1 + index in diagram.unknown:
            reason = MANY_COMBINATIONS if not property_.is_of_steps else MEMORY_RAN_OUT
            return Result(name, kind, text, Verdict.UNDECIDED, reason, span=span)
        doubt = self._uncertainty_of_monitor(index, property_)
        if doubt:
            return Result(name, kind, text, Verdict.UNDECIDED, doubt, span=span)
        mark = self.exploration.mark(1 + index)
        if property_.is_existential:
            if mark is not None:
                trace = self._seen(mark)
                return _with_reason(Result(name, kind, text, Verdict.HOLDS, trace=trace, span=span))
            absent = self._absent(name, kind, text, span, self._uncertainty)
            if absent.verdict is Verdict.UNDECIDED:
                return absent
            return Result(name, kind, text, Verdict.VIOLATED, span=span)
        if mark is None:
            return self._absent(name, kind, text, span, self._uncertainty)
        trace = self._seen(mark)
        return _with_reason(Result(name, kind, text, Verdict.VIOLATED, trace=trace, span=span))

    def _uncertainty_of_monitor(self, index: int, property_: Property) -> str:
        """Return why a monitor's verdict is unknown; empty if it is known, or not a monitor."""
        number = property_.atoms[0][1].machine if property_.atoms else 0
        if not self.closed.system.machines[number].is_monitor:
            return ""
        first = self.closed.first_marks[number]
        if self.exploration.mark(first + FULL) is not None:
            return "its queue can overflow: it does not see everything"
        if self.exploration.mark(first + FAULT) is not None:
            return "it can stop with a fault"
        timed = self.closed.untimed and any(d != 0 for d in delays_of(self.closed.charts[number]))
        if timed and self.exploration.mark(1 + index) is not None:
            return "its timeouts come at any time when untimed"
        return ""

    def _temporal(self, index: int, property_: Property, decided: OverGraph) -> Result:
        """Return the verdict on a property of the graph, which must be complete."""
        name, kind, text, span = property_.name, property_.kind, property_.text, property_.span
        found = self.exploration.answer(index)
        doubt = self._uncertainty_of_graph
        if decided.is_timed and self.closed.untimed:
            doubt = doubt or "time does not count when untimed"
        if not doubt and found.violated and decided.is_fair:
            doubt = self._uncertainty_of_turns()
        if not doubt and not found.known:
            doubt = found.why or self.exploration.doubt or MEMORY_RAN_OUT
        if doubt:
            return Result(name, kind, text, Verdict.UNDECIDED, doubt, span=span)
        reason = self._seen_of(decided, found)
        if not found.violated:
            return Result(name, kind, text, Verdict.HOLDS, reason, span=span)
        trace = self._trace(found.path, found.cycle)
        if trace is None and self.exploration.diagram is not None:
            return Result(name, kind, text, Verdict.UNDECIDED, NO_RUN, span=span)
        trace = trace and replace(trace, is_longer=found.is_longer)
        return Result(name, kind, text, Verdict.VIOLATED, reason, trace=trace, span=span)

    def _uncertainty_of_turns(self) -> str:
        """Return why a run may be unfair that counts as fair; empty if it is not."""
        schedule = self.closed.system.schedule
        order = () if schedule is None else schedule.order
        if any(p.fair and p.machine in order for p in self.closed.possible):
            return "an event under `will` waits for a turn here, and may wait for ever"
        return ""

    def _seen_of(self, decided: OverGraph, found: Answer) -> str:
        """Return the measured time beside the verdict."""
        if not decided.is_timed:
            return decided.violation if found.violated else ""
        if found.greatest is None:
            return "there is no bound" if found.violated else ""
        tick = self.closed.charts[0].capacities.tick
        return f"it takes at most {duration_text(found.greatest * tick)}"

    def _deadlock(self, name: str, kind: Kind | None, span: Span | None) -> Result:
        text = "there is always a next step"
        if self.closed.is_open:
            return self._trap(name, kind, span)
        mark = self.exploration.mark(DEADLOCK)
        if mark is None:
            return self._absent(name, kind, text, span, self._uncertainty)
        trace = self._seen(mark)
        return _with_reason(Result(name, kind, text, Verdict.VIOLATED, trace=trace, span=span))

    def _trap(self, name: str, kind: Kind | None, span: Span | None) -> Result:
        text = "every state can be left or is marked rest"
        doubt = "" if self.exploration.traps_known else self.exploration.doubt or MEMORY_RAN_OUT
        for path in sorted(self.exploration.traps, key=len):
            trace = self._trace(path)
            if trace is None:
                doubt = NO_WAY  # so it is unknown whether it counts
            elif len({step.after for step in trace.steps}) > 1 or trace.differs:
                return Result(name, kind, text, Verdict.VIOLATED, trace=trace, span=span)
            # the chart was never in another state: it works without states
        return self._absent(name, kind, text, span, self._uncertainty_of_graph or doubt)

    def _livelock(self, name: str, kind: Kind | None, span: Span | None) -> Result:
        text = "the machines never stay busy while no time passes"
        if self.exploration.livelock is not None:
            trace = self._trace(*self.exploration.livelock)
            return _with_reason(Result(name, kind, text, Verdict.VIOLATED, trace=trace, span=span))
        doubt = "" if self.exploration.livelock_known else MEMORY_RAN_OUT
        return self._absent(name, kind, text, span, self._uncertainty_of_graph or doubt)

    # --- properties that are always decided ------------------------------------------------------

    def builtin_results(self) -> Iterator[Result]:
        """Yield the properties that are always decided, unless the system lists them."""
        asked = {p.kind.decided for p in self.closed.system.properties}
        if Builtin.DEADLOCK not in asked:
            name = "trap" if self.closed.is_open else "deadlock"
            yield self._builtin_finding(self._deadlock(name, None, None), name)
        if Builtin.LIVELOCK not in asked:
            yield self._builtin_finding(self._livelock("livelock", None, None), "livelock")
        for machine, instance in enumerate(self.closed.system.machines):
            first = self.closed.first_marks[machine]
            yield from self._bad(
                first + FAULT, "reachable-fault", f"`{instance.name}` can stop with a fault",
                f"{instance.name}.fault", instance.span,
            )  # fmt: skip
            if self.closed.can_lose_events:
                continue  # see `_report_lost_events`
            yield from self._bad(
                first + FULL, "queue-overflow", f"a queue of `{instance.name}` can overflow",
                f"{instance.name}.overflow", instance.span,
            )  # fmt: skip

    def _builtin_finding(self, result: Result, rule: str) -> Result:
        if result.verdict is Verdict.VIOLATED and result.trace is not None:
            last = result.trace.steps[-1] if result.trace.steps else None
            active = f" in {', '.join(last.after)}" if last is not None and last.after else ""
            possible = self.closed.system.possible
            may_come = any(not (each.fair or each.spontaneous) for each in possible)
            words = {
                "deadlock": "nothing happens again, except for events under `may`"
                if may_come
                else "nothing can ever happen again",
                "trap": f"nothing leads out{active}",
                "livelock": "the machines can be busy for ever without time passing",
            }
            self.findings.add(rule, words[rule], None)
        return result

    def _bad(
        self, number: int, rule: str, message: str, name: str, span: Span | None
    ) -> Iterator[Result]:
        mark = self.exploration.mark(number)
        if mark is None:
            return
        trace = self._seen(mark)
        if rule == "reachable-fault" and trace is not None and trace.steps:
            message += fault_text(self.closed.system, trace.steps[-1])
        self.findings.add(rule, message, span)
        yield _with_reason(Result(name, None, message, Verdict.VIOLATED, trace=trace, span=span))

    def _report_lost_events(self) -> None:
        """Warn, once, that events are lost because external events do not wait."""
        machines, lost = self.closed.system.machines, self.closed.overflowing
        if self.closed.can_lose_events:
            lost = overflowing(self.closed, self.exploration)
        for number in lost:
            name, most = machines[number].name, machines[number].chart.capacities.queue
            self.findings.add(
                "queue-overflow",
                f"events to `{name}` are lost if more than {most} arrive at once",
                machines[number].span,
                help="with `--max-pending 1` an external event waits while more than 1 event is "
                "queued",
                severity=Severity.WARNING,
            )

    def report_vacuous(self, index: int, property_: Property, result: Result) -> None:
        """Warn of a property that holds because its condition is never true."""
        if result.verdict is not Verdict.HOLDS or self.exploration.end is not End.COMPLETE:
            return
        part = "" if self._uncertainty else vacuous(self.exploration, index, property_)
        if part:
            self.findings.add(
                "vacuous-property",
                f"`{property_.name}` holds because `{part}` is never true",
                property_.span,
                help="check the condition, or the environment",
            )

    def add_findings(self) -> None:
        """Report dead parts, lost events, and sampled values."""
        for machine, instance in enumerate(self.closed.system.machines):
            if self.exploration.end is End.COMPLETE and not self._uncertainty:
                self._report_dead_parts(machine)
            first = self.closed.first_marks[machine] + UNHANDLED
            lost = [
                event.name
                for event in instance.chart.events
                if self.exploration.mark(first + event.index) is not None
            ]
            if lost and not self.closed.is_open:
                names = ", ".join(f"`{name}`" for name in lost)
                message = f"{names} can reach `{instance.name}` where nothing handles it"
                self.findings.add("unanswered-event", message, instance.span)
        self._report_lost_events()
        if self.exploration.end in UNFINISHED:
            report_spread(self.closed, [m.spread for m in self.exploration.machines], self.findings)
        for sample, use in self.closed.samples.items():
            message = f"not every value of {sample} is tried: {use.text}"
            self.findings.add("sampled-values", message, use.span, help=SAMPLED)

    def _report_dead_parts(self, machine: int) -> None:
        """Report dead parts: for one chart each at its location, for a system together."""
        states = list(never_entered(self.closed, self.exploration, machine))
        transitions = list(never_taken(self.closed, self.exploration, machine))
        instance = self.closed.system.machines[machine]
        chart = instance.chart
        if self.closed.is_open:
            for state in states:
                message = f"the state `{state.id}` is never entered"
                self.findings.add("never-entered", message, state.span)
            for transition in transitions:
                source = chart.states[transition.source].id or "the root"
                message = f"this transition of `{source}` is never taken"
                self.findings.add("never-taken", message, transition.span)
            return
        if states:
            names = ", ".join(f"`{state.id}`" for state in states)
            message = f"in this system `{instance.name}` never enters {names}"
            self.findings.add("never-entered", message, instance.span, severity=Severity.NOTE)
        if transitions:
            message = (
                f"in this system `{instance.name}` never takes {len(transitions)} "
                f"of its transitions: {lines_of(chart, transitions)}"
            )
            self.findings.add("never-taken", message, instance.span, severity=Severity.NOTE)


def overflowing(closed: ClosedSystem, found: Exploration) -> tuple[int, ...]:
    """Return the machines that lost an event because their queue was full."""
    numbers = range(len(closed.system.machines))
    return tuple(n for n in numbers if found.mark(closed.first_marks[n] + FULL) is not None)


def never_entered(closed: ClosedSystem, found: Exploration, machine: int) -> Iterator[State]:
    """Yield the outermost states that are never entered."""
    chart, entered = closed.system.machines[machine].chart, found.machines[machine].states
    hoped = error_states(closed.system.machines[machine])
    for state in chart.states[1:]:
        if state.is_history or state.index in entered or state.index in hoped:
            continue
        if not state.parent or state.parent in entered:
            yield state


def never_taken(closed: ClosedSystem, found: Exploration, machine: int) -> Iterator[Transition]:
    """Yield the transitions that are never taken although their source is entered."""
    chart, figures = closed.system.machines[machine].chart, found.machines[machine]
    hoped = error_states(closed.system.machines[machine])
    for transition in chart.transitions:
        reachable = not transition.source or transition.source in figures.states
        expected = transition.trigger is not Trigger.INITIAL and not closed.is_silent(
            machine, transition.index
        )
        expected = expected and not hoped & {transition.source, *transition.targets}
        if reachable and expected and transition.index not in figures.transitions:
            yield transition


def lines_of(chart: Chart, transitions: Sequence[Transition]) -> str:
    """Return the locations of transitions: ``of `a` at gate.yaml:7 and 9``."""
    found: dict[tuple[str, str], list[str]] = {}
    for transition in transitions:
        source = transition.span.source
        line, _ = source.position(transition.span.start)
        state = chart.states[transition.source].id
        found.setdefault((f"`{state}`" if state else "the root", source.name), []).append(str(line))
    told = (
        f"of {state} at {file}:{' and '.join(dict.fromkeys(lines))}"
        for (state, file), lines in found.items()
    )
    return ", ".join(told)


def fault_text(system: System, step: TraceStep) -> str:
    """Return why the last step of a path stopped its machine, as the end of a sentence."""
    reasons = [line.removeprefix("fault ") for line in step.lines if line.startswith("fault ")]
    machine = next((each for each in system.machines if each.name == step.machine), None)
    cycle = "" if machine is None else cycle_text(machine.chart, traced_transitions(step.lines))
    rounds = f", round and round: {cycle}" if reasons[-1:] == ["microsteps"] and cycle else ""
    return f": {reasons[-1]}{rounds}" if reasons else ""


def assumptions(closed: ClosedSystem) -> Iterator[str]:
    """Yield each assumption as a sentence."""
    if closed.max_pending != UNLIMITED:
        most = closed.max_pending
        noun = "event is" if most == 1 else "events are"
        yield f"the environment posts an event only while at most {most} {noun} queued"
    if closed.silent:
        yield "transitions marked `watchdog` never fire"
    if closed.untimed:
        yield "an armed timer may fire at any time"
    if not closed.untimed:
        yield from closed.system.assumed
    if closed.system.schedule is not None:
        yield schedule_text(closed.system)
    for freezer in closed.system.freezers:
        yield freezer_text(freezer, closed.system)
    for sample in closed.samples:
        yield f"{sample} takes sample values only"
    yield from _given_results(closed)


def _given_results(closed: ClosedSystem) -> Iterator[str]:
    """Yield the declared results of an operation, if its chart declares them."""
    tick = closed.system.machines[0].chart.capacities.tick if closed.system.machines else 1000
    for machine in closed.system.machines:
        for chart in charts_within(machine.chart):
            for operation in chart.operations:
                if operation.tried and operation.result is not None:
                    type_ = operation.result
                    values = ", ".join(show(value, type_, tick) for value in operation.tried)
                    yield f"`{operation.name}` of `{machine.name}` returns one of {values}"
