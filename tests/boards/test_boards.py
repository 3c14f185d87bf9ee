"""Generated C on Arm, under emulation: the trace of every script is that of the interpreter."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.boards.conftest import HOSTS, RUNTIME, WARNINGS, Build, Run
from tests.boards.playing import (
    BOARD,
    CORTEX_M3,
    EMULATED,
    LINKED,
    Job,
    build_for_board,
    cell_jobs,
    expected,
    random_jobs,
    ticks,
    traces,
    write_player,
)

pytestmark = pytest.mark.external

RequireTool = Callable[[str], str]
LENGTH = 400
"""Lines of a script for a chart of the production cell, at most."""
RANDOM = 20


@pytest.fixture(scope="module", params=["the production cell", "random charts"])
def jobs(request: pytest.FixtureRequest) -> list[Job]:
    cell = request.param == "the production cell"
    found = cell_jobs(LENGTH) if cell else random_jobs(RANDOM)
    assert len(found) == (3 if cell else RANDOM)
    return found


def optimization(jobs: list[Job]) -> str:
    """Small, as on a board; but many charts compile in a third of the time without."""
    return "-Os" if len(jobs) < RANDOM else "-O0"


POSTED = ("post ", "reject ")
"""The start of trace lines for an event that an operation posts."""


@pytest.mark.slow
def test_cortex_m3(jobs: list[Job], tmp_path: Path, require_tool: RequireTool, run: Run) -> None:
    compiler = require_tool("arm-none-eabi-gcc")
    require_tool(EMULATED[0])
    write_player(tmp_path, jobs, board=True)
    image = build_for_board(tmp_path, compiler, optimization(jobs))
    printed = run(*EMULATED, "-kernel", image)
    assert traces(printed) == expected(jobs)
    told = re.search(r"ticks slept (\d+), events posted by interrupt (\d+)\n\Z", printed)
    assert told is not None
    waited = sum(ticks(job.script) for job in jobs)
    assert waited // 2 < int(told[1]) <= waited  # some passed while it printed
    posted = [line for job in jobs for line in job.script if line.startswith("post ")]
    within = [line for trace in traces(printed) for line in trace if line.startswith(POSTED)]
    assert int(told[2]) == len(posted) + len(within)


LOOP = """
#include "cortex_m/fsm_cortex_m.h"
#include "cortex_m/mps2_an385.h"

static int status = 5;          /* of .data: copied from the image */
static volatile uint32_t fired; /* of .bss: zero */
static unsigned steps;

void TIMER0_Handler(void);
void TIMER0_Handler(void)
{
    mps2_timer0_clear();
    fired++;
    fsm_cortex_m_wake();
}

static void step(void *context, uint32_t now)
{
    steps++;
    if (now == 5u)
        while (fsm_cortex_m_now() != 9u) { /* 6, 7 and 8 are missed */
        }
    if (now == 40u) {
        mps2_print_number(steps);
        mps2_print(" steps, missed ");
        mps2_print_number(fsm_cortex_m_missed());
        mps2_print(", fired ");
        mps2_print_number(fired);
        mps2_print("\\n");
        mps2_exit(*(int *)context);
    }
}

int main(void)
{
    fsm_cortex_m_start(MPS2_CLOCK_HZ / 1000, 4294967290u);
    mps2_timer0_start(MPS2_CLOCK_HZ / 1000 * 2);
    fsm_cortex_m_enable(MPS2_TIMER0);
    fsm_cortex_m_loop(step, &status);
    return 0;
}
"""


def test_loop_on_the_board(tmp_path: Path, build: Build, require_tool: RequireTool) -> None:
    """46 ticks across the wrap of the clock, a timer every other tick, three ticks missed."""
    emulator = require_tool(EMULATED[0])
    (tmp_path / "loop.c").write_text(LOOP, encoding="utf-8")
    image = build(tmp_path, "arm-none-eabi-gcc", "-O2", *BARE, "loop.c", *BOARD, *LINKED, "-lgcc")
    command = [emulator, *EMULATED[1:], "-icount", "shift=5", "-kernel", str(image)]  # 32 ns
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    told = re.fullmatch(r"(\d+) steps, missed (\d+), fired (\d+)\n", done.stdout)
    assert told is not None
    steps, missed, fired = map(int, told.groups())
    assert done.returncode == 5
    assert missed == 3
    assert fired in (22, 23)  # the last one comes with the last tick
    assert 46 - missed <= steps <= 46 - missed + fired


SHARED = """
#include "cortex_m/fsm_cortex_m.h"
#include "cortex_m/mps2_an385.h"
#ifdef GUARDED
#define FSM_ENTER_CRITICAL() const uint32_t mask_ = fsm_cortex_m_mask()
#define FSM_EXIT_CRITICAL() fsm_cortex_m_unmask(mask_)
#endif

#include <stdbool.h>
#include <stdint.h>

enum { TICKS = 200, PRIORITIES = 2 };
typedef struct { uint32_t number, from; } toy_event;
typedef struct {
    toy_event queue[4];
    uint32_t count, next[PRIORITIES], arrived[PRIORITIES], wrong;
} toy;

static bool toy_post(toy *m, const toy_event *e)
{
    if (m->count == 4u)
        return false;
    m->queue[m->count++] = *e;
    return true;
}

static void toy_run(toy *m, uint32_t now)
{
    (void)now;
    for (uint32_t i = 0; i < m->count; i++) {
        const toy_event *e = &m->queue[i];
        if (e->number < m->next[e->from])
            m->wrong++;
        m->next[e->from] = e->number + 1u;
        m->arrived[e->from]++;
    }
    m->count = 0;
}

