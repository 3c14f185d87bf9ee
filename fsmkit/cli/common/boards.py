"""``fsmkit check`` of files of boards: findings, and a line for each board."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fsmkit.cli.common.counts import CountedFile, print_counts
from fsmkit.cli.common.options import Reading
from fsmkit.system.any_file import read_board
from fsmkit.system.board import board_kinds, kind_of


def is_board(file: Path) -> bool:
    """Return whether a file is named like a board."""
    return any(file.name.endswith(kind.board_suffixes) for kind in board_kinds().values())


def check_boards(files: Sequence[Path], reading: Reading, *, as_json: bool) -> int:
    """Report the errors of boards; return 0 if there are none.

    Raises `FsmkitError` with every finding of the first invalid file.
    """
    findings = reading.findings()
    boards = [(file, read_board(file, findings, strict=reading.strict)) for file in files]
    counted = [
        CountedFile(file, board.name, kind_of(board).figures(board)) for file, board in boards
    ]
    return print_counts(counted, "boards", "board", findings, as_json=as_json)
