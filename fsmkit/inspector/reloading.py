"""Repeat the commands of a session with a saved chart, and find the first difference."""

from __future__ import annotations

from dataclasses import dataclass

from msgspec.structs import replace

from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector.breakpoints import machine_of
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.history import Branch
from fsmkit.inspector.questions.arguments import (
    datum_of,
    index_of_received_event,
    input_of,
    occurrence_of,
    results_of,
)
from fsmkit.inspector.simulation import Moment
from fsmkit.inspector.system_at import Course
from fsmkit.runtime.live.messages import Json, Post, Set

MOST_STEPS = 20_000
"""Maximum number of repeated steps, during which the session is blocked."""


@dataclass(frozen=True, slots=True)
class RepeatedSession:
    """The result of repeating the commands of a session.

    ``moment``: the system at the end. ``why``: ``["reloaded"]`` with the first differing entry,
    and the finding of a command that could not be repeated.
    """

    moment: Moment
    why: list[Json]


def repeat_actions(old: Course, fresh: Course, begin: Moment, at: int) -> RepeatedSession:
    """Repeat the actions of the branch in view in a new course from its initial moment.

    Each action follows the same number of entries as before, or comes when no step remains until
    its time. ``at``: the final time in ticks.
    """
    making = _Repetition(fresh, begin)
    branch, problem = old.history.branch, ""
    try:
        if branch.first:
            raise wrong("the first entries were dropped, so the session restarts")
        for n, action in sorted(branch.actions.items()):
            making.run(action.at, most=n - 1 - fresh.history.head)
            if making.moment.now < action.at:
                making.run(action.at)
            for message in old.messages(n):
                if isinstance(message, Post | Set):
                    making.do(message)
        making.run(at)
    except FsmkitError as error:
        problem = error.diagnostics[0].message
    differs = _first_difference(branch, fresh.history.branch)
    why: list[Json] = ["reloaded"]
    if differs is not None or problem:
        why.append(fresh.history.head if differs is None else differs)
    if problem:
        why.append(problem)
    return RepeatedSession(making.moment, why)


def _first_difference(old: Branch, new: Branch) -> int | None:
    """Return the first entry that is not as it was; None if all are."""
    first = max(old.first, new.first)
    for n in range(first, max(old.head, new.head) + 1):
        if n > old.head or n > new.head or old.text(n) != new.text(n):
            return n
    return None


@dataclass(slots=True)
class _Repetition:
    """A course under construction."""

    course: Course
    moment: Moment

    def run(self, until: int, most: int = MOST_STEPS + 1) -> None:
        """Step until a time, or so many steps."""
        course = self.course
        for _ in range(most):
            n = course.history.head + 1
            if n > MOST_STEPS:
                raise wrong(f"after {MOST_STEPS:,} steps it is not done again any further")
            self.moment, done = course.simulation.step(self.moment, until)
            if done is None:
                return
            course.add(self.moment, course.encoder.step(n, self.moment, done))

    def do(self, message: Post | Set) -> None:
        """Repeat an action of a client; raises `FsmkitError` if the event or input is gone."""
        simulation = self.course.simulation
        machine = machine_of(simulation.system, message.m)
        chart, n = simulation.charts[machine], self.course.history.head + 1
        if isinstance(message, Set):
            for name, value in message.inputs.items():
                given = input_of(chart, name, value)
                self.moment = simulation.set_input(self.moment, machine, *given)
            for name, value in message.data.items():
                given = datum_of(chart, name, value)
                self.moment = simulation.set_data(self.moment, machine, *given)
            for name, values in message.results.items():
                results = results_of(chart, name, values)
                self.moment = simulation.set_results(self.moment, machine, name, results)
            self.course.add(self.moment, [replace(message, n=n, at=self.moment.now)])
            return
        name, *values = message.event
        fields = [field.name for field in chart.events[index_of_received_event(chart, name)].fields]
        if len(fields) != len(values):
            raise wrong(f"the event `{name}` has other fields now")
        occurrence = occurrence_of(chart, name, dict(zip(fields, values, strict=True)))
        after = simulation.post(self.moment, machine, occurrence)
        how = "refused" if after is None else "queued"
        self.moment = self.moment if after is None else after
        self.course.add(self.moment, [replace(message, n=n, at=self.moment.now, how=how)])
