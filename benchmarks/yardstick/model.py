"""An interpreter of the charts by the rules of SCXML, and the digests of its runs."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from benchmarks.yardstick.charts import Chart, Content, Transition

FNV_OFFSET = 2166136261
FNV_PRIME = 16777619
MASK = 0xFFFFFFFF

Function = Callable[..., Any]


@dataclass(frozen=True, slots=True)
class Digests:
    """The expected digests of a run, eight hexadecimal digits each."""

    work: str
    """All variables at the end, the counters of entries and exits among them."""
    path: str
    """The variable ``n`` after each event."""
    order: str
    """The sequence of entries and exits that have content."""


def mix(digest: int, value: int) -> int:
    """Return an FNV-1a digest, by words of 32 bits, with one more value modulo 2^32."""
    return ((digest ^ (value & MASK)) * FNV_PRIME) & MASK


def digest(values: Iterable[int]) -> str:
    """Return the FNV-1a digest of values."""
    found = FNV_OFFSET
    for value in values:
        found = mix(found, value)
    return f"{found:08x}"


class Work:
    """The variables of a chart, with its guards and contents as functions over them."""

    def __init__(self, chart: Chart) -> None:
        self.data = SimpleNamespace(**chart.variables)

    def values(self) -> list[int]:
        """Return all variables in the order of the digests."""
        return list(vars(self.data).values())

    def function(self, body: str) -> Function:
        """Return a function over the variables; it ignores its arguments."""
        scope: dict[str, Any] = {"data": self.data}
        exec(f"def function(*ignored):\n    {body}", scope)  # noqa: S102  (text of the yardstick)
        found: Function = scope["function"]
        return found

    def guard(self, text: str | None) -> Function | None:
        """Return a guard as a function."""
        return None if text is None else self.function(f"return {_qualified(text)}")

    def content(self, assignments: Content) -> Function | None:
        """Return a content as a function; None if it is empty."""
        if not assignments:
            return None
        lines = (f"data.{name} = {_qualified(text)}" for name, text in assignments)
        return self.function("; ".join(lines))


def _qualified(text: str) -> str:
    """Return an expression over the attributes of ``data``."""
    return re.sub(r"\b[a-z]\w*\b", lambda name: f"data.{name[0]}", text)


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    """A transition with its functions."""

    transition: Transition
    guard: Function | None
    content: Function | None
    domain: str | None
    inside: frozenset[int]
    """The states within the domain, which the transition exits where they are active."""


class Model:
    """A running chart. States are numbers in document order.

    Enabled transitions of different regions must not exit the same states: there is no preemption.
    """

    def __init__(self, chart: Chart) -> None:
        self.chart = chart
        self.order = 0
        self._work = Work(chart)
        self._names = tuple(chart.states)
        self._numbers = {name: number for number, name in enumerate(self._names)}
        states = chart.states.values()
        self._entries = [self._work.content(state.entry) for state in states]
        self._exits = [self._work.content(state.exit) for state in states]
        steps = {t: self._step(t) for state in states for t in state.transitions}
        self._steps: dict[tuple[int, str], list[_Step]] = {}
        for state in states:
            if not state.children:
                for outer in chart.path(state.name):
                    for t in chart.states[outer].transitions:
                        key = self._numbers[state.name], t.event
                        self._steps.setdefault(key, []).append(steps[t])
        self._recorded = {name: history.default for name, history in chart.histories.items()}
        self._closures: dict[tuple[tuple[str, ...], str | None], frozenset[int]] = {}
        self._active: list[int] = []
        self._enter(self._closure((chart.initial,), None))

    def leaf(self) -> str:
        """Return the active state without children that is last in document order."""
        return self._names[self._active[-1]]

    def values(self) -> list[int]:
        """Return all variables in the order of the digests."""
        return self._work.values()

    def n(self) -> int:
        """Return the variable ``n``."""
        found: int = self._work.data.n
        return found

    def process(self, event: str) -> None:
        """Take the transitions that an event enables."""
        enabled = self._enabled(event)
        moves = [step for step in enabled if step.inside]
        if moves:
            self._exit({state for step in moves for state in step.inside})
        for step in enabled:
            if step.content is not None:
                step.content()
        if moves:
            self._enter({state for step in moves for state in self._entered(step)})

    def _enabled(self, event: str) -> list[_Step]:
        """Return the first transition of each active leaf whose guard holds, inner ones first."""
        enabled: list[_Step] = []
        for leaf in self._active:
            for step in self._steps.get((leaf, event), ()):
                if step.guard is None or step.guard():
                    if step not in enabled:
                        enabled.append(step)
                    break
        return enabled

    def _exit(self, states: set[int]) -> None:
        exited = [state for state in self._active if state in states]
        for name, history in self.chart.histories.items():
            if self._numbers[history.parent] in exited:
                self._recorded[name] = tuple(
                    self._names[state]
                    for state in exited
                    if self._is_leaf_below(state, history.parent)
                )
        for state in reversed(exited):
            content = self._exits[state]
            if content is not None:
                content()
                self.order = (self.order * 31 + 2 * state + 1) & MASK
        self._active = [state for state in self._active if state not in states]

    def _enter(self, states: Iterable[int]) -> None:
        for state in sorted(states):
            content = self._entries[state]
            if content is not None:
                content()
                self.order = (self.order * 31 + 2 * state) & MASK
        self._active = sorted({*self._active, *states})

    def _step(self, transition: Transition) -> _Step:
        domain = self._domain(transition)
        inside = (
            number for name, number in self._numbers.items()
            if transition.target and (domain is None or domain in self.chart.path(name)[1:])
        )  # fmt: skip
        guard, content = self._work.guard(transition.guard), self._work.content(transition.content)
        return _Step(transition, guard, content, domain, frozenset(inside))

    def _domain(self, transition: Transition) -> str | None:
        """Return the innermost compound ancestor of source and target; None for the chart."""
        if transition.target is None:
            return None
        history = self.chart.histories.get(transition.target)
        target = history.parent if history else transition.target
        for name in self.chart.path(transition.source)[1:]:
            if not self.chart.states[name].is_parallel and name in self.chart.path(target)[1:]:
                return name
        return None

    def _entered(self, step: _Step) -> frozenset[int]:
        target = step.transition.target
        assert target is not None
        return self._closure(self._recorded.get(target, (target,)), step.domain)

    def _closure(self, targets: tuple[str, ...], domain: str | None) -> frozenset[int]:
        """Return targets, their ancestors within a domain, and the defaults that complete them."""
        key = targets, domain
        if key not in self._closures:
            found: set[str] = set()
            for target in targets:
                for name in self.chart.path(target):
                    if name == domain:
                        break
                    found.add(name)
            for name in self._names:
                state = self.chart.states[name]
                if state.is_parallel and name in found:
                    found.update(state.children)
                elif state.initial and name in found and found.isdisjoint(state.children):
                    found.add(state.initial)
            self._closures[key] = frozenset(self._numbers[name] for name in found)
        return self._closures[key]

    def _is_leaf_below(self, state: int, ancestor: str) -> bool:
        name = self._names[state]
        return not self.chart.states[name].children and ancestor in self.chart.path(name)
