"""The tools of ``fsmkit mcp``, on the official SDK of the Model Context Protocol."""

from __future__ import annotations

import asyncio
import dataclasses
import difflib
import tempfile
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, get_args

import msgspec
from mcp.server.mcpserver import MCPServer

from fsmkit.diagnostics import FsmkitError, Source, fail
from fsmkit.diagnostics.fixes import apply_edits
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.editor.assistants.workspace import Json, Workspace, digest, findings_of
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import apply
from fsmkit.emit.version import VERSION

INSTRUCTIONS = """\
fsmkit: statecharts in YAML or SCXML that are compiled to C and Python and checked exhaustively.
Read a chart before you change it. After each change call `check`: it reports errors with their
locations and fixes, and a verdict for each property with a counterexample. Prefer `apply_operation`
over `write_chart`: it keeps comments and layout. Times in results are in microseconds."""
OPERATIONS: dict[str, Any] = {each.__name__: each for each in get_args(op.Operation)}


def server_of(workspace: Workspace) -> MCPServer:
    """Return a server whose tools work below the root of a workspace."""
    server = MCPServer("fsmkit", version=VERSION, instructions=INSTRUCTIONS)
    for tool in _tools(workspace):
        server.tool(description=tool.__doc__, structured_output=True)(_guarded(tool))
    return server


def _guarded(tool: Callable[..., Json]) -> Callable[..., Json]:
    """Return a tool that gives findings as its result, not as an exception."""

    @wraps(tool)
    def call(*arguments: Any, **named: Any) -> Json:
        try:
            return tool(*arguments, **named)
        except FsmkitError as error:
            return findings_of(error)

    return call


def _tools(workspace: Workspace) -> tuple[Callable[..., Json], ...]:
    def given(name: str) -> str:
        return f"./{workspace.name(workspace.path(name))}"

    def list_charts() -> dict[str, Any]:
        """List the files below the root that may be charts or systems."""
        return {"files": workspace.charts(), "readonly": workspace.is_readonly}

    def read_chart(file: str) -> dict[str, Any]:
        """Read a chart: its text, the sha256 that edits need, and the chart as understood."""
        path = workspace.path(file)
        text = workspace.text(path)
        shown = workspace.verb("show", given(file))
        return {"file": workspace.name(path), "text": text, "sha256": digest(text), "chart": shown}

    def check(file: str, properties: list[str] | None = None) -> dict[str, Any]:
        """Check a chart or a system exhaustively: findings, and a verdict on each property.

        `properties`: evaluate only these. A violated property has a `trace` to the violation.
        """
        options = [word for name in properties or () for word in ("--property", name)]
        limit = f"{max(workspace.seconds * 0.8, 1):.0f}s"
        return workspace.verb("check", given(file), "--timeout", limit, *options)

    def run(file: str, script: str) -> dict[str, Any]:
        """Run a scenario on a simulated clock.

        `script`: lines such as `request`, `fault code=jam`, `wait 500ms`, `set blocked true`,
        `motor returns 1`. In a system an event is `machine.event`.
        """
        events = ";".join(line for line in script.splitlines() if line.strip())
        return workspace.verb("run", given(file), f"--events={events}")

    def explain_counterexample(file: str, property: str) -> dict[str, Any]:  # noqa: A002
        """Explain why a property is violated: the steps from the start to the violation."""
        found = workspace.verb("check", given(file), "--property", property)
        rows = [each for each in found.get("properties", ()) if each["name"] == property]
        if not rows:
            return found
        steps = rows[0].get("trace", [])
        return {**rows[0], "steps": len(steps), "explained": [*map(_step, steps)]}

    def explain_rule(rule: str) -> dict[str, Any]:
        """Explain a rule of findings, by its name or its code: why it matters, how to fix it."""
        return workspace.verb("explain", "--", rule)

    def draw(file: str) -> dict[str, Any]:
        """Draw a chart or a system; the result has the SVG text."""
        with tempfile.TemporaryDirectory() as created:
            out = Path(created, "drawing.svg")
            drawn = workspace.verb("draw", given(file), "--out", str(out))
            if not out.exists():
                return drawn
            return {"file": file, "svg": out.read_text(encoding="utf-8")}

    def compare(old: str, new: str) -> dict[str, Any]:
        """Compare two charts by meaning: what was added, removed, moved, changed, renamed."""
        return workspace.verb("diff", given(old), given(new))

    def write_chart(file: str, text: str, sha256: str | None = None) -> dict[str, Any]:
        """Write a whole file. `sha256`: that of the text it replaces; omit it for a new file."""
        path = workspace.path(file)
        workspace.write(path, text, sha256)
        return {"file": workspace.name(path), "sha256": digest(text)}

    def apply_operation(
        file: str, operation: str, fields: dict[str, Any], sha256: str
    ) -> dict[str, Any]:
        """Apply an operation to a chart; comments and layout stay. The result has the difference.

        Operations and their fields (transitions are numbered within their source, from 0):
        """
        path = workspace.path(file)
        text = workspace.text(path)
        edits = apply(Source(workspace.name(path), text), _operation(operation, fields))
        new = apply_edits(text, edits)
        workspace.write(path, new, sha256)
        lines = difflib.unified_diff(
            text.splitlines(), new.splitlines(), workspace.name(path), workspace.name(path), "", "",
            lineterm="",
        )  # fmt: skip
        return {"file": workspace.name(path), "sha256": digest(new), "diff": "\n".join(lines)}

    apply_operation.__doc__ = f"{apply_operation.__doc__}{_described()}"
    return (
        list_charts, read_chart, check, run, explain_counterexample, explain_rule, draw, compare,
        write_chart, apply_operation,
    )  # fmt: skip


