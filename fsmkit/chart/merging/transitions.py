"""The transitions of three versions of a chart: which are the same, and what became of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from fsmkit.chart.merging.versions import Conflicts, Versions
from fsmkit.document.document import DocTransition, Trigger

TRIGGER = ("trigger", "events", "delay")
"""Fields that are one part."""
PARTS: tuple[tuple[str, ...], ...] = (
    TRIGGER,
    *(
        (one.name,)
        for one in fields(DocTransition)
        if one.name not in (*TRIGGER, "span", "origin", "super_guards")
    ),
)
"""The parts of a transition that are merged separately."""
TIMED = (Trigger.AFTER, Trigger.EVERY)
WORDS = {"events": "trigger", "delay": "trigger", "content": "statements", "internal": "type"}
Key = Any
"""The key of a state, see `documents`."""


@dataclass(frozen=True, slots=True)
class Placed:
    """A transition and the key of the state that it leaves."""

    source: Key
    one: DocTransition


@dataclass(frozen=True, slots=True)
class MergedTransition:
    """A transition of the result, with its positions in the three versions (None: not there)."""

    source: Key
    one: DocTransition
    numbers: tuple[int | None, int | None, int | None]


def _identities() -> Iterator[Callable[[Placed], object]]:
    """Yield functions whose equal results make two transitions one, the surest first."""

    def part(placed: Placed, *names: str) -> object:
        return tuple(getattr(placed.one, name) for name in names)

    yield lambda p: (p.source, comparable(p.one))
    yield lambda p: (p.source, p.one.id.value) if p.one.id is not None else object()
    yield lambda p: (p.source, part(p, *TRIGGER, "targets"))
    yield lambda p: (p.source, part(p, *TRIGGER, "guard"))
    yield lambda p: (p.source, part(p, *TRIGGER))
    yield lambda p: (p.source, part(p, "targets", "guard", "content"))
    yield lambda p: comparable(p.one)


def comparable(one: DocTransition) -> object:
    """Return a transition as a value that can be a key."""
    return tuple(getattr(one, name) for part in PARTS for name in part)


def matched(old: Sequence[Placed], new: Sequence[Placed]) -> dict[int, int]:
    """Return the positions of transitions of an old version in a new one."""
    pairs: dict[int, int] = {}
    taken: set[int] = set()
    for key in _identities():
        known: dict[object, list[int]] = {}
        for number, placed in enumerate(new):
            if number not in taken:
                known.setdefault(key(placed), []).append(number)
        for number, placed in enumerate(old):
            if number not in pairs and (found := known.get(key(placed))):
                pairs[number] = found.pop(0)
                taken.add(pairs[number])
    return pairs


def merged_transitions(
    versions: Versions[Sequence[Placed]], name: Callable[[Key], str], conflicts: Conflicts
) -> list[MergedTransition]:
    """Return the transitions of the merged chart; their order is not merged yet."""
    base, ours, theirs = versions.base, versions.ours, versions.theirs
    in_ours, in_theirs = matched(base, ours), matched(base, theirs)
    found: list[MergedTransition] = []
    for number, placed in enumerate(base):
        here, there = in_ours.get(number), in_theirs.get(number)
        numbers = number, here, there
        if here is not None and there is not None:
            three = Versions(placed, ours[here], theirs[there])
            found.append(_merged(three, numbers, name, conflicts))
        elif here is None and there is None:
            continue
        else:
            left = theirs[there] if here is None and there is not None else ours[here or 0]
            if left == placed:
                continue
            title = title_of(placed, name)
            is_ours = here is not None
            conflicts.add(
                f"{title} was {changed_and_removed(is_ours=is_ours)}",
                left.one.span if is_ours else None,
                None if is_ours else left.one.span,
                placed.one.span,
            )
            found.append(MergedTransition(left.source, left.one, numbers))
    found += _added(versions, in_ours, in_theirs, name, conflicts)
    return found


def _merged(
    three: Versions[Placed],
    numbers: tuple[int | None, int | None, int | None],
    name: Callable[[Key], str],
    conflicts: Conflicts,
) -> MergedTransition:
    ours, theirs = three.ours.one, three.theirs.one
    sources = Versions(three.base.source, three.ours.source, three.theirs.source)
    title = title_of(three.base, name)
    if sources.is_conflict:
        conflicts.add(f"{title} was moved to different states", ours.span, theirs.span)
    changes: dict[str, Any] = {}
    for part in PARTS:
        values = Versions(
            *(
                tuple(getattr(placed.one, field) for field in part)
                for placed in (three.base, three.ours, three.theirs)
            )
        )
        if values.is_conflict:
            word = WORDS.get(part[-1], part[-1])
            message = f"the {word} of {title} was changed differently"
            conflicts.add(message, ours.span, theirs.span)
        elif values.merged != values.ours:
            changes |= zip(part, values.merged, strict=True)
    return MergedTransition(sources.merged, replace(ours, **changes) if changes else ours, numbers)


def _added(
    versions: Versions[Sequence[Placed]],
    in_ours: Mapping[int, int],
    in_theirs: Mapping[int, int],
    name: Callable[[Key], str],
    conflicts: Conflicts,
) -> Iterator[MergedTransition]:
    """Yield the transitions that only the new versions have; equal ones once."""
    known, others = set(in_ours.values()), set(in_theirs.values())
    ours = [(n, one) for n, one in enumerate(versions.ours) if n not in known]
    theirs = [(n, one) for n, one in enumerate(versions.theirs) if n not in others]
    for number, placed in ours:
        same = next(((n, one) for n, one in theirs if one == placed), None)
        if same is not None:
            theirs.remove(same)
        there = None if same is None else same[0]
        yield MergedTransition(placed.source, placed.one, (None, number, there))
        for other in () if same is not None else (one for _, one in theirs):
            if _competes(placed, other):
                message = f"both versions added {title_of(placed, name)} differently"
                conflicts.add(message, placed.one.span, other.one.span)
    for number, placed in theirs:
        yield MergedTransition(placed.source, placed.one, (None, None, number))


def _competes(one: Placed, other: Placed) -> bool:
    """Return whether one of two transitions is taken always, instead of the other."""
    parts = (*TRIGGER, "guard")
    return one.source == other.source and all(
        getattr(one.one, part) == getattr(other.one, part) for part in parts
    )


def can_compete(one: DocTransition, other: DocTransition) -> bool:
    """Return whether two transitions may be enabled at once, so that their order has a meaning."""
    triggers = one.trigger, other.trigger
    if any(trigger in TIMED for trigger in triggers):
        return all(trigger in TIMED for trigger in triggers)
    if Trigger.EVENT in triggers:
        names = [[f"{event.value.removesuffix('*').rstrip('.')}." for event in each.events]
                 for each in (one, other)]  # fmt: skip
        return one.trigger is other.trigger and any(
            name == "." or same == "." or name.startswith(same) or same.startswith(name)
            for name in names[0]
            for same in names[1]
        )
    return True


def title_of(placed: Placed, name: Callable[[Key], str]) -> str:
    """Return a transition in the words of a message."""
    one = placed.one
    label = " ".join(event.value for event in one.events)
    if one.delay is not None:
        label = one.delay.value
    trigger = "" if one.trigger.value in ("event", "eventless") else f"{one.trigger.value} "
    shown = f"`{trigger}{label}`" if label or trigger else "without a trigger"
    return f"the transition {shown} of {name(placed.source)}"


def changed_and_removed(*, is_ours: bool) -> str:
    """Return what two versions did to an item that only one of them still has."""
    if is_ours:
        return "changed in ours and removed in theirs"
    return "removed in ours and changed in theirs"
