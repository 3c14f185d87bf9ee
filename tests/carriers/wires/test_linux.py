"""Wires of Linux: folders in place of sysfs, and a table of answers in place of the GPIO driver."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.carriers.wires.test_generated_c import LIBRARY, WARNINGS

pytestmark = pytest.mark.cc
MAIN = r"""
#define _POSIX_C_SOURCE 200809L
#include "fsm_io_linux.h"
#include <errno.h>
#include <fcntl.h>
#include <linux/gpio.h>
#include <stdio.h>
#include <string.h>

typedef struct { int32_t in_a, in_b, hot, turns, motor, lamp, beep, number; } image;
#define WIRE(name, number, kind, safe, full) \
    {#name, offsetof(image, name), number, kind, 32u, safe, full, false}
static const fsm_io_wire wires[] = {
    WIRE(in_a, 4u, FSM_IO_DIGITAL_IN, 0, 0), WIRE(in_b, 17u, FSM_IO_DIGITAL_IN, 0, 0),
    WIRE(hot, 2u, FSM_IO_ANALOG_IN, 0, 0),   WIRE(turns, 1u, FSM_IO_COUNTER, 0, 0),
    WIRE(motor, 0u, FSM_IO_PWM, 0, 4096),    WIRE(lamp, 5u, FSM_IO_DIGITAL_OUT, 1, 0),
    WIRE(beep, 6u, FSM_IO_DIGITAL_OUT, 0, 0), WIRE(number, 1u, FSM_IO_NUMBER_IN, 0, 0),
};
static image raw;
static unsigned answer; /* what lines are, or 99: an error */

static int answers(int file, unsigned long request, void *argument)
{
    (void)file;
    if (request == GPIO_V2_GET_LINE_IOCTL) {
        struct gpio_v2_line_request *const asked = argument;
        printf("lines");
        for (unsigned i = 0u; i < asked->num_lines; i++)
            printf(" %u", (unsigned)asked->offsets[i]);
        printf(" of %s flags %u attrs %u", asked->consumer, (unsigned)asked->config.flags,
               (unsigned)asked->config.num_attrs);
        if (asked->config.num_attrs > 0u)
            printf(" values %u mask %u", (unsigned)asked->config.attrs[0].attr.values,
                   (unsigned)asked->config.attrs[0].mask);
        printf("\n");
        if (answer == 99u) {
            errno = EBUSY;
            return -1;
        }
        asked->fd = open("/dev/null", O_RDWR);
        return 0;
    }
    if (answer == 99u) {
        errno = EIO;
        return -1;
    }
    if (request == GPIO_V2_LINE_GET_VALUES_IOCTL) {
        ((struct gpio_v2_line_values *)argument)->bits = answer;
        return 0;
    }
    if (request == GPIO_V2_LINE_SET_VALUES_IOCTL) {
        const struct gpio_v2_line_values *const set = argument;
        printf("set %u of %u\n", (unsigned)set->bits, (unsigned)set->mask);
        return 0;
    }
    errno = ENOTTY;
    return -1;
}

static char folder[4][200];

int main(int count, char **words)
{
    fsm_io_linux it;
    fsm_io_linux_places places = {folder[0], folder[1], folder[2], folder[3], 20000000u};
    char what[16];
    int value, error;
    memset(&it, 0, sizeof it);
    it.wires = wires;
    it.count = count > 2 ? sizeof wires / sizeof wires[0] : sizeof wires / sizeof wires[0] - 1u;
    it.ioctl = answers;
    for (int i = 0; i < 4; i++) {
        static const char *const names[] = {"chip", "iio", "counter", "pwm"};
        (void)snprintf(folder[i], sizeof folder[i], "%s/%s", words[1], names[i]);
    }
    if (count > 3)
        places.counter = NULL;
    while (scanf("%15s %d", what, &value) == 2) {
        switch (what[0]) {
        case 'a': answer = (unsigned)value; break;
        case 'm': raw.motor = value; break;
        case 'l': raw.lamp = value; break;
        case 'b': raw.beep = value; break;
        case 'o':
            error = fsm_io_linux_open(&it, &places);
            printf("open %d %s\n", error, it.failed != NULL ? it.failed : "-");
            if (error != 0)
                return 1;
            break;
        case 'r':
            error = fsm_io_linux_read(&it, &raw);
            printf("read %d: %d %d %d %d, %u\n", error, (int)raw.in_a, (int)raw.in_b, (int)raw.hot,
                   (int)raw.turns, (unsigned)it.errors);
            break;
        default:
            error = fsm_io_linux_write(&it, &raw);
            printf("write %d\n", error);
        }
        (void)fflush(stdout);
    }
    fsm_io_linux_close(&it);
    return 0;
}
"""


@pytest.fixture(scope="module")
def player(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    folder = tmp_path_factory.mktemp("linux")
    (folder / "main.c").write_text(MAIN)

    def build(gcc: str) -> Path:
        if not (folder / "play").exists():
            command = [gcc, "-std=c99", "-O1", "-fsanitize=undefined,address", *WARNINGS]
            command += [f"-I{LIBRARY}", str(folder / "main.c")]
            command += [str(LIBRARY / "fsm_io_linux.c"), str(LIBRARY / "fsm_io.c")]
            subprocess.run([*command, "-o", str(folder / "play")], check=True)
        return folder / "play"

    return build


def sysfs(folder: Path, *, is_exported: bool = True) -> None:
    (folder / "chip").touch()
    for name in ("iio", "counter/count1", "pwm"):
        (folder / name).mkdir(parents=True)
    (folder / "iio/in_voltage2_raw").write_text("1234\n")
    (folder / "counter/count1/count").write_text("4294967290\n")
    (folder / "pwm/export").touch()
    if is_exported:
        (folder / "pwm/pwm0").mkdir()
        for name in ("period", "duty_cycle", "enable"):
            (folder / "pwm/pwm0" / name).write_text("0\n")


def play(program: Path, script: str, *words: str) -> str:
    done = subprocess.run(
        [str(program), *words], input=script, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    return done.stdout


def first(path: Path) -> int:
    """Return the number in a file; sysfs forgets what was written before it."""
    return int(path.read_text().split()[0])


def test_wires_are_lines_and_files(
    player: Callable[[str], Path], tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    program = player(require_tool("gcc"))
    sysfs(tmp_path)
    script = "open 0\nanswer 2\nread 0\nlamp 1\nbeep 1\nmotor 1024\nwrite 0\n"
    told = play(program, f"{script}motor -5\nlamp 0\nwrite 0\n", str(tmp_path))
    assert told.splitlines() == [
        "lines 4 17 of fsmkit flags 4 attrs 0",
        "lines 5 6 of fsmkit flags 8 attrs 1 values 1 mask 3",
        "open 0 -",
        "read 0: 0 1 1234 -6, 0",
        "set 3 of 3",
        "write 0",
        "set 2 of 3",
        "write 0",
    ]
    assert first(tmp_path / "pwm/pwm0/period") == 20_000_000
    assert first(tmp_path / "pwm/pwm0/enable") == 1
    assert first(tmp_path / "pwm/pwm0/duty_cycle") == 0  # a pwm below 0 is 0
    play(program, "open 0\nmotor 1024\nwrite 0\n", str(tmp_path))
    assert first(tmp_path / "pwm/pwm0/duty_cycle") == 5_000_000


def test_what_fails_is_counted_and_the_rest_is_done(
    player: Callable[[str], Path], tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    sysfs(tmp_path)
    (tmp_path / "iio/in_voltage2_raw").write_text("none\n")
    told = play(
        player(require_tool("gcc")),
        "open 0\nanswer 1\nread 0\nanswer 99\nread 0\nwrite 0\n",
        str(tmp_path),
    )
    assert told.splitlines()[3:] == [
        "read 5: 1 0 0 -6, 1",
        "read 5: 1 0 0 -6, 3",
        "write 5",
    ]


@pytest.mark.parametrize(
    ("missing", "words", "answer", "wanted"),
    [
        ("iio/in_voltage2_raw", (), 0, "open 2 hot"),
        ("counter/count1/count", (), 0, "open 2 turns"),
        ("chip", (), 0, "open 2 lines"),
        ("", (), 99, "open 16 lines"),
        ("", ("number",), 0, "open 95 number"),
        ("", ("number", "none"), 0, "open 19 turns"),
    ],
)
def test_what_does_not_open_is_named(
    missing: str,
    words: tuple[str, ...],
    answer: int,
    wanted: str,
    player: Callable[[str], Path],
    tmp_path: Path,
    require_tool: Callable[[str], str],
) -> None:
    sysfs(tmp_path)
    if missing:
        (tmp_path / missing).unlink()
    script = f"answer {answer}\nopen 0\n"
    told = play(player(require_tool("gcc")), script, str(tmp_path), *words)
    assert told.splitlines()[-1] == wanted


def test_a_pwm_that_is_not_there_is_asked_for(
    player: Callable[[str], Path], tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    sysfs(tmp_path, is_exported=False)
    told = play(player(require_tool("gcc")), "open 0\n", str(tmp_path))
    assert told == "open 2 motor\n"  # no kernel here makes the folder
    assert first(tmp_path / "pwm/export") == 0
