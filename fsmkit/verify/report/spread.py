"""Name the part that makes an incompletely explored space large, and how to reduce it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from fsmkit.chart.chart import Chart, Data
from fsmkit.chart.content import all_statements
from fsmkit.chart.format import format_signature
from fsmkit.chart.statements import Assign
from fsmkit.diagnostics import Findings, Span
from fsmkit.language import Storage, Variable
from fsmkit.language.walk import nodes, root
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.spread import Kind, Part, Spread, parts_of

LEAST = 1.5
"""A part is named if it multiplies the space at least so often: twice, of all states."""
MOST_NAMED = 3
"""Parts that are named beside the first one."""


@dataclass(frozen=True, slots=True)
class _Share:
    """The factor of a part in the size of a space; without it ``others`` states are left."""

    machine: int
    chart: Chart
    part: Part
    states: int
    values: int
    others: int

    @property
    def factor(self) -> float:
        return self.states / max(1, self.others)

    @property
    def variable(self) -> Data | None:
        found = {
            Kind.INPUT: self.chart.inputs,
            Kind.DATA: self.chart.data,
            Kind.OUTPUT: self.chart.outputs,
        }.get(self.part.kind)
        return None if found is None else found[self.part.index]

    def _source_inputs(self, name: str) -> tuple[str, ...]:
        """Return the inputs that are assigned to a variable; they need not be state themselves."""
        assigned = (
            statement.value
            for statement in all_statements(self.chart)
            if isinstance(statement, Assign) and root(statement.location).name == name
        )
        return tuple(dict.fromkeys(input_ for value in assigned for input_ in _inputs(value)))

    @property
    def name(self) -> str:
        if self.variable is not None:
            kind = self.part.kind
            what = f"the {'variable' if kind is Kind.DATA else kind.value} `{self.variable.name}`"
            taken = () if kind is Kind.INPUT else self._source_inputs(self.variable.name)
            inputs = ", ".join(f"`{name}`" for name in taken)
            return f"{what}, which takes values of the input {inputs}," if inputs else what
        if self.part.kind is Kind.INVOKED:
            return f"the machine invoked as `{self.chart.invocations[self.part.index].id}`"
        if self.part.kind is Kind.TIMERS:
            return "the remaining time of the timers"
        return f"the queue of {self.chart.capacities.queue}"


def report_spread(closed: ClosedSystem, spreads: Sequence[Spread], findings: Findings) -> None:
    """Report the part with the largest factor, with a fix."""
    shares = sorted(_shares(closed, spreads), key=lambda share: -share.factor)
    if not shares or shares[0].factor < LEAST:
        return
    first, machine = shares[0], closed.system.machines[shares[0].machine]
    others = ", ".join(
        f"{share.name} by {share.factor:.0f}"
        for share in shares[1 : 1 + MOST_NAMED]
        if share.factor >= LEAST
    )
    message = (
        f"{first.name} {_effect(closed, first)}: of the first {first.states:,} local states of "
        f"`{machine.name}`, {first.others:,} differ in anything else"
    )
    message += f"; the space is multiplied by {others}, too" if others else ""
    span: Span | None = first.variable.span if first.variable is not None else machine.span
    findings.add("large-space", message, span, help=_fix(closed, first))


def _shares(closed: ClosedSystem, spreads: Sequence[Spread]) -> Iterator[_Share]:
    for machine, spread in enumerate(spreads):
        chart = closed.charts[machine]
        for part, counts in zip(parts_of(chart), spread.parts, strict=False):
            yield _Share(machine, chart, part, spread.states, *counts)


def _effect(closed: ClosedSystem, share: _Share) -> str:
    if share.part.kind is not Kind.QUEUE:
        return f"has {share.values:,} values"
    waiting = _waiting(closed, share)
    names = ", ".join(f"`{text}`" for text in waiting)
    ways = _payload_count(closed, share, len(waiting))
    bound = f"up to {ways}^{share.chart.capacities.queue} orders" if ways else "orders"
    return f"holds {bound} of {names}" if names else f"has {share.values:,} contents"


def _events(share: _Share) -> set[int]:
    """Return the events that wait because some state defers them."""
    return {event for state in share.chart.states for event in state.defer}


def _waiting(closed: ClosedSystem, share: _Share) -> tuple[str, ...]:
    """Return the declarations of the events that fill a queue, if they are known."""
    found = _events(share) or {
        link.event for link in closed.system.event_links if link.target == share.machine
    }
    events = [event for event in share.chart.events if event.index in found]
    return tuple(format_signature(e.name, e.fields, None) if e.fields else e.name for e in events)


def _payload_count(closed: ClosedSystem, share: _Share, waiting: int) -> int:
    """Return the number of kinds of one waiting event, payloads included; 0 if it is unknown."""
    deferred = _events(share)
    kinds = sum(p.machine == share.machine and p.event in deferred for p in closed.possible)
    return kinds if kinds >= waiting > 0 and closed.is_open else 0


def _fix(closed: ClosedSystem, share: _Share) -> str:
    match share.part.kind:
        case Kind.QUEUE:
            less = max(1, min(3, share.chart.capacities.queue - 1))
            return (
                f"a smaller queue: `capacity: {{queue: {less}}}`, in SCXML "
                f'`<fk:capacity queue="{less}"/>`; or fewer values in the waiting events'
            )
        case Kind.TIMERS:
            return "choose delays with a greater common divisor; or use `--time untimed`"
        case Kind.INPUT if closed.keeps_inputs:
            readers = ", ".join(f"`{name}`" for name in _readers(closed, share))
            return (
                f"inputs count as state since {readers} reads one; evaluate the state or the data "
                "that the chart has after it, and remove the input from the property"
            )
        case Kind.INVOKED:
            return "check that chart separately, with the inputs that it needs from this one"
        case _:
            return (
                "a type with fewer values, a counter with a bound, or a value that is set back "
                "where nothing reads it any more"
            )


def _readers(closed: ClosedSystem, share: _Share) -> list[str]:
    """Return the properties that read an input; if none does, those that read any."""
    read = {p.name: frozenset(_inputs(p.condition)) for p in closed.system.properties}
    name = "" if share.variable is None else share.variable.name
    return [p for p, names in read.items() if name in names] or [p for p in read if read[p]]


def _inputs(node: object) -> Iterator[str]:
    for part in nodes(node):
        if isinstance(part, Variable) and part.storage is Storage.INPUT:
            yield part.name
