"""Configurations during a microstep."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.diagnostics.fast_init import fast_init


@fast_init
@dataclass(frozen=True, slots=True)
class Place:
    """The partially known configuration during a microstep, at compile time.

    It is ``base``, if that is known; else the previous one, except the states in ``changed``.
    """

    base: int | None
    changed: int = 0

    def without(self, state: int) -> Place:
        """Return the configuration after an active state was exited."""
        if self.base is not None:
            return Place(self.base & ~(1 << state))
        return Place(None, self.changed ^ 1 << state)

    def with_(self, state: int) -> Place:
        """Return the configuration after a state was entered."""
        if self.base is not None:
            return Place(self.base | 1 << state)
        return Place(None, self.changed ^ 1 << state)


UNKNOWN = Place(None, -1)
"""A configuration of which nothing is known."""
