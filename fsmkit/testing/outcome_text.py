"""Report outcomes of cases: findings at the lines of the test, and the preceding steps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rich.text import Text

from fsmkit.diagnostics import Diagnostic, Findings, render
from fsmkit.runtime.trace_text import pretty
from fsmkit.testing.running import Outcome
from fsmkit.testing.suite import Suite

MOST_STEPS = 20
"""Macrosteps that are shown before a failure."""


def failure_findings(outcome: Outcome) -> Iterable[Diagnostic]:
    """Return a finding for each failure, at its place in the file of tests."""
    findings = Findings()
    for failure in outcome.failures:
        findings.add("failed-test", failure.message, failure.at)
    return findings


def story(suite: Suite, outcome: Outcome) -> Iterator[Text]:
    """Yield the last macrosteps before a failure."""
    charts = {machine.name: machine.chart for machine in suite.system.machines}
    happened = outcome.happened[-MOST_STEPS:]
    if len(happened) < len(outcome.happened):
        yield Text(f"    ... {len(outcome.happened) - len(happened)} steps before", style="dim")
    for each in happened:
        name = "" if suite.system.is_open else f"{each.machine}: "
        for line in pretty(charts[each.machine], each.macrostep):
            yield Text.assemble("    ", (name, "blue"), line)


def failure_text(suite: Suite, outcome: Outcome) -> str:
    """Return all of it as plain text."""
    lines = [line.plain for line in story(suite, outcome)]
    lines += [render(finding) for finding in failure_findings(outcome)]
    return "\n".join(lines)
