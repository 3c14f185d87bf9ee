"""What a machine without timers, deferral, payloads and so on does without."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.content import Needs
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.plain import CALLING, is_followed
from fsmkit.codegen.python.relations import samples_inputs
from fsmkit.document.document import Trigger

TRACE = r"if .*self\.trace is not None:"


@dataclass(frozen=True, slots=True)
class Features:
    """What a chart can need at run time."""

    trace: bool
    timers: bool
    deferral: bool
    inputs: bool
    """Eventless transitions that are tried once in each `run`."""
    calls: bool
    """The host is called in steps, and may raise."""
    errors: bool
    """Errors that stop the machine where nothing answers them."""
    payload: bool
    following: bool
    """Eventless transitions, internal events, an end or a fault may follow an event; or a trace
    tells where it led."""

    @property
    def unneeded(self) -> re.Pattern[str]:
        """What opens the suites that are left out."""
        openings = [
            *([] if self.trace else [TRACE]),
            *([] if self.timers else [r"elif self\._is_due\(now\):"]),
            *([] if self.deferral else [r"if self\._is_deferred and may_defer:"]),
            *([] if self.inputs else [r"if self\.SAMPLES_INPUTS:"]),
            *([] if self.calls else [r"except BaseException:"]),
            *([] if self.errors else [r"if event in self\.ERRORS:"]),
            *([] if self.payload else [r"for k in range\(.*width\):", r"if self\.WIDTH:"]),
        ]
        return re.compile("|".join(openings) or r"(?!)")

    def print_stand_ins(self, out: Lines) -> None:
        """Print what takes the place of methods that would have nothing to do."""
        if not self.timers:
            with out.method("next_deadline", "There are no timers.", result="int | None"):
                out.line("return None")
        if not self.deferral:
            with out.method("_recall", "No event is ever deferred.", result="int"):
                out.line("return NOTHING")
        if not self.following:
            with out.method("_settle", "Nothing follows an event that is taken."):
                if not self.errors:
                    out.line("return")
                    return
                with out.suite("if self._fault is not None:"):
                    out.line("self._running = self._finished = False")


def features_of(chart: Chart, needs: Needs, text: str, *, trace: bool) -> Features:
    """Return what a chart needs; ``text`` is that of its states and transitions."""
    errors = not chart.lenient and any(
        event.name.startswith("error.") and not event.directions for event in chart.events
    )
    timed = any(t.trigger in (Trigger.AFTER, Trigger.EVERY) for t in chart.transitions)
    return Features(
        trace=trace,
        timers=timed or bool(needs.delayed),
        deferral=any(state.defer for state in chart.states),
        inputs=samples_inputs(chart),
        calls=trace or re.search(CALLING, text) is not None,
        errors=errors,
        payload=any(event.fields for event in chart.events),
        following=trace or is_followed(chart, text),
    )
