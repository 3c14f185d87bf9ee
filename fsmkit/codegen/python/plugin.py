"""The Python target as a plug-in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fsmkit.codegen.target import EXTRAS, Generated, named_parts
from fsmkit.diagnostics import Findings

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart


@dataclass(frozen=True, slots=True)
class PythonTarget:
    """Writes ``<machine>.py``."""

    name: str = "python"
    summary: str = "a Python module that imports nothing but the standard library"
    options: tuple[str, ...] = ("prefix", "trace", "with")

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the module, or None after saying what Python cannot express.

        Options: ``trace``, if it is ``on``, gives the machine a `trace`; ``prefix`` names module
        and class instead of the chart; ``with`` may be ``save``, ``records`` and ``coverage``.
        """
        from fsmkit.codegen.python.generate import module_text
        from fsmkit.codegen.python.names import file_name
        from fsmkit.plan.environment_only import report_environment_only

        extras = named_parts(options, "with", EXTRAS)
        if not report_environment_only(chart, findings, "python-sometimes"):
            return None
        prefix = options.get("prefix")
        text = module_text(
            chart,
            traced=options.get("trace") == "on",
            prefix=prefix,
            saved="save" in extras,
            recorded="records" in extras,
            covered="coverage" in extras,
        )
        figures = {
            "states": len(chart.states) - 1,
            "transitions": len(chart.transitions),
            "lines": text.count("\n"),
        }
        return Generated({file_name(chart, prefix): text}, figures)


PLUGIN = PythonTarget()
