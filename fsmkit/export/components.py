"""What a local state is made of: where its regions are, what its variables hold, its timers.

A notation with variables says a local state by its components, so that a move names what it changes
and nothing else. With a number for the whole it would need a move for each value of all the rest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.export.identifiers import word
from fsmkit.export.local_states import ARMED_FIRST, Fact, Key, facts_of
from fsmkit.runtime.interpreter.snapshot import Snapshot

Code = tuple[int, ...]
"""A local state: a number for each component."""
NUMBERS = frozenset(map(str, range(256)))
"""Values that stand for themselves."""
TRUTH = ["false", "true"]


@dataclass(frozen=True, slots=True)
class Component:
    """A part of local states. ``texts`` says what its numbers mean, ``words`` in identifiers.

    ``plain``: the word is the number itself, or ``true`` or ``false``.
    """

    name: str
    texts: Mapping[int, str]
    words: Mapping[int, str]
    plain: bool

    def note(self, number: int) -> str:
        """Return what a number means, if its word does not tell."""
        text = self.texts[number]
        return "" if text.replace(" ", "_") == self.words[number] else text


ABSENT = Fact((-1, 0), "none")
"""A region that is not active, a timer that is not armed."""


def components_of(
    chart: Chart, snapshots: Sequence[Snapshot], *, untimed: bool
) -> tuple[tuple[Component, ...], tuple[Code, ...]]:
    """Return the components in which local states differ, and each local state by them."""
    found = [dict(facts_of(chart, snapshot, untimed=untimed)) for snapshot in snapshots]
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
