"""The sizes up to which every runtime keeps a chart.

They hold for all runtimes and engines alike, so that a chart that is simulated and checked can also
be compiled. Generated C and saved machines (`fsmkit.plan.image`) count in the widths given below.
"""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Send
from fsmkit.chart.walk import charts_within, own_nodes
from fsmkit.diagnostics import Findings, Span
from fsmkit.document.document import DocState, Document, Kind
from fsmkit.language import Literal

MOST_STATES = 65_534
"""States without the root: two bytes count them with the root, and 65,535 is no state."""
MOST_EVENTS = 65_000
"""Events: two bytes, with room for the numbers that mean something else."""
MOST_DECLARED = 16_384
"""Variables, constants, operations, members ..., each kind counted separately."""
MOST_FIELDS = 1_023
"""Fields of an event or a record, and parameters: as many members as each C compiler allows."""
MOST_NUMBERED = 65_535
"""Transitions, strings and recorded regions, each kind counted separately: two bytes."""
MOST_QUEUED = 250
"""Events in a queue, and delayed sends: one byte."""
MOST_TIMERS = 255
"""Timers armed at once, those of delayed sends included: one byte."""
MOST_TIMED = 32_768
"""Transitions up to the last one with a timer: 15 bits name it."""
MOST_MICROSTEPS = 65_535
"""Microsteps in a macrostep: two bytes."""
CAPACITIES = {
    "queue": (1, MOST_QUEUED),
    "internal": (1, MOST_QUEUED),
    "delayed": (0, MOST_QUEUED),
    "microsteps": (1, MOST_MICROSTEPS),
}
"""The least and the greatest value of each capacity."""
SPLIT = "split the chart into several machines"


def check_document(document: Document, states: Sequence[DocState], findings: Findings) -> bool:
    """Return whether a document keeps all limits; report those that it exceeds.

    ``states``: all states, the root first. The names of events and the content of copies are
    counted later, by `check_limits`. This check runs before any type is read, so that a large file
    is rejected early.
    """
    at = document.root.span
    data = len(document.data) + sum(len(state.data) for state in states)
    transitions = sum(len(state.transitions) for state in states)
    invocations = sum(len(state.invokes) for state in states)
    members = max((len(each.members) for each in document.types), default=0)
    is_small = True
    for what, count, most in (
        ("states", len(states) - 1, MOST_STATES),
        ("transitions", transitions, MOST_NUMBERED),
        ("variables under `data`", data, MOST_DECLARED),
        ("inputs", len(document.inputs), MOST_DECLARED),
        ("outputs", len(document.outputs), MOST_DECLARED),
        ("constants", len(document.constants), MOST_DECLARED),
        ("types", len(document.types), MOST_DECLARED),
        ("members of an enumeration", members, MOST_DECLARED),
        ("operations", len(document.operations), MOST_DECLARED),
        ("functions", len(document.functions), MOST_DECLARED),
        ("properties", len(document.properties), MOST_DECLARED),
        ("invocations", invocations, MOST_DECLARED),
    ):
        is_small &= _check(count, most, what, at, findings)
    for what, lists in (
        ("fields of an event", (each.fields for each in document.events)),
        ("fields of a record", (each.fields for each in document.types)),
        ("parameters of an operation", (each.parameters for each in document.operations)),
        ("parameters of a function", (each.parameters for each in document.functions)),
    ):
        is_small &= _check(max(map(len, lists), default=0), MOST_FIELDS, what, at, findings)
    return is_small


def check_limits(chart: Chart, findings: Findings) -> None:
    """Report everything in a chart that is more than all runtimes count.

    Capacities that the chart declares were checked where they are read. Those that follow from its
    content and from its copies are checked here.
    """
    at = chart.root.span
    _check(len(chart.events), MOST_EVENTS, "events", at, findings)
    fields = max((len(event.fields) for event in chart.events), default=0)
    for what, count, most in (
        ("variables under `data`", len(chart.data), MOST_DECLARED),
        ("inputs", len(chart.inputs), MOST_DECLARED),
        ("outputs", len(chart.outputs), MOST_DECLARED),
        ("operations", len(chart.operations), MOST_DECLARED),
        ("fields of an event", fields, MOST_FIELDS),
        ("transitions", len(chart.transitions), MOST_NUMBERED),
        ("strings and names of events", _strings(chart), MOST_NUMBERED),
        ("regions and regions recorded by histories", _numbers(chart), MOST_NUMBERED),
        ("invoked machines of all levels", sum(1 for _ in charts_within(chart)) - 1, MOST_DECLARED),
    ):
        _check(count, most, what, at, findings)
    for name, (_, most) in CAPACITIES.items():
        count = getattr(chart.capacities, name)
        if count > most:
            findings.add(
                "too-large", f"the capacity `{name}` is {count:,}, more than {most:,}", at,
                help=f"declare a smaller one, for instance `capacity: {{{name}: {most}}}`",
            )  # fmt: skip
    timed = [t for t in chart.transitions if t.has_timer]
    if timed and timed[-1].index >= MOST_TIMED:
        findings.add(
            "too-large", f"a timeout comes after {MOST_TIMED:,} other transitions", timed[-1].span,
            help=f"write states with timeouts first, or {SPLIT}",
        )  # fmt: skip
    if len(timed) + chart.capacities.delayed > MOST_TIMERS:
        sends = any(isinstance(s, Send) and s.delay is not None for s in all_statements(chart))
        count = timeouts_at_once(chart) + (chart.capacities.delayed if sends else 0)
        _check(count, MOST_TIMERS, "timers that can be armed at once", at, findings)


def timeouts_at_once(chart: Chart) -> int:
    """Return how many timeouts can be armed at once: those of states that are active together."""
    most = [0] * len(chart.states)
    for transition in chart.transitions:
        if transition.has_timer:
            most[transition.source] += 1
    for state in reversed(chart.states):
        inner = [most[child] for child in state.children]
        most[state.index] += sum(inner) if state.kind is Kind.PARALLEL else max(inner, default=0)
    return most[0]


def _strings(chart: Chart) -> int:
    """Return the number of strings that a saved machine may number: of literals, of event names.

    It is 0 where the sources are too short to have too many.
    """
    if sum(len(source.text) for source in chart.sources) <= MOST_NUMBERED:
        return 0
    nodes = (node for node in own_nodes(chart) if isinstance(node, Literal))
    found = {node.value for node in nodes if isinstance(node.value, str)}
    return len(found | {"", *(event.name for event in chart.events)}) if found else 0


def _numbers(chart: Chart) -> int:
    """Return the number of states in a saved machine: one per region, and those of histories."""
    below = [0] * len(chart.states)
    for state in reversed(chart.states):
        regions = [child for child in state.children if not chart.states[child].is_history]
        below[state.index] += len(regions) if state.kind is Kind.PARALLEL else 0
        if state.parent is not None:
            below[state.parent] += below[state.index]
    count = 1 + below[0]
    for state in chart.states:
        if state.kind is Kind.DEEP_HISTORY:
            parent = chart.states[state.parent or 0]
            count += below[parent.index] + (parent.kind is not Kind.PARALLEL)
        elif state.is_history:
            count += 1
    return count


def _check(count: int, most: int, what: str, at: Span, findings: Findings) -> bool:
    """Return whether a count is within its limit; report it if not."""
    if count > most:
        findings.add(
            "too-large",
            f"there are {count:,} {what}, but at most {most:,} are allowed",
            at,
            help=SPLIT,
        )
    return count <= most
