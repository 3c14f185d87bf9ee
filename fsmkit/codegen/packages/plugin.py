"""Packages as a target: the C of a chart in the layout of other build systems."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from fsmkit.codegen.target import Generated
from fsmkit.diagnostics import Findings, fail

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart

KINDS = ("arduino", "esp-idf", "platformio", "zephyr")
"""The packages of a chart."""


class Package:
    """C as a library of Arduino, ESP-IDF, PlatformIO or Zephyr."""

    name = "package"
    summary = "C as a library of Arduino, ESP-IDF, PlatformIO or Zephyr, with an example"
    options: tuple[str, ...] = ("prefix", "package", "with", "without", "optimize")

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the files, or None if C cannot express the chart (reported to `findings`).

        Options: ``package``, one of `KINDS`; the others as of the target ``c``.
        """
        from fsmkit.codegen.c.generate import machine_of
        from fsmkit.codegen.c.options import read_options
        from fsmkit.codegen.packages.packing import packed

        kind = options.get("package", "")
        if kind not in KINDS:
            raise fail(
                "wrong-option",
                f"there is no package `{kind}`" if kind else "no kind of package is named",
                help=f"use `--package` with {', '.join(KINDS)}",
            )
        replacing = {"trace", "records"} & read_options(options).extras
        if replacing:
            raise fail(
                "wrong-option",
                "a package compiles all its sources, and a trace replaces one of them",
                help=f"compile with `--with {min(replacing)}` and without `--package`",
            )
        machine = machine_of(chart, findings, options)
        if machine is None:
            return None
        return Generated(packed(kind, machine.names, machine.files), machine.figures)


PLUGIN = Package()
