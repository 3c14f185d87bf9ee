"""Declare the methods of `Recording` and of the counters for the classes below them.

Generated classes contain nothing of this module.
"""

from __future__ import annotations

from typing import Any


class Unrecorded:
    """A machine with tests for recording and counting; the generator removes constant ones."""

    records: bytearray
    _counting: Any
    _record_root: Any

    def _count(self, counter: int) -> None:
        """Count something, of which a state has its own number."""

    def _count_taken(self, transition: int) -> None:
        """Count a transition."""

    def _record_prepare(self) -> None:
        """Start without records."""

    def _record_starting(self, now: int) -> None:
        """Record the state before a start."""

    def _record_calling(self, now: int) -> None:
        """Record the state before a call."""

    def _record_dispatched(self, event: int) -> None:
        """Record an event that is processed immediately."""

    def _record_posted(self, event: int, payload: Any) -> None:
        """Record an event that is posted."""

    def _record_started(self) -> None:
        """Record a start."""

    def _record_taken(self, transition: int) -> None:
        """Record a transition."""

    def _record_end(self) -> None:
        """Record the end of a call."""

    def _record_broken(self) -> None:
        """Record an exception of the host."""

    def _record_restored(self, now: int) -> None:
        """Record that the machine is another."""
