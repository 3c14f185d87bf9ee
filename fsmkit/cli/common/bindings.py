"""Bindings of charts to existing C: which one counts, and ``fsmkit check`` of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from fsmkit.chart.chart import Chart
from fsmkit.cli.common.counts import CountedFile, print_counts
from fsmkit.cli.common.options import Reading
from fsmkit.codegen.existing_c.checks import check_binding
from fsmkit.codegen.existing_c.model import Binding
from fsmkit.codegen.existing_c.reader import beside, chart_of, read_binding
from fsmkit.system.any_file import read_chart

NO_BINDING = "none"


def binding_file_of(file: Path, option: str | None, model: object, target: str) -> str | None:
    """Return the binding file of a chart, or None.

    ``option``: the given file; by default the one of that name beside the chart, for the target
    ``c``.
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
    """Report bindings that do not match their charts; return 0 if all match.

    Raises `FsmkitError` with every finding of the first invalid file.
    """
    findings = reading.findings()
    read = []
    for file in files:
        binding = read_binding(file, findings)
        chart = read_chart(chart_of(binding), findings, strict=reading.strict)
        check_binding(binding, chart, findings)
        findings.stop_on_errors()
        read.append((file, binding))
    counted = [CountedFile(file, b.chart.value, figures(b)) for file, b in read]
    return print_counts(counted, "bindings", "chart", findings, as_json=as_json)


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
