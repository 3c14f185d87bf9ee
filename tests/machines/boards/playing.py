"""What plays orchestrator and plant for the boards: a few lines for each."""

from __future__ import annotations

import json
import struct
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

CELL = Path(__file__).resolve().parents[3] / "machines" / "production_cell"
TOP_SPEED, TIME_CONSTANT, FULL = 3000.0, 0.04, 4096
SWITCHES = {"feeder": 200.0, "molder": 300.0, "extractor": 900.0, "rotator": 900.0}
"""Axes with a limit switch at 0, and where they stand at first, in counts."""
BELTS = {"feeder_belt": -120.0, "extraction_belt": -80.0}
"""Axes with a mark at each 1000 counts."""


@dataclass
class Axis:
    """An axis without friction: a velocity that follows the pulse width."""

    position: float
    origin: float
    velocity: float = 0.0

    def step(self, pwm: int) -> None:
        """Move for a millisecond."""
        wanted = TOP_SPEED * pwm / FULL
        self.velocity += (wanted - self.velocity) * 0.001 / TIME_CONSTANT
        self.position += self.velocity * 0.001


@dataclass
class Plant:
    """All axes, no block: what a board reads."""

    axes: dict[str, Axis] = field(
        default_factory=lambda: {n: Axis(x, x) for n, x in (SWITCHES | BELTS).items()}
    )
    values: dict[str, int] = field(default_factory=lambda: {"power": 1, "sorter.retracted": 1})
    """Signals that are set from outside; all others are 0."""

    def read(self, name: str, step: int) -> int:
        """Return the value of a signal."""
        machine, _, what = name.partition(".")
        axis = self.axes.get(machine)
        if name == "camera.frame":
            return step // 33
        if axis is None or what not in ("encoder", "limit"):
            return self.values.get(name, 0)
        if what == "encoder":
            return round(axis.position - axis.origin)
        if machine in BELTS:
            return int(abs(axis.position - 1000 * round(axis.position / 1000)) <= 5)
        return int(axis.position <= 0)

    def step(self, outputs: dict[str, int]) -> None:
        """Move for a millisecond."""
        for name, axis in self.axes.items():
            axis.step(outputs.get(f"{name}.pwm", 0) if outputs.get(f"{name}.enable") else 0)


class Board:
    """A process, and the asking end of its connection."""

    def __init__(self, program: Path, name: str, folder: Path, *options: str) -> None:
        zmq = pytest.importorskip("zmq")
        endpoint = f"ipc://{folder}/{name}"
        self.log = folder / f"{name}.fsmlog"
        words = [str(program), "--cosim", endpoint, "--log", str(self.log), *options]
        self.process = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.REQ)
        self._socket.linger = 0
        self._socket.rcvtimeo = 20_000
        self._socket.connect(endpoint)
        self.about = json.loads(self.request(b"C", b'{"protocol": 1}'))
        self.inputs = [signal["name"] for signal in self.about["inputs"]]
        self.outputs = [signal["name"] for signal in self.about["outputs"]]
        self.peers = len(self.about["peers"])
        self.frames = 0
        self.bytes = b""

    def tell(self, request: bytes) -> bytes:
        """Send a request as it is, and return the reply as it is."""
        self._socket.send(request)
        reply = self._socket.recv()
        assert isinstance(reply, bytes)
        return reply

    def request(self, kind: bytes, body: bytes = b"") -> bytes:
        """Return the body of a reply, which must be of the same kind."""
        reply = self.tell(kind + body)
        assert reply[:1] == kind, reply
        return reply[1:]

    def check(self) -> Any:
        """Return what it says to `K`."""
        return json.loads(self.request(b"K"))

    def report(self) -> Any:
        """Return what it counted."""
        return json.loads(self.request(b"R"))

    def step(self, number: int, frames: Sequence[int], plant: Plant) -> dict[str, int]:
        """Advance by a step, and return the outputs."""
        values = [plant.read(name, number) for name in self.inputs]
        head = struct.pack(f"<{1 + len(frames)}I", number, *frames)
        self.bytes = self.request(b"S", head + struct.pack(f"<{len(values)}i", *values))
        told, self.frames, *found = struct.unpack(f"<II{len(self.outputs)}i", self.bytes)
        assert told == number
        return dict(zip(self.outputs, found, strict=True))

    def end(self) -> str:
        """Let it quit, and return what it wrote on stderr; it must have been content."""
        self.request(b"Q")
        _, said = self.process.communicate(timeout=20)
        self._close()
        assert self.process.returncode == 0, said
        return said

    def kill(self) -> None:
        """End it whatever it does."""
        self.process.kill()
        self.process.communicate()
        self._close()

    def _close(self) -> None:
        self._socket.close()
        self._context.term()


@dataclass
class Cell:
    """Both boards with axes of their own."""

    boards: dict[str, Board]
    plant: Plant = field(default_factory=Plant)
    now: int = 0
    outputs: dict[str, int] = field(default_factory=dict)
    trace: list[bytes] = field(default_factory=list)
    """What the boards replied to each step."""

    def state(self, machine: str) -> str:
        """Return the leaf that a machine is in."""
        for board in self.boards.values():
            if machine in board.about["states"]:
                number = self.outputs[f"{machine}.state"]
                return str(board.about["states"][machine][number])
        raise KeyError(machine)

    def states(self) -> set[str]:
        """Return the leaves of all modules."""
        names = {n for b in self.boards.values() for n in b.about["states"]}
        return {self.state(name) for name in names - {"supervisor"}}

    def step(self) -> None:
        """Advance all by a step."""
        self.now += 1
        frames = {name: board.frames for name, board in self.boards.items()}
        for name, board in self.boards.items():
            others = [n for other, n in frames.items() if other != name] or [0]
            self.outputs |= board.step(self.now, others, self.plant)
            self.trace.append(board.bytes)
        self.plant.step(self.outputs)

    def steps(self, count: int) -> None:
        """Advance by some steps."""
        for _ in range(count):
            self.step()

    def until(self, machine: str, state: str, most: int = 20_000) -> None:
        """Advance until a machine is in a state."""
        for _ in range(most):
            if self.outputs and self.state(machine) == state:
                return
            self.step()
        found = self.state(machine)
        raise AssertionError(f"{machine} is in {found}, not {state}, at {self.now} ms")

    def press(self, button: str) -> None:
        """Press a button for some milliseconds."""
        self.plant.values[f"button.{button}"] = 1
        self.steps(5)
        self.plant.values[f"button.{button}"] = 0
        self.step()

    def kill(self) -> None:
        """End all processes."""
        for board in self.boards.values():
            board.kill()
