"""Extension modules of CPython as a target."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fsmkit.codegen.c.limits import report_limits
from fsmkit.codegen.pyext.build import build, suffix
from fsmkit.codegen.pyext.generate import generate, source_name
from fsmkit.codegen.pyext.harness import run_many
from fsmkit.diagnostics import Findings
from fsmkit.model.chart import Chart
from fsmkit.plugins import Generated


@dataclass(frozen=True, slots=True)
class ExtensionTarget:
    """Writes ``<machine>.abi3.so`` with its sources and its types."""

    name: str = "pyext"
    summary: str = "the C as an extension module of CPython, with the class of the Python module"

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the files, or None after saying what C cannot express.

        Options: ``build``, if it is ``on``, makes the extension module itself; ``trace``, if it is
        ``on``, gives the machine a `trace`; ``prefix`` names module and class.
        """
        report_limits(chart, findings)
        if findings.has_errors:
            return None
        is_traced = options.get("trace") == "on"
        module, files = generate(chart, options.get("prefix"), traced=is_traced)
        built = {}
        if options.get("build") == "on":
            made = build(files, source_name(module), module.name)
            built[f"{module.name}{suffix()}"] = made
        return Generated(files, module.machine.figures, built)

    def harness_run(self, chart: Chart, script_lines: Sequence[str]) -> list[str]:
        """Build a chart and return the trace of a script."""
        (lines,) = self.harness_run_all([(chart, script_lines)])
        return lines

    def harness_run_all(self, pairs: Sequence[tuple[Chart, Sequence[str]]]) -> list[list[str]]:
        """Build several charts at once and return the trace of each one's script."""
        findings = Findings()
        for chart, _ in pairs:
            report_limits(chart, findings)
        findings.stop_on_errors()
        return run_many(pairs)


PLUGIN = ExtensionTarget()
