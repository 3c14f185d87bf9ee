"""Machines whose step is a single event: nothing follows it, and nothing is observed."""

from __future__ import annotations

import json
from collections.abc import Collection

from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import LINK, ME
from fsmkit.codegen.python.names import Names
from fsmkit.document.document import Trigger
from fsmkit.plan import Plan

TABLE = "_TAKEN"
"""The module constant with the methods of the events without fields."""


def is_plain(plan: Plan) -> bool:
    """Whether a step consists of taking one event."""
    chart, needs = plan.chart, plan.features
    # events that the root handles or defers are tested even while the machine does not run
    is_always = chart.root.defer or any(
        t.source == 0 and t.trigger is Trigger.EVENT for t in chart.transitions
    )
    return not (is_always or needs.follows or needs.calls or needs.replies or needs.reads_event)


def print_dispatch(out: Lines, *, has_payload: bool) -> None:
    """Print the method that processes an event by its name."""
    passed = "event: str, *payload: Any, now: int | None = None"
    doc = "Process one event at once, ahead of the queue; whether it enabled a transition."
    with out.method("dispatch", doc, passed, "bool"):
        out.line(f"take = {TABLE}.get(event)")
        with out.suite("if take is not None and not payload and now is None:"):
            out.line("return take(self)")
        out.line(f"index, _ = {ME}_named(event, payload)")
        out.line(f"{ME}_claim()")
        with out.suite(f"if now is not None and {ME}_running:"):
            out.line(f"{ME}_now = now & {LINK}CLOCK")
        if has_payload:
            out.line(f"{ME}_fields[: len(payload)] = payload")
        out.line(f"return {ME}_process(index)")


def print_table(chart: Chart, names: Names, taken: Collection[int]) -> str:
    """Return the table of the events without fields, which follows the class."""
    out = Lines()
    with out.block(f"{TABLE}: dict[str, Callable[[{names.machine}], bool]] = {{", "}"):
        for index in sorted(taken):
            event = chart.events[index]
            if not event.fields and chart.event_index[event.name] == index:
                method = f"{names.machine}._on_{names.events[index]}"
                out.line(f"{json.dumps(event.name)}: {method},")
    return out.finish()
