"""Scripts on boards: the harness of the differential test, built for another processor.

On Arm Linux it runs as it is. On the Cortex-M3 three calls change: `start` starts SysTick, `run`
waits for SysTick and is given its time, `post` has an interrupt put the event into a mailbox. On
the AVR, which has memory for one chart at a time, the calls are as on Linux.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path

from devtools.differential import random_case
from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.scripts import random_script
from devtools.reduction import Script
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import Machine, generate_machine
from fsmkit.codegen.c.limits import report_limits
from fsmkit.diagnostics import Findings
from fsmkit.testing.harness import c as harness
from fsmkit.testing.harness.harness import INTERPRETER
from tests.boards.conftest import HOSTS, ROOT, RUNTIME

CELL = ROOT / "machines/production_cell"
CORTEX_M3 = ("-mcpu=cortex-m3", "-mthumb")
BOARD = (HOSTS / "cortex_m/fsm_cortex_m.c", HOSTS / "cortex_m/mps2_an385.c")
LINKED = ("-nostartfiles", "-T", str(HOSTS / "cortex_m/mps2_an385.ld"))
EMULATED = (
    *("qemu-system-arm", "-M", "mps2-an385", "-display", "none", "-monitor", "none"),
    *("-serial", "stdio", "-semihosting-config", "enable=on,target=native"),
    *("-icount", "shift=0,sleep=off"),  # time is that of the program, and nobody waits for it
)
"""The board; each instruction takes a nanosecond, sleep none."""
NEWLIB = ("-D__int64_t_defined=1", "-D__int_least64_t_defined=1")
"""Its <inttypes.h> needs these to define PRId64, but the <stdint.h> of gcc defines neither."""
AVR = "atmega1284p"
"""Its 16 KB of memory hold the harness beside the machine; int has 16 bits."""
ON_AVR = (
    *("-DHARNESS_LONGEST=256", "-DHARNESS_MADE=16", "-DHARNESS_PATH=64", "-Dexit=stop"),
    *(f"-mmcu={AVR}", f'-DMCU="{AVR}"', "-DF_CPU=16000000"),
    *("-std=gnu99", "-w", "-Os", "-idirafter", "/usr/include"),  # where simavr's headers are
    *("-Wl,--undefined=_mmcu", "-Wl,--section-start=.mmcu=0x910000"),  # names the processor
)
BOARD_DRIVER = """\
FSM_MAILBOX({p}, {upper}_QUEUE, 2)
static {p}_mailbox {p}_box;
static {p}_event {p}_came;
typedef char {p}_size_is_as_stated[sizeof({p}) == {upper}_STRUCT_BYTES ? 1 : -1];
static void {p}_handler(void)
{{
    if (!{p}_mailbox_put(&{p}_box, &{p}_came))
        wrong("full mailbox");
}}
static bool {p}_post_by_interrupt(void *m, const void *e)
{{
    {p}_came = *(const {p}_event *)e;
    board_interrupt({p}_handler);
    if ({p}_mailbox_drain(&{p}_box, ({p} *)m) == 1u)
        return true;
    fsm_ring_release(&{p}_box.ring);
    return false;
}}
static void {p}_start_timer(void *m, uint32_t now)
{{
    {p}_driver.start(m, board_start(now));
}}
static void {p}_wait_and_run(void *m, uint32_t now)
{{
    {p}_driver.run(m, board_wait(now));
}}
static fsm_restored {p}_restore_timer(void *m, uint32_t now, const uint8_t *bytes, size_t size)
{{
    return {p}_driver.restore(m, board_start(now), bytes, size);
}}
"""
ON_BOARD = """\
    fsm_driver driver = {p}_driver;
    driver.start = {p}_start_timer;
    driver.run = {p}_wait_and_run;
    driver.post = {p}_post_by_interrupt;
    driver.restore = {p}_restore_timer;
