"""The result of comparing a mutant with the original, as data that can be stored and shown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from fsmkit.emit.lines import one_line
from fsmkit.language.units import duration_text
from fsmkit.verify.mutants.difference import Difference, Sameness
from fsmkit.verify.report.counterexample import Counterexample, as_json


@dataclass(frozen=True, slots=True)
class Contrast:
    """A run that only one of the two systems has, or why none is known.

    ``lines``: its steps for people. ``steps``: the same as data. ``in_mutant``: the mutant has it.
    ``local``: a step that the machine takes differently, from a state that the original reaches.
    """

    why: str = ""
    in_mutant: bool = False
    lines: tuple[str, ...] = ()
    steps: tuple[Mapping[str, Any], ...] = ()
    local: tuple[str, ...] = ()

    @staticmethod
    def of(found: Difference) -> Contrast:
        """Return the contrast of a comparison that found a difference, or did not complete."""
        if found.sameness is not Sameness.DIFFERENT or found.run is None:
            return Contrast(found.why)
        lines = tuple(run_lines(found.run))
        return Contrast("", found.in_mutant, lines, tuple(as_json(found.run)))

    def as_json(self) -> Mapping[str, Any]:
        """Return the contrast as data."""
        return asdict(self)

    @staticmethod
    def read(kept: Mapping[str, Any]) -> Contrast:
        """Return the contrast from the data of `as_json`."""
        return Contrast(kept["why"], kept["in_mutant"], tuple(kept["lines"]), tuple(kept["steps"]))


def run_lines(run: Counterexample) -> Iterator[str]:
    """Yield a line for each step of a run: machine, cause, effects; one line for time."""
    for number, step in enumerate(run.steps):
        if not step.machine:
            if number + 1 == len(run.steps) or run.steps[number + 1].machine:
                yield "time passes" if step.at is None else f"until {duration_text(step.at)}"
            continue
        sent = [f"{each.what} -> {each.target}" for each in step.deliveries]
        shown = [line for line in step.lines if line.startswith(("op ", "out ", "fault "))]
        notes = "; ".join(one_line(each) for each in (*shown, *sent))
        yield f"{step.machine}: {one_line(step.cause)}{f'  [{notes}]' if notes else ''}"
