"""What a conformance test reads from a trace."""

from __future__ import annotations

from collections.abc import Iterable

CLOCK = 2**32


def configurations(trace: Iterable[str]) -> list[tuple[int, tuple[str, ...]]]:
    """Return the time and the active atomic states after each macrostep."""
    found: list[tuple[int, tuple[str, ...]]] = []
    now = 0
    for line in trace:
        if line.startswith("@"):
            now = int(line[1:].partition(" ")[0])
        elif line == "=" or line.startswith("= "):
            found.append((now, tuple(name for name in line.split()[1:] if name != "finished")))
    return found


def ends_in(trace: Iterable[str]) -> tuple[str, ...] | None:
    """Return the atomic states in which the machine finished, if it did."""
    for line in trace:
        words = line.split()
        if words[:1] == ["="] and words[-1:] == ["finished"]:
            return tuple(words[1:-1])
    return None


def faults(trace: Iterable[str]) -> list[str]:
    """Return the reasons of faults."""
    return [line.removeprefix("fault ") for line in trace if line.startswith("fault ")]
