"""Fold copies of used charts into boxes with their entry and exit points."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Chart, CopyOf, Invocation, State, Transition
from fsmkit.document.document import Kind, Trigger

ALL = "all"
"""Name that selects all copies in the list of those that are not folded."""


def folded(
    chart: Chart, unfolded: Collection[str] = (), active: frozenset[int] = frozenset()
) -> tuple[Chart, frozenset[int]]:
    """Return a chart to be drawn, in which copies hold only their entry and exit points.

    Args:
        chart: The chart; it is drawn, and no machine runs the result.
        unfolded: The copies that stay as they are, by name, or `ALL`. Copies around one that is
            named are not folded either.
        active: The active states, which become those that are left and, of a folded copy, a line.

    """
    kept = [copy for copy in chart.copies if not _stays(copy, unfolded)]
    outer = [
        copy
        for copy in kept
        if not any(chart.is_descendant(copy.state, other.state) for other in kept)
    ]
    if not outer:
        return chart, active
    folding = _Folding(chart, outer, active)
    return folding.chart_of(), folding.active_of()


def _stays(copy: CopyOf, unfolded: Collection[str]) -> bool:
    return ALL in unfolded or any(
        name == copy.name or name.startswith(f"{copy.name}.") for name in unfolded
    )


@dataclass
class _Folding:
    chart: Chart
    copies: list[CopyOf]
    active: frozenset[int]

    def __post_init__(self) -> None:
        """Give each state that is left its number, entry points of a copy before its exits."""
        self.copy_at = {copy.state: copy for copy in self.copies}
        self.number: dict[int, int] = {}
        self.point: dict[tuple[int, str], int] = {}
        self.order: list[tuple[int, str]] = []
        hidden = {
            state
            for copy in self.copies
            for state in range(copy.state + 1, self.chart.states[copy.state].last_descendant + 1)
            if state not in copy.exits
        }
        for state in self.chart.states:
            if state.index in hidden:
                continue
            self.number[state.index] = len(self.order)
            self.order.append((state.index, ""))
            copy = self.copy_at.get(state.index)
            for name, _ in () if copy is None else copy.entries:
                self.point[state.index, name] = len(self.order)
                self.order.append((state.index, name))

    def chart_of(self) -> Chart:
        """Return the chart that is drawn."""
        transitions = self._transitions()
        by_source: dict[int, list[int]] = {}
        initial: dict[int, int] = {}
        for transition in transitions:
            if transition.trigger is Trigger.INITIAL:
                initial[transition.source] = transition.index
            else:
                by_source.setdefault(transition.source, []).append(transition.index)
        states = tuple(
            replace(
                made,
                transitions=tuple(by_source.get(made.index, ())),
                initial=initial.get(made.index),
            )
            for made in self._states()
        )
        copies = tuple(self._described(copy) for copy in self.copies)
        others = [c for c in self.chart.copies if c.state in self.number and c not in self.copies]
        kept = tuple(replace(c, state=self.number[c.state], is_folded=False) for c in others)
        return replace(
            self.chart, states=states, transitions=transitions, copies=(*copies, *kept),
            invocations=self._invocations(),
        )  # fmt: skip

    def active_of(self) -> frozenset[int]:
        """Return the active states that are left."""
        return frozenset(self.number[state] for state in self.active if state in self.number)

    def _invocations(self) -> tuple[Invocation, ...]:
        return tuple(
            replace(one, state=self.number[one.state])
            for one in self.chart.invocations
            if one.state in self.number
        )

    def _described(self, copy: CopyOf) -> CopyOf:
        """Return the description of a folded copy, with the path of its active states."""
        inside = range(copy.state + 1, self.chart.states[copy.state].last_descendant + 1)
        leaves = [s for s in inside if s in self.active and self.chart.states[s].is_leaf]
        path = ", ".join(self.chart.states[s].id.removeprefix(f"{copy.name}.") for s in leaves)
        return replace(
            copy,
            state=self.number[copy.state],
            entries=tuple((name, (self.point[copy.state, name],)) for name, _ in copy.entries),
            exits=tuple(self.number[state] for state in copy.exits),
            is_folded=True,
            path=path,
            count=sum(not self.chart.states[s].is_history for s in inside if s not in copy.exits),
        )

    def _states(self) -> Iterator[State]:
        for index, (old, point) in enumerate(self.order):
            state = self.chart.states[old]
            if point:
                parent = self.number[old]
                name = f"{state.id}.{point}"
                yield State(
                    index, name, Kind.ATOMIC, parent, (), None, (), (), (), state.depth + 1, index,
                    state.span, origin=state.origin,
                )  # fmt: skip
                continue
            inside = [
                number
                for place, number in self.number.items()
                if place != old and self.chart.is_descendant(place, old)
            ]
            children = [self.number[child] for child in state.children if child in self.number]
            kind = state.kind
            if (copy := self.copy_at.get(old)) is not None:
                points = [self.point[old, name] for name, _ in copy.entries]
                children = [*points, *(self.number[e] for e in copy.exits)]
                inside += points
                kind = Kind.COMPOUND if children else Kind.ATOMIC
            else:
                inside += [
                    n for (s, _), n in self.point.items() if self.chart.is_descendant(s, old)
                ]
            yield replace(
                state,
                index=index,
                kind=kind,
                parent=None if state.parent is None else self._parent(state),
                children=tuple(children),
                last_descendant=max(inside, default=index),
            )

    def _parent(self, state: State) -> int:
        assert state.parent is not None  # noqa: S101  (never called for the root)
        return self.number[state.parent]

    def _transitions(self) -> tuple[Transition, ...]:
        found: list[Transition] = []
        for transition in self.chart.transitions:
            source = transition.source
            if source not in self.number:
                continue
            if source in self.copy_at and transition.trigger is Trigger.INITIAL:
                continue
            targets = self._targets(transition.targets)
            made = replace(
                transition, index=len(found), source=self.number[source], targets=targets
            )
            found.append(made)
        return tuple(found)

    def _targets(self, targets: tuple[int, ...]) -> tuple[int, ...]:
        """Return the ends of an arrow; a hidden target becomes an entry point or the copy."""
        found: list[int] = []
        for target in targets:
            if target in self.number:
                found.append(self.number[target])
                continue
            copy = next(c for c in self.copies if self.chart.is_descendant(target, c.state))
            name = next(
                (
                    n
                    for n, entered in copy.entries
                    if target in entered and set(entered) <= {*targets}
                ),
                None,
            )
            at = self.number[copy.state] if name is None else self.point[copy.state, name]
            found.append(at)
        return tuple(dict.fromkeys(found))


def point_of(chart: Chart, state: State) -> str:
    """Return ``entry`` or ``exit`` for a point of a folded copy, nothing for all else."""
    for copy in chart.copies:
        if copy.is_folded and copy.state == state.parent:
            return "exit" if state.index in copy.exits else "entry"
    return ""


def title_of(chart: Chart, state: State) -> str:
    """Return the title of a state: of one that a chart fills, with the name of that."""
    for copy in chart.copies:
        if copy.state == state.index:
            return f"{state.id}: {copy.chart}"
    if point_of(chart, state):
        return state.id.rpartition(".")[2]
    return state.id
