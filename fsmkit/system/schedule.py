"""Cyclic schedules: machines run in a given order, once a period, as in the loop of a board.

``schedule: {cyclic: [feeder, molder], period: 10ms, jitter: 1ms}``

The explored system has one more machine that keeps turn and phase. A period starts every ``period``
ticks, its first turn at most ``jitter`` ticks later, and the turns of the machines follow each
other without delay. `verify.statespace.closed_system` decides which machine may move.
"""

from __future__ import annotations

from collections.abc import Mapping as Dictionary
from dataclasses import replace
from math import gcd

from fsmkit.chart.analysis.delays import delays_of
from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Edit, Findings, Fix, Source, Span, Text, fail
from fsmkit.diagnostics.fixes import remove_entry
from fsmkit.document.keys import SCHEDULE
from fsmkit.language import Scope, read_duration
from fsmkit.language.units import duration_text
from fsmkit.system.connections import find_machine
from fsmkit.system.indices import MOST_ELEMENTS, expand_indices
from fsmkit.system.machine import Machine
from fsmkit.system.system import Schedule, System
from fsmkit.yaml.nodes import Mapping, Node, Scalar, require_record, require_text, texts_of
from fsmkit.yaml.reader import read_document

EXAMPLE = "write `schedule: {cyclic: [feeder, molder], period: 10ms}`, or `interleaved`"


# --- reading --------------------------------------------------------------------------------------


def read_schedule(
    node: Node | None, machines: tuple[Machine, ...], findings: Findings
) -> Schedule | None:
    """Read the schedule of a system; None where it is interleaved, or after a finding.

    ``machines``: those of the file, with those of the environment marked.
    """
    if node is None or (isinstance(node, Scalar) and node.text.value == "interleaved"):
        return None
    if not isinstance(node, Mapping):
        findings.add(
            "unexpected-shape",
            "a schedule is `interleaved`, or an order with a period",
            node.span,
            help=EXAMPLE,
        )
        return None
    parts = require_record(node, SCHEDULE, "a schedule", findings) or {}
    for name in ("cyclic", "period"):
        if name not in parts:
            findings.add("missing-key", f"a schedule needs `{name}`", node.span, help=EXAMPLE)
    if "cyclic" not in parts or "period" not in parts:
        return None
    order = _order(parts["cyclic"], machines, findings)
    ticks = _ticks(parts, machines[0].chart.capacities.tick, findings)
    if ticks is None or order is None:
        return None
    return Schedule(order, *ticks, span=node.span)


def _order(node: Node, machines: tuple[Machine, ...], findings: Findings) -> tuple[int, ...] | None:
    """Read the order; each machine outside of the environment occurs once in it."""
    places: dict[int, Text] = {}
    for text in texts_of(node, "`cyclic`", "a machine of the order", findings):
        for one in expand_indices(text, machines):
            machine = find_machine(one, machines, findings)
            if machine is not None:
                _place(machine, one, machines, places, findings)
    if findings.has_errors:
        return None
    for number, omitted in enumerate(machines):
        if number not in places and not omitted.environment:
            findings.add(
                "unscheduled-machine",
                f"`{omitted.name}` is missing in the order",
                node.span,
                secondary=[] if omitted.span is None else [(omitted.span, "this machine")],
                help="name it in `cyclic`, or under `will` if it belongs to the environment",
                fixes=_fix_appending(node, omitted.name),
            )
    return tuple(places)


def _fix_appending(node: Node, name: str) -> tuple[Fix, ...]:
    """Return the fix that adds a machine at the end of the order, in flow style."""
    source, end = node.span.source, node.span.end - 1
    if source.text[end : end + 1] != "]":
        return ()
    return (Fix(f"Let `{name}` run last", (Edit(Span(source, end, end), f", {name}"),)),)


def _place(
    machine: int,
    text: Text,
    machines: tuple[Machine, ...],
    places: dict[int, Text],
    findings: Findings,
) -> None:
    name = machines[machine].name
    if machine in places:
        findings.add(
            "duplicate-name",
            f"`{name}` is in the order already",
            text,
            secondary=[(places[machine], "first here")],
            help="let it run once a period",
            fixes=remove_entry(text),
        )
    elif machines[machine].environment:
        findings.add(
            "unscheduled-machine",
            f"`{name}` belongs to the environment, which no loop runs",
            text,
            help="take it out of the order: it moves at any time",
            fixes=remove_entry(text),
        )
    else:
        places[machine] = text


