"""Bindings of charts to existing C: which one counts, and ``fsmkit check`` of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from fsmkit.binding.checks import check_binding
from fsmkit.binding.model import Binding
from fsmkit.binding.reader import beside, chart_of, read_binding
from fsmkit.chart.chart import Chart
from fsmkit.cli.common.console import print_json, report, result
from fsmkit.cli.common.options import Reading
from fsmkit.diagnostics.as_json import as_json as data_of
from fsmkit.system.reading import read_chart

NO_BINDING = "none"


def bound_by(file: Path, option: str | None, model: object, target: str) -> str | None:
    """Return the file of the binding that a chart is compiled with; None without one.

    ``option``: as it was given; by default the file of that name beside the chart counts, for the
    target ``c``.
    """
    if option == NO_BINDING:
        return None
    if option is not None:
        if not isinstance(model, Chart):
            raise click.UsageError("--binding is for one chart; a system has several")
        return option
    if target != "c" or not isinstance(model, Chart):
        return None
    found = beside(file)
    return None if found is None else str(found)


def check_bindings(files: Sequence[Path], reading: Reading, *, as_json: bool) -> int:
    """Report what of bindings does not fit their charts; 0 if all fit.

    Raises `FsmkitError` with every finding of the first file that cannot be used.
    """
    findings = reading.findings()
    read = []
    for file in files:
        binding = read_binding(file, findings)
        chart = read_chart(chart_of(binding), findings, strict=reading.strict)
        check_binding(binding, chart, findings)
        findings.stop_on_errors()
        read.append((file, binding))
    report(findings)
    if as_json:
        told = [{"file": str(f), "chart": b.chart.value, **figures(b)} for f, b in read]
        print_json({"bindings": told, "findings": [data_of(finding) for finding in findings]})
        return 0
    for file, binding in read:
        counts = ", ".join(f"{what} {count}" for what, count in figures(binding).items())
        result.print(f"{file}: {counts}", markup=False, highlight=False)
    return 0


def figures(binding: Binding) -> dict[str, int]:
    """Return how much of each kind is bound."""
    return {
        "constants": len(binding.constants),
        "types": len(binding.types),
        "operations": len(binding.operations),
        "sends": len(binding.sends),
        "inputs": len(binding.inputs),
        "outputs": len(binding.outputs),
        "names": len(binding.names),
    }
