"""The C programs of bad hosts: machines, or joined machines, with `bad_host.c` around them."""

from __future__ import annotations

import subprocess
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.compiler import find_compiler
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.host import print_host
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.system.glue import compose
from fsmkit.codegen.system.parts import Part, named_charts, parts_of
from fsmkit.diagnostics import Findings, fail
from fsmkit.emit import Emitter, snake
from fsmkit.emit.c import quoted
from fsmkit.system.system import System
from fsmkit.testing.harness.c import OPTIONS

HERE = Path(__file__).parent
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
FORMS = {"default": OPTIONS, "size": replace(OPTIONS, is_small=True)}
SECONDS = 600
"""After so long a program is taken not to end."""
FAILED = "failed: "


def machine_program(charts: Sequence[Chart]) -> dict[str, str]:
    """Return the files of a program with each chart in each form."""
    files: dict[str, str] = {}
    prefixes = []
    for number, chart in enumerate(charts):
        for form, options in FORMS.items():
            machine = generate_machine(chart, f"{form[0]}{number}", options)
            names, out = machine.names, Emitter()
            out.line('#include "bad_host.h"')
            _sources(out, names)
            _calls(out, names)
            _subject(out, names, f"{names.prefix}_subject", f"{number} {form}")
            files |= machine.files | {f"of_{names.prefix}.c": out.finish()}
            prefixes.append(names.prefix)
    lines = [f"abuse(&{prefix}_subject, many, seed);" for prefix in prefixes]
    sources = ["bad_host.c", "fsm.c", "fsm_save.c", *(f"of_{prefix}.c" for prefix in prefixes)]
    return files | _main(sources, lines)


def system_program(system: System, *, is_small: bool = False) -> dict[str, str]:
    """Return the files of a program with the joined machines of a system.

    Raises:
        FsmkitError: the system cannot be joined in C.

    """
    findings = Findings()
    options = FORMS["size" if is_small else "default"]
    charts = named_charts(system)
    queued = {chart.name for chart in charts}
    files = compose(system, charts, queued, findings)
    findings.stop_on_errors()
    parts = parts_of(system, charts, queued)
    linked = {(link.source, link.port) for link in system.event_links}
    out = Emitter()
    s = snake(system.name)
    out.lines(['#include "bad_system.c"', f'#include "{s}.h"', f"static {s} the_system;"])
    for prefix in dict.fromkeys(part.prefix for part in parts):
        same = [part for part in parts if part.prefix == prefix]
        files |= generate_machine(same[0].chart, None, options).files
        _sources(out, same[0].names, {port for p in same for i, port in linked if i == p.index})
        _calls(out, same[0].names)
    for part in parts:
        _subject(out, part.names, f"of_{part.member}", part.member, f"the_system.{part.member}")
    out.line(f'#include "{s}.c"')
    _joined(out, s, parts)
    files["joined.c"] = out.finish()
    return files | _main(["joined.c", "fsm.c", "fsm_save.c"], ["abuse_joined(&all, many, seed);"])


def _sources(out: Emitter, names: Names, linked: Collection[int] = ()) -> None:
    """Print a machine with its host functions, after those in its slots.

    ``linked``: events and, after all events, operations that are connected.
    """
    for inside in names.invoked:
        _sources(out, inside)
    p = names.prefix
    out.lines([f'#include "{p}.h"', f"extern const fsm_machine_info {p}_info;"])
    out.lines([f"#define CALLED {p}", f'#include "{p}.c"'])
    print_host(out, names, linked)
    out.line("#undef CALLED")


def _calls(out: Emitter, names: Names) -> None:
    """Print the calls of a machine that `fsm_driver` does not have."""
    p, does = names.prefix, names.does
    out.line(f'#include "{p}_info.c"')
    steps = [f"{p}_step_timer(of)"]
    steps += [f"{p}_step_event(of)"] * does.queued + [f"{p}_step_eventless(of)"] * does.polls
    with out.function(f"static bool step_{p}(void *m, uint32_t which)"):
        out.line(f"{p} *of = ({p} *)m;")
        for number, step in enumerate(steps):
            out.line(f"if (which == {number}u) return {step};")
        out.line("return false;")
    with out.function(f"static void read_{p}(const void *m, uint32_t number)"):
        out.lines([f"const {p} *of = (const {p} *)m;", f"{p}_state active[3];"])
        out.line(f"(void){p}_active(of, active, (uint16_t)(number % 4u));")
        out.line(f"(void){p}_in(of, ({p}_state)number);")
        out.line(f"(void){p}_finished(of); (void){p}_fault(of);")
        out.line(f"(void){p}_state_name(({p}_state)number); (void){p}_event_text(number);")
        out.line(f"(void){p}_symbol(number);")


