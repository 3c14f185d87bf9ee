"""What a local state is made of: where its regions are, what its variables hold, its timers.

A notation with variables says a local state by its components, so that a move names what it changes
and nothing else. With a number for the whole it would need a move for each value of all the rest.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fsmkit.chart.chart import OPEN_ENDED, Chart
from fsmkit.document.document import Kind
from fsmkit.export.identifiers import word
from fsmkit.export.local_states import timer_text
from fsmkit.language.values import show
from fsmkit.runtime.interpreter.snapshot import Delayed, Snapshot, Timeout
from fsmkit.verify.report.counterexample import occurrence_text

Code = tuple[int, ...]
"""A local state: a number for each component."""
NUMBERS = frozenset(map(str, range(256)))
"""Values that stand for themselves."""
TRUTH = ["false", "true"]
Key = tuple[str, object]
"""A component: its name, and what tells it from others of that name."""
ARMED_FIRST: Key = ("armed_first", None)
"""The order in which timers were armed: a component only where the others do not tell it."""


@dataclass(frozen=True, slots=True)
class Component:
    """A part of local states. ``texts`` says what its numbers mean, ``words`` in identifiers.

    ``plain``: the word is the number itself, or ``true`` or ``false``.
    """

    name: str
    texts: Mapping[int, str]
    words: Mapping[int, str]
    plain: bool

    @property
    def is_truth(self) -> bool:
        """Whether its values are false and true, 0 and 1."""
        return list(self.texts.values()) == TRUTH

    def note(self, number: int) -> str:
        """Return what a number means, if its word does not tell."""
        text = self.texts[number]
        return "" if text.replace(" ", "_") == self.words[number] else text


@dataclass(frozen=True, slots=True)
class Fact:
    """A component in one local state. ``rank`` orders its values."""

    rank: tuple[int, float | str]
    text: str


ABSENT = Fact((-1, 0), "none")
"""A region that is not active, a timer that is not armed."""


def components_of(
    chart: Chart, snapshots: Sequence[Snapshot], *, untimed: bool
) -> tuple[tuple[Component, ...], tuple[Code, ...]]:
    """Return the components in which local states differ, and each local state by them."""
    found = [dict(_facts(chart, snapshot, untimed=untimed)) for snapshot in snapshots]
    columns: dict[Key, list[Fact]] = {}
    for key in dict.fromkeys(key for facts in found for key in facts):
        column = [facts.get(key, ABSENT) for facts in found]
        if len(set(column)) > 1:
            columns[key] = column
    others = [column for key, column in columns.items() if key != ARMED_FIRST]
    if len(set(zip(*others, strict=True))) == len(snapshots):
        columns.pop(ARMED_FIRST, None)
    numbered = [_numbered(key[0], column) for key, column in columns.items()]
    codes = list(zip(*(numbers for _, numbers in numbered), strict=True)) if numbered else [()]
    if len(set(codes)) < len(snapshots):
        raise AssertionError("two local states have the same components")
    return tuple(component for component, _ in numbered), tuple(codes)


def _numbered(name: str, column: Sequence[Fact]) -> tuple[Component, list[int]]:
    """Return a component, and its number in each local state; whole numbers by themselves."""
    values = sorted(set(column), key=lambda fact: fact.rank)
    texts = [fact.text for fact in values]
    if set(texts) <= NUMBERS and len(set(texts)) == len(texts):
        numbers = {fact: int(fact.text) for fact in values}
        plain = True
    else:
        numbers = {fact: number for number, fact in enumerate(values)}
        plain = texts == TRUTH
    words: dict[str, None] = {}
    for text in texts:
        chosen = text if plain else word(text)
        while chosen in words:
            chosen += "_"
        words[chosen] = None
    meaning = dict(zip(numbers.values(), texts, strict=True))
    names = dict(zip(numbers.values(), words, strict=True))
    return Component(name, meaning, names, plain), [numbers[fact] for fact in column]


# --- what there is -------------------------------------------------------------------------------


def _facts(chart: Chart, snapshot: Snapshot, *, untimed: bool) -> Iterator[tuple[Key, Fact]]:
    if not snapshot.running:
        why = Fact((0, snapshot.fault or ""), snapshot.fault or "finished")
        yield ("stopped", None), why
    yield from _regions(chart, snapshot)
    tick = chart.capacities.tick
    declared = (*chart.data, *chart.outputs, *chart.inputs)
    for variable, value in zip(declared, (*snapshot.data, *snapshot.inputs), strict=True):
        rank = value if isinstance(value, int | float) else repr(value)
        text = show(value, variable.type, tick)
        yield (variable.name, variable), Fact((isinstance(rank, str), rank), text)
    for state, past in snapshot.history:
        ids = "_".join(chart.states[s].id for s in sorted(past) if chart.states[s].is_leaf)
        yield ("past of " + chart.states[state].id, None), Fact((0, repr(sorted(past))), ids)
    yield from _timers(chart, snapshot, untimed=untimed)
    if snapshot.queue or snapshot.deferred:
        waiting = (snapshot.deferred, snapshot.queue)
        text = " then ".join(" ".join(occurrence_text(chart, o) for o in part) for part in waiting)
        yield ("waiting", None), Fact((0, repr(waiting)), text)
    for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True):
        if child is not None:
            yield (invocation.id + " runs", None), Fact((0, 0), "here")
            for (name, what), fact in _facts(invocation.chart, child, untimed=untimed):
                yield (invocation.id + " " + name, (invocation.id, what)), fact


def _regions(chart: Chart, snapshot: Snapshot) -> Iterator[tuple[Key, Fact]]:
    """Yield the state that each active region is in: a leaf, or one that is divided further."""
    for state in sorted(snapshot.configuration):
        parent = chart.states[state].parent
        if parent is not None and chart.states[parent].kind is not Kind.PARALLEL:
            continue
        inner = state
        while chart.states[inner].kind is not Kind.PARALLEL:
            active = [s for s in chart.states[inner].children if s in snapshot.configuration]
            if not active:
                break
            (inner,) = active
        name = "state" if parent is None else chart.states[state].id
        yield (name, state), Fact((0, inner), chart.states[inner].id)


def _timers(chart: Chart, snapshot: Snapshot, *, untimed: bool) -> Iterator[tuple[Key, Fact]]:
    """Yield when each timer is due, from now on (untimed: that it is armed), and their order."""
    order: list[Key] = []
    armed: list[Timeout | Delayed] = []
    for timer in snapshot.timers:
        alike = sum(what == timer.what for what in armed)
        armed.append(timer.what)
        key = timer_text(chart, timer), (timer.what, alike)
        left = timer.deadline - snapshot.now
        due = f"in {left}" if left < OPEN_ENDED else f"in {left - OPEN_ENDED} or later"
        yield key, Fact((0, left), "armed" if untimed else due)
        order.append(key)
    yield ARMED_FIRST, Fact((0, repr(order)), " ".join(name for name, _ in order) or "none")
