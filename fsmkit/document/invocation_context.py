"""The context that an invoked chart inherits from its invoker (SCXML 6.4)."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.language import Field, Type


@dataclass(frozen=True, slots=True)
class InvocationContext:
    """The known facts about an invocation when its chart is elaborated.

    ``session`` is the invoked session, ``invoker`` the invoking one. ``events`` may arrive from the
    invoker, ``data`` are set at the start. ``depth`` is the nesting depth of invocations.
    """

    session: str
    invoker: str
    events: tuple[tuple[str, tuple[Field, ...]], ...] = ()
    data: tuple[tuple[str, Type | None], ...] = ()
    depth: int = 1
