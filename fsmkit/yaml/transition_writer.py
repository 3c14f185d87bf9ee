"""Transitions as YAML: sorted by what they wait for where that keeps their order."""

from __future__ import annotations

from itertools import groupby

from fsmkit.document import keys
from fsmkit.document.document import DocTransition, Trigger
from fsmkit.yaml.layout import Short, Tree
from fsmkit.yaml.writing import WORD, targets, written

LONGEST_KEY = 200
"""YAML ends a key after 1024 characters; people lose patience sooner."""
KEYS = {
    Trigger.EVENT: "on",
    Trigger.AFTER: "after",
    Trigger.EVERY: "every",
    Trigger.EVENTLESS: "always",
    Trigger.SOMETIMES: "sometimes",
}


def initial(transition: DocTransition) -> Tree:
    """Return what stands under ``initial`` or ``default``."""
    target = targets(transition.targets)
    if transition.content is None:
        return target
    return written(transition, keys.INITIAL, {"target": target})


def exit_point(given: tuple[DocTransition, ...]) -> Tree:
    """Return what stands under an exit point: one transition as it is, several as a list."""
    found: list[Tree] = []
    for one in given:
        parts = written(one, keys.EXIT)
        target = parts.get("target")
        is_plain = list(parts) == ["target"] and isinstance(target, str)
        found.append(target if is_plain and target is not None else Short(parts))
    return found if len(found) != 1 else found[0]


def transitions(given: tuple[DocTransition, ...], *, is_choice: bool) -> dict[str, Tree]:
    """Return the keys of a state that hold its transitions.

    Of one state, only the order of transitions that wait for the same thing matters to a machine,
    but it is kept for all: where the keys cannot tell it, they stand in one list.
    """
    labelled = [
        ("choice" if is_choice and one.trigger is Trigger.EVENTLESS else KEYS[one.trigger], one)
        for one in given
    ]
    tree: dict[str, Tree] = {"choice": []} if is_choice and "choice" not in dict(labelled) else {}
    grouped = [(key, [one for _, one in group]) for key, group in groupby(labelled, lambda k: k[0])]
    labels = [
        (key, [label for label, _ in groupby(_label(one) for one in group)])
        for key, group in grouped
    ]
    is_sorted = len({key for key, _ in grouped}) == len(grouped) and all(
        None not in of and len(set(of)) == len(of) for _, of in labels
    )
    if not is_sorted:
        listed = [Short({**_wait(one), **written(one, keys.TRANSITION)}) for one in given]
        return {**tree, "transitions": [*listed]}
    for key, group in grouped:
        if key in ("on", "after", "every"):
            by_label = groupby(group, lambda one: _label(one) or "")
            entries: dict[str, Tree] = {label: _listed(list(some)) for label, some in by_label}
            lonely = len(entries) == 1 and all(isinstance(e, str) for e in entries.values())
            tree[key] = Short(entries) if lonely else entries
        else:
            found = _listed(group)
            tree[key] = found if isinstance(found, list) else [found]
    return tree


def _label(transition: DocTransition) -> str | None:
    """Return the key a transition stands under; None where it cannot be a key."""
    match transition.trigger:
        case Trigger.EVENT:
            words = [event.value for event in transition.events]
            text = " ".join(words)
            is_sound = words and all(WORD.fullmatch(word) for word in words)
        case Trigger.AFTER | Trigger.EVERY:
            text = "" if transition.delay is None else transition.delay.value
            is_sound = text == text.strip()
        case _:
            return ""
    return text if text and is_sound and "\n" not in text and len(text) <= LONGEST_KEY else None


def _wait(transition: DocTransition) -> dict[str, Tree]:
    """Return what an entry of ``transitions`` waits for."""
    key = KEYS[transition.trigger]
    match transition.trigger:
        case Trigger.EVENT:
            return {key: targets(transition.events)}
        case Trigger.AFTER | Trigger.EVERY:
            return {key: "" if transition.delay is None else transition.delay.value}
        case _:
            return {key: "true"}


def _listed(group: list[DocTransition]) -> Tree:
    """Return transitions that wait for the same thing: one as it is, several as a list."""
    found: list[Tree] = []
    for one in group:
        parts = written(one, keys.TRANSITION)
        target = parts.get("target")
        found.append(
            target if list(parts) == ["target"] and isinstance(target, str) else Short(parts)
        )
    return found if len(found) != 1 else found[0]
