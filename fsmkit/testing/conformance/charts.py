"""Read public charts without tests, and determine how many stages towards C each passes."""

from __future__ import annotations

import re
import tempfile
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.loading import read_documents
from fsmkit.chart.passes.context import REPLACING
from fsmkit.codegen.c.compiler import compile_c
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Diagnostic, Findings, FsmkitError, Severity
from fsmkit.plugins import plugin
from fsmkit.testing.conformance.conformance import Result, reason_of, time_limit

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
NO_CHART = frozenset({"not-scxml", "not-a-chart"})
"""Rules broken by files that only have the suffix of a chart."""


MISSING = "unloaded-source"
"""The rule that a chart breaks if the file of a script is missing (SCXML 5.8)."""


class Stage(IntEnum):
    """The last stage that a file passed."""

    NOWHERE = 0
    READ = 1
    """Valid SCXML, though an external script may be missing."""
    CHART = 2
    COMPILED = 3
    """The C compiler took the generated C without a word."""


@dataclass(frozen=True, slots=True)
class Reading:
    """The last stage of a file, the number of warnings, and the error."""

    name: str
    stage: Stage
    warnings: int
    reason: str
    is_chart: bool = True
    replacement_causes: tuple[str, ...] = ()
    """The cause of each place that is replaced by an error at run time."""

    @property
    def causes(self) -> tuple[str, ...]:
        """Return why the meaning is not kept; nothing where every condition and content is."""
        return self.replacement_causes if self.stage >= Stage.CHART else (REFUSED,)

    @property
    def result(self) -> Result:
        """Return the result in terms of a test: whether it compiles."""
        if not self.is_chart:
            return Result.SKIPPED
        return Result.PASSED if self.stage is Stage.COMPILED else Result.FAILED


def read_chart(path: Path, name: str, limit: float) -> Reading:
    """Process a file up to its last stage, without exceptions. ``limit``: seconds."""
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
        if _errors(findings) == {MISSING}:
            stage = max(stage, Stage.READ)
    except Exception as error:  # noqa: BLE001  (a bug fails one file, not the run)
        reason = reason_of(error)
    warnings = sum(d.severity is Severity.WARNING for d in findings)
    is_chart = NO_CHART.isdisjoint(_errors(findings))
    return Reading(name, stage, warnings, reason, is_chart, replacement_causes(findings))


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
    """Return the number of charts per stage, and of those that compiled without warnings."""
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
    """The number of charts that keep every condition and content, and the causes for others."""

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


REFUSED = "the file is not a chart"
"""The cause of a file that is rejected as a whole."""
CAUSES: Mapping[str, re.Pattern[str]] = {
    "a target that nothing is reached under": re.compile(r"is no target$|nothing is reached under"),
    "a service, processor or chart that is not there": re.compile(
        r"there is no (service|event processor)|names no chart$"
        r"|could not be read$|leaves the folder of the chart$"
    ),
    "an element without what SCXML demands, or of no SCXML": re.compile(
        r"`<[^>]*>` (has no `|is not executable content|follows)"
    ),
    "a call on an object": re.compile(r"cannot be called$"),
    "a name, state or operation that is not there": re.compile(
        r"unknown (name|operation|state|type)"
    ),
    "`_event.data` as a whole": re.compile(r"`_event\.data` is outside"),
    "`_event.type` and its like": re.compile(r"`_event\.\w+` is outside"),
    "a field that the event does not have": re.compile(r"(the event|event `[^`]*`) has no field"),
    "strings joined at run time": re.compile(r"strings cannot be joined|computed at run time"),
    "an object or a list that grows": re.compile(
        r"`\{` is not expected|of an empty list is unknown|has no (field|elements)|is not an array"
    ),
    "a function, loop, class or module": re.compile(
        r"`(function|new|import|this|JSON|Date)` is outside|loop without a bound"
    ),
    "`Math`": re.compile(r"`Math\.|this power|may not be whole"),
    "types that do not agree": re.compile(
        r"is expected\b|one side is|does not apply|is given|cannot be compared"
    ),
    "text of another language, or broken": re.compile(
        r"is not expected here|is not a statement|ends too early|is outside the language"
    ),
}
"""Causes in the order in which they are tried, by the message of the finding."""


@dataclass(frozen=True, slots=True)
class Cause:
    """Why places are replaced: in how many files, and how many places."""

    name: str
    files: int
    places: int


def replacement_causes(findings: Iterable[Diagnostic]) -> tuple[str, ...]:
    """Return the cause of each location of a chart that is replaced by an error.

    A lenient dialect replaces invalid parts by the ``error.execution`` that SCXML 5.9 and 6.4
    prescribe. Such a chart compiles, but not with the intended meaning.
    """
    return tuple(cause(d.message) for d in findings if d.rule.name in REPLACING)


def cause(message: str) -> str:
    """Return the cause of a message, `other` where none is known."""
    return next((name for name, told in CAUSES.items() if told.search(message)), "other")


def count_causes(files: Iterable[tuple[str, ...]]) -> tuple[Cause, ...]:
    """Return the causes in files, each given by those of its locations; the most frequent first."""
    in_files: Counter[str] = Counter()
    places: Counter[str] = Counter()
    for causes in files:
        places.update(causes)
        in_files.update(set(causes))
    ordered = sorted(in_files, key=lambda name: (-in_files[name], -places[name], name))
    return tuple(Cause(name, in_files[name], places[name]) for name in ordered)
