"""Selects charts that behave equally as an FMU and in the interpreter, for every step size."""

from __future__ import annotations

from fsmkit.chart.analysis.effects import has_effect
from fsmkit.chart.chart import Chart
from fsmkit.codegen.fmu.generate import report_fmu_limits
from fsmkit.codegen.fmu.variables import variables_of
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Trigger
from fsmkit.language import FloatType
from fsmkit.plan.lower import lower


def can_be_compared(chart: Chart, version: str) -> bool:
    findings = Findings()
    report_fmu_limits(chart, findings)
    # how often such a guard is evaluated depends on how often the importer steps
    polls = any(
        t.trigger is Trigger.EVENTLESS and t.guard is not None and has_effect(t.guard)
        for t in chart.transitions
    )
    # a Real of FMI 2.0 does not hold every whole number of 64 bits
    of_2 = variables_of(chart, lower(chart), with_clocks=False)
    is_rounded = version == "2.0" and any(
        v.kind2 == "Real" and not isinstance(v.type, FloatType | None) for v in of_2
    )
    return not findings.has_errors and not polls and not is_rounded
