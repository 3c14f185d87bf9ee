"""A scripted client of the SDK writes, checks, repairs and draws a chart; the root confines it."""

from __future__ import annotations

import json
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from fsmkit.diagnostics import FsmkitError
from fsmkit.editor.assistants.workspace import Workspace, digest
from tests import needs

CHART = """\
chart: Door   # of the lift
events: {in: [open, close]}
initial: closed
states:
  closed: {on: {open: opened}}
  # nobody can leave this
  opened: {}
properties:
  comes_back: {always: "not In(opened)"}
"""
CLOSE = "close"
Call = Callable[..., Awaitable[dict[str, Any]]]


def talk(root: Path, script: Callable[[Call], Awaitable[None]], *options: str) -> None:
    """Start the server as an assistant does, and let a script call its tools."""
    needs.need(_has_mcp(), "mcp")
    import anyio
    from mcp import Client, StdioServerParameters

    server = StdioServerParameters(
        command=sys.executable, args=["-m", "fsmkit", "mcp", "--root", str(root), *options]
    )

    async def run() -> None:
        async with Client(server) as client:

            async def call(name: str, **fields: Any) -> dict[str, Any]:
                found = await client.call_tool(name, fields)
                assert not found.is_error, found
                content: dict[str, Any] = found.structured_content or {}
                assert json.loads(found.content[0].text) == content
                return content

            tools = {tool.name: tool for tool in (await client.list_tools()).tools}
            assert "SetTarget" in (tools["apply_operation"].description or "")
            await script(call)

    anyio.run(run)


def _has_mcp() -> bool:
    try:
        import mcp.server.mcpserver  # noqa: F401
    except ImportError:
        return False
    return True


@pytest.mark.cc
@pytest.mark.external
@pytest.mark.slow
def test_a_client_writes_checks_repairs_and_draws(tmp_path: Path) -> None:
    async def script(call: Call) -> None:
        written = await call("write_chart", file="door.yaml", text=CHART)
        assert written["sha256"] == digest(CHART)
        assert (await call("list_charts"))["files"] == ["door.yaml"]
        found = await call("check", file="door.yaml")
        assert (found["exit_code"], found["verdict"]) == (1, "error")
        assert found["findings"][0]["at"]["line"] == 9
        text = CHART.replace('{always: "not In(opened)"}', '{never: "In(opened)"}')
        stale = await call("write_chart", file="door.yaml", text=text, sha256="0" * 64)
        assert stale["findings"][0]["rule"] == "stale-edit"
        await call("write_chart", file="door.yaml", text=text, sha256=written["sha256"])
        why = await call("explain_counterexample", file="door.yaml", property="comes_back")
        assert why["verdict"] == "violated"
        assert why["explained"][-1].endswith("opened")
        read = await call("read_chart", file="door.yaml")
        assert read["chart"]["states"][1]["id"] == "closed"
        fixed = await call(
            "apply_operation", file="door.yaml", operation="AddTransition", sha256=read["sha256"],
            fields={"source": "opened", "targets": ["closed"], "trigger": "event", "label": CLOSE},
        )  # fmt: skip
        assert "# nobody can leave this" in (tmp_path / "door.yaml").read_text("utf-8")
        assert "+" in fixed["diff"]
        text = (tmp_path / "door.yaml").read_text("utf-8")
        head = text[: text.index("properties:")]
        await call("write_chart", file="door.yaml", text=head, sha256=fixed["sha256"])
        proved = await call("check", file="door.yaml")
        assert (proved["exit_code"], proved["verdict"]) == (0, "holds")
        ran = await call("run", file="door.yaml", script="open\nclose")
        assert ran["steps"][-1]["active"] == ["closed"]
        drawn = await call("draw", file="door.yaml")
        assert ">opened</text>" in drawn["svg"]
        await call("write_chart", file="old.yaml", text=CHART.split("properties", maxsplit=1)[0])
        changes = await call("compare", old="old.yaml", new="door.yaml")
        assert [each["name"] for each in changes["differences"]] == ["opened --close--> closed"]
        rule = await call("explain_rule", rule="stale-edit")
        assert "sha256" in json.dumps(rule)

    talk(tmp_path, script)


@pytest.mark.cc
@pytest.mark.external
@pytest.mark.slow
def test_nothing_outside_of_the_root_is_read_or_written(tmp_path: Path) -> None:
    root = tmp_path / "root"
    root.mkdir()
    (tmp_path / "secret.yaml").write_text("password: hunter2\n", encoding="utf-8")
    (root / "link.yaml").symlink_to(tmp_path / "secret.yaml")
    derived = "chart: A\nextends: ../secret.yaml\n"
    (root / "derived.yaml").write_text(derived, encoding="utf-8")

    async def script(call: Call) -> None:
        for name in ("../secret.yaml", str(tmp_path / "secret.yaml"), "link.yaml", "a\0.yaml"):
            for tool in ("read_chart", "check", "draw"):
                found = await call(tool, file=name)
                assert found["findings"][0]["rule"] == "outside-root"
            found = await call("write_chart", file=name, text="chart: A\n")
            assert found["findings"][0]["rule"] == "outside-root"
        for tool in ("check", "draw"):
            found = await call(tool, file="derived.yaml")
            assert "outside" in json.dumps(found)
            assert "hunter2" not in json.dumps(found)
        found = await call("read_chart", file="/etc/passwd")
        assert found["findings"][0]["rule"] == "outside-root"
        found = await call("explain_rule", rule="--version")
        assert found["exit_code"] != 0
        wrong = await call(
            "apply_operation", file="derived.yaml", operation="AddStat", fields={}, sha256=""
        )
        assert wrong["findings"][0]["rule"] == "edit-rejected"
        assert "AddState" in wrong["findings"][0]["help"]

    talk(root, script)
    assert (tmp_path / "secret.yaml").read_text("utf-8") == "password: hunter2\n"


@pytest.mark.cc
@pytest.mark.external
@pytest.mark.slow
def test_a_readonly_server_writes_nothing(tmp_path: Path) -> None:
    async def script(call: Call) -> None:
        found = await call("write_chart", file="a.yaml", text="chart: A\n")
        assert found["findings"][0]["rule"] == "unwritable-output"

    talk(tmp_path, script, "--readonly")
    assert [*tmp_path.iterdir()] == []


def test_a_write_needs_the_present_text(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    path = workspace.path("new/a.yaml")
    workspace.write(path, "a\r\n", None)
    assert path.read_bytes() == b"a\r\n"
    with pytest.raises(FsmkitError, match="exists already"):
        workspace.write(path, "b", None)
    with pytest.raises(FsmkitError, match="has changed"):
        workspace.write(path, "b", digest("other"))
    assert [each.name for each in path.parent.iterdir()] == ["a.yaml"]


@pytest.mark.cc
def test_a_verb_has_a_limit_of_time(tmp_path: Path) -> None:
    assert "stopped after" in Workspace(tmp_path, 0.001).verb("explain")["error"]
