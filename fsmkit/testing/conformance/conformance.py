"""Run one test of a public suite on any runtime.

The case defines the expectation: see `conformance_expectations`. A failed test reports its reason:
the observed behaviour, the remark of the suite, or the parts that reading omitted.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from types import FrameType

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.loading import load_with_findings, read_documents
from fsmkit.diagnostics import Diagnostic, Findings, FsmkitError, Severity, Span, Text
from fsmkit.document.document import Direction, DocEvent
from fsmkit.testing.harness.harness import Harness

LEFT_OUT = ("unsupported-invoke", "content-not-evaluable")
"""Rules of warnings that change the behaviour of a chart, the most severe first."""


class Result(Enum):
    """The result of a test."""

    PASSED = "passed"
    FAILED = "failed"
    SKIPPED = "skipped"


class UnmetExpectation(Exception):  # noqa: N818  (an expectation, not an error)
    """A test observed a wrong behaviour; the message describes it."""


class ContradictsRecommendation(Exception):  # noqa: N818  (a fact about a test, not an error)
    """A test requires something that contradicts the recommendation; the message names it."""


@dataclass(frozen=True, slots=True)
class Case:
    """One test.

    ``skip`` is a reason not to count a failure: a person must assess it. ``events`` are the
    external ones; a chart need not mention each.
    """

    name: str
    path: Path
    evaluate: Callable[[Chart, Harness], None]
    skip: str = ""
    must_be_rejected: bool = False
    events: tuple[str, ...] = ()
    note: str = ""
    """The suite's remark about the test, for its failure report."""
    suite: str = ""
    group: str = ""
    """The clause of the recommendation, or the folder; ``link`` leads to it."""
    link: str = ""

    def load(self, findings: Findings) -> Chart:
        """Return the chart; its undeclared events are declared, for prefixes and `*` to match."""
        chart = load_with_findings(self.path, findings)
        if all(name in chart.event_index for name in self.events):
            return chart
        document, *bases = read_documents(self.path, Findings())
        declared = tuple(
            DocEvent(Text(name, document.name.span), (), Direction.IN)
            for name in dict.fromkeys(self.events)
        )
        document = replace(document, events=(*document.events, *declared))
        chart_with = elaborate((document, *bases), findings)
        findings.stop_on_errors()
        return chart if chart_with is None else chart_with


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of one test on one runtime, and why."""

    case: Case
    target: str
    result: Result
    reason: str = ""

    @property
    def name(self) -> str:
        """Return the name of the test."""
        return self.case.name


def evaluate(case: Case, harnesses: Sequence[Harness], limit: float) -> Iterator[Verdict]:
    """Run one test on each runtime; it never raises. ``limit``: seconds for each."""
    chart: Chart | None = None
    failure: tuple[Result, str] | None = None
    findings = Findings()
    try:
        with time_limit(limit):
            chart = case.load(findings)
    except Exception as error:  # noqa: BLE001  (a bug fails one test, not the run)
        failure = _of_load(case, error)
    because = case.note or _left_out(findings)
    for harness in harnesses:
        if chart is None or failure is not None:
            result, reason = failure or (Result.FAILED, "was not loaded")
        else:
            result, reason = _run(case, chart, harness, limit)
        if result is Result.FAILED:
            reason = f"{reason} ({because})" if because else reason
            if case.skip:
                result, reason = Result.SKIPPED, f"{case.skip}; {reason}"
        yield Verdict(case, harness.name, result, reason)


def _of_load(case: Case, error: Exception) -> tuple[Result, str]:
    if isinstance(error, FsmkitError) and case.must_be_rejected:
        return Result.PASSED, ""
    return Result.FAILED, reason_of(error)


def _run(case: Case, chart: Chart, harness: Harness, limit: float) -> tuple[Result, str]:
    if case.must_be_rejected:
        return Result.FAILED, "is accepted, but must be rejected"
    try:
        with time_limit(limit):
            case.evaluate(chart, harness)
    except ContradictsRecommendation as contradiction:
        return Result.SKIPPED, str(contradiction)
    except Exception as error:  # noqa: BLE001  (a bug fails one test, not the run)
        return Result.FAILED, reason_of(error)
    return Result.PASSED, ""


def _left_out(findings: Findings) -> str:
    """Return the first of the gravest warnings, or nothing."""
    grave = [d for name in LEFT_OUT for d in findings if d.rule.name == name]
    return finding_line(grave[0]) if grave else ""


def reason_of(error: Exception) -> str:
    """Return one line with the reason of a failure."""
    match error:
        case UnmetExpectation():
            return str(error)
        case TimeoutError():
            return "takes too long"
        case FsmkitError():
            errors = [d for d in error.diagnostics if d.severity is Severity.ERROR]
            more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
            return f"{finding_line((errors or list(error.diagnostics))[0])}{more}"
        case _:
            return (
                f"bug: {type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
            )


def finding_line(diagnostic: Diagnostic) -> str:
    """Return the rule, message and location of a finding in one line.

    For a compiler error, return its first error. Files are named without their folders.
    """
    first, *others = diagnostic.message.splitlines()
    message = " ".join([first, *[line for line in others if "error:" in line][:1]])
    where = f" at {_place(diagnostic.primary.span)}" if diagnostic.primary else ""
    return f"{diagnostic.rule.code} {diagnostic.rule.name}: {message}{where}"


def _place(span: Span) -> str:
    line, column = span.source.position(span.start)
    return f"{Path(span.source.name).name}:{line}:{column}"


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