#include "fsm_mailbox.h"
FSM_MAILBOX(toy, 4, 16)

static toy machine;
static toy_mailbox box;
static volatile uint32_t sent[PRIORITIES], rejected[PRIORITIES];

static void produce(uint32_t from, uint32_t times)
{
    while (times-- > 0u) {
        const toy_event e = {sent[from], from};
        sent[from] = sent[from] + 1u;
        if (!toy_mailbox_put(&box, &e))
            rejected[from] = rejected[from] + 1u;
    }
}

void TIMER0_Handler(void);
void TIMER0_Handler(void) /* often, and urgent */
{
    mps2_timer0_clear();
    produce(0u, 1u);
    fsm_cortex_m_wake();
}

void IRQ31_Handler(void);
void IRQ31_Handler(void) /* long, and interrupted by the other */
{
    produce(1u, 20u);
}

static void print(const char *text, uint32_t number)
{
    mps2_print(text);
    mps2_print_number(number);
}

static void step(void *context, uint32_t now)
{
    (void)context;
    fsm_cortex_m_pend(MPS2_SPARE_INTERRUPT);
    toy_mailbox_run(&box, &machine, now);
    if (now < TICKS)
        return;
    __asm__ volatile("cpsid i" ::: "memory");
    toy_mailbox_run(&box, &machine, now);
    for (uint32_t from = 0; from < PRIORITIES; from++) {
        print("sent ", sent[from]);
        print(" arrived ", machine.arrived[from]);
        print(" rejected ", rejected[from]);
        mps2_print("\\n");
    }
    print("lost ", toy_mailbox_lost(&box));
    print(" wrong ", machine.wrong);
    mps2_exit(0);
}

int main(void)
{
    *(volatile uint8_t *)0xE000E41Fu = 0x80u; /* NVIC_IPR7: interrupt 31 is less urgent than 8 */
    fsm_cortex_m_start(MPS2_CLOCK_HZ / 1000, 0u);
    mps2_timer0_start(997u);
    fsm_cortex_m_enable(MPS2_TIMER0);
    fsm_cortex_m_enable(MPS2_SPARE_INTERRUPT);
    fsm_cortex_m_loop(step, 0);
    return 0;
}
"""
TOLD = (
    r"sent (\d+) arrived (\d+) rejected (\d+)\nsent (\d+) arrived (\d+) rejected (\d+)\n"
    r"lost (\d+) wrong (\d+)"
)


def shared_mailbox(folder: Path, build: Build, run: Run, emulator: str, *macros: str) -> list[int]:
    """Return the sent, received and rejected messages of two interrupts that share a mailbox."""
    (folder / "shared.c").write_text(SHARED, encoding="utf-8")
    words = ["-O1", *BARE, *macros, "shared.c", *BOARD, *LINKED, "-lgcc"]
    image = build(folder, "arm-none-eabi-gcc", *words)
    told = re.fullmatch(TOLD, run(emulator, *EMULATED[1:], "-icount", "shift=5", "-kernel", image))
    assert told is not None
    return [int(number) for number in told.groups()]


def test_two_interrupts_share_a_mailbox(
    tmp_path: Path, build: Build, run: Run, require_tool: RequireTool
) -> None:
    """One interrupts the other in the midst of a put; every event arrives or is counted."""
    found = shared_mailbox(tmp_path, build, run, require_tool(EMULATED[0]), "-DGUARDED")
    sent, arrived, refused, long_sent, long_arrived, long_refused, lost, wrong = found
    assert (sent, long_sent, lost) == (
        arrived + refused,
        long_arrived + long_refused,
        refused + long_refused,
    )
    assert wrong == 0
    assert min(arrived, long_arrived) > 200
    assert lost > 0


def test_two_interrupts_lose_events_without_a_guard(
    tmp_path: Path, build: Build, run: Run, require_tool: RequireTool
) -> None:
    found = shared_mailbox(tmp_path, build, run, require_tool(EMULATED[0]))
    sent, arrived, refused, long_sent, long_arrived, long_refused, _, wrong = found
    assert wrong > 0 or (sent, long_sent) != (arrived + refused, long_arrived + long_refused)


def test_a_fault_on_the_board_ends_it(
    tmp_path: Path, build: Build, require_tool: RequireTool
) -> None:
    emulator = require_tool(EMULATED[0])
    text = "int main(void) { return *(volatile int *)0xF0000000u; }\n"
    (tmp_path / "fault.c").write_text(text, encoding="utf-8")
    image = build(tmp_path, "arm-none-eabi-gcc", *BARE, "fault.c", *BOARD, *LINKED)
    done = subprocess.run(
        [emulator, *EMULATED[1:], "-kernel", image], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (70, "unexpected interrupt or fault\n")


BARE = (*CORTEX_M3, "-ffreestanding", "-nostdlib")


def test_no_warning(tmp_path: Path, build: Build, require_tool: RequireTool) -> None:
    for source in BOARD:
        build(tmp_path, "arm-none-eabi-gcc", "-O2", *BARE, "-c", source)
        clang = [require_tool("clang"), "--target=arm-none-eabi", "-std=c99", *WARNINGS, *BARE]
        includes = [f"-I{HOSTS}", f"-I{RUNTIME}"]
        subprocess.run([*clang, *includes, "-c", source, "-o", tmp_path / "o"], check=True)
