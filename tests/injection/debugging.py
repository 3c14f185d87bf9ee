"""The debug adapter as an output: an editor asks for all that there is, and types every name."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import Findings
from fsmkit.inspector.dap.framing import Frames, frame
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System
from tests.inspector.dap.editor import Editor

MOST_LINES = 60


def debugged(file: Path, folder: Path) -> bool:
    """Debug a file; whether it can be launched. Every text comes through JSON as it was."""
    del folder
    editor = Editor()
    editor.get("initialize", adapterID="fsmkit")
    launched = editor.ask("launch", program=str(file), speed=0, trace=True)
    if not launched["success"]:
        assert launched["body"]["findings"]
        return False
    system = load_any(file, Findings())
    _set_breakpoints(editor, system, file)
    editor.get("configurationDone")
    threads = editor.get("threads")["threads"]
    assert [thread["name"] for thread in threads] == [str(m.name) for m in system.machines]
    for machine in system.machines:
        for event in machine.chart.events:
            for line in (f"post {machine.name}.{event.name}", str(event.name), f"why {event.name}"):
                editor.answers("evaluate", {"expression": line, "context": "repl"})
    for command in ("next", "stepIn", "stepOut", "stepBack", "continue", "reverseContinue"):
        editor.answers(command, {"threadId": 1})
        if command == "continue" and editor.adapter.hub is not None:
            editor.adapter.hub.advance(1_000_000)
    _look_at_all(editor, system, len(threads))
    editor.get("disconnect")
    for message in editor.messages:
        text = frame(message)
        (body,) = Frames().feed(text)
        assert text.isascii()
        assert json.loads(body) == message
    return True


def _set_breakpoints(editor: Editor, system: System, file: Path) -> None:
    """Set breakpoints at every line and on every name, with names in conditions and logs."""
    charts = [machine.chart for machine in system.machines]
    names = [str(state.id) for chart in charts for state in chart.states]
    names += [str(event.name) for chart in charts for event in chart.events]
    names += [str(datum.name) for chart in charts for datum in chart.data]
    sources = {source.name for chart in charts for source in chart.sources} | {str(file)}
    for source in sorted(sources):
        lines: list[dict[str, Any]] = [
            {"line": line, "logMessage": f"{{{name}}} {name}", "condition": name}
            for line, name in zip(range(1, MOST_LINES), names * MOST_LINES, strict=False)
        ]
        lines += [{"line": line} for line in range(1, 4)]
        editor.get("setBreakpoints", source={"path": source}, breakpoints=lines)
    editor.get("setFunctionBreakpoints", breakpoints=[{"name": name} for name in names[:40]])
    editor.get("setExceptionBreakpoints", filters=["fault", "property", "lost", "error", *names])
    found = [editor.get("dataBreakpointInfo", name=name) for name in names]
    watched = [{"dataId": each["dataId"]} for each in found if each["dataId"] is not None]
    editor.get("setDataBreakpoints", breakpoints=[*watched, *({"dataId": n} for n in names)])


def _look_at_all(editor: Editor, system: System, threads: int) -> None:
    """Ask for every frame, scope and variable, evaluate their names, and complete them."""
    known = {str(state.id) for m in system.machines for state in m.chart.states}
    for thread in range(1, threads + 1):
        for row in editor.frames(thread):
            if row["presentationHint"] == "normal" and "(" not in row["name"]:
                assert row["name"] in known or row["name"] in _charts(system) or row["name"]
            for scope in editor.get("scopes", frameId=row["id"])["scopes"]:
                for name, variable in editor.parts(scope["variablesReference"]).items():
                    for text in (name, variable.get("evaluateName", name)):
                        asked = {"expression": text, "frameId": row["id"], "context": "watch"}
                        editor.answers("evaluate", asked)
                    given = {"variablesReference": scope["variablesReference"], "name": name}
                    editor.answers("setVariable", {**given, "value": variable["value"]})
        for text in ("", "post ", "set ", "why ", *sorted(known)):
            editor.get("completions", text=text, column=len(text) + 1)


def _charts(system: System) -> set[str]:
    return {str(machine.chart.name) for machine in system.machines}
