"""Microsoft's client, `@vscode/debugadapter-testsupport`, against the adapter as a program."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests import needs
from tests.foreign.readers import NODE_MODULES

pytestmark = pytest.mark.external
PACKAGE = NODE_MODULES / "@vscode" / "debugadapter-testsupport"
ROOT = Path(__file__).parents[3]
ADAPTER = "from fsmkit.cli import main\nimport sys\nsys.argv = ['fsmkit', 'dap']\nmain()\n"


def run_client(script: str, folder: Path, *arguments: str) -> object:
    """Run a script of the client; return what it printed."""
    needs.need(PACKAGE.is_dir(), "@vscode/debugadapter-testsupport")
    adapter = folder / "adapter.py"
    adapter.write_text(ADAPTER, encoding="utf-8")
    argv = [needs.tool("node"), str(Path(__file__).with_name(script)), str(NODE_MODULES)]
    done = subprocess.run(
        [*argv, sys.executable, str(adapter), *arguments],
        check=False,
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    found: object = json.loads(done.stdout.splitlines()[-1])
    return found


def test_the_client_goes_through_every_request(gate: Path, tmp_path: Path) -> None:
    told = run_client("client.js", tmp_path, str(gate))
    assert told == {
        "setBreakpoints": [[True, 0]],
        "configurationDone": ["entry", "start, in closed"],
        "threads": ["Gate"],
        "stackTrace": ["closed", "Gate"],
        "scopes": ["Data", "Inputs", "Outputs", "Event", "Timers", "Queue"],
        "variables": [["count", "0"], ["fault_code", "none"]],
        "setVariable": "4",
        "dataBreakpointInfo": "fault_code",
        "evaluate": "5",
        "completions": ["open"],
        "source": ["gate.yaml"],
        "locations": 3,
        "evaluate open": ["step", "open, closed -> opening"],
        "continue": "wide",
        "stepBack": ["step", "open, closed -> opening"],
        "stepIn": ["step", "microstep: after T_OPEN (4s), transition 2, opening -> wide"],
        "stepOut": ["step", "after T_OPEN (4s), opening -> wide"],
        "next": ["step", "no timer is armed: post an event"],
        "reverseContinue": ["step", "not started"],
        "restartFrame": ["restart", "not started"],
        "live": "http://127.0.0.1",
    }
