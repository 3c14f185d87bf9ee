"""Answers to commands that change nothing: of the entry in view, and of the history."""

from __future__ import annotations

from typing import Any

from fsmkit.inspector import commands
from fsmkit.inspector.breakpoints import machine_of, machine_without_prefix
from fsmkit.inspector.clients import Client
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.history import History
from fsmkit.inspector.questions.arguments import index_of_received_event, occurrence_of
from fsmkit.inspector.view import View
from fsmkit.runtime.live.messages import Again, to_json
from fsmkit.runtime.live.steps import rows_of
from fsmkit.verify import questions

MOST_RESENT = 10_000
"""Maximum number of entries sent again per command."""
UNKNOWN = "the data are not known at this entry"


def watched_value(view: View, command: commands.Watch) -> Any:
    """Return the value of an expression, or why it has none."""
    system = view.course.simulation.system
    own = machine_without_prefix(system, command.m)
    expression = questions.read(system, command.expression, own, None)
    if view.moment is None:
        return {"error": UNKNOWN}
    return questions.shown(expression, view.moment.snapshots)


def explain_event(view: View, command: commands.Why) -> Any:
    """Return the effect of an event."""
    machine = machine_of(view.course.simulation.system, command.m)
    chart = view.course.simulation.charts[machine]
    event = index_of_received_event(chart, command.event)
    payload = None
    if command.payload is not None or not chart.events[event].fields:
        payload = occurrence_of(chart, command.event, command.payload or {}).payload
    if view.moment is None:
        return {"would": "?", "looked": [], "because": UNKNOWN}
    return questions.why(chart, view.moment.snapshots[machine], event, payload)


def events(view: View, machine: str) -> Any:
    """Return for each event whether it would do something."""
    place = machine_of(view.course.simulation.system, machine)
    snapshot = None if view.moment is None else view.moment.snapshots[place]
    return questions.events(view.course.simulation.charts[place], snapshot)


def microsteps(view: View, n: int) -> Any:
    """Return the microsteps of an entry."""
    if not view.history.first < n <= view.history.head:
        raise wrong(f"there is no step {n}")
    done = view.course.stepped(n)
    if done is None:
        raise wrong(f"the microsteps of entry {n} are unknown")
    chart = view.course.simulation.charts[done.machine]
    return [
        {
            "transitions": list(small.transitions),
            "exited": [chart.states[state].id for state in small.exited],
            "entered": [chart.states[state].id for state in small.entered],
            "do": [row for effect in small.effects for row in rows_of(chart, effect)],
        }
        for small in done.macrostep.microsteps
    ]


def resend(client: Client, history: History, first: int, last: int | None) -> dict[str, int]:
    """Send entries to a client again; return which."""
    first = max(first, history.first)
    last = min(history.head if last is None else last, first + MOST_RESENT - 1, history.head)
    texts = list(history.texts(first, last))
    if texts:
        again = to_json(Again(first=first, last=last))
        client.send(b"[" + b",".join([again, *texts]) + b"]")
    return {"first": first, "last": last}


def branches(history: History) -> list[dict[str, int]]:
    """Return the branches that are not in view."""
    return [
        {"branch": number, "first": branch.first, "head": branch.head}
        for number, branch in sorted(history.others.items())
    ]