def _subject(out: Emitter, names: Names, name: str, label: str, machine: str = "") -> None:
    """Print the subject of a machine, which is there already or is defined here."""
    p, size = names.prefix, f"{names.upper}_SAVED_BYTES"
    if not machine:
        machine = f"{name}_machine"
        out.line(f"static {p} {machine};")
    out.line(f"static {p} {name}_other; static {p}_event {name}_event, {name}_inner;")
    out.line(f"static uint8_t {name}_saved[{size}], {name}_again[{size}];")
    places = [machine, *(f"{name}_{place}" for place in ("other", "event", "inner"))]
    listed = ", ".join(f"&{place}" for place in places)
    members = f"{quoted(label)}, &{p}_driver, {listed}, {name}_saved, {name}_again, {size}"
    out.line(f"#define {name.upper()} {{{members}, step_{p}, read_{p}}}")
    out.line(f"static const subject {name} = {name.upper()};")


def _joined(out: Emitter, s: str, parts: Sequence[Part]) -> None:
    """Print the parts of a system for `bad_system.c`."""
    with out.function("static void system_init(void *m)"):
        out.line(f"{s}_init(({s} *)m);")
    for name in ("start", "run"):
        with out.function(f"static bool system_{name}(void *m, uint32_t at)"):
            out.line(f"return {s}_{name}(({s} *)m, at);")
    with out.function("static bool system_next(const void *m, uint32_t *at)"):
        out.line(f"return {s}_next_deadline((const {s} *)m, at);")
    with out.function("static void system_rests(const void *m)"):
        out.lines([f"const {s} *of = (const {s} *)m;", "LAW(of->working == 0 && !of->starting);"])
        for part in parts:
            if part.is_fed:
                out.line(f"LAW(of->count_to_{part.member} == 0);")
    rows = ", ".join(f"OF_{part.member.upper()}" for part in parts)
    out.line(f"static const subject members[] = {{{rows}}};")
    out.line(
        "static const joined all = {&the_system, sizeof the_system, system_init, system_start, "
        f"system_run, system_next, system_rests, members, {len(parts)}u}};"
    )


def _main(sources: Sequence[str], calls: Sequence[str]) -> dict[str, str]:
    """Return the files that are the same for each program, and its one unit."""
    out = Emitter()
    out.lines(f'#include "{source}"' for source in sources)
    with out.function("int main(int count, char **words)"):
        out.line("const unsigned long many = strtoul(words[count - 3], NULL, 10);")
        out.line("const uint64_t seed = strtoull(words[count - 2], NULL, 10);")
        out.line('beyond = strcmp(words[count - 1], "1") == 0;')
        out.lines([*calls, "return 0;"])
    names = ("bad_host.c", "bad_host.h", "bad_system.c")
    files = {name: (HERE / name).read_text(encoding="utf-8") for name in names}
    return files | {"main.c": out.finish()}


def build(files: Mapping[str, str], folder: Path, flags: Sequence[str] = ()) -> None:
    """Build a program with sanitizers; `FsmkitError` where the compiler rejects it."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    command = [*find_compiler(), "-std=c99", "-O0", "-g", "-w", *SANITIZERS, *flags]
    done = subprocess.run(
        [*command, "main.c", "-o", "bad_host"], cwd=folder, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    if done.returncode != 0:
        raise fail("c-compiler-failed", f"the program does not compile: {done.stderr[:2000]}")


def run(folder: Path, calls: int, seed: int, *, beyond: bool = False) -> list[str]:
    """Return the output of the program; the last line gives the reason of an early end."""
    command = [str(folder / "bad_host"), str(calls), str(seed), str(int(beyond))]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return [f"{FAILED}no end in {SECONDS} s"]
    ended = [] if done.returncode == 0 else [FAILED + done.stderr[:3000]]
    return [*done.stdout.splitlines(), *ended]
