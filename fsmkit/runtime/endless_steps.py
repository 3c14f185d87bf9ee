"""Find the cycle of transitions in which a macrostep exceeded its bound."""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.chart.chart import Chart, Transition
from fsmkit.runtime.interpreter.snapshot import Macrostep

ROUNDS = 2
"""Number of equal rounds at the end of a macrostep that count as a cycle."""


def final_cycle(taken: Sequence[int]) -> Sequence[int]:
    """Return the shortest sequence that `taken` ends with at least twice, or an empty one."""
    for length in range(1, len(taken) // ROUNDS + 1):
        if taken[-length:] == taken[-2 * length : -length]:
            return taken[-length:]
    return ()


def cycle_text(chart: Chart, taken: Sequence[int]) -> str:
    """Return the cycle at the end of `taken` (numbers of transitions), each with its line.

    For example ``b -> c (gate.yaml:7), c -> b (gate.yaml:9)``. Empty if the sequence does not end
    in a cycle.
    """
    found = list(final_cycle(taken))
    first = found.index(min(found)) if found else 0
    turned = [chart.transitions[number] for number in found[first:] + found[:first]]
    return ", ".join(_text(chart, transition) for transition in turned)


def transition_numbers(macrostep: Macrostep) -> tuple[int, ...]:
    """Return the numbers of the transitions that a macrostep took, in order."""
    return tuple(number for small in macrostep.microsteps for number in small.transitions)


def traced_transitions(lines: Sequence[str]) -> tuple[int, ...]:
    """Return the numbers of the transitions in the lines of a trace."""
    return tuple(int(line[2:]) for line in lines if line.startswith("t "))


def _text(chart: Chart, transition: Transition) -> str:
    line, _ = transition.span.source.position(transition.span.start)
    targets = ", ".join(chart.states[target].id for target in transition.targets)
    source = chart.states[transition.source].id
    return f"{source} -> {targets or source} ({transition.span.source.name}:{line})"
