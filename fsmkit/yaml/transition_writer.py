"""Writing of transitions as YAML, sorted by trigger where that keeps their order."""

from __future__ import annotations

from itertools import groupby

from fsmkit.document import keys
from fsmkit.document.document import DocTransition, Trigger
from fsmkit.yaml.layout import Short, Tree
from fsmkit.yaml.writing import WORD, targets, write_keys

LONGEST_KEY = 200
"""Longer keys are hard to read; YAML permits 1024 characters."""
KEYS = {
    Trigger.EVENT: "on",
    Trigger.AFTER: "after",
    Trigger.EVERY: "every",
    Trigger.EVENTLESS: "always",
    Trigger.SOMETIMES: "sometimes",
}


def initial(transition: DocTransition) -> Tree:
    """Return the value of ``initial`` or ``default``."""
    target = targets(transition.targets)
    if transition.content is None:
        return target
    return write_keys(transition, keys.INITIAL, {"target": target})


def exit_point(given: tuple[DocTransition, ...]) -> Tree:
    """Return the value of an exit point: a single transition, or a list."""
    found: list[Tree] = []
    for one in given:
        parts = write_keys(one, keys.EXIT)
        target = parts.get("target")
        is_plain = list(parts) == ["target"] and isinstance(target, str)
        found.append(target if is_plain and target is not None else Short(parts))
    return found if len(found) != 1 else found[0]


def transitions(given: tuple[DocTransition, ...], *, is_choice: bool) -> dict[str, Tree]:
    """Return the keys of a state that hold its transitions.

    Only the order of a state's transitions with the same trigger matters to a machine. The whole
    order is kept, too: if the keys cannot express it, the transitions are written as one list.
    """
    labelled = [
        ("choice" if is_choice and one.trigger is Trigger.EVENTLESS else KEYS[one.trigger], one)
        for one in given
    ]
    tree: dict[str, Tree] = {"choice": []} if is_choice and "choice" not in dict(labelled) else {}
    grouped = [(key, [one for _, one in group]) for key, group in groupby(labelled, lambda k: k[0])]
    labels = [
        (key, [label for label, _ in groupby(label_text(one) for one in group)])
        for key, group in grouped
    ]
    is_sorted = len({key for key, _ in grouped}) == len(grouped) and all(
        None not in of and len(set(of)) == len(of) for _, of in labels
    )
    if not is_sorted:
        listed = [with_trigger(one) for one in given]
        return {**tree, "transitions": [*listed]}
    for key, group in grouped:
        if key in ("on", "after", "every"):
            by_label = groupby(group, lambda one: label_text(one) or "")
            entries: dict[str, Tree] = {label: _listed(list(some)) for label, some in by_label}
            lonely = len(entries) == 1 and all(isinstance(e, str) for e in entries.values())
            tree[key] = Short(entries) if lonely else entries
        else:
            found = _listed(group)
            tree[key] = found if isinstance(found, list) else [found]
    return tree


def label_text(transition: DocTransition) -> str | None:
    """Return the key of a transition; None if its trigger cannot be a key."""
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


def with_trigger(transition: DocTransition) -> Short:
    """Return an entry of ``transitions``: the key of its trigger, and those of any transition."""
    return Short({**trigger_keys(transition), **write_keys(transition, keys.TRANSITION)})


def trigger_keys(transition: DocTransition) -> dict[str, Tree]:
    """Return the trigger keys of an entry of ``transitions``."""
    key = KEYS[transition.trigger]
    match transition.trigger:
        case Trigger.EVENT:
            return {key: targets(transition.events)}
        case Trigger.AFTER | Trigger.EVERY:
            return {key: "" if transition.delay is None else transition.delay.value}
        case _:
            return {key: "true"}


def without_trigger(transition: DocTransition) -> Tree:
    """Return a transition without its trigger: its target, or its keys."""
    parts = write_keys(transition, keys.TRANSITION)
    target = parts.get("target")
    return target if list(parts) == ["target"] and isinstance(target, str) else Short(parts)


def _listed(group: list[DocTransition]) -> Tree:
    """Return transitions with the same trigger: a single one, or a list."""
    found: list[Tree] = [without_trigger(one) for one in group]
    return found if len(found) != 1 else found[0]
