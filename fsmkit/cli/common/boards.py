"""``fsmkit check`` of files of boards: findings, and a line for each board."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fsmkit.cli.common.counted import Counted, print_counted
from fsmkit.cli.common.options import Reading
from fsmkit.system.any_file import read_board
from fsmkit.system.board import board_kinds, kind_of


def is_board(file: Path) -> bool:
    """Return whether the name of a file says that it is one of a board."""
    return any(file.name.endswith(kind.board_suffixes) for kind in board_kinds().values())


def check_boards(files: Sequence[Path], reading: Reading, *, as_json: bool) -> int:
    """Report what is wrong with boards; 0 if nothing is.

    Raises `FsmkitError` with every finding of the first file that cannot be used.
    """
    findings = reading.findings()
    boards = [(file, read_board(file, findings, strict=reading.strict)) for file in files]
    counted = [Counted(file, board.name, kind_of(board).figures(board)) for file, board in boards]
    return print_counted(counted, "boards", "board", findings, as_json=as_json)
