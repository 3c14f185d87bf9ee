"""The child process of a check: explores one file and reports in lines of JSON.

``python -m fsmkit.editor.checking.child FILE SECONDS BYTES`` prints lines of ``progress``, then
one of ``report`` or ``error``. A separate process can be stopped at any time and has its own
limits of time and memory.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import Findings, FsmkitError, Span
from fsmkit.diagnostics.as_json import as_json, location
from fsmkit.runtime.interpreter.snapshot import Entered, Taken
from fsmkit.verify.explore import ExplorationOptions, check_file
from fsmkit.verify.report.counterexample import TraceStep
from fsmkit.verify.report.sequence import sequence
from fsmkit.verify.report.sequences import mermaid
from fsmkit.verify.report.verdict import Report, Result
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.statespace.sessions import effects_within
from fsmkit.verify.testgen.save import recorded

Json = dict[str, Any]


def main(arguments: list[str]) -> int:
    """Check a file and print the result."""
    path, seconds, size = Path(arguments[0]), float(arguments[1]), int(arguments[2])

    def report_progress(states: int, transitions: int, depth: int) -> None:
        say({"progress": {"states": states, "transitions": transitions, "depth": depth}})

    options = ExplorationOptions(timeout=seconds, memory=size)
    try:
        _, found = check_file(
            path, Findings(), options=options, progress=report_progress, deadline=Deadline(seconds)
        )
    except FsmkitError as error:
        say({"error": [as_json(finding) for finding in error.diagnostics]})
        return 1
    say({"report": as_data(found, path)})
    return 0


def say(message: Mapping[str, object]) -> None:
    """Print one line."""
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


def as_data(report: Report, path: Path) -> Json:
    """Return the report of a file as data: each property with its verdict, location and trace."""
    explored = report.exploration
    return {
        "verdict": report.verdict.value,
        "states": explored.states,
        "depth": explored.depth,
        "properties": [_property(report, result, path) for result in report.results],
        "findings": [as_json(finding) for finding in report.findings],
    }


def _property(report: Report, result: Result, path: Path) -> Json:
    found: Json = {
        "name": result.name,
        "verdict": result.verdict.value,
        "text": result.text,
        "reason": result.reason,
    }
    if result.span is not None:
        found["at"] = location(result.span)
    if result.trace is not None and result.trace.steps:
        found["steps"] = [_step(report, step) for step in result.trace.steps]
        found["loop"] = result.trace.loop
        found["trace"] = recorded(report.closed, result.trace, path)
        found["diagram"] = mermaid.draw(sequence(report.closed, result, result.trace))
    return found


def _step(report: Report, step: TraceStep) -> Json:
    spans = list(_places(report, step))
    return {
        "at": step.at,
        "machine": step.machine,
        "event": step.cause,
        "from": list(step.before),
        "to": list(step.after),
        "chosen": list(step.chosen),
        "sent": [f"{d.what} -> {d.target}" for d in step.deliveries],
        "places": [location(span) for span in spans],
    }


def _places(report: Report, step: TraceStep) -> Iterator[Span]:
    """Yield the places of the transitions that a step takes; of none, of the states it enters."""
    machines = {machine.name: machine.chart for machine in report.closed.system.machines}
    chart = machines.get(step.machine)
    if chart is None or step.done is None:
        return
    effects = [(own, effect) for _, own, effect in effects_within(chart, step.done)]
    taken = [own.transitions[e.transition].span for own, e in effects if isinstance(e, Taken)]
    entered = [own.states[e.state].span for own, e in effects if isinstance(e, Entered)]
    yield from taken or entered[-1:]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
