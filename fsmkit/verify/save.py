"""A counterexample as files: JSON, a pytest that performs it again, and a sequence diagram."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

from fsmkit.diagnostics import fail
from fsmkit.emit import legal
from fsmkit.runtime.clock import duration_text
from fsmkit.verify.closed import Closed
from fsmkit.verify.counterexample import Counterexample, as_json
from fsmkit.verify.moves import Action
from fsmkit.verify.verdict import Report, Result

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


def save(report: Report, source: Path, folder: Path) -> list[Path]:
    """Write the traces of a report into a folder and return the files; nothing on an error."""
    files: dict[Path, str] = {}
    for result in report.results:
        if result.trace is None or not result.trace.steps:
            continue
        name = re.sub(r"\W+", "_", f"{report.closed.system.name}_{result.name}")
        recorded = document(report.closed, result, result.trace, source)
        files[folder / f"{name}.json"] = json.dumps(recorded, indent=1) + "\n"
        files[folder / f"test_{name}.py"] = PYTEST.format(
            name=result.name,
            text=" ".join(result.text.split()).replace("\\", "/").replace('"', "'"),
            verdict="violation" if result.verdict.value == "violated" else "witness",
            file=name,
            identifier=name.lower(),
        )
        files[folder / f"{name}.mmd"] = mermaid(report.closed, result.trace)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, text in files.items():
            path.write_text(text, encoding="utf-8")
    except OSError as error:
        reason = (error.strerror or type(error).__name__).lower()
        raise fail(
            "unwritable-output",
            f"cannot write the traces into `{folder}`: {reason}",
            help="name a folder that can be written",
        ) from error
    return list(files)


def document(
    closed: Closed, result: Result, trace: Counterexample, source: Path
) -> Mapping[str, object]:
    """Return a trace as one JSON document, from which it can be performed again."""
    return {
        "file": str(source.resolve()),
        "replaced": {n: str(Path(file).resolve()) for n, file in closed.system.replaced},
        "property": result.name,
        "verdict": result.verdict.value,
        "text": result.text,
        "untimed": closed.untimed,
        "silent": closed.silent,
        "loop": trace.loop,
        "trail": [
            [[s.action.value, s.machine, s.argument, list(s.choices), str(s.ticks)] for s in steps]
            for steps in trace.trail
        ],
        "steps": as_json(trace),
    }


def mermaid(closed: Closed, trace: Counterexample) -> str:
    """Return a trace as a Mermaid sequence diagram."""
    lines = ["sequenceDiagram"]
    if any(step.action is Action.OCCUR for step in trace.steps):
        lines.append("  actor outside")
    names = [machine.name for machine in closed.system.machines]
    lines += [
        f"  participant {name}" if name.isidentifier() else f"  participant {legal(name)} as {name}"
        for name in names
    ]
    time = ""
    for number, step in enumerate(trace.steps):
        if number == trace.loop:
            lines.append("  loop for ever")
        at = "" if step.at is None else duration_text(step.at)
        if step.action is Action.ELAPSE:
            continue
        if at != time:
            first, last = legal(names[0]), legal(names[-1])
            over = first if first == last else f"{first},{last}"
            lines.append(f"  Note over {over}: {at}")
            time = at
        if step.action is Action.OCCUR:
            lines.append(f"  outside->>{legal(step.machine)}: {_plain(step.cause)}")
        goes = [name for name in step.after if name not in step.before]
        if goes:
            lines.append(f"  Note right of {legal(step.machine)}: {_plain(', '.join(goes))}")
        for sent in step.deliveries:
            arrow = "->>" if sent.is_event else "-->>"
            lines.append(f"  {legal(step.machine)}{arrow}{legal(sent.target)}: {_plain(sent.what)}")
    if trace.loop is not None:
        lines.append("  end")
    return "\n".join(lines) + "\n"


def _plain(text: str) -> str:
    return text.replace(";", ",").replace("#", "")
