"""A chart that is saved again: the same commands are done with it, and what differs is found."""

from __future__ import annotations

from dataclasses import dataclass

from msgspec.structs import replace

from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector.breakpoints import machine_of
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.history import Branch
from fsmkit.inspector.questions.arguments import (
    datum_of,
    input_of,
    occurrence_of,
    received,
    results_of,
)
from fsmkit.inspector.simulation import Moment
from fsmkit.inspector.system_at import Course
from fsmkit.runtime.live.messages import Json, Post, Set

MOST_STEPS = 20_000
"""Steps that are done again: the session stands still meanwhile."""


@dataclass(frozen=True, slots=True)
class Again:
    """How far the commands of a session were done again.

    ``moment``: the system at the end. ``why``: ``["reloaded"]``, with the first entry that differs,
    and if a command could not be done, its finding.
    """

    moment: Moment
    why: list[Json]


def done_again(old: Course, fresh: Course, begin: Moment, at: int) -> Again:
    """Do in a fresh course, which begins at a moment, what clients did in the branch in view.

    Each command comes after as many entries as it did, or when nothing else is to be done until
    its time. ``at``: the time at the end (ticks).
    """
    making = _Making(fresh, begin)
    branch, problem = old.history.branch, ""
    try:
        if branch.first:
            raise wrong("the first entries are forgotten, so it begins anew")
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
    return Again(making.moment, why)


def _first_difference(old: Branch, new: Branch) -> int | None:
    """Return the first entry that is not as it was; None if all are."""
    first = max(old.first, new.first)
    for n in range(first, max(old.head, new.head) + 1):
        if n > old.head or n > new.head or old.text(n) != new.text(n):
            return n
    return None


@dataclass(slots=True)
class _Making:
    """A course while it is made."""

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
            course.add(self.moment, course.teller.step(n, self.moment, done))

    def do(self, message: Post | Set) -> None:
        """Do what a client did; `FsmkitError` where there is no such event or input any more."""
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
        fields = [field.name for field in chart.events[received(chart, name)].fields]
        if len(fields) != len(values):
            raise wrong(f"the event `{name}` has other fields now")
        occurrence = occurrence_of(chart, name, dict(zip(fields, values, strict=True)))
        after = simulation.post(self.moment, machine, occurrence)
        how = "refused" if after is None else "queued"
        self.moment = self.moment if after is None else after
        self.course.add(self.moment, [replace(message, n=n, at=self.moment.now, how=how)])