def _ticks(parts: Dictionary[str, Node], tick: int, findings: Findings) -> tuple[int, int] | None:
    """Read period and jitter in ticks."""
    found = []
    texts = []
    for name in ("period", "jitter"):
        text = require_text(parts.get(name), f"`{name}`", findings)
        ticks = 0 if text is None else read_duration(text, Scope(tick=tick), findings)
        if ticks is None or (text is None and name in parts):
            return None
        found.append(ticks)
        texts.append(text)
    period, jitter = found
    if period == 0:
        findings.add(
            "bad-period", "the period must be positive", texts[0], help="for instance `10ms`"
        )
        return None
    if jitter >= period:
        findings.add(
            "bad-period",
            f"the jitter is not shorter than the period of {duration_text(period * tick)}",
            texts[1],
            help="reduce it: a period must start before the next one",
        )
        return None
    return period, jitter


def require_room(system: System, findings: Findings) -> None:
    """Report more machines than can be explored together with the scheduler."""
    machines = len(system.machines) + len(system.monitors) + len(system.freezers)
    if system.schedule is not None and machines + 1 > MOST_ELEMENTS:
        findings.add(
            "not-explored-yet",
            f"a system of {machines} machines with a cyclic schedule is too large to explore",
            system.schedule.span,
            help=f"use at most {MOST_ELEMENTS - 1} machines, monitors included",
        )


def time_unit(system: System) -> int:
    """Return the greatest common divisor of all delays, in ticks; 0 without delays."""
    ticks = {machine.chart.capacities.tick for machine in system.machines}
    if len(ticks) > 1:
        raise fail(
            "different-ticks",
            "the machines of this system count time in different ticks",
            system.machines[-1].span,
            help="give all charts the same `capacity: {tick: ...}`",
        )
    delays = [d for machine in system.machines for d in delays_of(machine.chart)]
    return gcd(*(1 if delay is None else delay for delay in delays)) if delays else 0


# --- in an exploration ----------------------------------------------------------------------------


def with_scheduler(system: System, *, untimed: bool) -> System:
    """Return a system in which the schedule is a machine, after all others."""
    if system.schedule is None:
        return system
    name = "schedule"
    while any(machine.name == name for machine in system.machines):
        name += "_"
    tick = system.machines[0].chart.capacities.tick
    chart = scheduler_chart(system.schedule, tick, untimed=untimed)
    machine = Machine(name, chart, environment=True, is_monitor=True, span=system.schedule.span)
    return replace(system, machines=(*system.machines, machine))


def scheduler_chart(schedule: Schedule, tick: int, *, untimed: bool) -> Chart:
    """Return the chart that keeps turn and phase: ``turn_N`` is that of the N-th in the order.

    ``untimed``: periods follow each other at any time.
    """
    findings = Findings()
    text = "\n".join(_lines(schedule, tick, untimed=untimed)) + "\n"
    document = read_document(Source("schedule", text), findings)
    chart = None if document is None else elaborate((document,), findings)
    assert chart is not None, str(list(findings))  # noqa: S101  (written here)
    return chart


def _lines(schedule: Schedule, tick: int, *, untimed: bool) -> list[str]:
    period, jitter = (f"{ticks * tick}us" for ticks in (schedule.period, schedule.jitter))
    delayed = schedule.jitter > 0 and not untimed
    turns = [f"turn_{n}" for n in range(1, len(schedule.order) + 1)]
    first = "starting" if delayed else turns[0]
    lines = ["chart: Schedule", f"capacity: {{tick: {tick}us}}", "initial: period", "states:"]
    lines += ["  period:", f"    initial: {first}"]
    if not untimed:
        lines.append(f"    after: {{{period}: period}}")
    lines.append("    states:")
    if delayed:
        lines.append(f"      starting: {{after: {{0us..{jitter}: {turns[0]}}}}}")
    for turn, following in zip(turns, [*turns[1:], "over"], strict=True):
        lines.append(f"      {turn}: {{after: {{0us: {following}}}}}")
    again = f"after: {{{period}: {first}}}" if untimed else ""
    return [*lines, f"      over: {{{again}}}"]


def schedule_text(system: System) -> str:
    """Return the assumption of a verdict about a cyclic schedule."""
    schedule = system.schedule
    if schedule is None:
        return ""
    tick = system.machines[0].chart.capacities.tick
    late = f", up to {duration_text(schedule.jitter * tick)} late" if schedule.jitter else ""
    names = ", ".join(system.machines[machine].name for machine in schedule.order)
    every = duration_text(schedule.period * tick)
    return f"the loop runs {names} in this order every {every}{late}, and takes no time for it"


def machines_by_turn(system: System) -> dict[int, int]:
    """Return the machines that have their turn in states of the scheduler, the last machine.

    The result is empty without a cyclic schedule.
    """
    if system.schedule is None:
        return {}
    chart = system.machines[-1].chart
    return {
        chart.state_index[f"turn_{n}"]: machine
        for n, machine in enumerate(system.schedule.order, 1)
    }