def _described() -> str:
    """Return a line for each operation: its name and its fields."""
    lines = []
    for name, kind in OPERATIONS.items():
        parts = (
            each.name if each.default is dataclasses.MISSING else f"[{each.name}]"
            for each in dataclasses.fields(kind)
        )
        lines.append(f"* {name}: {', '.join(parts)}")
    return "\n".join(lines)


def _operation(name: str, fields: Json) -> op.Operation:
    """Return an operation; raises `FsmkitError` (``edit-rejected``)."""
    kind = OPERATIONS.get(name)
    if kind is None:
        help_ = suggest(name, OPERATIONS, f"use one of {', '.join(OPERATIONS)}")
        raise fail("edit-rejected", f"there is no operation `{name}`", help=help_)
    known = {each.name for each in dataclasses.fields(kind)}
    for field in fields.keys() - known:
        help_ = suggest(field, known, f"its fields are {', '.join(sorted(known))}")
        raise fail("edit-rejected", f"`{name}` has no field `{field}`", help=help_)
    try:
        return msgspec.convert(fields, kind)  # type: ignore[no-any-return]
    except msgspec.ValidationError as error:
        raise fail("edit-rejected", f"the fields of `{name}` do not fit: {error}") from error


def _step(step: Json) -> str:
    """Return a step of a counterexample in one line."""
    at = step.get("at")
    time = "" if at is None else f"at {at / 1000:g} ms: "
    what = step.get("event") or step.get("action") or ""
    machine = f"{step['machine']}: " if step.get("machine") else ""
    states = ", ".join(step.get("to", ()))
    return f"{time}{machine}{what} -> {states}"


def described_tools() -> list[Json]:
    """Return the tools: name, description, and the JSON Schema of the arguments."""
    tools = asyncio.run(server_of(Workspace(Path())).list_tools())
    return [
        {"name": each.name, "description": each.description, "input": each.input_schema}
        for each in tools
    ]


def serve_stdio(root: Path, seconds: float, *, is_readonly: bool) -> None:
    """Serve an assistant on standard input and output."""
    server_of(Workspace(root, seconds, is_readonly)).run("stdio")
