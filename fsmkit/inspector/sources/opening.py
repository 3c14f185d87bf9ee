"""Open the source of a session from a path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import Findings, fail
from fsmkit.inspector.sources import Recorded
from fsmkit.inspector.sources.live_file import is_live, read_live
from fsmkit.inspector.sources.log import read_log
from fsmkit.system.any_file import NONE, read
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.system import System


@dataclass(frozen=True, slots=True)
class Opened:
    """Something to be shown, and the file of its chart or system, which saved tests name."""

    source: Chart | System | Recorded
    file: Path
    name: str

    @property
    def model(self) -> Chart | System | None:
        """The chart or system, if it is simulated."""
        return self.source if isinstance(self.source, Chart | System) else None


def open_source(
    path: Path,
    findings: Findings,
    replacing: Mapping[str, Path] | None = None,
    *,
    strict: bool = False,
    parameters: Mapping[str, str] = NONE,
    replay: Path | None = None,
    instance: int | None = None,
) -> Opened:
    """Open a file as the source of a session.

    The file is a chart or a system, a trace of ``check`` (``.json``), or messages (``.live``,
    ``.live.gz``). ``replacing``: other charts for machines of a system. ``replay``: the log of a
    machine in C or a file of messages, shown instead of a simulation; ``instance``: the machine in
    the log. ``strict`` and ``parameters`` are those of `read_model`. Raises `FsmkitError` with all
    findings if a file cannot be read.
    """
    messages = next((each for each in (replay, path) if each is not None and is_live(each)), None)
    if messages is not None:
        recorded, file = read_live(messages, findings, None if messages is path else path)
        return Opened(recorded, file, recorded.system.name)
    if path.suffix == ".json" and not _is_chart(path):
        from fsmkit.inspector.sources.counterexample import read_trace

        trace, file = read_trace(path)
        return Opened(trace, file, trace.system.name)
    model = read_model(path, findings, replacing, strict=strict, parameters=parameters)
    if replay is None:
        return Opened(model, path, model.name)
    if not isinstance(model, Chart):
        raise fail(
            "foreign-log",
            f"`{path}` is a system, and a log is of one machine",
            help="name the chart of the machine",
        )
    return Opened(read_log(model, read_bytes(replay), instance), path, model.name)


def _is_chart(path: Path) -> bool:
    """Return whether a file of JSON is a machine of another tool, and no trace."""
    content = read_bytes(path)
    return b'"states"' in content and b'"trail"' not in content


def read_model(
    path: Path,
    findings: Findings,
    replacing: Mapping[str, Path] | None = None,
    *,
    strict: bool = False,
    parameters: Mapping[str, str] = NONE,
) -> Chart | System:
    """Return the chart or system of a file; of a deployment its system.

    ``replacing``, ``strict``, ``parameters``: as of `fsmkit.system.any_file.read`.
    """
    model = read(path, findings, replacing, strict=strict, parameters=parameters)
    return model.written if isinstance(model, Deployment) else model
