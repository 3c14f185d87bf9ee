"""Packages as a target: the C of a chart where builds of others look for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from fsmkit.diagnostics import Findings, fail
from fsmkit.plugins import Generated

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart

KINDS = ("arduino", "esp-idf", "platformio", "zephyr")


class Package:
    """C as a library of Arduino, ESP-IDF, PlatformIO or Zephyr."""

    name = "package"
    summary = "C as a library of Arduino, ESP-IDF, PlatformIO or Zephyr, with an example"
    options: tuple[str, ...] = ("prefix", "package", "with", "without", "optimize")

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the files, or None after saying what C cannot express.

        Options: ``package``, one of `KINDS`; the others as of the target ``c``.
        """
        from fsmkit.codegen.c.generate import generate_machine
        from fsmkit.codegen.c.limits import report_limits
        from fsmkit.codegen.c.names import require_prefix
        from fsmkit.codegen.c.options import read_options, report_missing
        from fsmkit.codegen.packages.packing import packed

        kind = options.get("package", "")
        if kind not in KINDS:
            raise fail(
                "wrong-option",
                f"there is no package `{kind}`" if kind else "no kind of package is named",
                help=f"use `--package` with {', '.join(KINDS)}",
            )
        chosen = read_options(options)
        if "trace" in chosen.extras:
            raise fail(
                "wrong-option",
                "a package compiles all its sources, and a trace replaces one of them",
                help="compile with `--with trace` and without `--package`",
            )
        require_prefix(options.get("prefix"))
        report_limits(chart, findings)
        report_missing(chart, chosen, findings)
        if findings.has_errors:
            return None
        machine = generate_machine(chart, options.get("prefix"), chosen)
        return Generated(packed(kind, machine.names, machine.files), machine.figures)


PLUGIN = Package()
