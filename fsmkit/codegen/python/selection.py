"""Which transitions an event enables, as straight code (Appendix D, selectTransitions)."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.codegen.python.expressions import Printer, can_fail, has_effect, reads_event
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.names import Names
from fsmkit.model.chart import Chart, Transition
from fsmkit.model.document import Kind, Trigger

Step = Transition | None
"""A transition to try, or None: the search ends here because the state defers the event."""


def has_regions(chart: Chart) -> bool:
    """Whether several atomic states can be active at once."""
    return any(state.kind is Kind.PARALLEL for state in chart.states)


def own(chart: Chart, state: int, event: int | None) -> tuple[Step, ...]:
    """Return what one state tries; for no event, its eventless transitions."""
    found: list[Step] = []
    for number in chart.states[state].transitions:
        transition = chart.transitions[number]
        matches = (
            transition.trigger is Trigger.EVENTLESS
            if event is None
            else transition.trigger is Trigger.EVENT and event in transition.events
        )
        if matches:
            found.append(transition)
            if transition.guard is None:
                return tuple(found)
    if event is not None and event in chart.states[state].defer:
        found.append(None)
    return tuple(found)


def chain(chart: Chart, leaf: int, event: int | None) -> tuple[Step, ...]:
    """Return what is tried from an atomic state outward, up to what is sure to be taken."""
    found: list[Step] = []
    for state in (leaf, *chart.ancestors(leaf)):
        found += own(chart, state, event)
        if found and (found[-1] is None or found[-1].guard is None):
            break
    return tuple(found)


def payload_of(chart: Chart, transition: Transition) -> dict[str, int] | None:
    """Return where the fields of the event at hand are, None where that depends on the event."""
    if transition.trigger is not Trigger.EVENT or not transition.events:
        return None
    places = [
        {part.name: place for place, part in enumerate(chart.events[event].fields)}
        for event in transition.events
    ]
    return places[0] if all(each == places[0] for each in places) else None


def guard_text(chart: Chart, names: Names, transition: Transition) -> str:
    """Return the guard of a transition as it stands in a selection."""
    if transition.guard is None:
        return "True"
    if not is_needing_memo(chart, transition):
        return Printer(names, payload_of(chart, transition)).print(transition.guard)
    return f"self._test({transition.index})"


def is_needing_memo(chart: Chart, transition: Transition) -> bool:
    """Whether a guard is evaluated by `_test`, which catches its errors, once in a selection."""
    guard = transition.guard
    return guard is not None and (
        can_fail(guard)
        or has_effect(guard)
        or (reads_event(guard) and payload_of(chart, transition) is None)
    )


def print_selection(out: Lines, chart: Chart, names: Names, name: str, event: int | None) -> bool:
    """Print the method that selects for an event, if anything in the chart looks at it."""
    groups = _by_leaf(chart, event) if has_regions(chart) else _by_state(chart, event)
    if not groups:
        return False
    what = "which eventless transitions to take"
    if event is not None:
        what = f"which transitions `{chart.events[event].name}` enables"
    with out.method(name, f"Return {what}.", result="int"):
        out.line("active = self._active")
        if has_regions(chart):
            out.line("self._seen = self._chosen = 0")
            for states, steps in groups:
                with out.suite(f"if active & {mask(names, states)}:"):
                    _print_offers(out, chart, names, steps)
            out.line("return self._chosen")
        else:
            for states, steps in groups:
                with out.suite(f"if active & {mask(names, states)}:"):
                    _print_returns(out, chart, names, steps)
            out.line("return 0")
    return True


Groups = list[tuple[list[int], tuple[Step, ...]]]


def _by_leaf(chart: Chart, event: int | None) -> Groups:
    """Return what is tried from each atomic state outward, alike neighbours together."""
    groups: Groups = []
    for state in chart.states:
        steps = chain(chart, state.index, event) if state.is_leaf else ()
        if groups and groups[-1][1] == steps:
            groups[-1][0].append(state.index)
        elif steps:
            groups.append(([state.index], steps))
    return groups


def _by_state(chart: Chart, event: int | None) -> Groups:
    """Return what each state tries, inner ones before outer ones: only one path is active."""
    groups: Groups = []

    def visit(state: int) -> None:
        for child in chart.states[state].children:
            visit(child)
        if steps := own(chart, state, event):
            groups.append(([state], steps))

    visit(0)
    return groups


def _print_offers(out: Lines, chart: Chart, names: Names, steps: tuple[Step, ...]) -> None:
    word = "if"
    for step in steps:
        test = None if step is None else step.guard and guard_text(chart, names, step)
        if test is not None:
            out.line(f"{word} {test}:")
        elif word == "elif":
            out.line("else:")
        depth = "    " if test is not None or word == "elif" else ""
        if step is None:
            out.line(f"{depth}self._is_deferred = True")
        else:
            out.line(f"{depth}self._offer({step.index})")
        word = "elif"


def _print_returns(out: Lines, chart: Chart, names: Names, steps: tuple[Step, ...]) -> None:
    for step in steps:
        if step is None:
            out.line("self._is_deferred = True")
        elif step.guard is None:
            out.line(f"return {bit(step.index)}  # {names.transitions[step.index]}")
        else:
            with out.suite(f"if {guard_text(chart, names, step)}:"):
                out.line(f"return {bit(step.index)}  # {names.transitions[step.index]}")
    if steps[-1] is None:
        out.line("return 0")


def bit(index: int) -> str:
    """Return one bit as text, which stays short where the number does not."""
    return f"{1 << index:#x}" if index < 64 else f"1 << {index}"


def mask(names: Names, states: Iterable[int]) -> str:
    """Return a set of states as text."""
    members = sorted(states)
    if not members:
        return "0"
    if len(members) > 5:
        return f"{sum(1 << state for state in members):#x}"
    text = " | ".join(names.states[state] for state in members)
    return text if len(members) == 1 else f"({text})"
