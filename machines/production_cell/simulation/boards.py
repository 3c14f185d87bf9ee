"""Finds or builds the programs of the boards."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from .nodes import CellError, Program
from .pace import Pace

CELL = Path(__file__).resolve().parents[1]
BUILD = CELL / "boards" / "build.py"
NAMES = ("a", "b")
COSIM = ["--cosim", "{endpoint}"]


def build(
    out: Path,
    sockets: Path,
    pace: Pace,
    seconds: int,
    *,
    registers: bool = False,
    by_position: bool = False,
    is_followed: bool = False,
) -> tuple[Program, ...]:
    """Build the boards in a folder; their links are in another. Raises `CellError`.

    ``registers``: their wires are registers in a file (`fake_fpga`). ``by_position``: an estimate
    switches the sorter. ``is_followed``: they write their logs out before each answer.

    In the pace of a clock they end by themselves after ``seconds``, whoever is left to end them.
    """
    if not BUILD.exists():
        raise CellError(f"{BUILD} is missing")
    done = subprocess.run(
        [sys.executable, str(BUILD), str(out), *(("--by-position",) if by_position else ())],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise CellError(f"the boards cannot be built:\n{done.stdout}{done.stderr}")
    links = ",".join(f"ipc://{sockets / f'link_{name}'}" for name in NAMES)
    mode = ["--realtime", "{endpoint}", "--seconds", str(seconds)] if pace.hz else COSIM
    if pace.priority:
        mode = [*mode, "--priority", str(pace.priority)]
    return tuple(
        Program(
            name,
            (
                str(out / f"board_{name}"),
                *mode,
                "--links",
                links,
                "--log",
                str(out.parent / f"{name}.input"),
                *(("--follow",) if is_followed else ()),
                *(("--map", str(sockets / f"window_{name}")) if registers else ()),
            ),
            (sockets / f"window_{name}", out / f"generated/{name}/board_{name}_io.json")
            if registers
            else None,
        )
        for name in NAMES
    )
