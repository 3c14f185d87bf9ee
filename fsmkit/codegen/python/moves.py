"""What taking a transition leaves and enters, decided now as far as histories allow.

Appendix D's computeEntrySet is carried out once for each way in which the histories that it meets
may be recorded or not; only that, and what they hold, is left to be asked at run time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from fsmkit.model.chart import Chart, Transition
from fsmkit.model.document import Kind
from fsmkit.model.structure import is_internal, lcca


@dataclass(frozen=True, slots=True)
class Entry:
    """States to enter, default transitions whose content to run, recorded histories to restore."""

    states: frozenset[int]
    defaults: frozenset[int]
    restored: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Recorded:
    """What to do if a history has a recorded value, and if it has none."""

    history: int
    then: Decision
    otherwise: Decision


Decision = Entry | Recorded
Known = dict[int, bool]
"""Of the histories already asked: whether they have a recorded value."""


class Undecided(Exception):  # noqa: N818  (control flow of this module)
    """The computation met a history that nobody has asked yet."""

    def __init__(self, history: int) -> None:
        """Keep which."""
        self.history = history


def decide(compute: Callable[[Known], Entry], known: Known) -> Decision:
    """Return what a computation gives, branching on each history that it has to ask."""
    try:
        return compute(known)
    except Undecided as met:
        return Recorded(
            met.history,
            decide(compute, known | {met.history: True}),
            decide(compute, known | {met.history: False}),
        )


@dataclass
class _Set:
    """What computeEntrySet collects."""

    chart: Chart
    known: Known
    states: set[int] = field(default_factory=set)
    default_entry: set[int] = field(default_factory=set)
    history_content: dict[int, int] = field(default_factory=dict)
    """Default transitions of histories by the parent of the history."""
    restored: list[int] = field(default_factory=list)

    def entry(self) -> Entry:
        """Return the outcome."""
        taken = {self._default(state).index for state in self.default_entry}
        taken |= set(self.history_content.values())
        with_content = {index for index in taken if self.chart.transitions[index].content}
        return Entry(frozenset(self.states - {0}), frozenset(with_content), tuple(self.restored))

    def add(self, index: int) -> None:
        """Appendix D, addDescendantStatesToEnter."""
        state = self.chart.states[index]
        if state.is_history:
            self._add_history(index)
            return
        self.states.add(index)
        if state.kind is Kind.COMPOUND:
            self.default_entry.add(index)
            self._add_all(self._default(index).targets, index)
        elif state.kind is Kind.PARALLEL:
            self._add_regions(index)

    def add_ancestors(self, state: int, limit: int) -> None:
        """Appendix D, addAncestorStatesToEnter."""
        ancestors = self.chart.ancestors(state)
        if limit not in ancestors:
            return
        for index in ancestors[: ancestors.index(limit)]:
            self.states.add(index)
            if self.chart.states[index].kind is Kind.PARALLEL:
                self._add_regions(index)

    def effective(self, targets: Iterable[int]) -> list[int]:
        """Return the targets without histories; for a recorded one, a child of its parent."""
        found: list[int] = []
        for target in targets:
            if not self.chart.states[target].is_history:
                found.append(target)
            elif self._is_recorded(target):
                found.append(target)  # its ancestors are those of what it holds, from its parent on
            else:
                found += self.effective(self._default(target).targets)
        return found

    def _add_history(self, history: int) -> None:
        parent = self.chart.states[history].parent
        assert parent is not None  # noqa: S101
        if self._is_recorded(history):
            if self.chart.states[parent].kind is Kind.PARALLEL and self._is_shallow(history):
                self._add_all(real_children(self.chart, parent), parent)
            elif history not in self.restored:
                self.restored.append(history)
        else:
            default = self._default(history)
            self.history_content[parent] = default.index
            self._add_all(default.targets, parent)

    def _is_shallow(self, history: int) -> bool:
        return self.chart.states[history].kind is Kind.SHALLOW_HISTORY

    def _is_recorded(self, history: int) -> bool:
        if history not in self.known:
            raise Undecided(history)
        return self.known[history]

    def _add_all(self, targets: Iterable[int], ancestor: int) -> None:
        targets = tuple(targets)
        for target in targets:
            self.add(target)
        for target in targets:
            self.add_ancestors(target, ancestor)

    def _add_regions(self, parallel: int) -> None:
        holds_all = any(self.chart.states[h].parent == parallel for h in self.restored)
        for child in () if holds_all else real_children(self.chart, parallel):
            if not self._reaches_below(child):
                self.add(child)

    def _reaches_below(self, state: int) -> bool:
        below = self.chart.is_descendant
        return any(below(other, state) for other in (*self.states, *self.restored))

    def _default(self, state: int) -> Transition:
        initial = self.chart.states[state].initial
        assert initial is not None  # noqa: S101
        return self.chart.transitions[initial]


def entry_of(chart: Chart, targets: tuple[int, ...], domain: int) -> Decision:
    """Return what a transition with these targets and this domain enters (computeEntrySet)."""

    def compute(known: Known) -> Entry:
        found = _Set(chart, known)
        for target in targets:
            found.add(target)
        for target in found.effective(targets):
            found.add_ancestors(target, domain)
        return found.entry()

    return decide(compute, {})


def default_entry(chart: Chart, state: int) -> Decision:
    """Return what entering a state by default enters, the state itself included."""

    def compute(known: Known) -> Entry:
        found = _Set(chart, known)
        found.add(state)
        return found.entry()

    return decide(compute, {})


def static_domain(chart: Chart, transition: Transition) -> int | None:
    """Return the domain of a transition with targets if histories cannot change it, else None."""
    source = transition.source
    for target in transition.targets:
        parent = chart.states[target].parent
        assert parent is not None  # noqa: S101
        if chart.states[target].is_history and chart.is_descendant(source, parent):
            return None
    # what a history stands for lies below its parent, as the history itself does
    if is_internal(chart, transition):
        return source
    return lcca(chart, (source, *transition.targets))


def possible_domains(chart: Chart, transition: Transition) -> tuple[int, ...]:
    """Return the compound states that can be the domain, innermost first, the root last."""
    own = (transition.source,) if transition.internal else ()
    chain = (*own, *chart.ancestors(transition.source))
    return tuple(s for s in chain if s == 0 or chart.states[s].kind is Kind.COMPOUND)


def effective_defaults(chart: Chart, history: int) -> frozenset[int]:
    """Return what the default of a history leads to, other histories by their defaults."""
    initial = chart.states[history].initial
    assert initial is not None  # noqa: S101
    found: set[int] = set()
    for target in chart.transitions[initial].targets:
        found |= effective_defaults(chart, target) if chart.states[target].is_history else {target}
    return frozenset(found)


def real_children(chart: Chart, state: int) -> tuple[int, ...]:
    """Return the children without histories (getChildStates)."""
    return tuple(c for c in chart.states[state].children if not chart.states[c].is_history)


def real_below(chart: Chart, state: int) -> tuple[int, ...]:
    """Return the descendants without histories."""
    last = chart.states[state].last_descendant
    return tuple(s for s in range(state + 1, last + 1) if not chart.states[s].is_history)
