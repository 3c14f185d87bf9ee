"""The processes of a run: started, connected, stepped, killed, and never left behind."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import zmq

from .protocol import Client, Node, ProtocolError, read_hello
from .signals import PROTOCOL

START = 60.0
"""How long a process may take until it answers at all, in s."""
PACKAGE = __package__ or ""
ROOT = Path(__file__).resolve().parents[3]


class CellError(Exception):
    """A run cannot start, or cannot continue; the text is the reason."""


@dataclass(frozen=True)
class Program:
    """The command of a process: ``{endpoint}`` in it is its endpoint."""

    name: str
    command: tuple[str, ...]
    window: tuple[Path, Path] | None = None
    """For a board whose wires are registers: the file, and the description of its wires."""
    keeper: Path | None = None
    """For a board under supervisord: the endpoint of supervisord."""


def plant_program(seed: int) -> Program:
    """Return the plant."""
    module = f"{PACKAGE}.plant_process"
    return Program("plant", (sys.executable, "-m", module, "{endpoint}", "--seed", str(seed)))


def fmu_program(path: Path, seed: int) -> Program:
    """Return an FMU as plant."""
    module = f"{PACKAGE}.fmu_process"
    command = (sys.executable, "-m", module, "{endpoint}", str(path), "--seed", str(seed))
    return Program("plant", command)


def double_program(*, by_position: bool = False) -> Program:
    """Return the double of all boards. ``by_position``: an estimate switches the sorter."""
    words = (sys.executable, "-m", f"{PACKAGE}.double", "--cosim", "{endpoint}")
    return Program("double", (*words, *(("--by-position",) if by_position else ())))


class Process:
    """A process and the connection to it."""

    def __init__(
        self, program: Program, endpoint: str, log: Path, timeout: float,
        context: zmq.Context[zmq.Socket[bytes]],
    ) -> None:  # fmt: skip
        self.program = program
        self.endpoint = endpoint
        self.node = Node(program.name, None, None, {})  # type: ignore[arg-type]
        self.frames = 0
        """How many it has sent to its peers."""
        self.asked: int | None = None
        """The requested step without a reply yet."""
        self.asked_at = 0.0
        """When, in s of the monotonic clock."""
        self._log = log
        self._timeout = timeout
        self._context = context
        self._process: subprocess.Popen[bytes] | None = None
        self._client: Client | None = None

    @property
    def is_alive(self) -> bool:
        """Whether it was started and not killed."""
        return self._client is not None

    @property
    def is_running(self) -> bool:
        """Whether the operating system still has it."""
        return not self._is_dead()

    def begin(self) -> None:
        """Start the process, and read its signals."""
        command = [part.format(endpoint=self.endpoint) for part in self.program.command]
        with self._log.open("ab") as log:
            self._process = self._popen(command, log)
        self._connect()

    def _connect(self) -> None:
        """Connect, and read the signals of the process."""
        self._client = Client(
            self._context, self.endpoint, max(START, self._timeout), self._is_dead
        )
        try:
            told = self._client.request_json(b"C", {"protocol": PROTOCOL})
            self.node = read_hello(told)
        except ProtocolError as error:
            raise CellError(self._why(error)) from error
        self._client.timeout = self._timeout
        self.frames, self.asked = 0, None

    def _popen(self, command: Sequence[str], log: IO[bytes]) -> subprocess.Popen[bytes]:
        try:
            # a session of its own: Ctrl-C is for the orchestrator, which then ends the others
            return subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=ROOT,
                start_new_session=True,
            )  # fmt: skip
        except OSError as error:
            raise CellError(f"{self.program.name} cannot be started: {error}") from error

    def _is_dead(self) -> bool:
        return self._process is None or self._process.poll() is not None

    def _why(self, error: Exception) -> str:
        """Return what happened to the process, with the last that it said."""
        text = f"{self.program.name} {error}"
        if self._process is not None and (code := self._process.poll()) is not None:
            how = f"was killed by signal {-code}" if code < 0 else f"ended with exit code {code}"
            text = f"{self.program.name} {how}"
        try:
            said = self._log.read_text(errors="replace").strip().splitlines()[-5:]
        except OSError:
            said = []
        return "\n".join([text, *(f"  {line}" for line in said)])

    @property
    def client(self) -> Client:
        """The connection. Raises `CellError` without one."""
        if self._client is None:
            raise CellError(f"{self.program.name} is not connected")
        return self._client

    def send(self, kind: bytes, body: bytes = b"") -> None:
        """Send a request; `receive` returns the reply."""
        try:
            self.client.send(kind, body)
        except ProtocolError as error:
            raise CellError(self._why(error)) from error

    def receive(self, kind: bytes) -> bytes:
        """Return the answer."""
        try:
            return self.client.receive(kind)
        except ProtocolError as error:
            raise CellError(self._why(error)) from error

    def request(self, kind: bytes, body: bytes = b"") -> bytes:
        """Send a request, and return the reply."""
        self.send(kind, body)
        return self.receive(kind)

    def request_json(
        self, kind: bytes, question: dict[str, object] | None = None
    ) -> dict[str, object]:
        """Send a request, and return the reply, both in JSON."""
        try:
            return self.client.request_json(kind, question)
        except ProtocolError as error:
            raise CellError(self._why(error)) from error

    def kill(self) -> None:
        """Kill the process, as a power failure would."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._hang_up()

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None

    def end(self) -> None:
        """Let the process end; kill it if it does not."""
        if self._client is not None and not self._is_dead():
            try:
                self._client.timeout = 2.0
                self._client.request(b"Q")
            except ProtocolError:
                pass
        self._hang_up()
        if self._process is None:
            return
        try:
            self._process.wait(timeout=2.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def answering(processes: Sequence[Process], timeout: float) -> list[Process]:
    """Return those whose answer is here; wait for the first, at most ``timeout`` s."""
    poller = zmq.Poller()
    for process in processes:
        poller.register(process.client.socket, zmq.POLLIN)
    ready = dict(poller.poll(math.ceil(1000 * timeout)))
    return [process for process in processes if process.client.socket in ready]


def ping(process: Process, times: int = 2000) -> float:
    """Return how many empty questions a second a process answers."""
    begin = time.perf_counter()
    for _ in range(times):
        process.request(b"K")
    return times / (time.perf_counter() - begin)
