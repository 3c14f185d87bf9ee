"""What evaluation asks of a running machine, and the errors it can end with."""

from __future__ import annotations

from typing import Protocol

from fsmkit.language.types import Value


class ContentError(Exception):
    """Content that cannot be evaluated: ``error.execution`` (SCXML 3.12.2 and 5.9)."""

    def __init__(self, reason: str) -> None:
        """Keep the reason, in words."""
        super().__init__(reason)
        self.reason = reason


class RangeFault(Exception):  # noqa: N818  (a fault of the machine, not an error of the chart)
    """A value left the bounds of a type whose overflow is ``fault``: the machine stops."""

    def __init__(self, reason: str) -> None:
        """Keep the reason, in words."""
        super().__init__(reason)
        self.reason = reason


class Environment(Protocol):
    """The machine as an expression sees it."""

    def variable(self, name: str) -> Value:
        """Return the value of a variable: data, input or output."""

    def event_field(self, name: str) -> Value:
        """Return a field of the payload being handled; `ContentError` where there is none."""

    def event_name(self) -> str:
        """Return the name of the event being handled."""

    def event_type(self) -> str:
        """Return the type of the event being handled (SCXML 5.10.1)."""

    def is_in(self, state: int) -> bool:
        """Return whether the state of that index is active."""

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Call an operation of the host; None where it returns nothing."""

    def range_error(self) -> None:
        """Take note that a value was saturated: ``error.range``."""
