"""The boards of the Production Cell with links by topics of ROS, of which one is killed."""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.cli.tools.paths import PATHS
from tests.carriers.can.conftest import HERE as PLAYER
from tests.carriers.can.test_cell_on_can import CELL, HEARTBEAT, MACHINES
from tests.carriers.ros.test_c_carrier import ROS, RUNTIME
from tests.carriers.ros.test_python_carrier import _loopback, domain  # noqa: F401  (fixtures)
from tests.needs import need

pytestmark = [pytest.mark.external, pytest.mark.cc, pytest.mark.slow]

LINKS = RUNTIME / "links"


def built(cell: Path, folder: Path, node: str, require_tool: Callable[[str], str]) -> Path:
    """Return a board: its program, behind topics in place of ZeroMQ."""
    gcc, made, ros = require_tool("gcc"), folder / "made" / node, folder / "ros" / node
    messages = folder / "messages"
    if not messages.exists():
        messages.mkdir()
        idlc = require_tool("idlc")
        for idl in (ROS / "dds").glob("*.idl"):
            subprocess.run([idlc, "-t", "-o", str(messages), idl.name], cwd=idl.parent, check=True)
    wires = str(cell / "boards" / f"board_{node}.io.yaml")
    assert execute(["compile", wires, "--out", str(made), "--quiet"]) == 0
    names = (*MACHINES[node], "fsm", "fsm_io", f"board_{node}_io", f"ring_{node}")
    sources = [*(made / f"{name}.c" for name in names), ros / f"ring_{node}_dds.c"]
    sources += [LINKS / f"{name}.c" for name in ("fsm_link", "fsm_link_fan")]
    sources += [ROS / "dds" / f"{name}.c" for name in ("fsm_link_ros", "fsm_dds_domain")]
    sources += [cell / "controller" / f"{name}.c" for name in ("profile", "pid", "drive")]
    sources += [cell / "boards" / f"{name}.c" for name in ("board", f"board_{node}")]
    sources += [*messages.glob("*.c"), PLAYER / "board_player.c"]
    folders = [made, ros, messages, cell / "boards", cell / "controller", LINKS, ROS / "dds"]
    folders += [RUNTIME, RUNTIME / "hosts", PATHS["wires"]]
    command = [gcc, "-std=c99", "-O1", "-g", "-pthread", *(f"-I{folder}" for folder in folders)]
    command += [f'-DBOARD_TABLES="ring_{node}_dds.h"', f"-DBOARD_ROS=ring_{node}_ros"]
    program = folder / f"board_{node}"
    command += [*map(str, sources), "-lddsc", "-lm", "-o", str(program)]
    subprocess.run(command, check=True)
    return program


@contextmanager
def played(program: Path, session: int) -> Iterator[subprocess.Popen[str]]:
    command = [str(program), "-", str(session)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def test_a_board_stops_when_the_other_is_killed_and_hears_it_again(
    tmp_path: Path,
    domain: int,  # noqa: F811
    require_tool: Callable[[str], str],
) -> None:
    need(Path("/usr/include/dds/dds.h").exists(), "cyclonedds-dev")
    cell = tmp_path / "cell"
    shutil.copytree(CELL, cell, ignore=shutil.ignore_patterns("__pycache__"))
    text = (cell / "deployment.yaml").read_text()
    links = f"  kind: ros\n  domain: {domain}\n"
    (cell / "on_ros.yaml").write_text(re.sub(r"  endpoints:\n(    .*\n)+", links, text))
    for file, out in (("deployment", "made"), ("on_ros", "ros")):
        command = ["compile", str(cell / f"{file}.yaml"), "--out", str(tmp_path / out), "--quiet"]
        assert execute([*command, "--with", "info"]) == 0
    programs = {node: built(cell, tmp_path, node, require_tool) for node in MACHINES}
    with played(programs["a"], 7) as board:
        assert board.stdin is not None
        assert board.stdout is not None
        with played(programs["b"], 7):
            time.sleep(4.0)
        time.sleep(2.0)
        with played(programs["b"], 8):
            time.sleep(5.0)
            board.stdin.close()
            report = board.stdout.read().splitlines()
    failed = [tuple(map(int, re.findall(r"\d+", line))) for line in report if " failed " in line]
    # all but the supervisor, in the cycle that follows more than 100 silent ones
    modules = len(MACHINES["a"]) - 1
    assert (modules, HEARTBEAT + 2) in [(count, silence) for _, count, silence in failed], report
    notes = [line.split(maxsplit=2)[2] for line in report if line.startswith("note ")]
    # twice silent where the host let it wait before
    assert list(dict.fromkeys(notes)) == [
        "link: board b silent for 100 ms",
        "link: board b was restarted",
    ]
