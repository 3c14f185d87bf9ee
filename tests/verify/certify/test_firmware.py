"""A machine inside a firmware: certified there, or rejected with the reason."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import read_chart
from fsmkit.verify.certify.certify import certify
from fsmkit.verify.certify.comparison import Request
from tests.verify.certify.test_certify import require

COMMAND = ("arm-none-eabi-gcc", "-mcpu=cortex-m0", "-Os")
LAMP = """
chart: Lamp
data: {presses: 0..3 = 0}
operations: ['light(on bool)', 'battery() -> 0..9']
events: {in: ['press(strength 0..7)'], out: [lit]}
initial: dark
states:
  dark:
    rest: true
    entry: light(false)
    on:
      press:
        {if: event.strength > 3 and battery() > 1, target: bright, do: presses += 1; send lit}
  bright: {entry: light(true), after: {50ms: dark}}
"""
BOARD = """
#include "lamp.h"
static lamp machine;
volatile unsigned pin, level, now;
void lamp_light(lamp *m, bool on) { (void)m; pin = on; }
uint8_t lamp_battery(lamp *m) { (void)m; return (uint8_t)(level % 10u); }
void lamp_send_lit(lamp *m) { (void)m; pin = 2u; }
int main(void)
{
    lamp_init(&machine);
    lamp_start(&machine, 0);
    for (;;) {
        lamp_event e = LAMP_NO_EVENT;
        e.event = LAMP_EVENT_PRESS;
        e.of.press.strength = (uint8_t)(level & 7u);
        (void)lamp_post(&machine, &e);
        lamp_run(&machine, now);
    }
}
"""
LINKED = ("-nostartfiles", "-Wl,-e,main", "-Wl,-Ttext,0x08000000", "-Wl,-Tdata,0x20000000")


def firmware(folder: Path, chart: str = LAMP, flags: tuple[str, ...] = ("-g",)) -> Path:
    """Build a firmware with a machine, and what nothing calls removed."""
    require(COMMAND[0])
    folder.mkdir(exist_ok=True)
    (folder / "lamp.yaml").write_text(chart)
    assert execute(["compile", str(folder / "lamp.yaml"), "-q", "--out", str(folder)]) == 0
    (folder / "board.c").write_text(BOARD)
    sections = ("-ffunction-sections", "-Wl,--gc-sections")
    sources = ("board.c", "lamp.c", "fsm.c")
    subprocess.run(
        [*COMMAND, "-std=c99", *flags, *sections, *sources, *LINKED, "-lgcc", "-o", "board.elf"],
        cwd=folder, check=True,
    )  # fmt: skip
    return folder / "board.elf"


def certified(elf: Path, chart: str = LAMP, command: tuple[str, ...] = COMMAND) -> Any:
    source = elf.parent / "own.yaml"
    source.write_text(chart)
    return certify(read_chart(source, Findings()), Request(command, firmware=elf))


@pytest.mark.cc
@pytest.mark.external
def test_a_machine_is_certified_inside_a_firmware(tmp_path: Path) -> None:
    document = certified(firmware(tmp_path))
    assert document["result"] == "complete"
    assert document["firmware"]["file"].endswith("board.elf")
    steps = {row["step"] for row in document["maxima"]}
    assert "post press" in steps
    assert "dispatch press" not in steps  # its linker removed the function
    assert any("`lamp_dispatch`" in each for each in document["assumptions"])


OTHERS = {
    "another delay": LAMP.replace("50ms", "60ms"),
    "another guard": LAMP.replace("strength > 3", "strength > 4"),
    "another statement": LAMP.replace("light(true)", "light(false)"),
}


@pytest.mark.cc
@pytest.mark.external
@pytest.mark.parametrize("other", OTHERS)
def test_the_firmware_of_another_chart_differs(other: str, tmp_path: Path) -> None:
    document = certified(firmware(tmp_path), OTHERS[other])
    assert document["result"] == "different"
    assert "C in the emulator" in document["differences"][0]["what"]


@pytest.mark.cc
@pytest.mark.external
@pytest.mark.parametrize(
    ("chart", "message"),
    [
        (LAMP.replace("chart: Lamp", "chart: Torch"), "does not contain the machine `torch`"),
        (LAMP.replace("0..3 = 0", "0..3000 = 0"), "differs: `.data.presses` has"),
        (LAMP.replace("{presses", "{other: bool, presses"), "has `.data.other`"),
        (LAMP.replace("chart: Lamp", "chart: Lamp\ncapacity: {queue: 20}"), "has `.fsm.queue"),
    ],
)
def test_another_struct_is_rejected(chart: str, message: str, tmp_path: Path) -> None:
    elf = firmware(tmp_path)
    with pytest.raises(FsmkitError, match=message):
        certified(elf, chart)


def strip(elf: Path) -> None:
    subprocess.run(["arm-none-eabi-strip", str(elf)], check=True)


def edit_library(elf: Path) -> None:
    """Build with another `fsm.h`: timers have one more member."""
    header = elf.parent / "fsm.h"
    old = "    uint16_t what; /*"
    assert old in header.read_text()
    header.write_text(header.read_text().replace(old, "    uint32_t spare;\n" + old))
    subprocess.run(
        [*COMMAND, "-std=c99", "-g", "board.c", "lamp.c", "fsm.c", *LINKED, "-o", "board.elf"],
        cwd=elf.parent, check=True,
    )  # fmt: skip


@pytest.mark.cc
@pytest.mark.external
@pytest.mark.parametrize(
    ("change", "command", "message"),
    [
        (strip, COMMAND, "is stripped"),
        (edit_library, COMMAND, "has `.fsm.timers.0..spare`"),
        (lambda elf: elf.write_text("text"), COMMAND, "is not an ELF file"),
        (lambda elf: elf.write_bytes(elf.read_bytes()[:60]), COMMAND, "is not an ELF file"),
        (Path.unlink, COMMAND, "is not an ELF file"),
        (lambda _: None, ("arm-none-eabi-gcc", "-mcpu=cortex-m4", "-Os"), "is for Cortex-M0"),
        (lambda _: None, ("gcc", "-Os"), "no compiler is given"),
    ],
)
def test_an_unfit_firmware_is_rejected(
    change: Any, command: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    elf = firmware(tmp_path)
    change(elf)
    with pytest.raises(FsmkitError, match=message):
        certified(elf, command=command)


@pytest.mark.cc
@pytest.mark.external
def test_a_firmware_without_debug_information_is_rejected(tmp_path: Path) -> None:
    elf = firmware(tmp_path, flags=("-g0",))
    with pytest.raises(FsmkitError, match="does not describe the struct"):
        certified(elf)
