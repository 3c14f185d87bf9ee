"""Extension modules of CPython as a target."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fsmkit.codegen.target import EXTRAS, Generated, named_parts
from fsmkit.diagnostics import Findings

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart


@dataclass(frozen=True, slots=True)
class ExtensionTarget:
    """Writes ``<machine>.abi3.so`` with its sources and its types."""

    name: str = "pyext"
    summary: str = "the C as an extension module of CPython, with the class of the Python module"
    options: tuple[str, ...] = ("prefix", "trace", "with", "build")

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the files, or None after saying what C cannot express.

        Options: ``build``, if it is ``on``, makes the extension module itself; ``trace``, if it is
        ``on``, gives the machine a `trace`; ``prefix`` names module and class; ``with`` may be
        ``save``, ``records`` and ``coverage``.
        """
        from fsmkit.codegen.c.limits import report_limits
        from fsmkit.codegen.c.naming import require_prefix
        from fsmkit.codegen.pyext.build import build, suffix
        from fsmkit.codegen.pyext.generate import generate, source_name

        extras = named_parts(options, "with", EXTRAS)
        require_prefix(options.get("prefix"))
        report_limits(chart, findings)
        if findings.has_errors:
            return None
        is_traced = options.get("trace") == "on"
        prefix = options.get("prefix")
        parts = {
            "saved": "save" in extras,
            "recorded": "records" in extras,
            "covered": "coverage" in extras,
        }
        module, files = generate(chart, prefix, traced=is_traced, **parts)
        built = {}
        if options.get("build") == "on":
            made = build(files, source_name(module), module.name)
            built[f"{module.name}{suffix()}"] = made
        return Generated(files, module.machine.figures, built)


PLUGIN = ExtensionTarget()
