"""The boards of the Production Cell on a CAN bus that stays off for five seconds."""

from __future__ import annotations

import re
import shutil
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.carriers.can.deployment import bus_of
from fsmkit.carriers.can.message import CanWire
from fsmkit.cli import execute
from fsmkit.cli.tools.paths import PATHS
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.deployment.event_map import LEVELS
from tests.carriers.can.conftest import FOLDERS, HERE, free_port, source_of
from tests.carriers.can.counts import COUNTS, TOTALS

pytestmark = [pytest.mark.external, pytest.mark.cc, pytest.mark.slow]

CELL = Path(__file__).parents[3] / "machines/production_cell"
MACHINES = {
    "a": ("supervisor", "feeder_belt", "feeder", "molder", "extractor"),
    "b": ("extraction_belt", "sorter", "camera", "rotator"),
}
BUS_OFF = 0x40
HEARTBEAT = 100
"""Cycles of 1 ms without a word of the other board, after which a board stops."""


@pytest.fixture
def cell(tmp_path: Path) -> Path:
    """Copy the cell, with links on a bus."""
    folder = tmp_path / "cell"
    shutil.copytree(CELL, folder, ignore=shutil.ignore_patterns("__pycache__"))
    text = (folder / "deployment.yaml").read_text()
    text = re.sub(r"  endpoints:\n(    .*\n)+", "  kind: can\n  bus: can0\n  period: 1ms\n", text)
    (folder / "on_can.yaml").write_text(text)
    return folder


def built(cell: Path, out: Path, node: str, gcc: str) -> Path:
    """Return a board: its program, behind a bus in place of ZeroMQ."""
    made = out / "made" / node
    sources = [made / f"{name}.c" for name in ("fsm", "fsm_io", f"board_{node}_io", f"ring_{node}")]
    sources += [made / f"{name}.c" for name in MACHINES[node]]
    sources += [out / "bus" / node / f"ring_{node}_can.c"]
    library = [source_of(name) for name in ("fsm_link", "fsm_can", "fsm_can_bus", "fsm_link_net")]
    sources += [cell / "controller" / f"{name}.c" for name in ("profile", "pid", "drive")]
    sources += [cell / "boards" / f"{name}.c" for name in ("board", f"board_{node}")]
    folders = [made, out / "bus" / node, cell / "boards", cell / "controller"]
    folders += [*FOLDERS, PATHS["wires"], PATHS["ros"] / "dds"]
    command = [gcc, "-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-pthread"]
    command += [f"-I{folder}" for folder in folders]
    command += [f'-DBOARD_TABLES="ring_{node}_can.h"', f"-DBOARD_NET=ring_{node}_can"]
    program = out / f"board_{node}"
    command += [
        *map(str, sources),
        *library,
        str(HERE / "board_player.c"),
        "-lm",
        "-o",
        str(program),
    ]
    subprocess.run(command, check=True)
    return program


class Relay(threading.Thread):
    """Carries frames between the buses of both boards, until it is off."""

    def __init__(self, buses: dict[str, Any], senders: dict[int, tuple[str, CanWire]]) -> None:
        super().__init__(daemon=True)
        self.buses = buses
        self.senders = senders
        self.is_off = False
        self.is_over = False
        self.dropped: dict[str, Counter[str]] = {"a": Counter(), "b": Counter()}

    def run(self) -> None:
        """Carry, or drop and count."""
        while not self.is_over:
            for name, bus in self.buses.items():
                while (frame := bus.recv(0.0005)) is not None and not self.is_over:
                    sender, wire = self.senders.get(frame.arbitration_id, ("", None))
                    if frame.is_error_frame or sender != name or wire is None:
                        continue  # it is what this put there
                    if not self.is_off:
                        next(b for n, b in self.buses.items() if n != name).send(frame)
                    elif wire.number is not None:
                        self.dropped[name]["frames"] += 1
                        self.dropped[name]["events"] += wire.number != LEVELS


@contextmanager
def played(program: Path, at: str) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [str(program), f"udp:{at}", "7"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def test_boards_stop_when_their_bus_is_off(
    cell: Path, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    import can

    from fsmkit.carriers.can.translator import MulticastBus

    gcc = require_tool("gcc")
    for file, out in (("deployment.yaml", "made"), ("on_can.yaml", "bus")):
        folder = str(tmp_path / out)
        extras = ["--with", "info"] if out == "made" else []
        assert execute(["compile", str(cell / file), "--out", folder, *extras]) == 0
    for node in MACHINES:
        wires = str(cell / "boards" / f"board_{node}.io.yaml")
        assert execute(["compile", wires, "--out", str(tmp_path / "made" / node)]) == 0
    programs = {node: built(cell, tmp_path, node, gcc) for node in MACHINES}
    deployment = fsmkit.read(cell / "on_can.yaml")
    assert isinstance(deployment, Deployment)
    net = bus_of(deployment)
    assert net is not None
    senders = {wire.message.frame: (next(iter(wire.message.senders)), wire) for wire in net.wires}
    with ExitStack() as stack:
        at = {node: f"239.74.163.2:{free_port()}" for node in MACHINES}
        buses = {node: stack.enter_context(MulticastBus(at[node])) for node in MACHINES}
        relay = Relay(buses, senders)
        relay.start()
        boards = {node: stack.enter_context(played(programs[node], at[node])) for node in MACHINES}
        time.sleep(1.0)
        relay.is_off = True
        for bus in buses.values():
            bus.send(can.Message(arbitration_id=BUS_OFF, is_error_frame=True, data=bytes(8)))
        time.sleep(5.0)
        relay.is_off = False
        time.sleep(0.5)
        reports = {}
        for node, board in boards.items():
            assert board.stdin is not None
            assert board.stdout is not None
            board.stdin.close()
            reports[node] = board.stdout.read().splitlines()
        relay.is_over = True
        relay.join()
    for node, other in (("a", "b"), ("b", "a")):
        lines = reports[node]
        found = dict(zip([*COUNTS, *TOTALS], map(int, lines[-1].split()), strict=True))
        failed = [tuple(map(int, re.findall(r"\d+", line))) for line in lines if " failed " in line]
        modules = len(MACHINES[node]) - (node == "a")  # the supervisor waits for a reset
        assert [line for line in lines if "silent for 100 ms" in line], lines
        # it stops in the cycle that follows more than 100 silent ones, which this counts, too
        assert (modules, HEARTBEAT + 2) in [(count, silence) for _, count, silence in failed], lines
        dropped = relay.dropped[other]
        assert found["lost_events"] == dropped["events"]
        # counters have one byte; of an event that does not come again, only `hello` has counted
        levels = dropped["frames"] - dropped["events"]
        assert (found["lost_frames"] - levels) % 256 <= dropped["events"]
        assert levels > 400
        assert (found["bus_off"], found["malformed"], found["foreign"]) == (1, 0, 0)
