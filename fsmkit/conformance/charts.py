"""Charts as they are found, without a test: how far each gets on the way to C."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.codegen.c.compiler import compile_c
from fsmkit.conformance.conformance import Result, reason_of, time_limit
from fsmkit.conformance.meaning import REFUSED, Cause, count_causes, replaced
from fsmkit.diagnostics import Findings, FsmkitError, Severity
from fsmkit.loading import read_documents
from fsmkit.plugins import Target, plugin

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
NO_CHART = frozenset({"not-scxml", "not-a-chart"})
"""Rules broken by files that look like charts by their suffix only."""


class Stage(IntEnum):
    """How far a file got."""

    NOWHERE = 0
    READ = 1
    """It became a Document."""
    CHART = 2
    COMPILED = 3
    """The C compiler took the generated C without a word."""


@dataclass(frozen=True, slots=True)
class Reading:
    """How far a file got, with how many warnings, and what stopped it."""

    name: str
    stage: Stage
    warnings: int
    reason: str
    is_chart: bool = True
    replaced: tuple[str, ...] = ()
    """The cause of each place that is replaced by an error at run time."""

    @property
    def causes(self) -> tuple[str, ...]:
        """Return why the meaning is not kept; nothing where every condition and content is."""
        return self.replaced if self.stage >= Stage.CHART else (REFUSED,)

    @property
    def result(self) -> Result:
        """Return the result in terms of a test: whether it compiles."""
        if not self.is_chart:
            return Result.SKIPPED
        return Result.PASSED if self.stage is Stage.COMPILED else Result.FAILED


def read_chart(path: Path, name: str, limit: float) -> Reading:
    """Take one file as far as it gets; it never raises. ``limit``: seconds."""
    findings = Findings()
    stage, reason = Stage.NOWHERE, ""
    try:
        with time_limit(limit):
            documents = read_documents(path, findings)
            stage = Stage.READ
            chart = elaborate(documents, findings)
            findings.stop_on_errors()
            if chart is None:
                raise FsmkitError(findings)
            stage = Stage.CHART
            compile_strictly(chart, findings)
            stage = Stage.COMPILED
    except FsmkitError as error:
        findings.extend(error.diagnostics)
        reason = reason_of(error)
    except Exception as error:  # noqa: BLE001  (a bug fails one file, not the run)
        reason = reason_of(error)
    warnings = sum(d.severity is Severity.WARNING for d in findings)
    is_chart = NO_CHART.isdisjoint(_errors(findings))
    return Reading(name, stage, warnings, reason, is_chart, replaced(findings))


def compile_strictly(chart: Chart, findings: Findings) -> None:
    """Generate C and compile it without linking, each warning an error, in a temporary folder."""
    generated = plugin(Target, "c").generate(chart, findings, {})
    findings.stop_on_errors()
    if generated is None:
        raise FsmkitError(findings)
    with tempfile.TemporaryDirectory(prefix="fsmkit-") as folder:
        for name, text in generated.files.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        sources = [name for name in generated.files if name.endswith(".c")]
        compile_c([*STRICT, "-c", *sources], Path(folder))


def totals(readings: Iterable[Reading]) -> dict[str, int]:
    """Return how many charts got how far, and how many compiled without a warning of ours."""
    charts = [reading for reading in readings if reading.is_chart]
    compiled = [reading for reading in charts if reading.stage is Stage.COMPILED]
    return {
        "files": len(charts),
        "read": sum(reading.stage >= Stage.READ for reading in charts),
        "charts": sum(reading.stage >= Stage.CHART for reading in charts),
        "compiled": len(compiled),
        "compiled_without_warning": sum(not reading.warnings for reading in compiled),
    }


@dataclass(frozen=True, slots=True)
class Meaning:
    """How many of the charts keep every condition and every content, and why others do not."""

    files: int
    kept: int
    causes: tuple[Cause, ...]

    @property
    def places(self) -> int:
        """Return how many places are replaced by an error."""
        return sum(cause.places for cause in self.causes if cause.name != REFUSED)


def meaning(readings: Iterable[Reading]) -> Meaning:
    """Return how many charts keep their meaning."""
    causes = [reading.causes for reading in readings if reading.is_chart]
    return Meaning(len(causes), causes.count(()), count_causes(causes))


def _errors(findings: Findings) -> set[str]:
    return {d.rule.name for d in findings if d.severity is Severity.ERROR}
