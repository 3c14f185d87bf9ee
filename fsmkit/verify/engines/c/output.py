"""Parse the output of the explorer in C, line by line (``core/main.c``)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from fsmkit.diagnostics.parsing import parse_json
from fsmkit.verify.engines.c.concretize import ArmedTimer, PerformedStep
from fsmkit.verify.statespace.actions import Action, Step
from fsmkit.verify.statespace.exploration import End

MOST_DIGITS = 4000
"""Decimal digits that are read at once: Python rejects more than 4300 (``int``)."""


def natural(digits: str) -> int:
    """Return a number of any size."""
    found = 0
    for at in range(0, len(digits), MOST_DIGITS):
        part = digits[at : at + MOST_DIGITS]
        found = found * 10 ** len(part) + int(part)
    return found


def unfinished_result(
    end: End, why: str, last: Mapping[str, int], seconds: float
) -> Mapping[str, Any]:
    """Return a result without states: the reason, and the progress of the search."""
    nothing = {"marks": (), "livelock_known": False, "livelock": None, "traps_known": False}
    known = {name: last.get(name, 0) for name in ("states", "transitions", "depth", "bytes")}
    return {
        **nothing,
        **known,
        "outcome": end.value,
        "why": why,
        "traps": (),
        "machines": (),
        "seconds": seconds,
        "temporal": (),
        "watch": {"least": None, "greatest": None, "pending": None, "stopped": False},
    }


def parse_lines(text: str) -> Iterator[tuple[dict[str, Any], tuple[str, ...]]]:
    """Yield the explorer's own lines, each with the machines' lines after it.

    Its own lines start with a NUL, which no line of a machine can contain, since it ends a string
    in C. Only a line feed ends a line: names may contain other line separators of Unicode.
    """
    for part in text.split("\0")[1:]:
        own, _, told = part.partition("\n")
        yield parse_json(own), tuple(told.removesuffix("\n").split("\n") if told else ())


def performed_steps(text: str) -> Iterator[tuple[PerformedStep, tuple[str, ...]]]:
    """Yield the steps of a path, and the machines' output in each."""
    step: PerformedStep | None = None
    found: tuple[str, ...] = ()
    for told, lines in parse_lines(text):
        if "timers" in told and step is not None:
            step = replace(step, timers=tuple(ArmedTimer(*timer) for timer in told["timers"]))
            continue
        if step is not None:
            yield step, found
        own = told["step"]
        choices = tuple(own["choices"])
        taken = Step(Action(own["action"]), own["machine"], own["argument"], choices)
        step, found = PerformedStep(taken, own.get("waits", False), ()), lines
    if step is not None:
        yield step, found


def difference(ours: tuple[str, ...], theirs: tuple[str, ...]) -> tuple[str, str]:
    """Return the first pair of lines that differ."""
    for n in range(max(len(ours), len(theirs))):
        a = ours[n] if n < len(ours) else "(nothing more)"
        b = theirs[n] if n < len(theirs) else "(nothing more)"
        if a != b:
            return a, b
    return "", ""
