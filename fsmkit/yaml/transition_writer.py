"""Transitions as YAML: sorted by what they wait for where that keeps their order."""

from __future__ import annotations

import re
from itertools import groupby

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocTransition, Trigger
from fsmkit.yaml.layout import Short, Tree
from fsmkit.yaml.writing import statements

WORD = re.compile(r"[^\s,]+")
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
    tree: dict[str, Tree] = {"target": _targets(transition.targets)}
    if transition.content:
        return {**tree, "do": statements(transition.content)}
    return tree["target"]


def transitions(written: tuple[DocTransition, ...], *, is_choice: bool) -> dict[str, Tree]:
    """Return the keys of a state that hold its transitions.

    Of one state, only the order of transitions that wait for the same thing matters to a machine,
    but it is kept for all: where the keys cannot tell it, they stand in one list.
    """
    keys = [
        ("choice" if is_choice and one.trigger is Trigger.EVENTLESS else KEYS[one.trigger], one)
        for one in written
    ]
    tree: dict[str, Tree] = {"choice": []} if is_choice and "choice" not in dict(keys) else {}
    grouped = [(key, [one for _, one in group]) for key, group in groupby(keys, lambda k: k[0])]
    labels = [
        (key, [label for label, _ in groupby(_label(one) for one in group)])
        for key, group in grouped
    ]
    is_sorted = len({key for key, _ in grouped}) == len(grouped) and all(
        None not in of and len(set(of)) == len(of) for _, of in labels
    )
    if not is_sorted:
        return {**tree, "transitions": [Short({**_wait(one), **_parts(one)}) for one in written]}
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
            return {key: _targets(transition.events)}
        case Trigger.AFTER | Trigger.EVERY:
            return {key: "" if transition.delay is None else transition.delay.value}
        case _:
            return {key: "true"}


def _listed(group: list[DocTransition]) -> Tree:
    """Return transitions that wait for the same thing: one as it is, several as a list."""
    found: list[Tree] = []
    for one in group:
        parts = _parts(one)
        target = parts.get("target")
        found.append(
            target if list(parts) == ["target"] and isinstance(target, str) else Short(parts)
        )
    return found if len(found) != 1 else found[0]


def _parts(transition: DocTransition) -> dict[str, Tree]:
    tree: dict[str, Tree] = {}
    texts = {"id": transition.id, "override": transition.override}
    tree |= {key: text.value for key, text in texts.items() if text is not None}
    if transition.first:
        tree["first"] = "true"
    if transition.internal:
        tree["type"] = "internal"
    if transition.guard is not None:
        tree["if"] = transition.guard.value
    if transition.targets:
        tree["target"] = _targets(transition.targets)
    tree |= {key: "true" for key in ("watchdog", "ordered") if getattr(transition, key)}
    if transition.content or (transition.content is not None and transition.override is not None):
        tree["do"] = statements(transition.content)
    return tree


def _targets(targets: tuple[Text, ...]) -> Tree:
    if len(targets) == 1 and WORD.fullmatch(targets[0].value):
        return targets[0].value
    return Short([target.value for target in targets])
