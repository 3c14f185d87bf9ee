"""Selecting the transitions for an event, as straight code (Appendix D, selectTransitions)."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.chart.analysis.effects import can_fail, has_effect, reads_event
from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.forms import form
from fsmkit.codegen.python.expressions import Printer
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import ME
from fsmkit.codegen.python.names import Names
from fsmkit.document.document import Kind
from fsmkit.plan.features import payload_of
from fsmkit.plan.selection import Candidates, Defer, Selection


def has_regions(chart: Chart) -> bool:
    """Whether several atomic states can be active at once."""
    return any(state.kind is Kind.PARALLEL for state in chart.states)


def guard_text(chart: Chart, names: Names, transition: Transition) -> str:
    """Return the guard of a transition for use in a selection."""
    if transition.guard is None:
        return "True"
    if is_needing_memo(chart, transition):
        return f"{ME}_test({transition.index})"
    payload = payload_of(chart, transition)
    key = form(transition.guard), None if payload is None else tuple(payload.items())
    if key not in names.guards:
        names.guards[key] = Printer(names, payload).print(transition.guard)
    return names.guards[key]


def is_needing_memo(chart: Chart, transition: Transition) -> bool:
    """Whether `_test` evaluates a guard once per selection and catches its errors."""
    guard = transition.guard
    return guard is not None and (
        can_fail(guard)
        or has_effect(guard)
        or (reads_event(guard) and payload_of(chart, transition) is None)
    )


def print_selection(
    out: Lines, names: Names, selection: Selection, name: str, event: int | None
) -> bool:
    """Print the method that selects for an event, if the chart handles it."""
    chart = selection.plan.chart
    groups = selection.by_leaf(event) if has_regions(chart) else selection.by_state(event)
    if not groups:
        return False
    what = "which eventless transitions to take"
    if event is not None:
        what = "which transitions `" + chart.events[event].name + "` enables"
    with out.method(name, "Return " + what + ".", result="int"):
        out.line(f"active = {ME}_active")
        if has_regions(chart):
            out.line(f"{ME}_seen = {ME}_chosen = 0")
            out.line(f"{ME}_offered.clear()")
            for states, tried in groups:
                with out.suite(f"if active & {mask(names, states)}:"):
                    _print_offers(out, chart, names, tried)
            out.line(f"return {ME}_chosen")
        else:
            for states, tried in groups:
                with out.suite(f"if active & {mask(names, states)}:"):
                    _print_returns(out, chart, names, tried)
            out.line("return 0")
    return True


def _print_offers(out: Lines, chart: Chart, names: Names, tried: Candidates) -> None:
    word = "if"
    for step in tried:
        test = None
        if isinstance(step, Transition) and step.guard is not None:
            test = guard_text(chart, names, step)
        if test is not None:
            out.line(f"{word} {test}:")
        elif word == "elif":
            out.line("else:")
        depth = "    " if test is not None or word == "elif" else ""
        if isinstance(step, Defer):
            out.line(f"{depth}{ME}_is_deferred = True")
        else:
            out.line(f"{depth}{ME}_offer({step.index})")
        word = "elif"


def _print_returns(out: Lines, chart: Chart, names: Names, tried: Candidates) -> None:
    for step in tried:
        if isinstance(step, Defer):
            out.line(f"{ME}_is_deferred = True")
        elif step.guard is None:
            out.line(f"return {bit(step.index)}  # {names.transitions[step.index]}")
        else:
            with out.suite(f"if {guard_text(chart, names, step)}:"):
                out.line(f"return {bit(step.index)}  # {names.transitions[step.index]}")
    if isinstance(tried[-1], Defer):
        out.line("return 0")


def bit(index: int) -> str:
    """Return one bit as text in the shorter notation."""
    return f"{1 << index:#x}" if index < 64 else f"1 << {index}"


def bits(number: int) -> str:
    """Return a set of bits as text whose length depends on their distances."""
    lowest = (number & -number).bit_length() - 1
    return f"{number:#x}" if lowest < 64 else f"({number >> lowest:#x} << {lowest})"


def decimal(number: int) -> str:
    """Return a number as text; a large one as a set of bits."""
    return repr(number) if number < 1 << 64 else bits(number)


def mask(names: Names, states: Iterable[int]) -> str:
    """Return a set of states as text."""
    members = sorted(states)
    if not members:
        return "0"
    if len(members) > 5:
        first = members[0]
        number = sum(1 << (state - first) for state in members)
        return f"{number << first:#x}" if first < 64 else f"({number:#x} << {first})"
    text = " | ".join(names.states[state] for state in members)
    return text if len(members) == 1 else f"({text})"
