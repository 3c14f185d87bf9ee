"""Boards under supervisord, which starts them, and restarts killed ones.

Its configuration is the one that ``fsmkit deploy --to supervisor`` writes. A run connects to these
boards, kills them like any other (the fault ``kill``), and connects again.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from http.client import HTTPException
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING
from xmlrpc.client import Error, ServerProxy

import fsmkit
from fsmkit.codegen.units import KINDS, services_of
from fsmkit.codegen.units.service import Keeping
from fsmkit.system.deployment.deployment import Deployment

from .nodes import START, CellError, Process, Program

if TYPE_CHECKING:
    from .orchestrator import Setup

CONFIGURATION = """\
[supervisord]
nodaemon=true
logfile={out}/supervisord.log
pidfile=%(here)s/supervisord.pid
childlogdir={out}
[unix_http_server]
file=%(here)s/supervisord
[rpcinterface:supervisor]
supervisor.rpcinterface_factory=supervisor.rpcinterface:make_main_rpcinterface
[include]
files=%(here)s/*.conf
"""
DEPLOYMENT = Path(__file__).resolve().parents[1] / "deployment.yaml"
GROUP = "fsmkit-ring"
TO_END = 30.0
"""How long supervisord may take to end its programs, in s."""


class KeptBoard(Process):
    """A board under supervisord, which starts, restarts and ends it."""

    _pid = 0
    """0: none that is known to run."""

    def begin(self) -> None:
        """Connect to the board, as soon as it answers."""
        self._connect()
        self._pid = int(_info(self.program)["pid"])

    def _is_dead(self) -> bool:
        if not self._pid:
            return _info(self.program)["statename"] == "FATAL"
        return not _signal(self._pid, 0)

    def kill(self) -> None:
        """Kill the board; supervisord restarts it."""
        if self._pid:
            _signal(self._pid, signal.SIGKILL)
        self._pid = 0
        self._hang_up()

    def end(self) -> None:
        """Leave the board to supervisord."""
        self._hang_up()


def _signal(pid: int, number: int) -> bool:
    """Send a signal; return whether there was a process to take it."""
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        return False
    return True


def _info(program: Program) -> Mapping[str, int | str]:
    """Return what supervisord knows of a board. Raises `CellError`."""
    from supervisor.xmlrpc import SupervisorTransport

    transport = SupervisorTransport(None, None, f"unix://{program.keeper}")
    try:
        with ServerProxy("http://127.0.0.1", transport=transport) as proxy:
            found = proxy.supervisor.getProcessInfo(f"{GROUP}:{GROUP}-{program.name}")
    except (OSError, HTTPException, Error) as error:
        raise CellError(f"supervisord does not answer for {program.name}: {error}") from error
    assert isinstance(found, dict)  # noqa: S101  (as the method is documented)
    return found


@contextmanager
def kept(setup: Setup) -> Iterator[Setup]:
    """Let supervisord start the boards of a run, and end them after it. Raises `CellError`."""
    _check(setup)
    programs = tuple(replace(p, keeper=setup.endpoints / "supervisord") for p in setup.boards)
    folder = setup.endpoints
    (folder / "supervisord.conf").write_text(CONFIGURATION.format(out=setup.out), encoding="utf-8")
    for name, text in _files(setup).items():
        (folder / name).write_text(text, encoding="utf-8")
    command = [sys.executable, "-W", "ignore", "-m", "supervisor.supervisord"]
    # a session of its own, as the processes of `nodes`: Ctrl-C is for the orchestrator
    daemon = subprocess.Popen(
        [*command, "-c", str(folder / "supervisord.conf")],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        start_new_session=True,
    )  # fmt: skip
    try:
        _wait(daemon, folder / "supervisord", setup.out)
        yield replace(setup, boards=programs)
    finally:
        daemon.terminate()
        try:
            daemon.wait(TO_END)
        except subprocess.TimeoutExpired:
            daemon.kill()
            daemon.wait()


def _check(setup: Setup) -> None:
    if find_spec("supervisor") is None:
        raise CellError("supervisor is missing: pip install 'fsmkit[supervisor]'")
    if not setup.pace.hz:
        raise CellError("--kept needs --hz: step by step a board that is dead holds up the run")
    if any(p.window is not None for p in setup.boards):
        raise CellError("--kept boards have no registers: remove --registers")


def _files(setup: Setup) -> dict[str, str]:
    """Return the files of `fsmkit deploy` with the commands of this run."""
    deployment = fsmkit.read(DEPLOYMENT)
    assert isinstance(deployment, Deployment)  # noqa: S101  (it is ours)
    commands = {
        p.name: tuple(
            part.format(endpoint=f"ipc://{setup.endpoints / p.name}") for part in p.command
        )
        for p in setup.boards
    }
    services = [
        replace(service, command=commands[service.node])
        for service in services_of(deployment, "/board")
    ]
    return KINDS["supervisor"](services, Keeping())


def _wait(daemon: subprocess.Popen[bytes], socket: Path, out: Path) -> None:
    """Wait until supervisord answers."""
    end = time.monotonic() + START
    while not socket.exists():
        if daemon.poll() is not None or time.monotonic() > end:
            raise CellError(f"supervisord did not start: {out / 'supervisord.log'}")
        time.sleep(0.02)
