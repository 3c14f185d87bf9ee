"""Finds or builds the programs of the boards."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from .nodes import CellError, Program

CELL = Path(__file__).resolve().parents[1]
BUILD = CELL / "boards" / "build.py"
NAMES = ("a", "b")


def build(out: Path, sockets: Path) -> tuple[Program, ...]:
    """Build the boards in a folder; their links are in another. Raises `CellError`."""
    if not BUILD.exists():
        raise CellError(f"{BUILD} is missing")
    done = subprocess.run(
        [sys.executable, str(BUILD), str(out)], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise CellError(f"the boards cannot be built:\n{done.stdout}{done.stderr}")
    links = ",".join(f"ipc://{sockets / f'link_{name}'}" for name in NAMES)
    return tuple(
        Program(
            name,
            (
                str(out / f"board_{name}"),
                "--cosim",
                "{endpoint}",
                "--links",
                links,
                "--log",
                str(out.parent / f"{name}.input"),
            ),
        )
        for name in NAMES
    )
