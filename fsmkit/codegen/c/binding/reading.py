"""The binding that an option of the target names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.codegen.existing_c.checks import check_binding
from fsmkit.codegen.existing_c.model import Binding
from fsmkit.codegen.existing_c.reader import read_binding
from fsmkit.diagnostics import Findings


def binding_of(chart: Chart, options: Mapping[str, str], findings: Findings) -> Binding | None:
    """Return the binding of the option ``binding``, checked against a chart; None without it.

    Raises:
        FsmkitError: With every finding, where the file cannot be used.

    """
    if "binding" not in options:
        return None
    binding = read_binding(Path(options["binding"]), findings)
    check_binding(binding, chart, findings)
    return binding
