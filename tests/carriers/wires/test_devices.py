"""Operations, events and devices in C: what a machine calls reaches functions, flags and wires."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.codegen.system.program import program_of
from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import read, read_with_boards
from tests.carriers.wires.conftest import write
from tests.carriers.wires.test_generated_c import RUNTIME, WARNINGS

CHART = """\
chart: Mould
types: {Fault: [none, sensor, late], Place: [between, home, far]}
constants: {FAR: 1500, SLOW: 20}
inputs: {at: Place}
outputs: {lamp: bool = false}
data: {moves: 0..100 = 0}
operations:
  - goto(position 0..4000, speed 0..100)
  - creep(io 0..4000)
  - count() -> 0..9
  - heat(on bool)
  - complain(why Fault)
  - rest()
events:
  in: [start, arrived, wrong(code Fault)]
  out: [done(times 0..100), gone]
states:
  idle:
    on:
      start: {target: moving, do: "goto(FAR, SLOW); heat(true); lamp = true"}
      wrong: {do: complain(event.code)}
  moving:
    on:
      arrived:
        if: at == Place.far
        target: idle
        do: |
          moves += count()
          creep(3)
          rest()
          heat(false)
          send done(times = moves)
          send gone
"""
WIRES = """\
board: a
deployment: deployment.yaml
period: 1ms
signals:
  encoder: {counter: 1, bits: 8}
  button: {digital_in: 3, active: low}
  lamp: {digital_out: 1, active: low, safe: on}
  heater: {digital_out: 0}
  motor: {pwm: 0, full: 100, signed: true}
  beacon: {number_out: 0, range: 0..200, safe: 2}
  report: {number_out: 1, range: 0..2}
  is_done: {flag: off}
  is_off: {flag: off, host: true}
use:
  axis:
    {header: axis.h, type: axis, reads: [encoder, button], writes: [motor], notices: [near, stop]}
bind:
  mould:
    at:
      when: {home: {call: axis.is_at, with: 0}, far: {call: axis.is_at, with: [FAR]}}
      else: between
    start: {rising: button, while: not is_done}
    arrived: axis.stop
    wrong(code = Fault.late): {while: is_done and axis.near}
    goto: axis.goto
    creep: {call: axis.goto, with: [io + FAR, 2 * SLOW]}
    count: axis.count
    heat: heater
    complain: {set: {report: "why == Fault.late ? 2 : 0"}}
    rest: nothing
    done: {set: {beacon: 2 * times, is_done: true}}
    gone: host
    lamp: lamp
off: {when: is_off, keep: [heater]}
"""
HEADER = """\
#ifndef AXIS_H
#define AXIS_H
#include <stdbool.h>
#include <stdint.h>
enum { AXIS_NEAR = 1, AXIS_STOP = 2 };
typedef struct { int32_t target, speed, position; } axis;
unsigned axis_sense(axis *self, int32_t encoder, bool button);
void axis_act(axis *self, int32_t *pwm);
bool axis_is_at(const axis *self, int32_t position);
void axis_goto(axis *self, int32_t position, int32_t speed);
int32_t axis_count(axis *self);
#endif
"""
MAIN = r"""
#include "board_a_io.h"
#include <stdio.h>
static board_a_io io;
static board_a_io_raw raw;
static uint32_t now;
unsigned axis_sense(axis *self, int32_t encoder, bool button)
{
    self->position = encoder;
    (void)button;
    return encoder == 1500 ? 3u : encoder > 1400 ? 1u : 0u;
}
void axis_act(axis *self, int32_t *pwm) { *pwm = self->speed * 10; }
bool axis_is_at(const axis *self, int32_t position) { return self->position == position; }
void axis_goto(axis *self, int32_t position, int32_t speed)
{
    self->target = position;
    self->speed = speed;
    printf("goto %d %d\n", (int)position, (int)speed);
}
int32_t axis_count(axis *self) { (void)self; return 77; }
void mould_send_gone(mould *m) { (void)m; printf("gone\n"); }
static void step(void)
{
    board_a_io_read(&io, &raw);
    board_a_io_to_machines(&io);
    (void)plant_a_cycle(&io.node, ++now);
    board_a_io_from_machines(&io, &raw);
    printf("%d %d at %d: lamp %d heater %d motor %d beacon %d report %d\n", (int)io.in.encoder,
           (int)raw.button, (int)io.node.mould.in.at, (int)raw.lamp, (int)raw.heater,
           (int)raw.motor, (int)raw.beacon, (int)raw.report);
}
int main(void)
{
    board_a_io_init(&io);
    (void)plant_a_start(&io.node, now);
    raw.button = 1;
    step();
    raw.button = 0;
    step();
    for (int n = 0; n < 15; n++) {
        raw.encoder += 100;
        board_a_io_read(&io, &raw);
    }
    step();
    step();
    raw.button = 1;
    step();
    io.flag.is_off = true;
    step();
    for (unsigned n = 0u; n < BOARD_A_IO_WIRES; n++) {
        const fsm_io_wire *const wire = &board_a_io_wires[n];
        printf("%s %u %u %d %d\n", wire->name, (unsigned)wire->offset, (unsigned)wire->number,
               fsm_io_is_output(wire), (int)wire->safe);
    }
    return 0;
}
"""
TOLD = """\
0 1 at 1: lamp 1 heater 0 motor 0 beacon 2 report 0
goto 1500 20
0 0 at 1: lamp 0 heater 1 motor 100 beacon 2 report 0
goto 1503 40
gone
1500 0 at 2: lamp 0 heater 0 motor 100 beacon 18 report 0
1500 0 at 2: lamp 0 heater 0 motor 100 beacon 18 report 2
1500 1 at 2: lamp 0 heater 0 motor 100 beacon 18 report 2
1500 1 at 2: lamp 0 heater 0 motor 0 beacon 2 report 0
"""


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_what_a_machine_does_reaches_devices_and_wires(
    compiler: str, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    path = write(tmp_path, CHART, WIRES)
    board = read_with_boards(path, Findings())
    made = dict(program_of(board, "c", Findings(), {}).files)
    node = program_of(read(tmp_path / "deployment.yaml", Findings()), "c", Findings(), {}).files
    made |= {name.removeprefix("a/"): text for name, text in node.items()}
    made |= {"axis.h": HEADER, "main.c": MAIN}
    for name, text in made.items():
        assert isinstance(text, str)
        (tmp_path / name).write_text(text, encoding="utf-8")
    names = ("main", "board_a_io", "fsm_io", "plant_a", "mould", "fsm")
    command = [require_tool(compiler), "-std=c99", "-O1", "-fsanitize=undefined,address", *WARNINGS]
    command += [f"-I{each}" for each in (tmp_path, RUNTIME / "links", RUNTIME / "hosts")]
    command += [*(str(tmp_path / f"{name}.c") for name in names)]
    command += [str(RUNTIME / "links/fsm_link.c"), "-o", str(tmp_path / "play")]
    subprocess.run(command, check=True)
    done = subprocess.run([str(tmp_path / "play")], capture_output=True, text=True, check=True)
    described = json.loads((tmp_path / "board_a_io.json").read_text())["signals"]
    table = [
        f"{each['name']} {each['offset']} {each['number']} {each['is_output']:d} {each['safe']}\n"
        for each in described
    ]
    assert done.stdout == TOLD + "".join(table)
