"""Deferred events in C (see `chart.deferral`)."""

from __future__ import annotations

from fsmkit.codegen.c.expressions.fragments import ATOM
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.pieces import print_pieces


def print_is_deferred(out: Unit, names: Names) -> None:
    """Print the function that tests whether an active state defers an event."""
    if not names.does.defers:
        return
    p = names.own
    out.define("is_deferred")
    out.line(f"static bool {p}_is_deferred(const {p} *m, uint16_t event)")
    with out.block("{"):
        for state in names.chart.states:
            for event in state.defer:
                test = names.in_state("m", state.index).at(ATOM)
                with out.block(f"if ({test} && event == {names.events[event]}) {{"):
                    out.line("return true;")
        out.line("return false;")
    out.line()


def print_is_kept(out: Unit, names: Names) -> None:
    """Print the function that combines the answers of several regions, after its tables."""
    if not has_shared(names):
        return
    p = names.own
    print_pieces(out, names, "selection", "is_answered")
    out.define("is_kept")
    out.line("/* Whether a state defers an event that no region below it answers. */")
    selection = f"const {p}_selection *found"
    out.line(f"static bool {p}_is_kept(const {p} *m, uint16_t event, {selection})")
    with out.block("{"):
        for state, events in enumerate(names.plan.shared_deferral):
            for event in sorted(events):
                test = names.in_state("m", state).at(ATOM)
                answered = f"!{p}_is_answered(found, {state}u)"
                with out.block(f"if ({test} && event == {names.events[event]} && {answered}) {{"):
                    out.line("return true;")
        out.line("return false;")
    out.line()


def has_shared(names: Names) -> bool:
    """Whether regions below a state may answer what it defers."""
    return any(names.plan.shared_deferral)
