"""What the explorer in C says, read line by line (``core/main.c``)."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from fsmkit.verify.exploration import End
from fsmkit.verify.instants import Armed, Performed
from fsmkit.verify.moves import Action, Step


def unfinished(end: End, why: str, last: Mapping[str, int], seconds: float) -> Mapping[str, Any]:
    """Return a result that says only why there is none, and how far the search had come."""
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


def performed_steps(lines: list[str]) -> Iterator[tuple[Performed, tuple[str, ...]]]:
    """Yield the steps of a path, and what the machines said in each."""
    step: Performed | None = None
    found: list[str] = []
    for line in lines:
        if not line.startswith("{"):
            found.append(line)
            continue
        told = json.loads(line)
        if "timers" in told and step is not None:
            step = replace(step, timers=tuple(Armed(*timer) for timer in told["timers"]))
            continue
        if step is not None:
            yield step, tuple(found)
        told = told["step"]
        choices = tuple(told["choices"])
        taken = Step(Action(told["action"]), told["machine"], told["argument"], choices)
        step = Performed(taken, told.get("waits", False), ())
        found = []
    if step is not None:
        yield step, tuple(found)


def difference(ours: tuple[str, ...], theirs: tuple[str, ...]) -> tuple[str, str]:
    """Return the first pair of lines that differ."""
    for n in range(max(len(ours), len(theirs))):
        a = ours[n] if n < len(ours) else "(nothing more)"
        b = theirs[n] if n < len(theirs) else "(nothing more)"
        if a != b:
            return a, b
    return "", ""
