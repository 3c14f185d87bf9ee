"""What can be chosen when a chart is compiled to C."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Destination, Send
from fsmkit.codegen.c.chosen import Chosen
from fsmkit.codegen.existing_c.model import Binding
from fsmkit.codegen.target import named_parts
from fsmkit.diagnostics import Findings, Span, fail

PARTS = {
    "queue": "the external queue, with what posts into it and steps through it",
    "counters": "how many events enabled nothing, or found a queue full",
}
"""What a machine can be made without, and what that is."""

EXTRAS = {
    "info": "a source that describes the machine, for what drives any machine",
    "save": "the same, and functions that save the machine to bytes and restore it",
    "trace": "a source with a trace and a log, to be compiled instead of the machine's own",
    "records": "a source with records of 1 to 4 bytes for a live trace, to be compiled likewise",
    "coverage": "counters of what tests reach, and a function that gives them out",
}
"""What a machine can be made with, and what that is."""

SIZE = "size"
"""What code can be optimized for; without it, code is for speed."""

COMPILING = "compiling"
"""An aim of programs of our own, which are built and run at once: few lines for the compiler."""


@dataclass(frozen=True, slots=True)
class Options:
    """What whoever compiles a chart decides."""

    without: frozenset[str] = frozenset()
    """Of `PARTS`."""
    extras: frozenset[str] = frozenset()
    """Of `EXTRAS`."""
    is_small: bool = False
    """Whether code is to be tables, which are small, and slower."""
    is_tabled: bool = False
    """With that: tables also where a grid of answers takes fewer bytes, as each is code."""
    binding: Binding | None = None
    """What the chart is in the host's own C, if it is bound."""

    tells_reads: bool = False
    """Whether each read of an input calls a hook first: of programs of our own, which choose it."""

    @property
    def chosen(self) -> Chosen:
        """The names that the binding chooses."""
        return Chosen(self.binding)


def read_options(options: Mapping[str, str]) -> Options:
    """Return the options of a target; an error where one names what is not there."""
    without = named_parts(options, "without", PARTS)
    extras = named_parts(options, "with", EXTRAS)
    aim = options.get("optimize", "")
    if aim not in ("", SIZE, COMPILING):
        raise fail(
            "unknown-aim",
            f"C cannot be optimized for `{aim}`",
            help=f"use `{SIZE}`, or no aim: code is for speed then",
        )
    return Options(without, extras, bool(aim), is_tabled=aim == COMPILING)


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
