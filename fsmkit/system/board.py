"""Boards connect the machines of a node to its hardware. Plug-ins read their files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

from fsmkit.plugins import plugin, plugins

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from fsmkit.diagnostics import Findings
    from fsmkit.document.keys import Keys
    from fsmkit.system.deployment.deployment import Deployment
    from fsmkit.system.machines import Replacement
    from fsmkit.system.system import System
    from fsmkit.yaml.nodes import Node


@runtime_checkable
class Board(Protocol):
    """A node of a deployment with its hardware. Only its kind can interpret it."""

    @property
    def board_kind(self) -> str:
        """The name of the plug-in that read the board."""
        ...

    @property
    def name(self) -> str:
        """The name of the node."""
        ...

    @property
    def deployment(self) -> Deployment:
        """The deployment of the node."""
        ...

    @property
    def node(self) -> int:
        """The index of the node in the deployment."""
        ...


@runtime_checkable
class BoardKind(Protocol):
    """Reads boards of one kind: a plug-in."""

    name: str
    board_key: str
    """The outermost key by which a file in YAML is one of a board."""
    board_suffixes: tuple[str, ...]
    """The end of the names of such files."""
    board_keys: Keys
    """The outermost keys."""

    def read_board(
        self,
        root: Node,
        folder: Path,
        findings: Findings,
        replacing: Mapping[str, Replacement],
        *,
        strict: bool,
    ) -> Board | None:
        """Return the board in a file; None after an error.

        ``folder``: the base of relative paths. For the others see `fsmkit.system.any_file.read`.
        """
        ...

    def narrowed(self, system: System, boards: Iterable[Board]) -> System:
        """Return a system whose free inputs and events are restricted by boards of this kind."""
        ...

    def figures(self, board: Board) -> Mapping[str, int]:
        """Return the number of elements of each kind on a board, which `fsmkit check` prints."""
        ...


def board_kinds() -> dict[str, BoardKind]:
    """Return the kinds of boards by the outermost key of their files."""
    return {kind.board_key: kind for kind in plugins(BoardKind)}


def kind_of(board: Board) -> BoardKind:
    """Return the plug-in that read a board."""
    return plugin(BoardKind, board.board_kind)


def with_boards(system: System, boards: Iterable[Board]) -> System:
    """Return a system whose environment is restricted by boards, kind by kind.

    Raises `FsmkitError` if a board belongs to another system.
    """
    by_kind: dict[str, list[Board]] = {}
    for board in boards:
        by_kind.setdefault(board.board_kind, []).append(board)
    for name, found in by_kind.items():
        system = plugin(BoardKind, name).narrowed(system, found)
    return system
