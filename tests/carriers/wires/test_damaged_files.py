"""A file of wires that is damaged in any way is refused with findings, or means something else."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from fsmkit.carriers.wires.board import Board
from fsmkit.codegen.system.program import program_of
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import read_with_boards
from tests.carriers.wires import test_devices, test_reader
from tests.carriers.wires.conftest import write
from tests.parameters import sampled

STRANGE = (
    "0", "-1", "9" * 20, "0x10", "{", "[", "~", "nothing", "host", "1.5", "50ms", '"x"', "é",
    "mould.In(idle)", "axis.arrived", "count()", "min(1, 2)", "Fault.none",
)  # fmt: skip


def damaged(draw: random.Random, text: str) -> str:
    """Return a text with one to three pieces lost, moved or replaced."""
    pieces = re.findall(r"\w+|\s+|[^\w\s]", text)
    for _ in range(draw.randint(1, 3)):
        place = draw.randrange(len(pieces))
        match draw.randrange(4):
            case 0:
                del pieces[place]
            case 1:
                pieces[place] = draw.choice(pieces)
            case 2:
                pieces.insert(place, draw.choice(STRANGE))
            case _:
                other = draw.randrange(len(pieces))
                pieces[place], pieces[other] = pieces[other], pieces[place]
    return "".join(pieces)


@pytest.mark.parametrize("seed", sampled(range(4), every=4))
def test_damage_is_no_traceback(seed: int, tmp_path: Path) -> None:
    draw = random.Random(seed)
    refused = compiled = 0
    for _ in range(100):
        source = draw.choice([test_reader, test_devices])
        path = write(tmp_path, source.CHART, damaged(draw, source.WIRES))
        try:
            board = read_with_boards(path, Findings())
        except FsmkitError:
            refused += 1
            continue
        if isinstance(board, Board):
            program_of(board, "c", Findings(), {})
            compiled += 1
    assert refused > 50
    assert compiled > 0
