"""Scripts as scenarios of a page: what `fsmkit run --script` does, as commands of the page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import Text, fail
from fsmkit.inspector.bundle import Scenario
from fsmkit.loading import read_bytes
from fsmkit.runtime.interpreter.snapshot import Occurrence
from fsmkit.runtime.live.values import to_json
from fsmkit.runtime.script import read_line, script_texts, wrong_line
from fsmkit.runtime.system_session import read_post
from fsmkit.system.system import System
from fsmkit.texts import plain

KNOWN = "a scenario has the lines `start`, `post`, `input` (of a chart alone) and `run`"
Json = dict[str, Any]


def read_scenario(system: System, path: Path) -> Scenario:
    """Read a script of a system, or of the chart that stands for it.

    `FsmkitError`: ``unreadable-file``, ``wrong-script-line`` for a line that no page can do.
    """
    text = read_bytes(path).decode("utf-8", errors="replace")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    actions = tuple(_actions(system, list(script_texts(lines, str(path)))))
    if not actions:
        raise fail("wrong-script-line", f"there is nothing in `{path}`", help=KNOWN)
    return Scenario(path.stem, "", actions)


def _actions(system: System, lines: list[Text]) -> Iterator[Json]:
    of_chart = system.is_open and len(system.machines) == 1
    for line in lines:
        found = _of_chart(system, line) if of_chart else _of_system(system, line)
        if found is not None:
            yield found


def _of_chart(system: System, line: Text) -> Json | None:
    """Return what a line of the script of a chart does; None for what only prints."""
    machine = system.machines[0]
    read = read_line(machine.chart, line)
    match read.verb:
        case "start" if read.number == 0:
            return {"do": "start"}
        case "start":
            raise wrong_line(line, "the time of a page begins at 0", "write `start 0`")
        case "run":
            return {"do": "run", "at": read.number}
        case "post":
            return _post(system, machine.name, read.event)
        case "input":
            declared = machine.chart.inputs[read.number]
            value = to_json(read.value, declared.type)
            return {"do": "set", "m": plain(machine.name), "input": declared.name, "value": value}
        case "dump":
            return None
        case "seed" if read.number == 1:
            return None
        case verb:
            raise wrong_line(line, f"a page has no line `{verb}`", KNOWN)


def _of_system(system: System, line: Text) -> Json:
    verb, _, rest = line.value.strip().partition(" ")
    charts = {machine.name: machine.chart for machine in system.machines}
    match verb:
        case "start":
            return {"do": "start"}
        case "post":
            return _post(system, *read_post(charts, line))
        case "run" if rest.strip().isdecimal():
            return {"do": "run", "at": int(rest)}
        case _:
            raise wrong_line(line, f"a page has no line `{verb}`", KNOWN)


def _post(system: System, name: str, occurrence: Occurrence) -> Json:
    machine = next(each for each in system.machines if each.name == name)
    event = machine.chart.events[occurrence.event]
    pairs = zip(event.fields, occurrence.payload, strict=True)
    payload = {plain(field.name): to_json(value, field.type) for field, value in pairs}
    return {"do": "post", "m": plain(name), "event": event.name, "with": payload}
