"""Limits of C: parts of a chart that it cannot express, reported before generating."""

from __future__ import annotations

from collections.abc import Iterable

import fsmkit.language as lang
from fsmkit.chart.chart import Chart
from fsmkit.chart.statements import Reply
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Trigger
from fsmkit.language.walk import nodes

CHECKED = frozenset(
    {lang.Binary, lang.Convert, Reply, lang.Literal, lang.Conditional, lang.EventField}
)
"""The nodes that C cannot express in all cases."""


def require_limits(charts: Iterable[Chart]) -> None:
    """Raise `FsmkitError` with all findings of C's limits in some charts."""
    findings = Findings()
    for chart in charts:
        report_limits(chart, findings)
    findings.stop_on_errors()


def report_limits(chart: Chart, findings: Findings) -> None:
    """Report everything in a chart that the C target cannot express."""
    at = chart.root.span
    if chart.abstract:
        findings.add(
            "abstract-chart", f"`{chart.name}` is abstract: it is there to be extended", at,
            help="compile a chart that extends it, or remove `abstract`",
        )  # fmt: skip
    for invocation in chart.invocations:
        report_limits(invocation.chart, findings)
    check = _Checker(chart, findings).check
    for transition in chart.transitions:
        if transition.trigger is Trigger.SOMETIMES:
            findings.add(
                "c-limit", "a transition that may come at any time is for the environment",
                transition.span, help="give it an event or a delay",
            )  # fmt: skip
        if transition.least is not None:
            findings.add(
                "c-limit", "a delay that is an interval is for the environment",
                transition.span, help="give it one delay",
            )  # fmt: skip
        check((transition.guard, transition.content), transition.events)
    for state in chart.states:
        content = (state.on_entry, state.on_exit, state.invokes, state.done_data)
        check(content, ())
    for event in chart.events:
        check(event.finalize, (event.index,))
    check(chart.script, ())


class _Checker:
    """Reports what C cannot express in the content of a chart."""

    def __init__(self, chart: Chart, findings: Findings) -> None:
        self._chart = chart
        self._findings = findings
        self._carriers: dict[str, set[int]] = {}
        for event in chart.events:
            for field in event.fields:
                self._carriers.setdefault(field.name, set()).add(event.index)

    def check(self, content: object, events: tuple[int, ...]) -> None:
        """Check content, given the events that can be current there."""
        for node in nodes(content):
            if node.__class__ in CHECKED:
                self._look_at(node, events)

    def _look_at(self, node: object, events: tuple[int, ...]) -> None:
        findings = self._findings
        match node:
            case lang.Binary(lang.BinaryOp.REM, _, _, lang.FloatType()):
                findings.add(
                    "c-limit", "the remainder of floating-point numbers needs a library in C",
                    node.span, help="declare an operation for it",
                )  # fmt: skip
            case lang.Convert(operand, lang.IntType(_, hi)) if (
                isinstance(operand.type, lang.FloatType) and hi > 2**63 - 1
            ):
                findings.add(
                    "c-limit", "C cannot convert a floating-point number to `uint64`",
                    node.span, help="use int64 or a range",
                )  # fmt: skip
            case Reply(value) if isinstance(value.type, lang.ArrayType | lang.RecordType):
                findings.add(
                    "c-limit", "a reply of several parts cannot be written in C", node.span,
                    help="reply with a number, or send an event",
                )  # fmt: skip
            case (
                lang.Literal(_, lang.ArrayType() | lang.RecordType())
                | lang.Conditional(type=lang.ArrayType())
            ):
                findings.add(
                    "c-limit", "C needs a variable here, not a constant of several parts",
                    node.span, help="declare a variable with that start value and use it here",
                )  # fmt: skip
            case lang.EventField(name):
                having = self._carriers.get(name)
                is_lenient = not events and self._chart.lenient
                if having is None or not having.issuperset(events) or is_lenient:
                    findings.add(
                        "c-limit", f"not every event that can occur here has the field `{name}`",
                        node.span, help="use it in a transition on events that declare it",
                    )  # fmt: skip
            case _:
                pass
