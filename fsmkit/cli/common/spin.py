"""``fsmkit export --replay-trail``: a path that SPIN found, shown as a counterexample."""

from __future__ import annotations

from pathlib import Path

from fsmkit.cli.common.console import err, out, print_json, report
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import Findings
from fsmkit.export.exporter import ExportOptions
from fsmkit.export.network import Network
from fsmkit.export.promela.trail import counterexample_of
from fsmkit.system.properties.property import Property
from fsmkit.system.system import System
from fsmkit.verify.report.counterexample import Counterexample, as_json
from fsmkit.verify.report.show import counterexample
from fsmkit.verify.report.verdict import Report, Result, Verdict
from fsmkit.verify.statespace.exploration import End, Exploration
from fsmkit.verify.testgen.save import saved


def show_trail(
    system: System,
    wanted: ExportOptions,
    file: Path,
    path: Path,
    folder: Path | None,
    *,
    as_json_: bool,
) -> int:
    """Print the path, and save it into a folder; return the exit code: 1, it is a violation."""
    network, property_, trace = counterexample_of(system, wanted, path)
    result = _result(property_, trace)
    traced = saved(_report(network, result), file, folder) if folder is not None else {}
    write_files(traced, folder)
    report(Findings())
    if as_json_:
        print_json(
            {
                "property": result.name,
                "verdict": result.verdict.value,
                "trace": as_json(trace),
                "replayed": list(trace.replayed),
            }
        )
    else:
        out.print(counterexample(result))
        if trace.differs:
            err.print(trace.differs, style="bold red")
        if traced:
            out.print(f"saved {len(traced)} files in {folder}", style="dim")
    return 1


def _result(property_: Property | None, trace: Counterexample) -> Result:
    if property_ is None:
        return Result("path of SPIN", None, "", Verdict.VIOLATED, trace=trace)
    return Result(
        property_.name,
        property_.kind,
        property_.text,
        Verdict.VIOLATED,
        trace=trace,
        span=property_.span,
    )


def _report(network: Network, result: Result) -> Report:
    """Return the path as a report for saving."""
    steps = 0 if result.trace is None else len(result.trace.steps)
    exploration = Exploration(
        engine="spin",
        end=End.DECIDED,
        why="",
        states=network.states,
        transitions=network.transitions,
        depth=steps,
        bytes=0,
        seconds=0,
        marks=(),
        livelock_known=False,
        livelock=None,
        traps_known=False,
        traps=(),
        machines=(),
    )
    return Report(network.closed, exploration, (result,), Findings(), ())
