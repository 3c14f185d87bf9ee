"""The C program of an endurance run: a machine, its tables, and endurance.c."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from fsmkit.analysis.host_events import posted_events, sent_events
from fsmkit.chart.chart import Chart, State
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Send
from fsmkit.codegen.c.expressions.types import storage
from fsmkit.codegen.c.generate import LIBRARY, generate_machine
from fsmkit.codegen.c.harness.harness import made
from fsmkit.codegen.c.header import parameters
from fsmkit.codegen.c.names import Names
from fsmkit.diagnostics import Findings, Span
from fsmkit.document.document import Trigger
from fsmkit.emit import Emitter
from fsmkit.language import BoolType, DurationType, EnumType, Field, FloatType, IntType, Type
from fsmkit.texts import printing
from fsmkit.texts.c import quoted

HERE = Path(__file__).parent
PREFIX = "x"
"""Of the machine in the program, whatever the chart's name is."""
SAMPLED = 2**22
"""Values of a wider range are drawn from this many of its least, and the greatest."""
LONGEST_TEXT = 4096
"""Bytes of an event or an input as a script spells it."""


def report_limits(chart: Chart, findings: Findings) -> None:
    """Say what of a chart has no account yet: invoked charts, delayed events, compound values."""

    def refuse(what: str, span: Span | None) -> None:
        findings.add("c-limit", f"an endurance run keeps no account of {what}", span)

    for invocation in chart.invocations:
        refuse("invoked charts", invocation.span)
    for statement in all_statements(chart):
        if isinstance(statement, Send) and statement.delay is not None:
            refuse("delayed events", statement.span)
    for variable in chart.inputs:
        if not is_plain(variable.type):
            refuse(f"inputs of the type `{variable.type}`", variable.span)
    for index in posted_events(chart):
        for part in chart.events[index].fields:
            if not is_plain(part.type):
                refuse(f"fields of the type `{part.type}`", chart.events[index].span)
    if not posted_events(chart):
        refuse("charts that take no events", chart.root.span)


def is_plain(type_: Type) -> bool:
    """Whether values of a type can be drawn."""
    return isinstance(type_, BoolType | DurationType | EnumType | FloatType | IntType)


@printing
def program(chart: Chart) -> dict[str, str]:
    """Return the files of the program, ``main.c`` among them; mind `report_limits`."""
    machine = generate_machine(chart, PREFIX)
    files = dict(machine.files)
    for name in ("endurance.c", "hooks.h"):
        files[name] = (HERE / name).read_text(encoding="utf-8")
    for name in ("fsm_mailbox.h", "fsm_shared.h"):
        files[name] = (LIBRARY / "hosts" / name).read_text(encoding="utf-8")
    files["main.c"] = _main(machine.names, files[f"{PREFIX}.h"])
    return files


def _main(names: Names, header: str) -> str:
    out = Emitter()
    out.line('#define FSM_HOOKS "hooks.h"')
    out.line(f'#include "{PREFIX}.h"')
    _accessors(out, names, header)
    _tables(out, names.chart)
    out.line("static void fill_event(unsigned kind, x_event *e);")
    out.line("static void show_event(const x_event *e, char *text);")
    out.line("static void draw_input(x *m, unsigned input, char *text);")
    out.line('#include "endurance.c"')
    out.line(f'#include "{PREFIX}.c"')
    out.line('#include "fsm.c"')
    _draw(out)
    _fill_event(out, names)
    _show_event(out, names)
    _draw_input(out, names)
    _host(out, names)
    return out.finish()


def _accessors(out: Emitter, names: Names, header: str) -> None:
    """Print how members are read that a machine has only where it needs them."""
    struct = header[header.index(f"typedef struct {PREFIX} {{") :]
    for macro, member, otherwise in (
        ("MACHINE_NOW", "now", "now"),
        ("DEFERRED_COUNT", "deferred_count", "(uint64_t)0"),
        ("TIMER_COUNT", "timer_count", "0u"),
        ("INTERNAL_COUNT", "internal_count", "0u"),
    ):
        has = re.search(rf"\b{member};", struct[: struct.index(f"}} {PREFIX};")])
        out.line(f"#define {macro}(m) {f'((m)->{member})' if has else otherwise}")
    out.line(f"#define RUNNING(m) ({names.running.replace('m->', '(m)->')})")


def _tables(out: Emitter, chart: Chart) -> None:
    timed = (Trigger.AFTER, Trigger.EVERY)
    out.line(f"enum {{ TRANSITIONS = {len(chart.transitions)}, STATES = {len(chart.states)},")
    out.line(f"       INPUTS = {len(chart.inputs)}, EVENTS = {len(posted_events(chart))},")
    out.line(f"       TEXT = {LONGEST_TEXT} }};")
    out.line("typedef struct { uint32_t delay; unsigned transition; } timed; /* in ticks */")
    with out.block("static const timed *const timed_of[] = { /* by state, up to a delay of 0 */"):
        for state in chart.states:
            found = [chart.transitions[t] for t in state.transitions]
            own = [f"{{{t.delay}u, {t.index}u}}" for t in found if t.trigger in timed]
            out.line(f"(const timed[]){{{', '.join([*own, '{0u, 0u}'])}}},")
    out.line(";")
    with out.block(
        "static const unsigned *const answering[] = { /* states by kind of event, up to 0 */"
    ):
        for index in posted_events(chart):
            states = [s.index for s in chart.states[1:] if _answers(chart, s, index)]
            out.line(f"(const unsigned[]){{{', '.join(f'{s}u' for s in (*states, 0))}}},")
    out.line(";")
    periods = [t.delay if t.trigger is Trigger.EVERY else 0 for t in chart.transitions]
    out.line(f"static const uint32_t every[] = {{{', '.join(f'{p}u' for p in (*periods, 0))}}};")


