"""``fsmkit check`` of the wires of boards: findings, and a line for each board."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fsmkit.cli.common.counted import Counted, print_counted
from fsmkit.cli.common.options import Reading
from fsmkit.system.any_file import read_board
from fsmkit.system.wires.board import Board

WIRES = (".io.yaml", ".io.yml")
"""What the names of files with wires end with."""


def check_wires(files: Sequence[Path], reading: Reading, *, as_json: bool) -> int:
    """Report what is wrong with the wires of boards; 0 if nothing is.

    Raises `FsmkitError` with every finding of the first file that cannot be used.
    """
    findings = reading.findings()
    boards = [(file, read_board(file, findings, strict=reading.strict)) for file in files]
    counted = [Counted(file, board.name, figures(board)) for file, board in boards]
    return print_counted(counted, "boards", "board", findings, as_json=as_json)


def figures(board: Board) -> dict[str, int]:
    """Return how much of each kind a board has."""
    return {
        "signals": len(board.signals),
        "devices": len(board.devices),
        "inputs": len(board.inputs),
        "events": len(board.events),
        "operations": len(board.ports),
    }
