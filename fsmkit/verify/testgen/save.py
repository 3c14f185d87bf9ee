"""Save a counterexample as files: JSON, a pytest that performs it again, and a sequence diagram."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

from fsmkit.emit import legal
from fsmkit.emit.python import docstring
from fsmkit.verify.report.counterexample import Counterexample, as_json
from fsmkit.verify.report.sequence import sequence
from fsmkit.verify.report.sequences import mermaid
from fsmkit.verify.report.verdict import Report, Result
from fsmkit.verify.statespace.closed_system import ClosedSystem

LONGEST = 100
"""Characters in the name of a file; file systems take 255 bytes with its end."""
PYTEST = '''"""Performs the {verdict} of `{name}` again: {text}."""

from __future__ import annotations

import json
from pathlib import Path

from fsmkit.verify.replay import perform

TRACE = Path(__file__).with_name("{file}.json")


def test_{identifier}_is_performed_as_recorded() -> None:
    recorded = json.loads(TRACE.read_text(encoding="utf-8"))
    assert perform(recorded) == [step["lines"] for step in recorded["steps"]]
'''


def saved(report: Report, source: Path, folder: Path) -> dict[Path, str]:
    """Return the traces of a report as the files of a folder."""
    files: dict[Path, str] = {}
    for result in report.results:
        if result.trace is None or not result.trace.steps:
            continue
        name = name_of(report, result)
        recorded = document(report.closed, result, result.trace, source)
        files[folder / f"{name}.json"] = json.dumps(recorded, indent=1) + "\n"
        files[folder / f"test_{name}.py"] = PYTEST.format(
            name=docstring(result.name),
            text=docstring(" ".join(result.text.split())),
            verdict="violation" if result.verdict.value == "violated" else "witness",
            file=name,
            identifier=legal(name).lower(),
        )
        files[folder / f"{name}.mmd"] = mermaid.draw(sequence(report.closed, result, result.trace))
    return files


def json_traces(report: Report, folder: Path) -> dict[str, Path]:
    """Return the JSON files of `saved`, by property."""
    return {
        result.name: folder / f"{name_of(report, result)}.json"
        for result in report.results
        if result.trace is not None and result.trace.steps
    }


def name_of(report: Report, result: Result) -> str:
    """Return the name of the files of a trace, without a suffix."""
    return re.sub(r"\W+", "_", f"{report.closed.system.name}_{result.name}")[:LONGEST]


def document(
    closed: ClosedSystem, result: Result, trace: Counterexample, source: Path
) -> Mapping[str, object]:
    """Return a trace as a JSON document, from which it can be performed again."""
    return {
        "property": result.name,
        "verdict": result.verdict.value,
        "text": result.text,
        **recorded(closed, trace, source),
        "steps": as_json(trace),
    }


def recorded(closed: ClosedSystem, trace: Counterexample, source: Path) -> Mapping[str, object]:
    """Return the data for performing a path again."""
    return {
        "file": str(source.resolve()),
        "replaced": {n: str(Path(file).resolve()) for n, file in closed.system.replaced},
        "parameters": dict(closed.system.parameters),
        "wires": [str(Path(file).resolve()) for file in closed.system.wires],
        "untimed": closed.untimed,
        "silent": closed.silent,
        "loop": trace.loop,
        "trail": [
            [[s.action.value, s.machine, s.argument, list(s.choices), str(s.ticks)] for s in steps]
            for steps in trace.trail
        ],
    }
