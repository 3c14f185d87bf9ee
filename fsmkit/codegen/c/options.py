"""The options of the C target."""

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
    "queue": "the external queue and the functions that post to it and step through it",
    "counters": "how many events enabled nothing, or found a queue full",
}
"""The parts that a machine can omit, with their descriptions."""

EXTRAS = {
    "info": "a source that describes the machine, for what drives any machine",
    "save": "the same, and functions that save the machine to bytes and restore it",
    "trace": "a source with a trace and a log, to be compiled instead of the machine's own",
    "records": "a source with records of 1 to 4 bytes for a live trace, to be compiled likewise",
    "coverage": "coverage counters, and a function that reports them",
}
"""The parts that a machine can add, with their descriptions."""

SIZE = "size"
"""The optimization for size; the default is speed."""

COMPILING = "compiling"
"""The optimization for programs that fsmkit builds and runs once: little to compile."""


@dataclass(frozen=True, slots=True)
class Options:
    """The options of a compilation."""

    without: frozenset[str] = frozenset()
    """Omitted parts, a subset of `PARTS`."""
    extras: frozenset[str] = frozenset()
    """Added parts, a subset of `EXTRAS`."""
    is_small: bool = False
    """Whether the code consists of tables, which are smaller and slower."""
    is_tabled: bool = False
    """Whether, with `is_small`, tables replace even a smaller grid, whose answers are code."""
    binding: Binding | None = None
    """The binding to the host's own C, or None."""

    observes_reads: bool = False
    """Whether each read of an input first calls a hook. Only fsmkit's own programs set it."""

    @property
    def chosen(self) -> Chosen:
        """The names that the binding chooses."""
        return Chosen(self.binding)


def read_options(options: Mapping[str, str]) -> Options:
    """Return the options of a target; raise `FsmkitError` for an unknown name."""
    without = named_parts(options, "without", PARTS)
    extras = named_parts(options, "with", EXTRAS)
    aim = options.get("optimize", "")
    if aim not in ("", SIZE, COMPILING):
        raise fail(
            "unknown-aim",
            f"C cannot be optimized for `{aim}`",
            help=f"use `{SIZE}`, or omit the option to optimize for speed",
        )
    return Options(without, extras, bool(aim), is_tabled=aim == COMPILING)


def report_missing(chart: Chart, options: Options, findings: Findings) -> None:
    """Report each need of a chart that the omitted parts leave unmet."""
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
            "c-limit", f"`{chart.name}` is compiled without a queue, but {what}",
            span or chart.root.span,
            help="compile it with the queue, or use `raise`, which takes the internal one",
        )  # fmt: skip
