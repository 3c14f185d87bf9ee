"""The machine as evaluation sees it, and the errors that evaluation raises."""

from __future__ import annotations

from typing import Protocol

from fsmkit.language.types import Value


class ContentError(Exception):
    """Content that cannot be evaluated: ``error.execution`` (SCXML 3.12.2 and 5.9)."""

    def __init__(self, reason: str) -> None:
        """Store the reason, as text."""
        super().__init__(reason)
        self.reason = reason


class RangeFault(Exception):  # noqa: N818  (a fault of the machine, not an error of the chart)
    """A value left the bounds of a type whose overflow is ``fault``: the machine stops."""

    def __init__(self, reason: str) -> None:
        """Store the reason, as text."""
        super().__init__(reason)
        self.reason = reason


class Environment(Protocol):
    """The machine as an expression sees it."""

    def variable(self, name: str) -> Value:
        """Return the value of a variable: data, input or output."""

    def event_field(self, name: str) -> Value:
        """Return a field of the payload of the current event; `ContentError` if it is missing."""

    def event_name(self) -> str:
        """Return the name of the current event."""

    def event_type(self) -> str:
        """Return the type of the current event (SCXML 5.10.1)."""

    def is_in(self, state: int) -> bool:
        """Return whether the state of that index is active."""

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Call an operation of the host; return None if it has no result."""

    def range_error(self) -> None:
        """Record that a value was saturated: ``error.range``."""
