"""Which transitions an event enables, as straight code (Appendix D, selectTransitions)."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable

from fsmkit.chart.analysis.effects import can_fail, has_effect, reads_event
from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.forms import form
from fsmkit.chart.structure import shared_deferral
from fsmkit.codegen.python.expressions import Printer
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import ME
from fsmkit.codegen.python.names import Names
from fsmkit.document.document import Kind, Trigger
from fsmkit.plan.features import payload_of

Step = Transition | None
"""A transition to try, or None: the search ends here because the state defers the event."""
Groups = list[tuple[list[int], tuple[Step, ...]]]
"""States, and what is tried in each of them."""


def has_regions(chart: Chart) -> bool:
    """Whether several atomic states can be active at once."""
    return any(state.kind is Kind.PARALLEL for state in chart.states)


class Offers:
    """What each state tries for each event, found in one pass over the transitions."""

    def __init__(self, chart: Chart) -> None:
        """Look at every transition once."""
        self._chart = chart
        self._own: dict[int | None, dict[int, list[Step]]] = {}
        self._shared = shared_deferral(chart)
        for state in chart.states:
            for number in state.transitions:
                self._add(chart.transitions[number])
            for event in state.defer:
                if event not in self._shared[state.index]:
                    self._steps(event, state.index).append(None)
        order = _inner_first(chart)
        self._place = {state: place for place, state in enumerate(order)}
        self._leaves = [state.index for state in chart.states if state.is_leaf]

    def _steps(self, event: int | None, state: int) -> list[Step]:
        return self._own.setdefault(event, {}).setdefault(state, [])

    def _add(self, transition: Transition) -> None:
        is_eventless = transition.trigger is Trigger.EVENTLESS
        is_event = transition.trigger is Trigger.EVENT
        for event in (None,) if is_eventless else transition.events if is_event else ():
            self._steps(event, transition.source).append(transition)

    def deferring(self, event: int) -> list[tuple[int, list[int]]]:
        """Return the states that defer an event which regions below them may answer instead.

        With the transitions on it that begin there or below.
        """
        states = [s for s, events in enumerate(self._shared) if event in events]
        if not states:
            return []
        taken = [t for t in self._chart.transitions if event in t.events]
        return [
            (
                state,
                [t.index for t in taken if state <= t.source <= self._last(state)],
            )
            for state in states
        ]

    def is_deferred(self, event: int) -> bool:
        """Whether any state defers an event."""
        return any(event in state.defer for state in self._chart.states)

    def _last(self, state: int) -> int:
        return self._chart.states[state].last_descendant

    def own(self, state: int, event: int | None) -> tuple[Step, ...]:
        """Return what one state tries, up to what is sure to be taken.

        For no event, its eventless transitions.
        """
        found: list[Step] = []
        for step in self._own.get(event, {}).get(state, ()):
            found.append(step)
            if _is_sure(step):
                break
        return tuple(found)

    def by_state(self, event: int | None) -> Groups:
        """Return what each state tries, inner ones before outer ones: only one path is active."""
        states = sorted(self._own.get(event, ()), key=self._place.__getitem__)
        return [([state], self.own(state, event)) for state in states]

    def by_leaf(self, event: int | None) -> Groups:
        """Return what is tried from each atomic state outward, alike neighbours together."""
        groups: Groups = []
        for leaf in self._leaves_below(self._own.get(event, ())):
            steps = self._chain(leaf, event)
            if groups and groups[-1][1] == steps:
                groups[-1][0].append(leaf)
            else:
                groups.append(([leaf], steps))
        return groups

    def _leaves_below(self, states: Iterable[int]) -> list[int]:
        """Return the atomic states that are among some states or below them, in document order."""
        found: list[int] = []
        end = 0
        for state in sorted(states):
            last = self._chart.states[state].last_descendant
            first = bisect_left(self._leaves, max(state, end))
            end = max(end, last + 1)
            found += self._leaves[first : bisect_left(self._leaves, end)]
        return found

    def _chain(self, leaf: int, event: int | None) -> tuple[Step, ...]:
        """Return what is tried from an atomic state outward, up to what is sure to be taken."""
        found: list[Step] = []
        for state in (leaf, *self._chart.ancestors(leaf)):
            found += self.own(state, event)
            if found and _is_sure(found[-1]):
                break
        return tuple(found)


def _is_sure(step: Step) -> bool:
    return step is None or step.guard is None


def _inner_first(chart: Chart) -> list[int]:
    """Return all states, each after those below it, otherwise in document order."""
    order: list[int] = []
    open_: list[int] = []
    for state in chart.states:
        while open_ and not chart.is_descendant(state.index, open_[-1]):
            order.append(open_.pop())
        open_.append(state.index)
    return [*order, *reversed(open_)]


def guard_text(chart: Chart, names: Names, transition: Transition) -> str:
    """Return the guard of a transition as it stands in a selection."""
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
    """Whether a guard is evaluated by `_test`, which catches its errors, once in a selection."""
    guard = transition.guard
    return guard is not None and (
        can_fail(guard)
        or has_effect(guard)
        or (reads_event(guard) and payload_of(chart, transition) is None)
    )


def print_selection(
    out: Lines, chart: Chart, names: Names, offers: Offers, name: str, event: int | None
) -> bool:
    """Print the method that selects for an event, if anything in the chart looks at it."""
    groups = offers.by_leaf(event) if has_regions(chart) else offers.by_state(event)
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
            for states, steps in groups:
                with out.suite(f"if active & {mask(names, states)}:"):
                    _print_offers(out, chart, names, steps)
            out.line(f"return {ME}_chosen")
        else:
            for states, steps in groups:
                with out.suite(f"if active & {mask(names, states)}:"):
                    _print_returns(out, chart, names, steps)
            out.line("return 0")
    return True


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
            out.line(f"{depth}{ME}_is_deferred = True")
        else:
            out.line(f"{depth}{ME}_offer({step.index})")
        word = "elif"


def _print_returns(out: Lines, chart: Chart, names: Names, steps: tuple[Step, ...]) -> None:
    for step in steps:
        if step is None:
            out.line(f"{ME}_is_deferred = True")
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


def bits(number: int) -> str:
    """Return a set of bits as text that is only as long as they lie apart."""
    lowest = (number & -number).bit_length() - 1
    return f"{number:#x}" if lowest < 64 else f"({number >> lowest:#x} << {lowest})"


def decimal(number: int) -> str:
    """Return a number as text, a large one as a set of bits."""
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
