"""Machines whose step is over once an event is taken: nothing follows, and nobody is called."""

from __future__ import annotations

import json
import re
from collections.abc import Collection

from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.names import Names
from fsmkit.document.document import Trigger

CALLING = r"self\.(?:_call_|_emit_|_log\(|log\(|reply)"
"""The host is called, and could call the machine; or a reply is to be reset."""
FOLLOWED = re.compile(
    r"self\.(?:_raise_|_enqueue_internal|_error_execution|_clamp|_finish|_stop|_test|_holds_)"
)
"""An internal event, the end or a fault may follow."""
READING = r"self\.(?:_field\(|_event_name)"
"""It is asked which event is at hand."""
TABLE = "_TAKEN"
"""The constant of a module that holds the methods of the events without fields."""
BUSY = re.compile(f"{CALLING}|{READING}")


def answered(chart: Chart, names: Names, text: str) -> set[int] | None:
    """Return the events that have a method ``_on_...`` in the text of a class.

    None where taking an event is not all of a step.
    """
    if is_followed(chart, text) or BUSY.search(text):
        return None
    if chart.root.defer or any(
        t.source == 0 and t.trigger is Trigger.EVENT for t in chart.transitions
    ):
        return None  # these are asked even while the machine does not run
    methods = set(re.findall(r"^    def _on_(\w+)\(", text, re.MULTILINE))
    return {index for index, name in enumerate(names.events) if name in methods}


def is_followed(chart: Chart, text: str) -> bool:
    """Whether more than an event's own transitions can be taken in a step, or a fault end it."""
    is_eventless = any(t.trigger is Trigger.EVENTLESS for t in chart.transitions)
    return is_eventless or FOLLOWED.search(text) is not None


def print_dispatch(out: Lines) -> None:
    """Print how an event is processed by its name."""
    passed = "event: str, *payload: Any, now: int | None = None"
    doc = "Process one event at once, ahead of the queue; whether it enabled a transition."
    with out.method("dispatch", doc, passed, "bool"):
        out.line(f"take = {TABLE}.get(event)")
        with out.suite("if take is not None and not payload and now is None:"):
            out.line("return take(self)")
        out.line("index, _ = self._named(event, payload)")
        out.line("self._claim()")
        with out.suite("if now is not None and self._running:"):
            out.line("self._now = now & CLOCK")
        out.line("self._fields[: len(payload)] = payload")
        out.line("return self._process(index)")


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