def _answers(chart: Chart, state: State, event: int) -> bool:
    return event in state.defer or any(
        event in chart.transitions[t].events for t in state.transitions
    )


def _draw(out: Emitter) -> None:
    """Print how whole numbers are drawn: often a bound, else any of the least."""
    out.line("static inline int64_t draw_integer(int64_t low, int64_t high, uint32_t many)")
    with out.block("{"):
        out.lines(["if (one_in(8))", "    return one_in(2) ? low : high;"])
        out.line("return low + (int64_t)random_below(many);")


def _drawn(type_: Type, names: Names) -> str:
    """Return the C expression of a random value."""
    match type_:
        case BoolType():
            return "one_in(2)"
        case EnumType(_, members):
            return f"(uint8_t)random_below({len(members)}u)"
        case FloatType():
            return "((double)random_below(2001u) - 1000.0) / 8.0"
        case DurationType():
            return "random_below(1001u)"
        case IntType(lo, hi):
            low = f"(-INT64_C({-lo - 1}) - 1)" if lo < 0 else f"(int64_t)UINT64_C({lo})"
            many = min(hi - lo + 1, SAMPLED)
            ctype = storage(type_, names.records).text
            return f"({ctype})draw_integer({low}, (int64_t)UINT64_C({hi % 2**64}), {many}u)"
        case _:
            raise TypeError(type_)  # see `report_limits`


def _fields(names: Names, index: int) -> Iterator[tuple[Field, str]]:
    for part in names.chart.events[index].fields:
        yield part, f"e->of.{names.payloads[index]}.{names.field(part.name)}"


def _fill_event(out: Emitter, names: Names) -> None:
    out.line("static void fill_event(unsigned kind, x_event *e)")
    with out.block("{"):
        out.line("static const x_event none = X_NO_EVENT;")
        out.line("*e = none;")
        with out.block("switch (kind) {"):
            for kind, index in enumerate(posted_events(names.chart)):
                out.line(f"case {kind}:")
                with out.indented():
                    out.line(f"e->event = {names.events[index]};")
                    for part, place in _fields(names, index):
                        out.line(f"{place} = {_drawn(part.type, names)};")
                    out.line("break;")
            out.line("default: break;")


def _printed(type_: Type, value: str, at: str) -> str:
    if isinstance(type_, FloatType):
        return f'{at} += sprintf({at}, " %.17g", (double){value});'
    if isinstance(type_, IntType) and type_.hi > 2**63 - 1:
        return f'{at} += sprintf({at}, " %" PRIu64, (uint64_t){value});'
    return f'{at} += sprintf({at}, " %" PRId64, (int64_t){value});'


def _show_event(out: Emitter, names: Names) -> None:
    out.line("static void show_event(const x_event *e, char *text)")
    with out.block("{"), out.block("switch (e->event) {"):
        for index in posted_events(names.chart):
            out.line(f"case {names.events[index]}:")
            with out.indented():
                name = quoted(names.chart.events[index].name)
                out.line(f'text += sprintf(text, "%s", {name});')
                for part, place in _fields(names, index):
                    out.line(_printed(part.type, place, "text"))
                out.line("break;")
        out.line("default: break;")


def _draw_input(out: Emitter, names: Names) -> None:
    out.line("static void draw_input(x *m, unsigned input, char *text)")
    with out.block("{"):
        out.line("(void)m; (void)text;")
        with out.block("switch (input) {"):
            for place, variable in enumerate(names.chart.inputs):
                member = f"m->{names.variables[variable.name]}"
                out.line(f"case {place}:")
                with out.indented():
                    out.line(f"{member} = {_drawn(variable.type, names)};")
                    out.line(f'text += sprintf(text, "%s", {quoted(variable.name)});')
                    out.lines([_printed(variable.type, member, "text"), "break;"])
            out.line("default: break;")


def _host(out: Emitter, names: Names) -> None:
    """Print the operations, which return anything and call back, and where events leave."""
    for place, operation in enumerate(names.chart.operations):
        name = names.operations[operation.name]
        result = operation.result
        ctype = "void" if result is None else storage(result, names.records).text
        out.line(f"{ctype} {PREFIX}_{name}(x *m{parameters(operation.parameters, names)})")
        with out.block("{"):
            out.lines(f"(void){names.field(part.name)};" for part in operation.parameters)
            out.line(f"call_back(m, {place}u);")
            if result is not None:
                out.line(f"{ctype} result;")
                made(out, result, "result", names)
                out.line("return result;")
    for event in (names.chart.events[index] for index in sent_events(names.chart)):
        name = names.event_names[event.index]
        out.line(f"void {PREFIX}_send_{name}(x *m{parameters(event.fields, names)})")
        with out.block("{"):
            out.line("(void)m;")
            out.lines(f"(void){names.field(part.name)};" for part in event.fields)
