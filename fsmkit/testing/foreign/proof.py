"""The proof of an import: random events on the interpreter, generated C, and the tool itself."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import cycle, zip_longest

import fsmkit.language as lang
from fsmkit.chart.chart import Chart
from fsmkit.document.document import Direction
from fsmkit.foreign.rewriting.resting_composites import SUFFIX
from fsmkit.runtime.interpreter.trace import value_text
from fsmkit.runtime.script import SeededHost, run_script
from fsmkit.runtime.session import Session
from fsmkit.testing.foreign.program import Observation, Program
from fsmkit.testing.harness.harness import harness

RUNS = (20, 100, 500)
"""Events of the runs of a program, in turn: a machine that ends early starts again soon."""
WAITS = (0, 0, 1, 10, 100, 1_000, 5_000)
"""Milliseconds between two events."""
MOST_RUNS = 200
"""Runs that look for a shorter difference."""


@dataclass(frozen=True, slots=True)
class Step:
    """An event after a wait, and the results of the guards meanwhile."""

    wait: int
    event: str | None
    guards: tuple[tuple[str, bool], ...] = ()


@dataclass(frozen=True, slots=True)
class Difference:
    """Two runs that differ: what led there, and what each did in the last step."""

    other: str
    steps: tuple[str, ...]
    expected: tuple[str, ...]
    found: tuple[str, ...]

    def lines(self) -> tuple[str, ...]:
        """Return the difference as text: the steps, then both sides beside each other."""
        width = max((len(line) for line in self.expected), default=0) + 2
        rows = zip_longest(self.expected, self.found, fillvalue="")
        heading = f"{'interpreter'.ljust(max(width, 13))}{self.other}"
        return (
            *self.steps,
            heading,
            *(f"{left.ljust(max(width, 13))}{right}".rstrip() for left, right in rows),
        )


# --- generated C ----------------------------------------------------------------------------------


def compare_with_c(chart: Chart, count: int, seed: int = 0) -> Difference | None:
    """Run random events on the interpreter and on generated C; return the first difference.

    Raises `FsmkitError` if there is no C compiler.
    """
    script = _script(chart, count, seed)
    expected, found = run_script(chart, script), harness("c").run(chart, script)
    return None if expected == found else _difference(expected, found, script)


def _script(chart: Chart, count: int, seed: int) -> list[str]:
    chosen, host = random.Random(seed), SeededHost(chart, seed)  # noqa: S311  (to repeat a run)
    events = [each for each in chart.events if Direction.IN in each.directions]
    now, lines = 0, [f"seed {seed}", "start 0"]
    for _ in range(count):
        if events:
            event = chosen.choice(events)
            values = [value_text(host.value(each.type)) for each in event.fields]
            lines.append(" ".join(["post", event.name, *values]))
        now += chosen.choice(WAITS) * 1_000 // max(1, chart.capacities.tick)
        lines.append(f"run {now}")
    return [*lines, "dump"]


def _difference(expected: list[str], found: list[str], script: list[str]) -> Difference:
    pairs = enumerate(zip_longest(expected, found))
    place = next(number for number, (one, two) in pairs if one != two)
    start = max(0, place - 5)
    return Difference(
        "generated C", tuple(script[:2]), tuple(expected[start : place + 3]),
        tuple(found[start : place + 3]),
    )  # fmt: skip


# --- a program ------------------------------------------------------------------------------------


def compare_with_program(
    chart: Chart, command: str, count: int, seed: int = 0
) -> Difference | None:
    """Run random events on the interpreter and on a program; return a short difference."""
    start = 0
    for length in cycle(RUNS):
        if start >= count:
            break
        steps = _steps(chart, min(length, count - start), seed + start)
        found = _run_both(chart, command, steps)
        if found is not None:
            return _shortest(chart, command, steps, found)
        start += length
    return None


def _steps(chart: Chart, count: int, seed: int) -> list[Step]:
    chosen = random.Random(seed)  # noqa: S311  (to repeat a run)
    events = [each.name for each in chart.events if Direction.IN in each.directions]
    guards = [one.name for one in chart.operations if isinstance(one.result, lang.BoolType)]
    found = []
    for number in range(count + 1):
        values = tuple((name, chosen.random() < 0.5) for name in guards)
        event = chosen.choice(events) if number and events else None
        found.append(Step(chosen.choice(WAITS) if number else 0, event, values))
    return found


def _run_both(chart: Chart, command: str, steps: Sequence[Step]) -> Difference | None:
    """Return the first difference of a run; the first step is the start."""
    machine = _Interpreted(chart)
    with closing(Program(command)) as program:
        for number, step in enumerate(steps):
            lines = [f"set {name} {str(value).lower()}" for name, value in step.guards]
            lines += [f"advance {step.wait}"] if step.wait else []
            lines += [f"post {step.event}"] if step.event is not None else []
            expected, found = machine.do(step), program.observe(lines)
            if _normal(expected) != _normal(found):
                done = tuple(
                    f"{f'after {each.wait} ms: ' if each.wait else ''}{each.event or 'start'}"
                    for each in steps[: number + 1]
                )
                return Difference(command, done, _lines(_normal(expected)), _lines(_normal(found)))
    return None


def _shortest(chart: Chart, command: str, steps: list[Step], found: Difference) -> Difference:
    """Return a difference after fewer steps: steps are removed while some difference stays."""
    kept = steps[: len(found.steps)]
    size, runs = len(kept) // 2, 0
    while size and runs < MOST_RUNS:
        place = 1
        while place < len(kept) and runs < MOST_RUNS:
            tried = kept[:place] + kept[place + size :]
            runs += 1
            shorter = _run_both(chart, command, tried)
            if shorter is None:
                place += size
            else:
                kept, found = tried[: len(shorter.steps)], shorter
        size //= 2
    return found


def _lines(observed: Observation) -> tuple[str, ...]:
    sent = (f"sent {name}" for name in observed.sent)
    return (*observed.operations, *sent, *(f"state {name}" for name in sorted(observed.states)))


def _normal(observed: Observation) -> Observation:
    """Return an observation without case; a state that rests is named as its parent."""
    names = (name.lower().removesuffix(SUFFIX) for name in observed.states)
    return Observation(observed.operations, observed.sent, frozenset(names))


class _Interpreted:
    """A session that records the operations without a result, and the events that it sends."""

    def __init__(self, chart: Chart) -> None:
        self.called: list[str] = []
        self.sent: list[str] = []
        self.values: dict[str, bool] = {}
        self.is_started = False
        operations = {
            each.name: self._operation(each.name, has_result=each.result is not None)
            for each in chart.operations
        }
        self.session = Session(
            chart, operations, start=False, on_event=lambda event: self.sent.append(event.event)
        )

    def _operation(self, name: str, *, has_result: bool) -> Callable[..., bool | None]:
        def call(*_: object) -> bool | None:
            if has_result:
                return self.values.get(name, False)
            self.called.append(name)
            return None

        return call

    def do(self, step: Step) -> Observation:
        """Do a step; the start has no event."""
        self.values = dict(step.guards)
        if not self.is_started:
            self.session.start()
            self.is_started = True
        if step.wait:
            self.session.advance(f"{step.wait}ms")
        if step.event is not None:
            self.session.post(step.event)
            self.session.run()
        called, self.called = tuple(self.called), []
        sent, self.sent = tuple(self.sent), []
        return Observation(called, sent, frozenset(self.session.active))
