"""Machines in C that are recorded, played by scripts: the bytes of each trace."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.generate import Machine, generate_machine
from fsmkit.codegen.c.options import Options
from fsmkit.runtime.interpreter import Macrostep
from fsmkit.runtime.interpreter.trace import trace_lines
from fsmkit.runtime.script import Player, read_line, script_texts
from fsmkit.runtime.tracing.following import Followed, Follower, ReplayedStep
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.stream import Stream
from fsmkit.runtime.tracing.writing import Writer
from fsmkit.testing.harness import c as harness

RECORDED = Options(extras=frozenset({"save", "records"}))
RING = """
#define FSM_TRACE_LEVEL {level}
#define FSM_TRACE_SIZE {size}
#include <stdio.h>
{defined}
#include "fsm_records.c"
static FILE *trace_file;
static void keep_trace(void)
{{
    uint8_t bytes[256];
    size_t n;
    while ((n = fsm_records_take(bytes, sizeof bytes)) > 0u)
        fwrite(bytes, 1, n, trace_file);
}}
static void open_trace(const char *name)
{{
    keep_none();
    trace_file = fopen(name, "wb");
}}
static void close_trace(const char *name)
{{
    FILE *const file = fopen(name, "w");
    keep_trace();
    fclose(trace_file);
    fprintf(file, "%u", (unsigned)fsm_records.lost);
    fclose(file);
}}
"""
NONE = """
static void keep_none(void)
{
    const fsm_records_state none = {0};
    fsm_records = none;
    fsm_records_rtt.up.read = fsm_records_rtt.up.write;
}
"""

Job = tuple[Chart, Sequence[str]]


def include_instead(folder: Path, machine: Machine, part: str) -> Path:
    """Let the driver of a machine include its C with a part instead; return its file."""
    prefix = machine.names.prefix
    driver = folder / f"run_{prefix}.c"
    text = driver.read_text()
    for names, _ in machine.family[:-1]:
        text = text.replace(f'#include "{names.prefix}.c"\n', "")
    driver.write_text(text.replace(f'#include "{prefix}.c"\n', f'#include "{prefix}_{part}.c"\n'))
    return driver


def play_all(folder: Path, jobs: Sequence[Job]) -> None:
    """Compile the drivers of machines and play their scripts."""
    subprocess.run(["gcc", *harness.FLAGS, "main.c", "-o", "player"], cwd=folder, check=True)
    scripts = [harness.script_for_c(chart, script) for chart, script in jobs]
    text = "".join(f"{line}\n" for script in scripts for line in (*script, harness.END))
    subprocess.run(["./player"], cwd=folder, input=text, check=True, capture_output=True, text=True)


def recorded(
    folder: Path,
    jobs: Sequence[Job],
    *,
    level: int = 2,
    size: int = 1 << 20,
    options: Options = RECORDED,
    every: int = 0,
    defined: str = "",
) -> list[bytes]:
    """Play scripts and return the trace of each machine; ``every``: read after so many lines.

    Losses after the last record of a trace are counted in a file (`unreported`).
    """
    machines = [generate_machine(chart, f"x{i}", options) for i, (chart, _) in enumerate(jobs)]
    harness._write(folder, machines)
    ring = RING.format(level=level, size=size, defined=defined).replace(
        "static void open_trace", NONE + "static void open_trace"
    )
    main = (folder / "main.c").read_text()
    main = main.replace('#include "fsm_save.c"\n', '#include "fsm_save.c"\n' + ring)
    for machine in machines:
        prefix = machine.names.prefix
        include_instead(folder, machine, "records")
        play = f"play_{prefix}();"
        main = main.replace(
            play, f'open_trace("{prefix}.trace"); {play} close_trace("{prefix}.lost");'
        )
    (folder / "main.c").write_text(main)
    if every:
        text = (folder / "harness.c").read_text()
        read = "    return fgets(line, sizeof line, stdin)"
        assert text.count(read) == 1
        text = text.replace(read, f"    line_done();\n{read}")
        (folder / "harness.c").write_text("static void line_done(void);\n" + text)
        drain = (
            "static void line_done(void)\n{\n    static unsigned lines;\n"
            f"    if (trace_file != NULL && ++lines % {every}u == 0u)\n        keep_trace();\n}}\n"
        )
        main = main.replace("static void close_trace", drain + "static void close_trace")
        (folder / "main.c").write_text(main)
    play_all(folder, jobs)
    return [(folder / f"x{i}.trace").read_bytes() for i in range(len(jobs))]


def unreported(folder: Path, number: int = 0) -> int:
    """Return the losses that the target counted after its last record."""
    return int((folder / f"x{number}.lost").read_text())


def followed(chart: Chart, data: bytes) -> list[Followed]:
    """Follow a trace that is all there."""
    stream, follower = Stream([Numbering(chart)]), Follower()
    timed = [*stream.feed(data), *stream.end()]
    return [each for one in timed for each in follower.follow(one, stream.of.get(one.instance))]


def lines(chart: Chart, found: Sequence[Followed]) -> list[str]:
    """Return the lines of the known parts of a trace."""
    steps = [each.macrostep for each in found if isinstance(each, ReplayedStep) and each.is_known]
    return list(trace_lines(chart, steps))


def by_interpreter(chart: Chart, script: Sequence[str], level: int = 2) -> bytes:
    """Return the trace of the interpreter under a script."""
    player, writer, out = Player(chart), Writer(chart, level), bytearray()
    for line in script_texts(script):
        read, before = read_line(chart, line), player.snapshot
        done = [each for each in player.play(line) if isinstance(each, Macrostep)]
        match read.verb:
            case "start":
                out += writer.started(before, before.inputs, done[0])
            case "post":
                out += writer.posted(read.event)
            case "run":
                out += writer.ran(before, player.now, done)
            case "dispatch" | "ask" if before.running:
                out += writer.ran(before, player.now, done, read.event)
            case "restore":
                out += writer.restored(player.snapshot, player.now)
            case _:
                pass
    return bytes(out)
