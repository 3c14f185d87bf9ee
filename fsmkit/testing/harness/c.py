"""Runs generated C by a script and returns its trace, for comparison with the interpreter."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from fsmkit.chart.chart import Chart, every_operation
from fsmkit.codegen.c.compiler import QUICKEST, compile_c
from fsmkit.codegen.c.generate import Machine, generate_machine
from fsmkit.codegen.c.host import print_host
from fsmkit.codegen.c.limits import require_limits
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.options import Options
from fsmkit.diagnostics import fail
from fsmkit.emit import Emitter, plain
from fsmkit.emit.c import quoted
from fsmkit.language import Value
from fsmkit.runtime.interpreter.trace import value_text
from fsmkit.runtime.script import read_line, script_texts

OPTIONS = Options(extras=frozenset({"save"}))
FLAGS = ("-std=c99", "-O0", "-w")
FOLDER = Path(__file__).parent
MOST_LEAVES = 0xFFFF
"""Maximum number of counted calls of a machine."""
SECONDS = 60
"""Scripts that take longer do not end."""
END = "%"
"""The line after a script, and after its trace."""


@dataclass(frozen=True, slots=True)
class Processor:
    """The commands that build for a processor and run its programs; empty for this computer."""

    compiler: tuple[str, ...] = ()
    emulator: tuple[str, ...] = ()


HERE = Processor()


def run_many(
    pairs: Sequence[tuple[Chart, Sequence[str]]],
    options: Options = OPTIONS,
    processor: Processor = HERE,
) -> list[list[str]]:
    """Build all charts in one run of the compiler and return the trace of each one's script.

    `FsmkitError` for those that cannot be expressed in C.
    """
    if not pairs:
        return []
    require_limits(chart for chart, _ in pairs)
    with tempfile.TemporaryDirectory(prefix="fsmkit-") as name:
        folder = Path(name)
        machines = [generate_machine(chart, f"x{i}", options) for i, (chart, _) in enumerate(pairs)]
        _write(folder, machines)
        arguments = [*FLAGS, "main.c", "-o", "harness"]
        compile_c(arguments, folder, QUICKEST, compiler=processor.compiler)
        scripts = [script_for_c(chart, lines) for chart, lines in pairs]
        return _run(folder, scripts, processor)


def script_for_c(chart: Chart, lines: Sequence[str]) -> Iterator[str]:
    """Yield a script as the harness reads it: results with their number, `from` lists at first."""
    for name, operation in every_operation(chart).items():
        if operation.tried:
            yield _results("from", name, operation.tried)
    for text in script_texts(lines):
        if text.value.startswith("returns "):
            read = read_line(chart, text)
            yield _results("returns", read.name, read.results)
        else:
            yield text.value


def _results(verb: str, name: str, values: Sequence[Value]) -> str:
    return " ".join((verb, str(len(values)), name, *map(value_text, values)))


def _write(folder: Path, machines: list[Machine]) -> None:
    for name in ("harness.c", "harness.h"):
        (folder / name).write_text((FOLDER / name).read_text(encoding="utf-8"), encoding="utf-8")
    for machine in machines:
        for name, text in machine.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        prefix = machine.names.prefix
        (folder / f"run_{prefix}.c").write_text(driver(machine.names), encoding="utf-8")
    (folder / "main.c").write_text(_main(machines), encoding="utf-8")


def _main(machines: list[Machine]) -> str:
    """Return one unit of everything: the compiler reads the system's headers once."""
    out = Emitter()
    prefixes = [machine.names.prefix for machine in machines]
    out.lines(f'#include "{file}"' for file in ("harness.c", "fsm.c", "fsm_save.c"))
    out.lines(f'#include "run_{prefix}.c"' for prefix in prefixes)
    out.line("int main(void)")
    with out.block("{"):
        out.lines(f"play_{prefix}();" for prefix in prefixes)
        out.line("return 0;")
    return out.finish()


def _run(
    folder: Path, scripts: Sequence[Iterable[str]], processor: Processor = HERE
) -> list[list[str]]:
    try:
        done = subprocess.run(
            [*processor.emulator, str(folder / "harness")],
            input="".join(f"{line}\n" for script in scripts for line in (*script, END)),
            capture_output=True,
            text=True,
            check=False,
            timeout=SECONDS,
        )
    except subprocess.TimeoutExpired as error:
        raise fail("harness-failed", f"the generated C did not end in {SECONDS} s") from error
    if done.returncode != 0:
        raise fail(
            "harness-failed",
            f"the generated C ended with code {done.returncode}: {done.stderr.strip()[:400]}",
        )
    return [trace.splitlines() for trace in done.stdout.split(f"{END}\n")[:-1]]


def driver(names: Names) -> str:
    """Return the C that plays a script on one machine, with those in its slots."""
    out = Emitter()
    p, upper = names.prefix, names.upper
    out.lines(['#include "harness.h"', '#define FSM_HOOKS "harness.h"'])
    _machine(out, names)
    out.line(f'#include "{p}_info.c"')
    out.text(f"""
    void play_{p}(void)
    {{
        static {p} machine;
        static {p}_event e, posted;
        static uint8_t saved[{upper}_SAVED_BYTES];
        play_script(&fsm_watched_{p}, &{p}_driver, &machine, &e, &posted, saved, sizeof saved);
    }}
    """)
    return out.finish()


def _machine(out: Emitter, names: Names) -> None:
    """Print a machine, after those in its slots, with its hooks and operations."""
    for inside in names.invoked:
        _machine(out, inside)
    p = names.prefix
    path = "".join(f"{plain(slot)}: " for slot in names.path)
    leaves = min(len(names.chart.states), MOST_LEAVES)
    out.line(f'#include "{p}.h"')
    out.line(f"enum {{ leaves_{p} = {leaves} }};")
    out.lines([f"WATCH({p}, {quoted(path)})", f"#define HOOKED {p}", f'#include "{p}.c"'])
    print_host(out, names)
    out.line("#undef HOOKED")
