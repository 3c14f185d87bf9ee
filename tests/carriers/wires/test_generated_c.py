"""The wires of random boards in C against the reference, on random raw sequences."""

from __future__ import annotations

import os
import random
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.carriers.wires.board import Board, Kind
from fsmkit.carriers.wires.printing.names import names_of
from fsmkit.codegen.system.program import program_of
from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import read
from tests.carriers.wires.conftest import load, write
from tests.carriers.wires.random_boards import BITS, CHART, EVENTS, NUMBERS, Maker
from tests.carriers.wires.reference import Reference

RUNTIME = Path(__file__).parents[3] / "fsmkit/runtime/c"
LIBRARY = Path(__file__).parents[3] / "fsmkit/carriers/wires/c"
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
SEQUENCES = int(os.environ.get("FSMKIT_WIRE_SEQUENCES", "1200"))
BOARDS = 12
CYCLES = 40


def player(board: Board) -> str:
    """Return a program: sequences of raw inputs in, what comes of them out, as int32_t."""
    names = names_of(board)
    inputs = [n for n, signal in enumerate(board.signals) if signal.is_input]
    outputs = [n for n, signal in enumerate(board.signals) if signal.is_output]
    seen = [f"io.{names.value(n).removeprefix('io->')}" for n in inputs]
    seen += [f"io.node.mould.in.b{n}" for n in range(BITS)]
    seen += [f"io.node.mould.in.n{n}" for n in range(NUMBERS)]
    seen += ["io.node.mould.in.e"]
    seen += [f"io.node.mould.data.k{n}" for n in range(EVENTS)]
    seen += [f"raw.{names.signals[n]}" for n in outputs]
    s = names.prefix
    return "\n".join((
        f'#include "{s}.h"',
        "#include <stdio.h>",
        f"static {s} io;",
        f"static {s}_raw raw;",
        "int main(void)",
        "{",
        f"    int32_t in[{len(inputs)}];",
        "    uint32_t now = 0u;",
        "    while (fread(in, sizeof in, 1u, stdin) == 1u) {",
        f"        if (now % {CYCLES}u == 0u) {{",
        f"            {s}_init(&io);",
        "            (void)plant_a_start(&io.node, now);",
        "        }",
        "        now++;",
        *(f"        raw.{names.signals[n]} = in[{place}];" for place, n in enumerate(inputs)),
        f"        {s}_read(&io, &raw);",
        f"        {s}_to_machines(&io);",
        "        (void)plant_a_cycle(&io.node, now);",
        f"        {s}_from_machines(&io, &raw);",
        f"        const int32_t told[] = {{{', '.join(f'(int32_t){each}' for each in seen)}}};",
        "        (void)fwrite(told, sizeof told, 1u, stdout);",
        "    }",
        "    return 0;",
        "}",
        "",
    ))  # fmt: skip


def compiled(path: Path, board: Board, compiler: str, options: tuple[str, ...]) -> Path:
    """Build the program of a board."""
    folder = path.parent
    made = program_of(board, "c", Findings(), {}).files
    node = program_of(read(folder / "deployment.yaml", Findings()), "c", Findings(), {}).files
    made = dict(made) | {n.removeprefix("a/"): t for n, t in node.items() if n.startswith("a/")}
    for name, text in made.items():
        assert isinstance(text, str)
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "main.c").write_text(player(board), encoding="utf-8")
    sources = [folder / f"{name}.c" for name in (
        "main", "board_a_io", "fsm_io", "plant_a", "mould", "fsm")]  # fmt: skip
    sources.append(RUNTIME / "links/fsm_link.c")
    command = [compiler, "-std=c99", *options, *WARNINGS]
    command += [f"-I{each}" for each in (folder, RUNTIME / "links", RUNTIME / "hosts")]
    subprocess.run([*command, *map(str, sources), "-o", str(folder / "play")], check=True)
    return folder / "play"


def drawn(draw: random.Random, board: Board) -> list[int]:
    """Return raw inputs of all signals; 0 for outputs and flags."""
    found = []
    for signal in board.signals:
        match signal.kind:
            case Kind.DIGITAL_IN:
                raw = draw.choice([0, 1, 1, -7])
            case Kind.COUNTER:
                raw = draw.randint(-(2**31), 2**31 - 1)
            case Kind.ANALOG_IN:
                low = -(2 ** (signal.bits - 1)) if signal.is_signed else 0
                high = low + 2**signal.bits - 1
                raw = draw.choice([low, high, draw.randint(low, high), draw.randint(low, high)])
                raw = draw.choice([raw] * 9 + [low - 1, high + 1, -(2**31), 2**31 - 1])
            case Kind.NUMBER_IN:
                raw = draw.randint(signal.valid[0] - 1, signal.valid[1] + 1)
            case _:
                raw = 0
        found.append(raw)
    return found


def sequence(draw: random.Random, board: Board) -> list[list[int]]:
    """Return raw inputs of a run: each signal rests now and then, so that something settles."""
    found = [drawn(draw, board)]
    for _ in range(CYCLES - 1):
        new = drawn(draw, board)
        rests = draw.choice([0.2, 0.6, 0.95])
        found.append([
            old if draw.random() < rests else now
            for old, now in zip(found[-1], new, strict=True)
        ])  # fmt: skip
    return found


@pytest.mark.external
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(BOARDS))
def test_c_and_reference_agree(
    seed: int, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    draw = random.Random(seed)
    path = write(tmp_path, CHART, Maker(draw).text())
    board = load(path)
    compiler = require_tool("gcc" if seed % 2 else "clang")
    program = compiled(path, board, compiler, ("-O1", "-fsanitize=undefined,address"))
    runs = [sequence(draw, board) for _ in range(SEQUENCES // BOARDS)]
    inputs = [n for n, signal in enumerate(board.signals) if signal.is_input]
    sent = b"".join(
        raw[n].to_bytes(4, "little", signed=True) for run in runs for raw in run for n in inputs
    )
    got = subprocess.run([str(program)], input=sent, capture_output=True, check=True).stdout
    width = 4 * (len(inputs) + BITS + NUMBERS + 1 + EVENTS)
    width += 4 * sum(signal.is_output for signal in board.signals)
    assert len(got) == width * CYCLES * len(runs)
    at = 0
    for run in runs:
        reference = Reference(board)
        for cycle, raw in enumerate(run):
            reference.read(raw)
            told = reference.to_machines()
            expected = [reference.values[n] for n in inputs] + told
            expected += [reference.posted.get(event, 0) for event in range(EVENTS)]
            expected += reference.from_machines()
            found = [
                int.from_bytes(got[at + 4 * n : at + 4 * n + 4], "little", signed=True)
                for n in range(len(expected))
            ]
            assert found == expected, (cycle, run[: cycle + 1])
            at += width
