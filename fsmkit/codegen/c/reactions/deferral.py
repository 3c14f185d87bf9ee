"""Which events are kept for later, in C (see `chart.deferral`)."""

from __future__ import annotations

from fsmkit.chart.structure import shared_deferral
from fsmkit.codegen.c.helpers import fill
from fsmkit.codegen.c.names import Names
from fsmkit.emit import Emitter

ANSWERED = """
/* Whether a transition was found of a state, or of one below it. */
static bool @_is_answered(const @_selection *found, uint16_t state)
{
    for (uint16_t i = 0u; i < found->count; i++) {
        const uint16_t source = @_source_of[found->at[i]];
        if (source >= state && source < @_last_below[state]) {
            return true;
        }
    }
    return false;
}
"""


def print_is_deferred(out: Emitter, names: Names) -> None:
    """Print the function that tests whether an active state defers an event."""
    if not names.does.defers:
        return
    p = names.prefix
    out.line(f"static bool {p}_is_deferred(const {p} *m, uint16_t event)")
    with out.block("{"):
        for state in names.chart.states:
            for event in state.defer:
                test = _group(names.in_state("m", state.index))
                with out.block(f"if ({test} && event == {names.events[event]}) {{"):
                    out.line("return true;")
        out.line("return false;")
    out.line()


def print_is_kept(out: Emitter, names: Names) -> None:
    """Print the function that looks at what several regions answer, after the tables it reads."""
    if not has_shared(names):
        return
    p = names.prefix
    out.lines(fill(names, ANSWERED))
    out.line()
    out.line("/* Whether a state defers an event that no region below it answers. */")
    selection = f"const {p}_selection *found"
    out.line(f"static bool {p}_is_kept(const {p} *m, uint16_t event, {selection})")
    with out.block("{"):
        for state, events in enumerate(shared_deferral(names.chart)):
            for event in sorted(events):
                test = _group(names.in_state("m", state))
                answered = f"!{p}_is_answered(found, {state}u)"
                with out.block(f"if ({test} && event == {names.events[event]} && {answered}) {{"):
                    out.line("return true;")
        out.line("return false;")
    out.line()


def is_kept(names: Names) -> str:
    """Return the test whether an event is deferred, when all regions have been asked."""
    also = f" || {names.prefix}_is_kept(m, fsm_event_number(e->event), &found)"
    return "found.defers" + (also if has_shared(names) else "")


def has_shared(names: Names) -> bool:
    """Whether regions below a state may answer what it defers."""
    return any(shared_deferral(names.chart))


def _group(text: str) -> str:
    return text if text.startswith("(") else f"({text})"
