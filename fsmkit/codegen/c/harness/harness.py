"""Runs generated C by a script and returns its trace, for comparison with the interpreter."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from fsmkit.analysis.host_events import sent_events
from fsmkit.chart.chart import Chart, Event
from fsmkit.codegen.c.compiler import QUICKEST, compile_c
from fsmkit.codegen.c.expressions.types import storage
from fsmkit.codegen.c.generate import LIBRARY, Machine, generate_machine
from fsmkit.codegen.c.harness.text import HOOKS, VERBS
from fsmkit.codegen.c.header import parameters
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.options import Options
from fsmkit.diagnostics import fail
from fsmkit.emit import Emitter
from fsmkit.language import (
    ArrayType,
    BoolType,
    DurationType,
    EnumType,
    FloatType,
    IntType,
    RecordType,
    SymbolType,
    Type,
)
from fsmkit.texts.c import quoted

OPTIONS = Options(extras=frozenset({"save"}))
FLAGS = ("-std=c99", "-O0", "-w")
FOLDER = Path(__file__).parent
SECONDS = 60
"""Scripts that take longer do not end."""
END = "%"
"""The line after a script, and after its trace."""


def run_many(
    pairs: Sequence[tuple[Chart, Sequence[str]]], options: Options = OPTIONS
) -> list[list[str]]:
    """Build all charts in one run of the compiler and return the trace of each one's script."""
    if not pairs:
        return []
    with tempfile.TemporaryDirectory(prefix="fsmkit-") as name:
        folder = Path(name)
        machines = [generate_machine(chart, f"x{i}", options) for i, (chart, _) in enumerate(pairs)]
        _write(folder, machines)
        compile_c([*FLAGS, "main.c", "-o", "harness"], folder, QUICKEST)
        return _run(folder, [lines for _, lines in pairs])


def _write(folder: Path, machines: list[Machine]) -> None:
    for name in ("harness.c", "harness.h"):
        (folder / name).write_text((FOLDER / name).read_text(encoding="utf-8"), encoding="utf-8")
    for name in ("fsm.c", "fsm.h", "fsm_bytes.h"):
        (folder / name).write_text((LIBRARY / name).read_text(encoding="utf-8"), encoding="utf-8")
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
    out.lines(['#include "harness.c"', '#include "fsm.c"'])
    out.lines(f'#include "run_{prefix}.c"' for prefix in prefixes)
    out.line("int main(void)")
    with out.block("{"):
        for prefix in prefixes:
            out.lines([f"{prefix}_play();", "end_script();"])
        out.line("return 0;")
    return out.finish()


