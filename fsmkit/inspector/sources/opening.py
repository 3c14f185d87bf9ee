"""From a path to whatever a hub shows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.inspector.sources import Recorded
from fsmkit.system.deployment import Deployment
from fsmkit.system.reading import read
from fsmkit.system.system import System


@dataclass(frozen=True, slots=True)
class Opened:
    """Something to be shown, and the file of its chart or system, which saved tests name."""

    source: Chart | System | Recorded
    file: Path
    name: str


def open_source(path: Path, findings: Findings, *, strict: bool = False) -> Opened:
    """Return what a file holds: a chart or a system, or (``.json``) a trace of ``check``.

    `FsmkitError` with every finding, where it cannot be read.
    """
    if path.suffix == ".json":
        from fsmkit.inspector.sources.counterexample import read_trace

        trace, file = read_trace(path)
        return Opened(trace, file, trace.system.name)
    model = read(path, findings, strict=strict)
    model = model.written if isinstance(model, Deployment) else model
    return Opened(model, path, model.name)
