"""Boards whose file declares the meaning of their wires to the machines of their node."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from fsmkit.carriers.wires.keys import BOARD
from fsmkit.document.keys import Keys

if TYPE_CHECKING:
    from fsmkit.carriers.wires.board import Board
    from fsmkit.diagnostics import Findings
    from fsmkit.system.machines import Replacement
    from fsmkit.system.system import System
    from fsmkit.yaml.nodes import Node


class Wires:
    """Reads files with an outermost key ``board``, and writes their C."""

    name = "wires"
    library = Path(__file__).parent / "c"
    board_key = "board"
    board_suffixes: tuple[str, ...] = (".io.yaml", ".io.yml")
    board_keys: Keys = BOARD

    def read_board(
        self,
        root: Node,
        folder: Path,
        findings: Findings,
        replacing: Mapping[str, Replacement],
        *,
        strict: bool,
    ) -> Board | None:
        """Return the board of a file; None after an error."""
        from fsmkit.carriers.wires.reader import board_of

        return board_of(root, folder, findings, replacing, strict=strict)

    def narrowed(self, system: System, boards: Iterable[Board]) -> System:
        """Return a system whose free inputs and events are restricted by the wires of boards."""
        from fsmkit.carriers.wires.promises import with_wires

        return with_wires(system, boards)

    def figures(self, board: Board) -> dict[str, int]:
        """Return the number of elements of each kind on a board."""
        return {
            "signals": len(board.signals),
            "devices": len(board.devices),
            "inputs": len(board.inputs),
            "events": len(board.events),
            "operations": len(board.ports),
        }

    def board_files(self, board: Board) -> Mapping[str, str]:
        """Return the C of the wires of a board."""
        from fsmkit.carriers.wires.printing.printer import compose_board

        return compose_board(board)


PLUGIN = Wires()
