"""Configurations in the midst of a step."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.diagnostics.fast_init import fast_init


@fast_init
@dataclass(frozen=True, slots=True)
class Place:
    """The configuration in the midst of a step, as far as it is known when compiling.

    If ``base`` is known, it is that; else what was active, but for the states in ``changed``.
    """

    base: int | None
    changed: int = 0

    def without(self, state: int) -> Place:
        """Return the configuration after an active state was left."""
        if self.base is not None:
            return Place(self.base & ~(1 << state))
        return Place(None, self.changed ^ 1 << state)

    def with_(self, state: int) -> Place:
        """Return the configuration after a state was entered."""
        if self.base is not None:
            return Place(self.base | 1 << state)
        return Place(None, self.changed ^ 1 << state)


UNKNOWN = Place(None, -1)
"""None that is ever meant."""
