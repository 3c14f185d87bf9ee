"""The mailbox: events from other threads arrive once and in order, or are counted as lost."""

from __future__ import annotations

import os
import subprocess
from contextlib import suppress
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from tests.boards.conftest import ROOT, Build, Run

STRESS = ROOT / "tests/boards/mailbox_stress.c"
POSIX = ("-D_POSIX_C_SOURCE=200809L", "-pthread")
SANITIZER = ("-fsanitize=thread", "-g", "-O1")
COMPILER_BARRIER = "-DFSM_BARRIER()=__sync_synchronize()"
KINDS = [
    pytest.param(["-std=c99"], id="functions of the compiler"),
    pytest.param(["-std=c11"], id="atomics of C11"),
    pytest.param(["-std=c99", COMPILER_BARRIER], id="a barrier of one's own"),
]
EVENTS = 100_000


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("kind", KINDS)
def test_threads(compiler: str, kind: list[str], tmp_path: Path, build: Build, run: Run) -> None:
    program = build(tmp_path, compiler, *kind, "-O2", *POSIX, STRESS)
    assert run(program, str(EVENTS)).endswith("wrong 0 failures 0\n")


@pytest.mark.external
@pytest.mark.parametrize("kind", KINDS[:2])
def test_threads_under_the_thread_sanitizer(
    kind: list[str], tmp_path: Path, build: Build, run: Run
) -> None:
    program = build(tmp_path, "clang", *kind, *SANITIZER, *POSIX, STRESS)
    assert run(program, str(EVENTS)).endswith("wrong 0 failures 0\n")


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_threads_that_share_a_mailbox(
    compiler: str, tmp_path: Path, build: Build, run: Run
) -> None:
    program = build(tmp_path, compiler, "-DSHARED", "-O2", *POSIX, STRESS)
    assert run(program, str(EVENTS)).endswith("wrong 0 failures 0\n")


@pytest.mark.external
def test_threads_that_share_a_mailbox_under_the_thread_sanitizer(
    tmp_path: Path, build: Build, run: Run
) -> None:
    program = build(tmp_path, "clang", "-DSHARED", *SANITIZER, *POSIX, STRESS)
    assert run(program, str(EVENTS)).endswith("wrong 0 failures 0\n")


def shows_a_race(program: Path) -> bool:
    """Return whether one of several runs shows a race; threads may not meet in a single run.

    A run ends at its first race; after that a lost message would keep it waiting for ever.
    """
    environment = {**os.environ, "TSAN_OPTIONS": "halt_on_error=1"}
    for _ in range(20):
        command = [str(program), "1000"]
        with suppress(subprocess.TimeoutExpired):
            done = subprocess.run(
                command, env=environment, capture_output=True, text=True, check=False, timeout=60
            )
            if "data race" in done.stderr:
                return True
    return False


@pytest.mark.external
def test_the_thread_sanitizer_sees_a_shared_mailbox_without_a_guard(
    tmp_path: Path, build: Build
) -> None:
    unguarded = ["-DSHARED", "-DUNGUARDED", "-Wno-unused-variable"]
    program = build(tmp_path, "clang", *unguarded, *SANITIZER, *POSIX, STRESS)
    assert shows_a_race(program)


@pytest.mark.cc
def test_a_guard_has_two_ends(tmp_path: Path, build: Build) -> None:
    (tmp_path / "half.c").write_text('#include "fsm_mailbox.h"\nint n;\n', encoding="utf-8")
    build(tmp_path, "gcc", "-c", "half.c")
    with pytest.raises(AssertionError, match="define both FSM_ENTER_CRITICAL"):
        build(tmp_path, "gcc", "-c", "-DFSM_ENTER_CRITICAL()=(void)0", "half.c")


CRITICAL = {
    "none": "",
    "empty": "#define FSM_ENTER_CRITICAL() ((void)0)\n#define FSM_EXIT_CRITICAL() ((void)0)\n",
    "masks": (
        '#include "cortex_m/fsm_cortex_m.h"\n'
        "#define FSM_ENTER_CRITICAL() const uint32_t mask_ = fsm_cortex_m_mask()\n"
        "#define FSM_EXIT_CRITICAL() fsm_cortex_m_unmask(mask_)\n"
    ),
}
PRODUCER = """
#include "fsm_mailbox.h"
typedef struct { uint32_t n; } x_event; typedef struct { uint8_t n; } x;
bool x_post(x *m, const x_event *e); void x_run(x *m, uint32_t now);
FSM_MAILBOX(x, 2, 8)
bool put(x_mailbox *box, const x_event *e);
bool put(x_mailbox *box, const x_event *e) { return x_mailbox_put(box, e); }
"""


