"""What the tests of CAN share."""

from __future__ import annotations

import socket
import subprocess
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

import pytest

from fsmkit.cli import execute
from tests.needs import need

HERE = Path(__file__).parent
HEATER = HERE / "heater.dbc"
RUNTIME = HERE.parents[2] / "fsmkit/runtime/c"
LINKS = RUNTIME / "links"
CAN = HERE.parents[2] / "fsmkit/carriers/can/c"
FOLDERS = (RUNTIME, RUNTIME / "hosts", LINKS, CAN)
"""Where headers are."""


def source_of(name: str) -> str:
    """Return the path of a source of the library."""
    return str(next(f for folder in (LINKS, CAN) if (f := folder / f"{name}.c").is_file()))


def free_port() -> int:
    """Return a port of UDP that nobody has now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("", 0))
        return int(free.getsockname()[1])


@pytest.fixture(autouse=True)
def _cantools() -> None:
    need(find_spec("cantools") is not None, "cantools")


def built(deployment: Path, tmp_path: Path, gcc: str, sources: Iterable[str], player: str) -> Path:
    """Build node `a` of a deployment with a player of its bus; return the program."""
    out = tmp_path / "out"
    assert execute(["compile", str(deployment), "--out", str(out)]) == 0
    command = [gcc, "-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-Wpedantic"]
    command += ["-Wconversion", "-Wshadow", "-Werror", "-fsanitize=address,undefined", "-pthread"]
    folders = [out / "a", *FOLDERS]
    command += [f"-I{folder}" for folder in folders]
    command += [str(path) for path in sorted((out / "a").glob("*.c"))]
    command += [source_of(name) for name in sources]
    subprocess.run([*command, str(HERE / player), "-o", str(tmp_path / "node")], check=True)
    return tmp_path / "node"