"""


@dataclass(frozen=True, slots=True)
class Job:
    """A chart and the script of its host."""

    chart: Chart
    script: Script


def cell_jobs(length: int) -> list[Job]:
    """Return the charts of the production cell, each with a random script."""
    charts = [load(CELL / f"{name}.yaml") for name in ("feeder", "molder", "plant")]
    return [Job(c, random_script(SeededChoices(f"board:{c.name}"), c, length)) for c in charts]


def random_jobs(count: int, seed: int = 11) -> list[Job]:
    """Return random charts that C can express, with their scripts."""
    found: list[Job] = []
    number = 0
    while len(found) < count:
        case = random_case(seed, number)
        number += 1
        findings = Findings()
        report_limits(case.chart, findings)
        if not findings.has_errors:
            found.append(Job(case.chart, case.script))
    return found


def expected(jobs: Sequence[Job]) -> list[list[str]]:
    """Return the traces of the interpreter."""
    return [list(INTERPRETER.run(job.chart, job.script)) for job in jobs]


def write_player(folder: Path, jobs: Sequence[Job], *, board: bool) -> str:
    """Write the C that plays the scripts; return the text that it reads."""
    machines = [generate_machine(job.chart, f"x{i}", harness.OPTIONS) for i, job in enumerate(jobs)]
    harness._write(folder, machines)
    scripts = [harness.script_for_c(job.chart, job.script) for job in jobs]
    text = "".join(f"{line}\n" for script in scripts for line in (*script, harness.END))
    if board:
        for machine in machines:
            _use_board(folder / f"run_{machine.names.prefix}.c", machine)
        _name_main_play(folder / "main.c")
        (folder / "script.c").write_text(_linked_in(text), encoding="ascii")
    return text


def _name_main_play(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count("int main(void)") == 1
    main = text.replace("int main(void)", "int play(void);\nint play(void)")
    path.write_text(main, encoding="utf-8")


def _use_board(path: Path, machine: Machine) -> None:
    p, upper = machine.names.prefix, machine.names.upper
    text = '#include "board_player.h"\n' + path.read_text(encoding="utf-8")
    for before, after in (
        (
            f"void play_{p}(void)\n",
            BOARD_DRIVER.format(p=p, upper=upper) + f"void play_{p}(void)\n",
        ),
        ("    play_script(", ON_BOARD.format(p=p) + "    play_script("),
        (f"&{p}_driver,", "&driver,"),
    ):
        assert text.count(before) == 1, before
        text = text.replace(before, after)
    path.write_text(text, encoding="utf-8")


def _linked_in(script: str, place: str = "") -> str:
    data = script.encode()
    rows = (", ".join(map(str, data[at : at + 24])) for at in range(0, len(data), 24))
    body = ",\n".join(rows)
    return (
        "#include <stddef.h>\nextern const char script[];\nextern const size_t script_length;\n"
        f"const char script[]{place} = {{\n{body}\n}};\n"
        "const size_t script_length = sizeof script;\n"
    )


def build_for_board(folder: Path, compiler: str, optimization: str) -> Path:
    """Compile and link the player for the Cortex-M3."""
    player = ROOT / "tests/boards"
    includes = (f"-I{folder}", f"-I{RUNTIME}", f"-I{HOSTS}", f"-I{player}")
    files = ("main.c", "script.c", str(player / "board_player.c"), *map(str, BOARD))
    command = [
        compiler,
        "-std=c99",
        "-w",
        optimization,
        *CORTEX_M3,
        *NEWLIB,
        *includes,
        *files,
        *LINKED,
    ]
    done = subprocess.run(
        [*command, "-o", "image.elf"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder / "image.elf"


def random_jobs_for_avr(count: int) -> list[Job]:
    """Return random charts without floats: the double of this compiler has 32 bits."""
    machines = (
        (job, generate_machine(job.chart, "x0", harness.OPTIONS)) for job in random_jobs(4 * count)
    )
    plain = (
        job
        for job, machine in machines
        if not any(
            re.search(r"\b(double|float)\b", text)
            for name, text in machine.files.items()
            if name.startswith("x0")
        )
    )
    return list(islice(plain, count))


def play_on_avr(folder: Path, job: Job, compiler: str, simulator: str) -> tuple[list[str], int]:
    """Return the trace of a script on simavr, and how many bytes of memory nothing used."""
    text = write_player(folder, [job], board=False)
    _name_main_play(folder / "main.c")
    script = "#include <avr/pgmspace.h>\n" + _linked_in(text, " PROGMEM")
    (folder / "script.c").write_text(script, encoding="ascii")
    player = ROOT / "tests/boards/avr_player.c"
    made = subprocess.run(
        [compiler, *ON_AVR, f"-I{folder}", "main.c", "script.c", str(player), "-o", "image.elf"],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    done = subprocess.run(
        [simulator, "image.elf"], cwd=folder, text=True, check=False, timeout=300,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    lines = re.findall(r"^(?:\x1b\[\d+m)*O:(.*?)(?:\x1b\[0m)?$", done.stdout, re.MULTILINE)
    ended = re.fullmatch(r"status 0, bytes of memory never used (\d+)", lines[-1])
    assert ended is not None, lines[-1]
    (trace,) = traces("".join(f"{line}\n" for line in lines[:-1]))
    return trace, int(ended[1])


def ticks(script: Sequence[str]) -> int:
    """Return for how many ticks a script waits."""
    lines = (line.split() for line in script)
    times = [
        (words[0], int(words[1])) for words in lines if words[0] in ("start", "restore", "run")
    ]
    waits = [
        (now - before) % 2**32 for (_, before), (verb, now) in pairwise(times) if verb == "run"
    ]
    return sum(waits)


def traces(printed: str) -> list[list[str]]:
    """Split the output of the harness into traces."""
    return [trace.splitlines() for trace in printed.split(f"{harness.END}\n")[:-1]]
