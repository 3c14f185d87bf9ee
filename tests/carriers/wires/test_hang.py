"""Registers of a loop that hangs: another context makes them safe, on a simulated clock."""

from __future__ import annotations

import random
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.carriers.wires import test_registers
from tests.carriers.wires.test_registers import HEAD, built

WIRES = (
    HEAD
    + """\
  go: {digital_in: 0, register: {at: 0, access: 8}}
  motor: {pwm: 0, full: 100, signed: true, safe: 0, register: {at: 4, access: 16, bits: 8}}
  brake: {digital_out: 1, safe: on, register: {at: 4, access: 16, shift: 8}}
  magnet: {digital_out: 2, safe: off, register: {at: 4, access: 16, shift: 9}}
  stop: {flag: off}
off: {when: stop, keep: [magnet]}
"""
)
MAIN = """\
#include "board_a_io.h"
#include "fsm_io_map.h"
#include "fsm_watch.h"
#include <inttypes.h>
#include <stdio.h>
static board_a_io_raw raw;
static fsm_shared completed;
int main(void)
{
    static uint32_t window[2];
    const fsm_io_map map = {window, sizeof window, board_a_io_wires, board_a_io_registers,
                            BOARD_A_IO_REGISTERS};
    fsm_watch watch;
    uint64_t now, next = 0u, last = 0u, look = 0u;
    unsigned period, hang_at, hang_for;
    if (!fsm_io_map_fits(&map) || scanf("%u %u %u", &period, &hang_at, &hang_for) != 3)
        return 1;
    fsm_watch_start(&watch, 0u, BOARD_A_IO_WATCHDOG_MS, 0u);
    for (now = 0u; now < hang_at + hang_for + 1000u; now++) {
        if (now == next) { /* the loop */
            next += period;
            if (next >= hang_at && next < hang_at + hang_for)
                next = hang_at + hang_for;
            raw.motor = -70;
            raw.brake = 0;
            raw.magnet = 1;
            fsm_io_map_write(&map, &raw);
            fsm_shared_write(&completed, fsm_shared_own(&completed) + 1u);
            last = now;
        }
        if (now >= look) { /* a timer interrupt, or a thread */
            look = now + fsm_watch_every(&watch);
            if (!fsm_watch_look(&watch, fsm_shared_read(&completed), now)) {
                board_a_io_raw safe = raw;
                fsm_io_switch_off(board_a_io_wires, BOARD_A_IO_WIRES, &safe);
                fsm_io_map_write(&map, &safe);
            }
        }
        printf("%" PRIu64 " %" PRIu64 " %" PRIu32 "\\n", now, last, window[1]);
    }
    return 0;
}
"""
DRIVEN, SAFE = 0x2BA, 0x300  # motor -70, magnet; brake, magnet


@pytest.mark.cc
def test_the_outputs_of_a_hung_loop_are_safe_within_the_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, require_tool: Callable[[str], str]
) -> None:
    monkeypatch.setattr(test_registers, "MAIN", MAIN)
    program = built(tmp_path, WIRES, require_tool("gcc"))
    draw = random.Random(5)
    for _ in range(20):
        period, hang_at, hang_for = draw.randint(1, 50), draw.randint(200, 900), 2000
        text = f"{period} {hang_at} {hang_for}"
        done = subprocess.run([program], input=text, capture_output=True, text=True, check=True)
        for line in done.stdout.splitlines():
            now, last, outputs = map(int, line.split())
            assert outputs in (DRIVEN, SAFE)
            if now - last >= 100:
                assert outputs == SAFE
            elif now - last < 50 - 1:
                assert outputs == DRIVEN
