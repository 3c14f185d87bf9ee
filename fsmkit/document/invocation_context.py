"""What an invoked chart takes over from the chart that invokes it (SCXML 6.4)."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.language import Field, Type


@dataclass(frozen=True, slots=True)
class InvocationContext:
    """What is known of an invocation when the chart in it is elaborated.

    ``session`` is its own, ``invoker`` that of the invoking machine. ``events`` may come from
    there, ``data`` are set when it starts. ``depth`` counts the invocations it lies in.
    """

    session: str
    invoker: str
    events: tuple[tuple[str, tuple[Field, ...]], ...] = ()
    data: tuple[tuple[str, Type | None], ...] = ()
    depth: int = 1
