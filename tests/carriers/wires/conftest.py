"""Boards from texts: a system of one chart, its deployment, and the wires."""

from __future__ import annotations

from pathlib import Path

from fsmkit.carriers.wires.board import Board
from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import read_with_boards

SYSTEM = "system: Plant\nmachines: {mould: mould.yaml}\n"
DEPLOYMENT = "system: plant.yaml\nnodes: {a: [mould]}\n"
FILE = "board_a.io.yaml"


def write(folder: Path, chart: str, wires: str, **more: str) -> Path:
    """Write the files of a board; return that of its wires."""
    texts = {"mould.yaml": chart, "plant.yaml": SYSTEM, "deployment.yaml": DEPLOYMENT, FILE: wires}
    for name, text in (texts | {f"{key}.yaml": text for key, text in more.items()}).items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / FILE


def load(path: Path, findings: Findings | None = None) -> Board:
    """Read a board; `FsmkitError` with what is wrong."""
    board = read_with_boards(path, Findings() if findings is None else findings)
    assert isinstance(board, Board)
    return board
