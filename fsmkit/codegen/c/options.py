"""What can be chosen when a chart is compiled to C."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fsmkit.diagnostics import Findings, Span, fail
from fsmkit.model.chart import Chart
from fsmkit.model.content import all_statements
from fsmkit.model.statements import Destination, Send

PARTS = {
    "queue": "the external queue, with what posts into it and steps through it",
    "counters": "how many events enabled nothing, or found a queue full",
}
"""What a machine can be made without, and what that is."""


@dataclass(frozen=True, slots=True)
class Options:
    """What whoever compiles a chart decides."""

    without: frozenset[str] = frozenset()
    """Of `PARTS`."""


def read_options(options: Mapping[str, str]) -> Options:
    """Return the options of a target; an error where one names what is not there."""
    without = frozenset(
        filter(None, (part.strip() for part in options.get("without", "").split(",")))
    )
    for part in sorted(without - PARTS.keys()):
        known = "; ".join(f"`{name}`: {what}" for name, what in PARTS.items())
        raise fail(
            "unknown-part", f"there is no part `{part}` to leave out", help=f"known are {known}"
        )
    return Options(without)


def report_missing(chart: Chart, options: Options, findings: Findings) -> None:
    """Say where a chart needs what it is to be made without."""
    if "queue" not in options.without:
        return
    users: list[tuple[Span | None, str]]
    users = [(s.span, "defers events") for s in chart.states if s.defer]
    users += [(i.span, "invokes a chart") for i in chart.invocations]
    users += [
        (statement.span, "sends events to itself")
        for statement in all_statements(chart)
        if isinstance(statement, Send) and statement.destination is Destination.SELF
    ]
    for span, what in users:
        findings.add(
            "c-limit", f"`{chart.name}` is to be made without a queue, but {what}",
            span or chart.root.span,
            help="compile it with the queue, or use `raise`, which takes the internal one",
        )  # fmt: skip
