"""Write paths as a C program that drives the machines of `fsmkit compile`, and compares."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.limits import require_limits
from fsmkit.codegen.c.naming import name_everything
from fsmkit.emit import Emitter, plain, printing
from fsmkit.emit.c import comment, quoted
from fsmkit.plan import lower
from fsmkit.verify.report.counterexample import TraceStep, explorer_step
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.testgen.c_machine import MachineTest
from fsmkit.verify.testgen.script import commands

HEAD = r"""
#include <inttypes.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* The output of the current machine in a step, and the results of its operations. */
static char done[ROOM];
static size_t length;
static const unsigned *answers;
static const char *path;

static void note(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    int written = vsnprintf(done + length, sizeof done - length, format, arguments);
    va_end(arguments);
    if (written > 0)
        length += (size_t)written;
    if (length >= sizeof done)
        length = sizeof done - 1u;
}

static void begin(const unsigned *chosen)
{
    length = 0u;
    done[0] = '\0';
    answers = chosen;
}

static int differs(int step, const char *what, const char *expected)
{
    if (strcmp(done, expected) == 0)
        return 0;
    printf("%s, step %d, %s: expected\n%sbut it was\n%s", path, step, what, expected, done);
    return 1;
}
"""


ANSWER = """
static unsigned answer(void)
{
    return answers == NULL ? 0u : *answers++;
}
"""


@dataclass(frozen=True, slots=True)
class Scenario:
    """A path with a name, which is that of a C function, and its description."""

    name: str
    text: str
    steps: tuple[TraceStep, ...]


@printing
def in_c(
    closed: ClosedSystem,
    scenarios: Sequence[Scenario],
    charts: Sequence[Chart],
    about: Sequence[str],
    file: str,
) -> str:
    """Return the text of the program; ``charts``: of the machines, named as they are compiled.

    Machines of the environment and of connections are not part of it. ``about``: the lines of its
    first comment, before the command for compiling it; ``file``: its own name.
    """
    tested = [
        n
        for n, machine in enumerate(closed.system.machines)
        if closed.is_open or not (machine.environment or machine.is_channel)
    ]
    out = Emitter()
    writers: dict[str, MachineTest] = {}
    sources: dict[str, None] = {}
    for number in tested:
        prefix, members = _header(charts[number], sources)
        if prefix not in writers:
            writers[prefix] = MachineTest(closed, number, charts[number], members)
    files = tuple(name for name in sources if name.endswith(".c"))
    out.lines(
        f"/* {comment(line)}" if n == 0 else f" * {comment(line)}" for n, line in enumerate(about)
    )
    out.line(f" *     cc -I generated {file} {' '.join(f'generated/{name}' for name in files)}")
    out.line(" * It returns 0 if all machines behave in every step as recorded here. */")
    out.lines(f'#include "{prefix}.h"' for prefix in writers)
    out.line(f"#define ROOM {_room(closed, scenarios)}u /* bytes of the output of a step */")
    out.text(HEAD)
    by_machine = {n: writers[_prefix(charts[n])] for n in tested}
    paths = Emitter()
    for scenario in scenarios:
        _scenario(paths, closed, scenario, by_machine)
    used = paths.finish()
    hosts = [writer.functions(used) for writer in writers.values()]
    if any("answer()" in host for host in hosts):
        out.text(ANSWER)
        out.line()
    for text in (*hosts, used):
        out.lines(text.splitlines())
        out.line()
    with out.block("int main(void)\n{"):
        out.line("int failed = 0;")
        out.lines(f"failed += {scenario.name}();" for scenario in scenarios)
        out.line("return failed == 0 ? 0 : 1;")
    return out.finish()


LEAST_ROOM = 4096
"""Bytes for what a machine does in a step, be it other than what is expected."""


def _room(closed: ClosedSystem, scenarios: Sequence[Scenario]) -> int:
    """Return the number of bytes for the expected output of any step, twice."""
    texts = (
        "\n".join(_expected(closed.charts[command.machine], command.trace_step))
        for scenario in scenarios
        for command in commands(closed, scenario.steps)
    )
    return max(LEAST_ROOM, *(2 * len(text.encode()) for text in texts), 0)


def _prefix(chart: Chart) -> str:
    return name_everything(lower(chart), None).prefix


def _header(chart: Chart, sources: dict[str, None]) -> tuple[str, frozenset[str]]:
    """Return the prefix of a machine and the members of its struct; add its files."""
    require_limits([chart])
    made = generate_machine(chart)
    sources.update(dict.fromkeys(made.files))
    return made.names.prefix, made.family[-1][1]


SEEN = ("op", "out", "d", "=")
"""Lines that a host can observe."""


def _scenario(
    out: Emitter, closed: ClosedSystem, scenario: Scenario, writers: Mapping[int, MachineTest]
) -> None:
    out.line(f"/* {comment(scenario.text)} */")
    with out.block(f"static int {scenario.name}(void)\n{{"):
        for number, writer in writers.items():
            out.line(f"static {writer.type} m{number}; /* {comment(_name(closed, number))} */")
        out.line(f'path = "{scenario.name}";')
        for number, writer in writers.items():
            out.line(f"{writer.type}_init(&m{number});")
        last: dict[int, int] = {}
        for command in commands(closed, scenario.steps):
            writer_ = writers.get(command.machine)
            if writer_ is None:
                continue
            before = last.get(command.machine)
            elapsed = None if before is None else command.now - before
            last[command.machine] = command.now
            label = _name(closed, command.machine) + ": " + command.trace_step.cause
            out.line(f"/* {command.number}. {comment(label)} */")
            writer_.step(out, command, f"m{command.machine}", elapsed)
            out.line(f"if (differs({command.number}, {quoted(label)},")
            with out.indented():
                lines = list(_expected(closed.charts[command.machine], command.trace_step))
                out.lines(quoted(f"{line}\n") for line in lines[:-1])
                out.line(f"{quoted(lines[-1] + chr(10))}) != 0)")
                out.line("return 1;")
        out.line("return 0;")
    out.line()


def _name(closed: ClosedSystem, number: int) -> str:
    return closed.system.machines[number].name


def _expected(chart: Chart, trace_step: TraceStep) -> Iterator[str]:
    """Yield the observable output of a step; active states by name."""
    for line in map(plain, explorer_step(chart, trace_step)):  # each line becomes a string of C
        what, *words = line.split(" ")
        if what == "=":
            names = [chart.states[int(w)].id if w.isdecimal() else w for w in words]
            yield " ".join(("=", *names))
        elif what in SEEN:
            yield line