@pytest.mark.external
def test_a_guard_costs_nothing_where_there_is_none(tmp_path: Path, build: Build) -> None:
    made = {}
    for name, guard in CRITICAL.items():
        (tmp_path / "put.c").write_text(guard + PRODUCER, encoding="utf-8")
        words = ["-mcpu=cortex-m3", "-mthumb", "-Os", "-S", "put.c"]
        made[name] = build(tmp_path, "arm-none-eabi-gcc", *words).read_text(encoding="utf-8")
    assert made["none"] == made["empty"]
    assert "cpsid" not in made["none"]
    assert made["masks"].count("cpsid i") == made["masks"].count("msr primask") == 1


@pytest.mark.external
def test_the_thread_sanitizer_sees_a_mailbox_without_order(tmp_path: Path, build: Build) -> None:
    arguments = ["-DFSM_BARRIER()=(void)0", *SANITIZER, *POSIX, STRESS]
    program = build(tmp_path, "clang", *arguments)
    assert shows_a_race(program)


LAWS = """
#include "lamp.h"
#include "fsm_mailbox.h"
#include <stdio.h>
FSM_MAILBOX(lamp, LAMP_QUEUE, 8)
static lamp machine;
static lamp_mailbox box;
static unsigned lit;
void lamp_light(lamp *m, uint8_t level) { (void)m; lit = lit * 10u + level; }
static void put(uint8_t level)
{
    lamp_event e = LAMP_NO_EVENT;
    e.event = LAMP_EVENT_SET;
    e.of.set.level = level;
    printf("%d", lamp_mailbox_put(&box, &e));
}
int main(void)
{
    lamp_init(&machine);
    lamp_start(&machine, 0);
    for (int round = 0; round < 100; round++) { /* counts wrap around where they are 8 bits wide */
        lit = 0;
        for (uint8_t level = 1; level <= 9; level++)
            put(level); /* the ninth finds no room */
        printf(" lost %u", (unsigned)lamp_mailbox_lost(&box));
        printf(" drained %u", (unsigned)lamp_mailbox_drain(&box, &machine));
        printf(" more %u", (unsigned)lamp_mailbox_drain(&box, &machine)); /* the queue is full */
        lamp_mailbox_run(&box, &machine, 1);
        printf(" lit %u\\n", lit);
    }
    return 0;
}
"""
LAMP = """\
chart: Lamp
capacity: {queue: 2}
operations: [light(level uint8)]
events: {in: [set(level uint8)]}
initial: on
states:
  on: {on: {set: {do: light(event.level)}}}
"""


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("index", ["uint8_t", "uint32_t"])
def test_nothing_is_lost_but_at_a_full_mailbox(
    index: str, compiler: str, tmp_path: Path, build: Build, run: Run
) -> None:
    """By hand: 9 put into 8 slots, 1 lost, 2 posted, none more into a full queue of 2, 8 run."""
    (tmp_path / "lamp.yaml").write_text(LAMP, encoding="utf-8")
    for name, text in generate_machine(load(tmp_path / "lamp.yaml")).files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "laws.c").write_text(LAWS, encoding="utf-8")
    files = sorted(path.name for path in tmp_path.glob("*.c"))
    printed = run(build(tmp_path, compiler, f"-DFSM_INDEX={index}", *files)).splitlines()
    most = 255 if index == "uint8_t" else 2**32 - 1
    for count, line in enumerate(printed, 1):
        lost = min(count, most)
        assert line == f"111111110 lost {lost} drained 2 more 0 lit 12345678"
    assert len(printed) == 100


@pytest.mark.cc
@pytest.mark.parametrize(
    ("slots", "queue"), [("6", "2"), ("0", "2"), ("256", "2"), ("8", "0"), ("8", "256")]
)
def test_sizes_that_cannot_be_do_not_compile(
    slots: str, queue: str, tmp_path: Path, build: Build
) -> None:
    text = (
        '#include "fsm_mailbox.h"\n'
        "typedef struct { uint8_t n; } x_event; typedef struct { uint8_t n; } x;\n"
        "bool x_post(x *m, const x_event *e); void x_run(x *m, uint32_t now);\n"
    )
    (tmp_path / "sound.c").write_text(f"{text}FSM_MAILBOX(x, 2, 128)\n", encoding="utf-8")
    (tmp_path / "wrong.c").write_text(f"{text}FSM_MAILBOX(x, {queue}, {slots})\n", encoding="utf-8")
    build(tmp_path, "gcc", "-c", "-DFSM_INDEX=uint8_t", "sound.c")
    with pytest.raises(AssertionError, match="mailbox"):
        build(tmp_path, "gcc", "-c", "-DFSM_INDEX=uint8_t", "wrong.c")


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang", "g++", "clang++", "arm-none-eabi-gcc"])
def test_header_alone(compiler: str, tmp_path: Path, build: Build) -> None:
    name = "alone.cc" if compiler.endswith("++") else "alone.c"
    (tmp_path / name).write_text('#include "fsm_mailbox.h"\nint n;\n', encoding="utf-8")
    build(tmp_path, compiler, "-ffreestanding", "-c", name)
