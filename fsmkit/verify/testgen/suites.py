"""Save traces as tests: a pytest, for the interpreter and the generated Python, and a C program."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from pprint import pformat

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.system.parts import named_charts
from fsmkit.diagnostics import Findings, FsmkitError, fail
from fsmkit.emit import Namer, legal
from fsmkit.emit.python import docstring
from fsmkit.system.channels import without_channels
from fsmkit.system.system import System
from fsmkit.system.without_environment import without_world
from fsmkit.verify.report.counterexample import Counterexample
from fsmkit.verify.report.verdict import Report, Verdict
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.sessions import require_alone
from fsmkit.verify.testgen.cover import Cover, named_paths, table
from fsmkit.verify.testgen.replay_c import Scenario, in_c
from fsmkit.verify.testgen.save import LONGEST, recorded

SUFFIXES = (".py", ".c")
PYTEST = '''"""{about}"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fsmkit.verify.replay import perform, perform_in_python

FOLDER = Path(__file__).parent
PATHS: dict[str, dict[str, Any]] = {paths}


@pytest.mark.parametrize("name", PATHS)
def test_interpreter(name: str) -> None:
    path = PATHS[name]
    assert perform(path, FOLDER) == [step["lines"] for step in path["steps"]]


@pytest.mark.parametrize("name", PATHS)
def test_generated_python(name: str) -> None:
    path = PATHS[name]
    expected = [[x for x in step["lines"] if x[0] != "@"] for step in path["steps"]]
    assert perform_in_python(path, FOLDER) == expected
'''


def require_language(path: Path) -> None:
    """Raise `FsmkitError` if no language of tests has the suffix of a file."""
    if path.suffix.lower() not in SUFFIXES:
        raise fail(
            "unknown-suffix",
            f"no language for tests has the suffix `{path.suffix}` of `{path.name}`",
            help=f"use one of {', '.join(SUFFIXES)}",
        )


def covering(folder: Path, found: Cover, source: Path, charts: Sequence[Chart]) -> dict[Path, str]:
    """Return the files of a suite that covers machines, and the page on its coverage."""
    name = legal(found.closed.system.name)[:LONGEST].lower()
    files = {folder / "coverage.md": table(found)}
    if found.paths:
        for path in (folder / f"test_{name}_cover.py", folder / f"{name}_cover.c"):
            files[path] = suite(path, found.closed, named_paths(found), source, charts)
    return files


def traces(report: Report) -> dict[str, tuple[str, Counterexample]]:
    """Return the traces of a report by the name of a test, each with its description."""
    found, namer = {}, Namer()
    for result in report.results:
        if result.trace is not None and result.trace.steps:
            word = "violates" if result.verdict is Verdict.VIOLATED else "reaches"
            name = namer.name(
                re.sub(r"\W+", "_", word + "_" + result.name, flags=re.ASCII)[:LONGEST]
            )
            found[name] = word + " " + result.name + ": " + result.text, result.trace
    return found


def suite(
    path: Path,
    closed: ClosedSystem,
    paths: Mapping[str, tuple[str, Counterexample]],
    source: Path,
    charts: Sequence[Chart],
) -> str:
    """Return a file of tests, by its suffix; ``charts`` are named as they are compiled."""
    for machine in closed.system.machines:
        way_out = "save the traces with `--save-trace`: the interpreter performs them"
        require_alone(machine.chart, "no tests of generated code are written", way_out)
    if path.suffix.lower() == ".py":
        return _pytest(path, closed, paths, source)
    for machine in closed.system.machines:
        if machine.any_start:
            raise fail(
                "wrong-option",
                f"`{machine.name}` starts from any value, but its code from the chart's value",
                help="write the tests as a pytest (`.py`), or name the value under `start`",
            )
    about = [
        f"{source.name}: paths that fsmkit check found, for the machines in C:",
        *(f"  {name}: {text}" for name, (text, _) in paths.items()),
        "Compile them and this:",
        *(f"    fsmkit compile {name} --out generated" for name in _compiled(closed, source)),
    ]
    scenarios = [Scenario(name, text, trace.steps) for name, (text, trace) in paths.items()]
    return in_c(closed, scenarios, charts, about, path.name)


def _pytest(
    path: Path, closed: ClosedSystem, paths: Mapping[str, tuple[str, Counterexample]], source: Path
) -> str:
    folder = path.resolve().parent
    documents = {}
    for name, (text, trace) in paths.items():
        found = dict(recorded(closed, trace, source), text=text)
        found["file"] = os.path.relpath(source.resolve(), folder)
        found["replaced"] = {
            n: os.path.relpath(Path(file).resolve(), folder) for n, file in closed.system.replaced
        }
        found["wires"] = [
            os.path.relpath(Path(file).resolve(), folder) for file in closed.system.wires
        ]
        found["steps"] = [{"lines": list(step.lines)} for step in trace.steps]
        documents[name] = found
    about = f"{source.name}: paths that `fsmkit check` found, performed again."
    shown = pformat(documents, width=98, compact=True, sort_dicts=False)
    return PYTEST.format(about=docstring(about), paths=shown)


def _compiled(closed: ClosedSystem, source: Path) -> list[str]:
    """Return the files to compile: charts, or the system if it gives them constants or names."""
    if closed.is_open:
        return [source.as_posix()]
    found: dict[str, None] = {}
    for machine in closed.system.machines:
        if machine.environment or machine.is_channel:
            continue
        path = Path(machine.chart.states[0].span.source.name)
        if not _is_whole(path, machine.chart):
            return [source.as_posix()]
        found[path.as_posix()] = None
    return list(found)


def _is_whole(path: Path, chart: Chart) -> bool:
    """Whether a file holds exactly this chart."""
    try:
        return load(path) == chart
    except FsmkitError:
        return False


def compiled_charts(system: System, explored: System) -> tuple[Chart, ...]:
    """Return the charts of the explored machines, named as `fsmkit compile` names them."""
    whole = system
    if not system.of_chart:  # named as without the environment
        whole = without_world(without_channels(system), Findings()).system
    named = tuple(m.chart for m in whole.machines) if system.of_chart else named_charts(whole)
    known = dict(zip((machine.name for machine in whole.machines), named, strict=True))
    return tuple(known.get(machine.name, machine.chart) for machine in explored.machines)
