"""Compare two charts: what was added, removed, moved, changed and renamed.

Inheritance is resolved first, so a change of a base chart changes each chart that extends it. The
layout of a file, comments and the notation do not matter. A new name counts as a rename if the old
chart, with the name replaced throughout, differs less from the new one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

from fsmkit.chart.chart import Chart
from fsmkit.chart.differences.facts import (
    CHART,
    DECLARATIONS,
    Facts,
    Json,
    StateFacts,
    TransitionFacts,
    facts_of,
    renamed,
)
from fsmkit.language.units import duration_text

MOST_TRIED = 60
"""Pairs of names that are tried as renames."""
Kind = Literal["added", "removed", "moved", "changed", "renamed"]


@dataclass(frozen=True, slots=True)
class Detail:
    """A key with its old and its new value; None if it is missing there."""

    key: str
    old: Any
    new: Any


@dataclass(frozen=True, slots=True)
class Change:
    """One difference.

    ``what``: ``chart``, ``state``, ``transition``, or a kind of declaration. ``name``: its name in
    the new chart, or in the old one if it is removed there; a transition is its ends. ``old`` and
    ``new``: the numbers of the state or transition in both charts. ``old_at`` and ``new_at``: where
    it is written.
    """

    kind: Kind
    what: str
    name: str
    details: tuple[Detail, ...] = ()
    old: int | None = None
    new: int | None = None
    old_at: Json | None = None
    new_at: Json | None = None


def differences(old: Chart, new: Chart) -> tuple[Change, ...]:
    """Return what differs: first declarations, then states, then transitions."""
    before, after = facts_of(old), facts_of(new)
    renames: list[Change] = []
    changes = [*_compare(before, after)]
    for kind, one, other in _candidates(before, after):
        names = before.states if kind == "state" else before.declarations[kind]
        if one not in names or other in names:  # the name has its pair already
            continue
        tried = renamed(before, kind, one, other)
        found = [*_compare(tried, after)]
        if len(found) <= len(changes) - 2:
            renames.append(_rename(before, after, kind, one, other))
            before, changes = tried, found
    return (*renames, *changes)


def _rename(before: Facts, after: Facts, kind: str, old: str, new: str) -> Change:
    details = (Detail("name", old, new),)
    if kind == "state":
        one, other = before.states[old], after.states[new]
        return Change("renamed", "state", new, details, one.index, other.index, one.at, other.at)
    places = before.places.get((kind, old)), after.places.get((kind, new))
    return Change("renamed", DECLARATIONS[kind], new, details, None, None, *places)


def _candidates(before: Facts, after: Facts) -> Iterator[tuple[str, str, str]]:
    """Yield pairs of a removed and an added name that may be a rename, the likeliest first."""
    found: list[tuple[float, str, str, str]] = []
    for kind in DECLARATIONS:
        one, other = before.declarations[kind], after.declarations[kind]
        found += (
            (_distance([*one], a, [*other], b), kind, a, b)
            for a in one.keys() - other.keys()
            for b in other.keys() - one.keys()
        )
    states = before.states.keys() - after.states.keys(), after.states.keys() - before.states.keys()
    found += (
        (_distance([*before.states], a, [*after.states], b), "state", a, b)
        for a in states[0]
        for b in states[1]
        if before.states[a].keys["kind"] == after.states[b].keys["kind"]
    )
    yield from (each[1:] for each in sorted(found)[:MOST_TRIED])


def _distance(olds: Sequence[str], old: str, news: Sequence[str], new: str) -> float:
    """Return how unlikely a rename is: by the position in the list, then by the letters."""
    letters = len(set(old) ^ set(new)) / 100
    return abs(olds.index(old) - news.index(new)) + letters


def _compare(before: Facts, after: Facts) -> Iterator[Change]:
    if details := _details(before.own, after.own):
        yield Change("changed", "chart", str(after.own["name"]), details)
    for kind, what in DECLARATIONS.items():
        yield from _declarations(kind, what, before, after)
    yield from _states(before, after)
    yield from _transitions(before, after)


def _details(old: Mapping[str, Any], new: Mapping[str, Any]) -> tuple[Detail, ...]:
    keys = dict.fromkeys((*old, *new))
    return tuple(
        Detail(key, old.get(key), new.get(key)) for key in keys if old.get(key) != new.get(key)
    )


def _declarations(kind: str, what: str, before: Facts, after: Facts) -> Iterator[Change]:
    one, other = before.declarations[kind], after.declarations[kind]
    for name in dict.fromkeys((*one, *other)):
        places = before.places.get((kind, name)), after.places.get((kind, name))
        if name not in other:
            yield Change("removed", what, name, old_at=places[0])
        elif name not in one:
            yield Change("added", what, name, new_at=places[1])
        elif details := _details(one[name], other[name]):
            yield Change("changed", what, name, details, None, None, *places)


# --- states --------------------------------------------------------------------------------------


def _states(before: Facts, after: Facts) -> Iterator[Change]:
    for name, old in before.states.items():
        if name not in after.states:
            yield Change("removed", "state", name, _within(old), old=old.index, old_at=old.at)
    for name, new in after.states.items():
        old_one = before.states.get(name)
        if old_one is None:
            yield Change("added", "state", name, _within(new), new=new.index, new_at=new.at)
            continue
        ends = old_one.index, new.index, old_one.at, new.at
        if old_one.parent != new.parent:
            moved = Detail("parent", old_one.parent, new.parent)
            yield Change("moved", "state", name, (moved,), *ends)
        details = _details(old_one.keys, new.keys)
        if (orders := _orders(old_one.children, new.children)) is not None:
            details = (*details, Detail("order", *orders))
        if details:
            yield Change(
                "changed",
                "state" if name else "chart",
                name or str(after.own["name"]),
                details,
                *ends,
            )


def _within(state: StateFacts) -> tuple[Detail, ...]:
    return () if state.parent == CHART else (Detail("parent", state.parent, state.parent),)


def _orders(old: Sequence[str], new: Sequence[str]) -> tuple[list[str], list[str]] | None:
    """Return the orders of the states that both have, if these differ."""
    one = [name for name in old if name in new]
    other = [name for name in new if name in old]
    return None if one == other else (one, other)


# --- transitions ---------------------------------------------------------------------------------

_KEYS: tuple[tuple[str, ...], ...] = (
    ("source", "trigger", "descriptors", "delay_us", "targets"),
    ("source", "trigger", "descriptors", "delay_us", "guard"),
    ("source", "trigger", "descriptors"),
    ("source", "targets", "guard", "content"),
)
"""Keys that are equal in two versions of a transition, after all keys and the id; surest first."""


def _identities() -> Iterator[Callable[[TransitionFacts], object]]:
    """Yield functions whose equal results make two transitions one, the surest first."""
    yield lambda t: (t.source, _frozen(t.keys))
    yield lambda t: (t.source, t.keys["id"]) if t.keys["id"] else object()
    for names in _KEYS:
        yield lambda t, names=names: _frozen([{**t.keys, "source": t.source}[k] for k in names])  # type: ignore[misc]
    yield lambda t: _frozen(t.keys)


def _frozen(value: Any) -> object:
    match value:
        case dict():
            return tuple((k, _frozen(v)) for k, v in sorted(value.items()))
        case list():
            return tuple(map(_frozen, value))
        case _:
            return value


def _transitions(before: Facts, after: Facts) -> Iterator[Change]:
    pairs, gone, added = _matched(before.transitions, after.transitions)
    for each in gone:
        yield Change(
            "removed", "transition", title(each), _guard(each), old=each.index, old_at=each.at
        )
    for each in added:
        yield Change(
            "added", "transition", title(each), _guard(each), new=each.index, new_at=each.at
        )
    overtaken = _overtaken(pairs)
    for number, (one, other) in enumerate(pairs):
        ends = one.index, other.index, one.at, other.at
        details = _details(one.keys, other.keys)
        if one.source != other.source:
            details = (Detail("source", one.source, other.source), *details)
            yield Change("moved", "transition", title(other), details, *ends)
        elif details:
            yield Change("changed", "transition", title(other), details, *ends)
        elif number in overtaken:
            yield Change(
                "moved", "transition", title(other), (Detail("order", *overtaken[number]),), *ends
            )


def _matched(
    old: Iterable[TransitionFacts], new: Iterable[TransitionFacts]
) -> tuple[
    list[tuple[TransitionFacts, TransitionFacts]], list[TransitionFacts], list[TransitionFacts]
]:
    """Return pairs of one transition in both, those that are gone, and those that are added."""
    rest, others = [*old], [*new]
    pairs: list[tuple[TransitionFacts, TransitionFacts]] = []
    for key in _identities():
        known: dict[object, list[TransitionFacts]] = {}
        for each in others:
            known.setdefault(key(each), []).append(each)
        left = []
        for each in rest:
            if found := known.get(key(each)):
                pairs.append((each, found.pop(0)))
            else:
                left.append(each)
        rest, taken = left, {other.index for _, other in pairs}
        others = [each for each in others if each.index not in taken]
    pairs.sort(key=lambda pair: pair[1].index)
    return pairs, rest, others


def _overtaken(
    pairs: Sequence[tuple[TransitionFacts, TransitionFacts]],
) -> dict[int, tuple[int, int]]:
    """Return the transitions that another of their state is tried before now, with positions."""
    found: dict[int, tuple[int, int]] = {}
    by_source: dict[str, list[int]] = {}
    for number, (one, other) in enumerate(pairs):
        if one.source == other.source:
            by_source.setdefault(one.source, []).append(number)
    for numbers in by_source.values():
        old_order = sorted(numbers, key=lambda n: pairs[n][0].index)
        if all(a < b for a, b in pairwise(old_order)):
            continue
        stay = _longest_rising(old_order)
        for position, number in enumerate(numbers):
            if number not in stay:
                found[number] = old_order.index(number) + 1, position + 1
    return found


def _longest_rising(values: Sequence[int]) -> set[int]:
    """Return the members of a longest rising part of a sequence."""
    best: list[list[int]] = []
    for value in values:
        before: list[int] = max((run for run in best if run[-1] < value), key=len, default=[])
        best.append([*before, value])
    longest: list[int] = max(best, key=len, default=[])
    return {*longest}


def _guard(transition: TransitionFacts) -> tuple[Detail, ...]:
    guard = transition.keys["guard"]
    return () if guard is None else (Detail("guard", guard, guard),)


def title(transition: TransitionFacts) -> str:
    """Return the name of a transition: its source, its trigger and its targets."""
    keys = transition.keys
    trigger = " ".join(keys["descriptors"]) or keys["trigger"]
    if keys["delay_us"] is not None:
        trigger = f"{keys['trigger']} {duration_text(keys['delay_us'])}"
    targets = " ".join(keys["targets"]) or "(no target)"
    return f"{transition.source or 'chart'} --{trigger}--> {targets}"
