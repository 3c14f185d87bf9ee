"""Labels of StateSmith: the first line of a state, and the behaviours of states and arrows.

A behaviour is ``1. (EV1, EV2) [guard] / action via exit x via entry y``; every part is optional.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from fsmkit.diagnostics import Findings, Span, Text

ORDER = re.compile(r"(\d+(?:\.\d+)?)\s*\.(?!\d)|else\b", re.IGNORECASE)
TRIGGERS = re.compile(r"[\w$]+|\(\s*([\w$]+(?:\s*,\s*[\w$]+)*)\s*\)")
VIA = re.compile(r"via\s+(entry|exit)\s+(\w+)", re.IGNORECASE)
LATE_VIA = re.compile(r"\s+via\s+(?:entry|exit)\s+\w+\s*$", re.IGNORECASE)
NAME = re.compile(r"[^\W\d]\w*")
UNORDERED = 1e6
"""The order of a behaviour without a number."""
LAST = 1e9
"""The order of ``else``."""


@dataclass(frozen=True, slots=True)
class Behaviour:
    """A behaviour of a state, or the label of an arrow. ``target`` is the key of a node."""

    triggers: tuple[Text, ...]
    guard: Text | None
    action: Text | None
    order: float
    span: Span
    via: tuple[tuple[str, str], ...] = ()
    target: str | None = None


def read_behaviours(text: Text, findings: Findings) -> list[Behaviour]:
    """Return the behaviours of a label, up to the first that cannot be read."""
    found: list[Behaviour] = []
    value = text.value
    at = skip(value, 0)
    while at < len(value):
        behaviour, end = _behaviour(text, at)
        if behaviour is None or end <= at:
            line = value[at:].split("\n")[0].strip()
            findings.add(
                "foreign-syntax",
                f"`{line[:60]}` is not a behaviour",
                text.span_of(at, at + max(1, len(line))),
                help="write `TRIGGER [guard] / action`",
            )
            break
        found.append(behaviour)
        at = skip(value, end)
    return found


def _behaviour(text: Text, start: int) -> tuple[Behaviour | None, int]:
    value, at = text.value, start
    order = UNORDERED
    if match := ORDER.match(value, at):
        order = LAST if match[1] is None else float(match[1])
        at = skip(value, match.end(), lines=False)
    triggers: tuple[Text, ...] = ()
    if not VIA.match(value, at) and (match := TRIGGERS.match(value, at)):
        inner = match.span(1) if match[1] is not None else match.span()
        words = re.finditer(r"[\w$]+", value[inner[0] : inner[1]])
        triggers = tuple(
            text.part(inner[0] + word.start(), inner[0] + word.end()) for word in words
        )
        at = skip(value, match.end(), lines=False)
    at = skip(value, at) if value[skip(value, at) :][:1] in ("[", "/") else at
    guard = action = None
    if value.startswith("[", at):
        end = closing(value, at)
        if end is None:
            return None, at
        guard = text.part(at + 1, end).strip()
        at = skip(value, end + 1) if _continues(value, end + 1) else end + 1
    if value.startswith("/", at):
        action, at = _action(text, at + 1)
        if action is None:
            return None, at
    via: list[tuple[str, str]] = []
    while match := VIA.match(value, skip(value, at)):
        via.append((match[1].lower(), match[2]))
        at = match.end()
    rest = skip(value, at, lines=False)
    if rest < len(value) and value[rest] != "\n" and not value.startswith("//", rest):
        return None, at
    if rest == start:
        return None, at
    return Behaviour(triggers, guard, action, order, text.span_of(start, at), tuple(via)), rest


def _continues(value: str, at: int) -> bool:
    """Return whether an action follows, perhaps on the next line."""
    place = skip(value, at)
    return value.startswith("/", place)


def _action(text: Text, at: int) -> tuple[Text | None, int]:
    """Return the action after a slash: a block in braces, or the rest of the line."""
    value = text.value
    place = skip(value, at, lines=False)
    block = skip(value, place)
    if value.startswith("{", block):
        end = closing(value, block)
        return (None, at) if end is None else (text.part(block + 1, end).strip(), end + 1)
    end = at
    while end < len(value) and value[end] != "\n":
        end = _string_end(value, end) if value[end] in "\"'`" else end + 1
    line = value[at:end]
    late = LATE_VIA.search(line)
    while late is not None and (more := LATE_VIA.search(line[: late.start()])):
        late = more
    end = at + late.start() if late is not None else end
    return text.part(at, end).strip(), end


def closing(value: str, at: int) -> int | None:
    """Return the place of the bracket that closes the one at ``at``; None if it stays open."""
    opening = value[at]
    close = {"{": "}", "[": "]", "(": ")"}[opening]
    depth = 0
    while at < len(value):
        char = value[at]
        if char in "\"'`":
            at = _string_end(value, at)
            continue
        if value.startswith("//", at):
            at = value.find("\n", at)
            if at < 0:
                return None
            continue
        if value.startswith("/*", at):
            at = value.find("*/", at + 2)
            if at < 0:
                return None
            at += 2
            continue
        depth += (char == opening) - (char == close)
        if not depth:
            return at
        at += 1
    return None


def _string_end(value: str, at: int) -> int:
    """Return the place behind a string; a quote that is not closed on its line is a character."""
    quote, place = value[at], at + 1
    while place < len(value) and value[place] != "\n":
        if value[place] == "\\":
            place += 2
            continue
        if value[place] == quote:
            return place + 1
        place += 1
    return at + 1


def skip(value: str, at: int, *, lines: bool = True) -> int:
    """Return the place behind blanks and comments; without ``lines`` on the same line."""
    while at < len(value):
        if value.startswith("/*", at) and (end := value.find("*/", at + 2)) >= 0:
            at = end + 2
        elif lines and value.startswith("//", at):
            end = value.find("\n", at)
            at = len(value) if end < 0 else end
        elif value[at].isspace() and (lines or value[at] != "\n"):
            at += 1
        else:
            break
    return at
