"""FMUs as a target."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from fsmkit.codegen.target import Generated
from fsmkit.diagnostics import Findings, fail

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart
    from fsmkit.system.system import System

VERSIONS = ("3.0", "2.0")


class Fmu:
    """Co-simulation by FMI 3.0 with Clocks, or by FMI 2.0 with counters."""

    name = "fmu"
    summary = "an FMU for co-simulation, FMI 3.0 or 2.0, with its sources"
    options: tuple[str, ...] = ("prefix", "fmi", "build")

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the FMU, or None after reporting the chart's unsupported parts.

        Options: ``fmi``, the version, ``3.0`` or ``2.0``; ``build``, if it is ``on``, adds a
        library for this platform; ``prefix`` replaces the chart's name in C.
        """
        from fsmkit.codegen.c.naming import require_prefix
        from fsmkit.codegen.fmu.generate import generate

        version = _version(options)
        require_prefix(options.get("prefix"))
        if not _can_express((chart,), findings):
            return None
        name, data, figures = generate(
            chart,
            version,
            options.get("prefix"),
            with_binary=options.get("build") == "on",
        )
        return Generated({}, figures, {f"{name}.fmu": data})

    def generate_system(
        self, system: System, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return one FMU of the machines and their connections; options as in `generate`.

        Machines of the environment model its surroundings and are omitted.
        """
        from fsmkit.codegen.fmu.generate import generate_system, surrounded

        version = _version(options)
        own = surrounded(system)
        charts = tuple(dict.fromkeys(machine.chart for machine in own.machines))
        if not _can_express(charts, findings):
            return None
        with_binary = options.get("build") == "on"
        made = generate_system(own, version, findings, with_binary=with_binary)
        if made is None:
            return None
        name, data, figures = made
        return Generated({}, figures, {f"{name}.fmu": data})


def _version(options: Mapping[str, str]) -> str:
    version = options.get("fmi", VERSIONS[0])
    if version not in VERSIONS:
        raise fail(
            "wrong-option", f"there is no FMI `{version}`", help=f"use {' or '.join(VERSIONS)}"
        )
    return version


def _can_express(charts: Iterable[Chart], findings: Findings) -> bool:
    from fsmkit.codegen.c.limits import report_limits
    from fsmkit.codegen.fmu.generate import report_fmu_limits

    for chart in charts:
        report_limits(chart, findings)
        report_fmu_limits(chart, findings)
    return not findings.has_errors


PLUGIN = Fmu()
