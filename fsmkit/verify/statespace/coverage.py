"""Record the coverage of a machine's steps."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.runtime.interpreter.snapshot import Entered, Macrostep, Taken


@dataclass(slots=True)
class Coverage:
    """The states and transitions covered so far."""

    states: set[int]
    transitions: set[int]
    microsteps: int = 0

    def add(self, done: Macrostep) -> None:
        """Add the coverage of a macrostep."""
        self.microsteps = max(self.microsteps, len(done.microsteps))
        for effect in done.effects:
            match effect:
                case Entered(state):
                    self.states.add(state)
                case Taken(transition):
                    self.transitions.add(transition)
                case _:
                    pass
