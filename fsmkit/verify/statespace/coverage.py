"""What the steps of a machine have reached."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.runtime.interpreter.snapshot import Entered, Macrostep, Taken


@dataclass(slots=True)
class Coverage:
    """What the steps of a machine have reached so far."""

    states: set[int]
    transitions: set[int]
    microsteps: int = 0

    def add(self, done: Macrostep) -> None:
        """Add what a macrostep has reached."""
        self.microsteps = max(self.microsteps, len(done.microsteps))
        for effect in done.effects:
            match effect:
                case Entered(state):
                    self.states.add(state)
                case Taken(transition):
                    self.transitions.add(transition)
                case _:
                    pass
