"""The C program of an endurance run: a machine, its tables, and endurance.c."""

from __future__ import annotations

from pathlib import Path

from fsmkit.chart.analysis.host_events import posted_events
from fsmkit.chart.chart import Chart, State
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Send
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.host import print_host
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.options import Options
from fsmkit.diagnostics import Findings, Span
from fsmkit.emit import Emitter, printing
from fsmkit.language import BoolType, DurationType, EnumType, FloatType, IntType, Type
from fsmkit.runtime.library import C_LIBRARY

HERE = Path(__file__).parent
PREFIX = "x"
"""Prefix of the machine in the program."""


def report_limits(chart: Chart, findings: Findings) -> None:
    """Report unsupported parts of a chart: invoked charts, delayed events, compound values."""

    def reject(what: str, span: Span | None) -> None:
        findings.add("c-limit", f"an endurance run keeps no account of {what}", span)

    for invocation in chart.invocations:
        reject("invoked charts", invocation.span)
    for statement in all_statements(chart):
        if isinstance(statement, Send) and statement.delay is not None:
            reject("delayed events", statement.span)
    for variable in chart.inputs:
        if not is_plain(variable.type):
            reject(f"inputs of the type `{variable.type}`", variable.span)
    for index in posted_events(chart):
        for part in chart.events[index].fields:
            if not is_plain(part.type):
                reject(f"fields of the type `{part.type}`", chart.events[index].span)
    if not posted_events(chart):
        reject("charts that take no events", chart.root.span)


def is_plain(type_: Type) -> bool:
    """Whether values of a type can be drawn."""
    return isinstance(type_, BoolType | DurationType | EnumType | FloatType | IntType)


@printing
def program(chart: Chart) -> dict[str, str]:
    """Return the files of the program, with ``main.c``, for a chart within `report_limits`."""
    machine = generate_machine(chart, PREFIX, Options(extras=frozenset({"info"})))
    files = dict(machine.files)
    for name in ("endurance.c", "hooks.h"):
        files[name] = (HERE / name).read_text(encoding="utf-8")
    for name in ("fsm_mailbox.h", "fsm_shared.h"):
        files[name] = (C_LIBRARY / "hosts" / name).read_text(encoding="utf-8")
    files["main.c"] = _main(machine.names)
    return files


def _main(names: Names) -> str:
    out = Emitter()
    out.line('#define FSM_HOOKS "hooks.h"')
    out.lines([f'#include "{PREFIX}.h"', f'#include "{PREFIX}_info.c"'])
    _tables(out, names.chart)
    out.lines(f'#include "{file}"' for file in ("endurance.c", f"{PREFIX}.c", "fsm.c"))
    print_host(out, names)
    return out.finish()


def _tables(out: Emitter, chart: Chart) -> None:
    """Print the sizes of the counters, and the states that handle an event."""
    out.line(f"enum {{ TRANSITIONS = {len(chart.transitions)}, STATES = {len(chart.states)},")
    out.line(f"       EVENTS = {len(posted_events(chart))} }};")
    with out.block(
        "static const unsigned *const answering[] = { /* states by kind of event, up to 0 */"
    ):
        for index in posted_events(chart):
            states = [s.index for s in chart.states[1:] if _answers(chart, s, index)]
            out.line(f"(const unsigned[]){{{', '.join(f'{s}u' for s in (*states, 0))}}},")
    out.line(";")


def _answers(chart: Chart, state: State, event: int) -> bool:
    return event in state.defer or any(
        event in chart.transitions[t].events for t in state.transitions
    )
