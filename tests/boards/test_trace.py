"""A Cortex-M3 that is traced: over a serial port that loses frames, and by its memory."""

from __future__ import annotations

import random
import struct
import subprocess
import time
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import Options
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.tracing.following import (
    CompleteState,
    Divergence,
    Followed,
    Follower,
    Missing,
    ReplayedStep,
)
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.stream import Line, Stream
from tests.boards.conftest import Build
from tests.boards.gdb_remote import Probe
from tests.boards.playing import BOARD, CORTEX_M3, EMULATED, LINKED

pytestmark = [pytest.mark.external, pytest.mark.slow]
RequireTool = Callable[[str], str]
RECORDED = Options(extras=frozenset({"save", "records"}))
RAM = 0x20000000
SECOND = 1_000
"""Ticks."""
GATE = """
chart: Gate
events: {in: ["open(how 0..3)", close]}
data: {opened: uint16 = 0}
operations: [width() -> 0..100]
initial: closed
states:
  closed: {on: {open: {target: moving, if: event.how > 0, do: opened += width()}}}
  moving:
    regions:
      door: {initial: slow, states: {slow: {after: {7ms: fast}}, fast: {}}}
      lamp: {initial: dark, states: {dark: {after: {3ms: lit}}, lit: {after: {3ms: dark}}}}
    on: {close: closed}
    after: {40ms: wide}
  wide: {on: {close: closed}, after: {300ms: closed}}
"""
PROGRAM = """
#include "gate.h"
#include "cortex_m/fsm_cortex_m.h"
#include "cortex_m/mps2_an385.h"
#include "fsm_records.h"

static gate machine;
static uint32_t chance = 1u;

uint8_t gate_width(gate *m)
{
    (void)m;
    return (uint8_t)(chance >> 16 & 63u);
}

static void step(void *context, uint32_t now)
{
    (void)context;
    chance = 1103515245u * chance + 12345u;
    if (now % 37u == 0u)
        (void)gate_post_open(&machine, (uint8_t)(chance >> 20 & 3u));
    if (now % 91u == 0u && (chance >> 24 & 1u) != 0u)
        (void)gate_post_close(&machine);
    gate_run(&machine, now);
#ifdef SERIAL
    static uint8_t frame[FSM_FRAME_BYTES];
    size_t size;
    while ((size = fsm_records_frame(frame)) > 0u)
        for (size_t i = 0u; i < size; i++)
            mps2_put((char)frame[i]);
    if (now == SERIAL)
        mps2_exit(0);
#endif
}

int main(void)
{
    gate_init(&machine);
    fsm_cortex_m_start(MPS2_CLOCK_HZ / 1000, 4294967000u);
    gate_start(&machine, fsm_cortex_m_now());
    fsm_cortex_m_loop(step, NULL);
    return 0;
}
"""


@pytest.fixture(scope="module")
def gate(tmp_path_factory: pytest.TempPathFactory) -> Chart:
    path = tmp_path_factory.mktemp("gate") / "gate.yaml"
    path.write_text(GATE)
    return load(path)


def image_of(folder: Path, chart: Chart, build: Build, *defined: str) -> Path:
    """Build the program."""
    for name, text in generate_machine(chart, "gate", RECORDED).files.items():
        (folder / name).write_text(text)
    (folder / "host.c").write_text(PROGRAM)
    sources = ["host.c", "gate_records.c", "gate_info.c", "fsm_records.c", "fsm_save.c", "fsm.c"]
    return build(
        folder, "arm-none-eabi-gcc", "-Os", *CORTEX_M3, "-ffreestanding", "-DFSM_NO_NAMES",
        *defined, *sources, *BOARD, *LINKED, "-lgcc",
    )  # fmt: skip


def followed(chart: Chart, sent: bytes) -> tuple[list[Followed], Line]:
    line, follower = Line(Stream([Numbering(chart)])), Follower()
    found: list[Followed] = []
    for timed in [*line.feed(sent), *line.end()]:
        found += follower.follow(timed, line.stream.of.get(timed.instance))
    return found, line


def states(chart: Chart, found: list[Followed]) -> Iterator[tuple[int, list[str] | None]]:
    """Yield when the states became known, others, or unknown."""
    for each in found:
        if isinstance(each, ReplayedStep):
            yield each.at, active_leaves(chart, each.macrostep.after)
        elif isinstance(each, CompleteState):
            yield each.at, active_leaves(chart, each.snapshot)
        elif isinstance(each, Missing):
            yield each.at, None