def _run(folder: Path, scripts: Sequence[Sequence[str]]) -> list[list[str]]:
    try:
        done = subprocess.run(
            [str(folder / "harness")],
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
    """Return the C that plays a script on one machine: hooks, operations, verbs."""
    out = Emitter()
    out.line('#include "harness.h"')
    out.line('#define FSM_HOOKS "harness.h"')
    _machine(out, names)
    _reading(out, names)
    _play(out, names)
    return out.finish()


def _machine(out: Emitter, names: Names) -> None:
    """Print a machine, after those in its slots, with its hooks and operations."""
    for inside in names.invoked:
        _machine(out, inside)
    p = names.prefix
    path = "".join(f"{slot}: " for slot in names.path)
    out.line(f'#include "{p}.h"')
    out.line(f"static void {p}_show_event(const {p}_event *e);")
    now = "m->now" if names.does["now"] else f"{p}_now"
    hooks = HOOKS.replace("@", p).replace("$PATH", quoted(path)).replace("$NOW", now)
    room = min(len(names.chart.states), 0xFFFF)  # the root, which is the one more, is no leaf
    hooks = hooks.replace("$STATES", str(room))
    out.lines(hooks.strip("\n").split("\n"))
    out.line(f'#include "{p}.c"')
    out.line()
    out.line(f"static const char *{p}_symbol_text(long symbol)")
    with out.block("{"):
        out.line(
            f"return made_symbol(symbol) ? made_symbol(symbol) : {p}_symbol((uint32_t)symbol);"
        )
    out.line(f"static void {p}_show_event(const {p}_event *e)")
    with out.block("{"), out.block("switch (e->event) {"):
        for event in names.chart.events:
            _event_case(out, names, event)
        out.lines(["default:", "    break;"])
    out.line()
    _operations(out, names)
    _dump(out, names)


def _dump(out: Emitter, names: Names) -> None:
    """Print the function that shows the data of a machine, and of those that run in it."""
    p = names.prefix
    out.line(f"static void {p}_dump(const {p} *m)")
    with out.block("{"):
        for variable in (*names.chart.data, *names.chart.outputs):
            out.line(f"{p}_begun();")
            out.line(f'printf("d %s", {quoted(variable.name)});')
            show(out, variable.type, f"m->{names.variables[variable.name]}", names)
            out.line('printf("\\n");')
        for inside, slot in zip(names.invoked, names.slots, strict=True):
            out.line(f"if (m->{slot}.running)")
            out.line(f"    {inside.prefix}_dump(&m->{slot});")


def _event_case(out: Emitter, names: Names, event: Event) -> None:
    out.line(f"case {names.events[event.index]}:")
    with out.indented():
        out.line(f'printf("%s", {quoted(event.name)});')
        for part in event.fields:
            show(
                out,
                part.type,
                f"e->of.{names.payloads[event.index]}.{names.field(part.name)}",
                names,
            )
        out.line("break;")


def show(out: Emitter, type_: Type, text: str, names: Names) -> None:
    """Print how to print a value."""
    match type_:
        case FloatType():
            out.line(f"show_float((double){text});")
        case SymbolType():
            out.line(f"show_text({names.prefix}_symbol_text({text}));")
        case ArrayType(element, length):
            out.line("show_bracket(1);")
            for place in range(length):
                show(out, element, f"{text}[{place}]", names)
            out.line("show_bracket(0);")
        case RecordType(_, fields):
            out.line("show_bracket(1);")
            for part in fields:
                show(out, part.type, f"{text}.{names.field(part.name)}", names)
            out.line("show_bracket(0);")
        case _:
            out.line(f"show_integer({text} < 0, (uint64_t){text});")


def _operations(out: Emitter, names: Names) -> None:
    p = names.prefix
    for operation in names.chart.operations:
        name = names.operations[operation.name]
        result = operation.result
        ctype = "void" if result is None else storage(result, names.records).text
        out.line(f"{ctype} {p}_{name}({p} *m{parameters(operation.parameters, names)})")
        with out.block("{"):
            out.line(f"(void)m; {p}_begun();")
            out.line(f'printf("op %s", {quoted(operation.name)});')
            for part in operation.parameters:
                show(out, part.type, names.field(part.name), names)
            if result is not None:
                out.line(f"{ctype} result;")
                made(out, result, "result", names)
                out.line('printf(" =");')
                show(out, result, "result", names)
            out.line('printf("\\n");')
            if result is not None:
                out.line("return result;")
    for event in (names.chart.events[index] for index in sent_events(names.chart)):
        name = names.event_names[event.index]
        out.line(f"void {p}_send_{name}({p} *m{parameters(event.fields, names)})")
        with out.block("{"):
            out.line("(void)m;")
            out.lines(f"(void){names.field(part.name)};" for part in event.fields)


def made(out: Emitter, type_: Type, place: str, names: Names) -> None:
    """Print how a place gets the next pseudo-random value, as `SeededHost` makes it."""
    match type_:
        case RecordType(_, fields):
            for part in fields:
                made(out, part.type, f"{place}.{names.field(part.name)}", names)
        case ArrayType(element, length):
            for index in range(length):
                made(out, element, f"{place}[{index}]", names)
        case BoolType():
            out.line(f"{place} = (next_random() >> 16 & 1) != 0;")
        case IntType(lo, hi):
            size = min(hi - lo + 1, 2**22)
            low = f"({lo + 1} - 1)" if lo == -(2**63) else str(lo)
            ctype = storage(type_, names.records).text
            drawn = f"(int64_t)((next_random() >> 8) % {size})"
            out.line(f"{place} = ({ctype})({low}LL + {drawn});")
        case EnumType(_, members):
            out.line(f"{place} = (next_random() >> 8) % {len(members)};")
        case DurationType():
            out.line(f"{place} = (next_random() >> 8) % 1001;")
        case FloatType():
            out.line(f"{place} = ((double)((next_random() >> 8) % 2001) - 1000.0) / 8.0;")
        case SymbolType():
            out.line(f"(void)next_random(); {place} = 0;")


def _read(out: Emitter, type_: Type, place: str, names: Names) -> None:
    match type_:
        case RecordType(_, fields):
            for part in fields:
                _read(out, part.type, f"{place}.{names.field(part.name)}", names)
        case ArrayType(element, length):
            for index in range(length):
                _read(out, element, f"{place}[{index}]", names)
        case FloatType():
            out.line(f"{place} = read_float();")
        case SymbolType():
            out.line(f"{place} = {names.prefix}_symbol_number(read_text());")
        case EnumType(_, members):
            texts = ", ".join(quoted(member) for member in members)
            out.line(f"{{ static const char *const members[] = {{{texts}}};")
            out.line(f"{place} = read_member(members, {len(members)}); }}")
        case BoolType():
            out.line(f"{place} = read_bool();")
        case _:
            out.line(f"{place} = ({storage(type_, names.records).text})read_integer();")


def _reading(out: Emitter, names: Names) -> None:
    p = names.prefix
    chart = names.chart
    out.line(f"static uint16_t {p}_symbol_number(const char *text)")
    with out.block("{"):
        out.line(f"return find_symbol({p}_symbol, {len(names.symbols)}, text);")
    out.line(f"static {p}_event {p}_read_event(void)")
    with out.block("{"):
        out.line(f"{p}_event e = {p}_no_event;")
        out.line("const char *name = read_text();")
        for event in (chart.events[index] for index in chart.event_index.values()):
            with out.block(f"if (strcmp(name, {quoted(event.name)}) == 0) {{"):
                out.line(f"e.event = {names.events[event.index]};")
                for part in event.fields:
                    place = f"e.of.{names.payloads[event.index]}.{names.field(part.name)}"
                    _read(out, part.type, place, names)
                out.line("return e;")
        out.line("wrong(name);")
        out.line("return e;")


def _reply(out: Emitter, names: Names) -> None:
    """Print the function that shows what an event was answered with, if it declares that."""
    p = names.prefix
    out.line(f"static void {p}_show_reply(const {p} *m, const {p}_event *e)")
    with out.block("{"), out.block("switch (e->event) {"):
        for event in names.chart.events:
            if event.reply is not None:
                out.line(f"case {names.events[event.index]}:")
                with out.indented():
                    show(out, event.reply, "m->reply" if names.does["replies"] else "0", names)
                    out.line("break;")
        out.lines(["default:", "    break;"])


def _play(out: Emitter, names: Names) -> None:
    p = names.prefix
    chart = names.chart
    out.line(f'#include "{p}_save.c"')
    out.line(f"static {p} {p}_machine;")
    out.line(f"static uint8_t {p}_saved[{names.upper}_SAVED_BYTES];")
    _reply(out, names)
    out.line(f"void {p}_play(void)")
    with out.block("{"):
        out.line(f"{p}_init(&{p}_machine);")
        with out.block("while (next_line()) {"):
            out.line("const char *verb = read_text();")
            out.text(VERBS.replace("@", p))
            out.line('else if (strcmp(verb, "seed") == 0) seed_random((uint32_t)read_integer());')
            out.line('else if (strcmp(verb, "input") == 0) {')
            with out.indented():
                out.line("const char *name = read_text();")
                for variable in chart.inputs:
                    with out.block(f"if (strcmp(name, {quoted(variable.name)}) == 0) {{"):
                        _read(
                            out,
                            variable.type,
                            f"{p}_machine.{names.variables[variable.name]}",
                            names,
                        )
                out.line("(void)name;")
            out.line("}")
            out.line(f'else if (strcmp(verb, "dump") == 0) {p}_dump(&{p}_machine);')
            out.line("else wrong(verb);")
