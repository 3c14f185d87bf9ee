"""The transitions that a machine takes round and round, when it is stopped for it."""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.chart.chart import Chart, Transition
from fsmkit.runtime.interpreter.snapshot import Macrostep

ROUNDS = 2
"""So many equal rounds at the end of a macrostep are a cycle."""


def round_of(taken: Sequence[int]) -> Sequence[int]:
    """Return the shortest part that ends a sequence at least twice; nothing if none does."""
    for length in range(1, len(taken) // ROUNDS + 1):
        if taken[-length:] == taken[-2 * length : -length]:
            return taken[-length:]
    return ()


def cycle_text(chart: Chart, taken: Sequence[int]) -> str:
    """Return the cycle in which transitions, by their numbers, were taken last, with their lines.

    ``b -> c (gate.yaml:7), c -> b (gate.yaml:9)``; empty where there is none, as data differ.
    """
    found = list(round_of(taken))
    first = found.index(min(found)) if found else 0
    turned = [chart.transitions[number] for number in found[first:] + found[:first]]
    return ", ".join(_text(chart, transition) for transition in turned)


def taken_by(macrostep: Macrostep) -> tuple[int, ...]:
    """Return the numbers of the transitions that a macrostep took, in order."""
    return tuple(number for small in macrostep.microsteps for number in small.transitions)


def taken_in(lines: Sequence[str]) -> tuple[int, ...]:
    """Return the same from the lines of its trace."""
    return tuple(int(line[2:]) for line in lines if line.startswith("t "))


def _text(chart: Chart, transition: Transition) -> str:
    line, _ = transition.span.source.position(transition.span.start)
    targets = ", ".join(chart.states[target].id for target in transition.targets)
    source = chart.states[transition.source].id
    return f"{source} -> {targets or source} ({transition.span.source.name}:{line})"
