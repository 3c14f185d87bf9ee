"""The target `javascript` as a plug-in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fsmkit.codegen.target import EXTRAS, Generated, named_parts
from fsmkit.diagnostics import Findings

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart


@dataclass(frozen=True, slots=True)
class JavaScriptTarget:
    """Writes ``<machine>.mjs``, what it imports, and their types."""

    name: str = "javascript"
    summary: str = "a module of ECMAScript 2020, for browsers and Node, with its small runtime"
    options: tuple[str, ...] = ("prefix", "with")

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the modules, or None after saying what JavaScript cannot express.

        Options: ``prefix`` names module and class instead of the chart; ``with`` may be ``save``.
        """
        from fsmkit.codegen.javascript.declarations import declarations_text
        from fsmkit.codegen.javascript.generate import (
            RUNTIME,
            class_name,
            file_name,
            library,
            module_text,
        )
        from fsmkit.plan.environment_only import report_environment_only

        saved = "save" in named_parts(options, "with", {"save": EXTRAS["save"]})
        if not report_environment_only(chart, findings, "javascript-sometimes"):
            return None
        prefix = options.get("prefix")
        text = module_text(chart, prefix, saved=saved)
        figures = {
            "states": len(chart.states) - 1,
            "transitions": len(chart.transitions),
            "lines": text.count("\n"),
        }
        name = file_name(chart, prefix)
        types = declarations_text(chart, class_name(chart, prefix), RUNTIME, saved=saved)
        files = {name: text, name.replace(".mjs", ".d.mts"): types, **library(saved=saved)}
        return Generated(files, figures)


PLUGIN = JavaScriptTarget()
