"""Types and durations as texts."""

from __future__ import annotations

from fsmkit.diagnostics import Findings, Text
from fsmkit.expressions.scope import Scope
from fsmkit.expressions.types import Type


def read_type(text: Text, scope: Scope, findings: Findings) -> Type | None:
    """Read a type."""
    raise NotImplementedError


def read_duration(text: Text, scope: Scope, findings: Findings) -> int | None:
    """Read a duration literal or the name of a constant of type duration, in ticks."""
    raise NotImplementedError