@pytest.mark.parametrize("level", [1, 2])
def test_states_are_right_within_a_second_of_the_last_loss(
    level: int, gate: Chart, tmp_path: Path, build: Build, require_tool: RequireTool
) -> None:
    """20 % of the frames of four seconds are dropped, across the wrap of the clock."""
    emulator = require_tool(EMULATED[0])
    image = image_of(tmp_path, gate, build, f"-DFSM_TRACE_LEVEL={level}", "-DSERIAL=5000u")
    done = subprocess.run(
        [emulator, *EMULATED[1:], "-icount", "shift=7", "-kernel", str(image)],
        capture_output=True, check=True, timeout=100,
    )  # fmt: skip
    whole = done.stdout.split(b"\0")[:-1]
    chance = random.Random(7)
    until = len(whole) * 3 // 4
    kept = [frame for n, frame in enumerate(whole) if n >= until or chance.random() >= 0.2]
    dropped = len(whole) - len(kept)
    assert 0.15 < dropped / until < 0.25

    truth, _ = followed(gate, done.stdout)
    assert not [each for each in truth if isinstance(each, Missing | Divergence)]
    timeline = list(states(gate, truth))
    times = [at for at, _ in timeline]
    found, line = followed(gate, b"\0".join([*kept, b""]))
    assert line.unframer.lost == dropped
    assert line.unframer.spoilt == 0
    assert not [each for each in found if isinstance(each, Divergence)]

    losses = [each.at for each in found if isinstance(each, Missing)]
    again = next(
        e.at for e in found if isinstance(e, CompleteState | ReplayedStep) and e.at >= losses[-1]
    )
    assert again <= losses[-1] + SECOND
    for at, on in states(gate, found):
        if on is not None:  # reported values are true
            first, after = bisect_left(times, at), bisect_right(times, at)
            assert on in [told for _, told in timeline[max(0, first - 1) : after]]
    if level == 2:
        assert any(
            isinstance(e, ReplayedStep) and e.is_known for e in found if e.at > losses[-1] + SECOND
        )
        ends = [
            [e for e in some if isinstance(e, ReplayedStep)][-1].macrostep.after
            for some in (truth, found)
        ]
        assert ends[0] == ends[1]


def test_a_probe_reads_the_ring_in_the_memory(
    gate: Chart, tmp_path: Path, build: Build, require_tool: RequireTool
) -> None:
    """The block is found by its id; bytes are read, and freed, while the processor runs on."""
    emulator = require_tool(EMULATED[0])
    image = image_of(tmp_path, gate, build, "-DFSM_TRACE_LEVEL=2", "-DFSM_TRACE_SIZE=4096")
    stub = tmp_path / "stub"
    command = [
        emulator, *EMULATED[1:], "-icount", "shift=7", "-kernel", str(image), "-S", "-chardev",
        f"socket,path={stub},server=on,wait=off,id=stub", "-gdb", "chardev:stub",
    ]  # fmt: skip
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as board:
        try:
            probe = Probe(stub)
            data = b""
            for _ in range(200):
                probe.go_on()
                time.sleep(0.03)  # of the emulator: no output shows the program's progress
                probe.stop()
                data += taken(probe)
                if len(data) >= 3_000:
                    break
            probe.close()
        finally:
            board.kill()
    stream, follower = Stream([Numbering(gate)]), Follower()
    found = [
        each for timed in stream.feed(data)
        for each in follower.follow(timed, stream.of.get(timed.instance))
    ]  # fmt: skip
    known = [each for each in found if isinstance(each, ReplayedStep) and each.is_known]
    assert len(known) > 20
    assert not [each for each in found if isinstance(each, Divergence)]


def taken(probe: Probe) -> bytes:
    """Read the new bytes of the ring, as the tools for RTT do."""
    memory = probe.read(RAM, 0x2000)
    block = memory.find(b"SEGGER RTT\0\0\0\0\0\0")
    if block < 0:
        return b""  # not started yet
    ups, downs, _, ring, size, write, read, _ = struct.unpack_from("<iiIIIIII", memory, block + 16)
    assert (ups, downs, size) == (1, 0, 4096)
    bytes_ = probe.read(ring, size)
    probe.write(RAM + block + 40, struct.pack("<I", write))
    return bytes_[read:write] if read <= write else bytes_[read:] + bytes_[:write]
