"""Wires in a window of registers: C against Python on random layouts; wrong layouts."""

from __future__ import annotations

import json
import random
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.carriers.wires.registers import Registers, places_of, size_of
from fsmkit.codegen.system.program import program_of
from fsmkit.diagnostics import Findings, FsmkitError
from tests.carriers.wires.conftest import load, write
from tests.carriers.wires.test_generated_c import LIBRARY, RUNTIME, WARNINGS

CHART = "chart: Mould\nstates: {s: {}}\n"
HEAD = "board: a\ndeployment: deployment.yaml\nperiod: 1ms\nsignals:\n"
ROUNDS = 200
LAYOUTS = 6


def layout(draw: random.Random) -> str:
    """Return signals in registers of all sizes, several in some."""
    lines: list[str] = []
    offset = 0
    for number in range(12):
        access = draw.choice([8, 16, 32])
        offset += -offset % (access // 8)
        is_output = draw.random() < 0.5
        shift = 0
        for part in range(draw.randint(1, 4)):
            shift += draw.randint(0, 3)
            if shift >= access:
                break
            bits = draw.randint(1, min(24, access - shift))
            place = f"register: {{at: {offset}, access: {access}, shift: {shift}, bits: {bits}}}"
            name, wire = f"s{number}_{part}", number * 8 + part
            low, high = draw.choice([(0, 2**bits - 1), (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)])
            if is_output:
                kind = f"number_out: {wire}, range: {low}..{high}"
            elif low == 0 and draw.random() < 0.3:
                kind = f"counter: {wire}, bits: {bits}"
            elif draw.random() < 0.3:
                kind = f"digital_in: {wire}"
            elif low < 0:
                kind = f"number_in: {wire}, range: -2147483648..2147483647"
            else:
                kind = f"analog_in: {wire}, bits: {bits}"
            lines.append(f"  {name}: {{{kind}, {place}}}")
            shift += bits
        offset += access // 8
    return HEAD + "\n".join((*lines, ""))


MAIN = """\
#include "board_a_io.h"
#include "fsm_io_map.h"
#include "fsm_io_memory.h"
#include <stdio.h>
static board_a_io_raw raw;
int main(int count, char **words)
{
    fsm_io_map map = {NULL, BOARD_A_IO_WINDOW, board_a_io_wires, board_a_io_registers,
                      BOARD_A_IO_REGISTERS};
    fsm_io_memory memory = {board_a_io_wires, BOARD_A_IO_WIRES, &raw};
    const int error = count == 2 ? fsm_io_map_open(&map, words[1], 0u) : -1;
    char name[64];
    int value;
    int32_t got = 0;
    if (error != 0) {
        printf("%d\\n", error);
        return 1;
    }
    fsm_io_memory_make_safe(&memory);
    while (scanf("%63s %d", name, &value) == 2) {
        if (name[0] == '<')
            fsm_io_map_read(&map, &raw);
        else if (name[0] == '>')
            fsm_io_map_write(&map, &raw);
        else if (name[0] == '?' && fsm_io_memory_get(&memory, name + 1, &got))
            printf("%d\\n", (int)got);
        else if (name[0] == '!' && fsm_io_memory_find(&memory, name + 1) != NULL)
            *fsm_io_at(&raw, fsm_io_memory_find(&memory, name + 1)) = value;
        else
            printf("%d\\n", fsm_io_memory_set(&memory, name, value));
        (void)fflush(stdout);
    }
    fsm_io_map_close(&map);
    return 0;
}
"""


def built(folder: Path, wires: str, gcc: str) -> Path:
    board = load(write(folder, CHART, wires))
    from fsmkit.system.any_file import read

    node = program_of(read(folder / "deployment.yaml", Findings()), "c", Findings(), {}).files
    made = dict(program_of(board, "c", Findings(), {}).files) | {"main.c": MAIN}
    made |= {name.removeprefix("a/"): text for name, text in node.items()}
    for name, text in made.items():
        assert isinstance(text, str)
        (folder / name).write_text(text, encoding="utf-8")
    names = ("main", "board_a_io", "fsm_io", "plant_a", "mould", "fsm")
    sources = [str(folder / f"{name}.c") for name in names]
    library = ("fsm_io_map", "fsm_io_map_posix", "fsm_io_memory")
    sources += [str(LIBRARY / f"{name}.c") for name in library]
    sources += [str(RUNTIME / "links/fsm_link.c")]
    command = [gcc, "-std=c99", "-O1", "-fsanitize=undefined,address", *WARNINGS]
    command += [f"-I{each}" for each in (folder, LIBRARY, RUNTIME / "links", RUNTIME / "hosts")]
    subprocess.run([*command, *sources, "-o", str(folder / "play")], check=True)
    return folder / "play"


@pytest.mark.cc
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(LAYOUTS))
def test_c_and_python_meet_in_a_window(
    seed: int, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    draw = random.Random(seed)
    program = built(tmp_path, layout(draw), require_tool("gcc" if seed % 2 else "clang"))
    described = json.loads((tmp_path / "board_a_io.json").read_text())
    places = places_of(described)
    window = tmp_path / "window"
    with (
        Registers(window, places, create=True) as registers,
        subprocess.Popen(
            [str(program), str(window)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as playing,
    ):
        assert playing.stdin is not None
        assert playing.stdout is not None
        for _ in range(ROUNDS):
            wanted = {}
            for name, place in places.items():
                low = -(2 ** (place.bits - 1)) if place.is_signed else 0
                wanted[name] = draw.randint(low, low + 2**place.bits - 1)
                if place.is_output:
                    playing.stdin.write(f"!{name} {wanted[name]}\n")
                else:
                    registers.set(name, wanted[name])
            playing.stdin.write("< 0\n> 0\n")
            playing.stdin.write("".join(f"?{name} 0\n" for name in places))
            playing.stdin.flush()
            told = {name: int(playing.stdout.readline()) for name in places}
            assert told == wanted
            assert {name: registers.get(name) for name in places} == wanted
        playing.stdin.close()
    (tmp_path / "short").write_bytes(bytes(size_of(places.values()) - 1))
    for path in ("short", "missing"):
        refused = subprocess.run([str(program), str(tmp_path / path)], check=False)
        assert refused.returncode == 1
    with pytest.raises(ValueError, match="greater"):
        Registers(tmp_path / "short", places)


RIGHT = """\
  in: {digital_in: 0, register: 0x10}
  speed: {pwm: 0, full: 100, signed: true, register: {at: 4, access: 16, bits: 8}}
  lamp: {digital_out: 0, register: {at: 4, access: 16, shift: 8}}
"""


def test_registers_are_read(tmp_path: Path) -> None:
    board = load(write(tmp_path, CHART, HEAD + RIGHT))
    assert [str(signal.register) for signal in board.signals] == [
        "Register(offset=16, access=32, shift=0, bits=1, is_signed=False)",
        "Register(offset=4, access=16, shift=0, bits=8, is_signed=True)",
        "Register(offset=4, access=16, shift=8, bits=1, is_signed=False)",
    ]


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (", register: 0x10", "", "`in` has no register, and others have one"),
        ("0x10", "0x11", "not at a multiple"),
        ("shift: 8}", "shift: 7}", "have a bit in common"),
        ("at: 4, access: 16, shift: 8", "at: 4, access: 32, shift: 8", "in different ways"),
        ("0x10", "{at: 4, access: 16, shift: 12}", "in different ways"),
        ("bits: 8", "bits: 7", "-100..100 does not fit into 7 bits"),
        ("bits: 8", "bits: 17", "does not fit into its register"),
        ("{at: 4, access: 16, bits: 8}", "{access: 16}", "has no address"),
        ("access: 16, bits", "access: 24, bits", "8, 16 or 32 bits"),
        ("{at: 4, access: 16, bits: 8}", "{at: 4, word: 16}", "word"),
    ],
)
def test_layouts_that_are_wrong_are_found(tmp_path: Path, old: str, new: str, text: str) -> None:
    assert old in RIGHT
    with pytest.raises(FsmkitError) as raised:
        load(write(tmp_path, CHART, HEAD + RIGHT.replace(old, new)))
    assert any(text in found.message for found in raised.value.diagnostics)
