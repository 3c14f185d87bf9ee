"""Convert a session to a path of the explorer, which becomes a test in C.

The explorer's interpreter repeats each step and must give the same trace. Otherwise no test can
express the session.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path

from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.simulation import SimulationStep
from fsmkit.inspector.system_at import Course
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Called, Macrostep, Occurrence, Sent, Snapshot, Start
from fsmkit.runtime.interpreter.trace import trace_lines
from fsmkit.runtime.live.messages import Post, Set
from fsmkit.system.machine import FreeInput, Possible
from fsmkit.verify.report.counterexample import Counterexample, Replay, ReplayError
from fsmkit.verify.statespace.actions import Action, Step
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.testgen.suites import compiled_charts, suite

WRONG = (ReplayError, LookupError, ValueError)


def c_test(course: Course, file: Path) -> str:
    """Return a C program that repeats the current branch on the generated machines.

    ``file``: the chart or system, which the program compiles. Raises `FsmkitError` if a test
    cannot express the session or the chart.
    """
    system = course.simulation.system
    path = _Path(course)
    path.read()
    bare = replace(
        system, possible=(), free_inputs=(), properties=(), monitors=(), schedule=None, freezers=()
    )
    closed = path.closed(close(bare, keeps_dead=True))
    try:
        steps = tuple(Replay(closed).walk(((*path.starts(),), *((step,) for step in path.steps()))))
    except WRONG as error:
        raise _unsaid(str(error)) from error
    told = [step for step in steps if step.done is not None]
    for step, done in zip(told, path.done, strict=True):
        chart = course.simulation.charts[done.machine]
        if list(step.lines)[1:] != list(trace_lines(chart, (done.macrostep,)))[1:]:
            raise _unsaid("the machines ran in another order")
    name = f"{file.stem}_session.c"
    paths = {"session": (f"a session of {system.name}", Counterexample(steps))}
    charts = compiled_charts(system, closed.system)
    return suite(Path(name), closed, paths, file, charts)


def _unsaid(why: str) -> FsmkitError:
    return wrong(f"no test in C can express this session: {why}", "save as `pytest`, or as `live`")


@dataclass(slots=True)
class _Path:
    """The steps of a session."""

    course: Course
    done: list[SimulationStep] = field(default_factory=list)
    _found: list[tuple[SimulationStep, bool, Snapshot]] = field(default_factory=list)
    """Each step, whether its event was external, and the machine before it."""
    _possible: list[Possible] = field(default_factory=list)
    _inputs: list[list[Value]] = field(default_factory=list)
    _results: list[dict[str, list[Value]]] = field(default_factory=list)

    def read(self) -> None:
        """Go through the branch in view."""
        course, branch = self.course, self.course.history.branch
        if branch.first:
            raise wrong("the first steps are forgotten", "save as `live`")
        count = len(course.simulation.charts)
        queues: list[list[bool]] = [[] for _ in range(count)]
        self._results = [{} for _ in range(count)]
        self._inputs = [[] for _ in course.simulation.charts[0].inputs]
        moment = course.moment(0)
        for n in range(1, branch.head + 1):
            if n in branch.actions:
                moment = branch.moments.get(n)
                for message in course.messages(n):
                    if isinstance(message, Post) and message.how == "queued":
                        queues[course.simulation.names.index(message.m)].append(True)
                    elif isinstance(message, Set) and message.data:
                        raise _unsaid("data were set by hand")
                    elif isinstance(message, Set) and not course.encoder.is_alone:
                        raise _unsaid("an input of a system was set")
                continue
            before, done = moment, branch.steps.get(n)
            if n <= branch.given:
                moment = branch.moments.get(n)
            elif before is not None:
                moment, done = course.simulation.step(before)
            if before is None or done is None:
                raise wrong(f"the step at entry {n} is not known", "save as `live`")
            self._note(done, before.snapshots[done.machine], queues)

    def _note(self, done: SimulationStep, before: Snapshot, queues: list[list[bool]]) -> None:
        """Add a step; ``queues``: for each queued event of each machine, whether it is external."""
        macrostep, queue = done.macrostep, queues[done.machine]
        is_taken = len(macrostep.before.queue) < len(before.queue)
        is_outside = queue.pop(0) if is_taken and queue else False
        if is_outside and isinstance(macrostep.event, Occurrence):
            event = macrostep.event
            each = Possible(done.machine, event.event, event.payload)
            if each not in self._possible:
                self._possible.append(each)
        for effect in macrostep.effects:
            if isinstance(effect, Sent):
                queue.append(False)
            elif isinstance(effect, Called) and effect.result is not None:
                _add(self._results[done.machine].setdefault(effect.operation, []), effect.result)
        for values, value in zip(self._inputs, macrostep.before.inputs, strict=False):
            _add(values, value)
        for passed in done.passed:
            if passed.has_room:
                queues[passed.link.target].append(False)
        self.done.append(done)
        self._found.append((done, is_outside, before))

    def closed(self, closed: ClosedSystem) -> ClosedSystem:
        """Return the system with the events, inputs and results that there were."""
        free = tuple(
            FreeInput(0, place, tuple(values))
            for place, values in enumerate(self._inputs if closed.is_open else ())
            if len(values) > 1 or values != [self._start_of(place)]
        )
        results = tuple({name: tuple(v) for name, v in each.items()} for each in self._results)
        return replace(
            closed, possible=tuple(self._possible), free_inputs=free, results=results, samples={}
        )

    def _start_of(self, place: int) -> Value:
        return self.course.simulation.charts[0].inputs[place].init.value

    def starts(self) -> Iterator[Step]:
        """Yield the first steps."""
        for done, _, _ in self._found:
            if isinstance(done.macrostep.event, Start):
                yield Step(Action.START, done.machine, 0, self._choices(done))

    def steps(self) -> Iterator[Step]:
        """Yield the others, and the time that passes between them."""
        now = 0
        for done, is_outside, before in self._found:
            macrostep = done.macrostep
            if isinstance(macrostep.event, Start):
                continue
            if macrostep.at > now:
                yield Step(Action.ELAPSE, ticks=Fraction(macrostep.at - now))
                now = macrostep.at
            action, argument = _action(macrostep, before), 0
            if is_outside and isinstance(macrostep.event, Occurrence):
                each = Possible(done.machine, macrostep.event.event, macrostep.event.payload)
                action, argument = Action.OCCUR, self._possible.index(each)
            yield Step(action, done.machine, argument, self._choices(done))

    def _choices(self, done: SimulationStep) -> tuple[int, ...]:
        """Return which inputs and which results there were, where there were others, too."""
        alone = self.course.encoder.is_alone
        inputs = zip(self._inputs if alone else (), done.macrostep.before.inputs, strict=False)
        found = [values.index(value) for values, value in inputs if len(values) > 1]
        for effect in done.macrostep.effects:
            if isinstance(effect, Called) and effect.result is not None:
                values = self._results[done.machine][effect.operation]
                found += [values.index(effect.result)] if len(values) > 1 else []
        return tuple(found)


def _add(values: list[Value], value: Value) -> None:
    if value not in values:
        values.append(value)


def _action(macrostep: Macrostep, before: Snapshot) -> Action:
    if len(macrostep.before.timers) < len(before.timers):
        return Action.FIRE
    return Action.EVENTLESS if macrostep.event is None else Action.TAKE
