"""Public test suites, found by looking: the W3C tests and scripted charts, on any runtime.

A W3C test passes when it ends in its top-level state ``pass``. A scripted chart (SCION's format)
passes when the active atomic states are the expected ones at first and after each event.
"""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from types import FrameType
from typing import Any

from fsmkit.diagnostics import Findings, FsmkitError, Severity, Text
from fsmkit.loading import load, read_documents
from fsmkit.model.chart import Chart
from fsmkit.model.document import Direction, DocEvent
from fsmkit.model.elaborate import elaborate
from fsmkit.testing.conformance_traces import configurations, ends_in, faults
from fsmkit.testing.harness import Harness

PATIENCE = 600_000_000
"""Simulated microseconds after which a W3C test that has not ended is stuck."""


class Result(Enum):
    """How a test ended."""

    PASSED = "passed"
    FAILED = "failed"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of one test on one runtime, and why."""

    name: str
    target: str
    result: Result
    reason: str = ""


class Unmet(Exception):  # noqa: N818  (an expectation, not an error)
    """A test did something else than it should; the message says what."""


@dataclass(frozen=True, slots=True)
class Case:
    """One test.

    ``skip`` is a reason not to count a failure: a person must judge it. ``events`` are those that
    come from outside: a chart need not mention each.
    """

    name: str
    path: Path
    judge: Callable[[Chart, Harness], None]
    skip: str = ""
    must_be_rejected: bool = False
    events: tuple[str, ...] = ()

    def load(self) -> Chart:
        """Return the chart; its undeclared events are declared, for prefixes and `*` to match."""
        chart = load(self.path)
        if all(name in chart.event_index for name in self.events):
            return chart
        findings = Findings()
        document, *bases = read_documents(self.path, findings)
        declared = tuple(
            DocEvent(Text(name, document.name.span), (), Direction.IN)
            for name in dict.fromkeys(self.events)
        )
        document = replace(document, events=(*document.events, *declared))
        chart_with = elaborate((document, *bases), findings)
        findings.stop_on_errors()
        return chart if chart_with is None else chart_with


def judge(case: Case, harnesses: Sequence[Harness], limit: float) -> Iterator[Verdict]:
    """Run one test on each runtime; it never raises. ``limit``: seconds for each."""
    chart: Chart | None = None
    failure: tuple[Result, str] | None = None
    try:
        with time_limit(limit):
            chart = case.load()
    except Exception as error:  # noqa: BLE001  (a bug fails one test, not the run)
        failure = _of_load(case, error)
    for harness in harnesses:
        if chart is None or failure is not None:
            result, reason = failure or (Result.FAILED, "was not loaded")
        else:
            result, reason = _run(case, chart, harness, limit)
        if result is Result.FAILED and case.skip:
            result, reason = Result.SKIPPED, f"{case.skip}; {reason}"
        yield Verdict(case.name, harness.name, result, reason)


def _of_load(case: Case, error: Exception) -> tuple[Result, str]:
    if isinstance(error, FsmkitError) and case.must_be_rejected:
        return Result.PASSED, ""
    return Result.FAILED, reason_of(error)


def _run(case: Case, chart: Chart, harness: Harness, limit: float) -> tuple[Result, str]:
    if case.must_be_rejected:
        return Result.FAILED, "is accepted, but must be rejected"
    try:
        with time_limit(limit):
            case.judge(chart, harness)
    except Exception as error:  # noqa: BLE001  (a bug fails one test, not the run)
        return Result.FAILED, reason_of(error)
    return Result.PASSED, ""


def reason_of(error: Exception) -> str:
    """Return one line that says why a test failed."""
    match error:
        case Unmet():
            return str(error)
        case TimeoutError():
            return "takes too long"
        case FsmkitError():
            errors = [d for d in error.diagnostics if d.severity is Severity.ERROR]
            first = (errors or list(error.diagnostics))[0]
            more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
            where = f" at {first.primary.span}" if first.primary else ""
            return f"{first.rule.code} {first.rule.name}: {first.message}{where}{more}"
        case _:
            return (
                f"bug: {type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
            )


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise `TimeoutError` in the body after some time, where the platform can."""
    if not hasattr(signal, "setitimer") or threading.current_thread() != threading.main_thread():
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        del number, frame
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


# --- the two kinds of tests -------------------------------------------------------------------


def ends_in_pass(chart: Chart, harness: Harness) -> None:
    """Let simulated time pass until the chart must have ended; that must be in ``pass``."""
    late = PATIENCE // chart.capacities.tick
    runs = [0, 0, 0, *(late * part // 10 for part in range(1, 11))]
    trace = harness.run(chart, ["start 0", *(f"run {at}" for at in runs)])
    end = ends_in(trace)
    if end == ("pass",):
        return
    if end is not None:
        raise Unmet(f"ends in {', '.join(end)}")
    stuck = configurations(trace)
    where = ", ".join(stuck[-1][1]) if stuck else "nothing"
    because = f" after the fault {faults(trace)[0]}" if faults(trace) else ""
    raise Unmet(f"does not end: it stays in {where}{because}")


def follows(script: dict[str, Any]) -> Callable[[Chart, Harness], None]:
    """Return the judge of a scripted chart.

    Each event comes one millisecond after the one before, so that the time of a macrostep tells
    which event it belongs to.
    """

    def judge_script(chart: Chart, harness: Harness) -> None:
        times, lines, now = [0], ["start 0", "run 0"], 0
        for entry in script["events"]:
            now += max(1, (int(entry.get("after", 0)) * 1000 + 1000) // chart.capacities.tick)
            times.append(now)
            lines += [f"run {now}", f"post {entry['event']['name']}", f"run {now}"]
        names = [entry["event"]["name"] for entry in script["events"]]
        trace = configurations(harness.run(chart, lines))
        wanted = [script["initialConfiguration"]]
        wanted += [entry["nextConfiguration"] for entry in script["events"]]
        for step, (time, expected) in enumerate(zip(times, wanted, strict=True)):
            reached = [states for at, states in trace if at <= time]
            found = reached[-1] if reached else ()
            if sorted(found) != sorted(expected):
                after = f"after event {step} `{names[step - 1]}`" if step else "at first"
                raise Unmet(f"{after}: {_listed(found)} instead of {_listed(expected)}")

    return judge_script


def _listed(states: Sequence[str]) -> str:
    return ", ".join(sorted(states)) or "nothing"


def read_script(path: Path) -> dict[str, Any] | None:
    """Return the script beside a chart, if that is what the file holds."""
    try:
        script = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return None
    is_script = isinstance(script, dict) and {"initialConfiguration", "events"} <= set(script)
    return script if is_script else None
