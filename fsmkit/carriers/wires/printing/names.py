"""The C names of a board's signals, devices and machines."""

from __future__ import annotations

from dataclasses import dataclass, field

from fsmkit.carriers.wires.board import Board, Hysteresis
from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.reserved import KEYWORDS, unreserved
from fsmkit.codegen.system.node import Node, nodes_of
from fsmkit.codegen.system.node_printer import NodePrinter
from fsmkit.codegen.system.parts import Part, parts_of
from fsmkit.emit import Namer, snake

MEMBERS = {"in", "out", "flag", "own", "node"}
"""Members of the struct of a board, beside its devices."""


@dataclass
class BoardNames:
    """The names of a board. ``signals``, ``devices``: members, by number."""

    board: Board
    node: Node
    parts: dict[int, Part]
    """By the number of the machine in the whole system."""
    signals: tuple[str, ...]
    devices: tuple[str, ...]
    told: dict[tuple[int, int], str]
    """By machine and port: the host's function for events that other machines receive, too."""
    thresholds: dict[Hysteresis, str] = field(default_factory=dict)
    """Members that hold what is on."""
    pointer: str = "io"
    """The name of the pointer to the board."""
    is_used: bool = False
    """Whether something printed reads through it."""

    @property
    def io(self) -> str:
        """The pointer to the board; from now on it is used."""
        self.is_used = True
        return self.pointer

    @property
    def prefix(self) -> str:
        """The prefix of all names."""
        return f"board_{snake(self.board.name)}_io"

    def value(self, number: int) -> str:
        """Return the member with the meaning of a signal."""
        signal = self.board.signals[number]
        group = "in" if signal.is_input else "out" if signal.is_output else "flag"
        return f"{self.io}->{group}.{self.signals[number]}"

    def threshold(self, found: Hysteresis) -> str:
        """Return the member for whether a signal is beyond its thresholds."""
        name = self.thresholds.setdefault(found, f"beyond_{len(self.thresholds)}")
        return f"{self.io}->own.{name}"

    def chart(self, machine: int) -> Chart:
        """Return the chart of a machine as it was read."""
        return self.board.deployment.system.machines[machine].chart


def names_of(board: Board) -> BoardNames:
    """Return the names of a board and of its node."""
    node = next(node for node in nodes_of(board.deployment) if node.place == board.node)
    parts = parts_of(node.system, node.charts, ())
    by_number = {node.numbers[part.index]: part for part in parts}
    members = Namer(KEYWORDS)
    signals = tuple(members.name(unreserved(snake(signal.name))) for signal in board.signals)
    others = Namer(KEYWORDS | MEMBERS)
    devices = tuple(others.name(unreserved(snake(device.name))) for device in board.devices)
    told = {
        (node.numbers[machine], port): name
        for (machine, port), name in NodePrinter(node, parts).host_function_names().items()
    }
    return BoardNames(board, node, by_number, signals, devices, told)
