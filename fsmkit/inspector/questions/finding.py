"""Search a history for an entry that hits a breakpoint."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.inspector import breakpoints
from fsmkit.inspector.breakpoints import Breakpoint
from fsmkit.inspector.commands import Break, Find
from fsmkit.inspector.view import View

MOST_AT_ONCE = 512
"""Maximum number of entries searched per command; conditions need recomputed moments."""


def found(view: View, command: Find) -> dict[str, int]:
    """Return the entry that a command looks for, where to go on, or nothing.

    `FsmkitError` for a kind or a name that there is not.
    """
    history = view.history
    wanted = Break(id=0, on=command.on, m=command.m, what=command.what, guard=command.guard)
    point = breakpoints.read(view.course.simulation.system, wanted)
    if command.back:
        last = min(command.first - 1, history.head)
        first = max(history.first + 1, last - MOST_AT_ONCE + 1)
        *_, n = (0, *_hits(view, point, first, last))
        return {"n": n} if n else {"from": first} if first > history.first + 1 else {}
    first = max(command.first, history.first) + 1
    last = min(history.head, first + MOST_AT_ONCE - 1)
    n = next(_hits(view, point, first, last), 0)
    return {"n": n} if n else {"from": last} if last < history.head else {}


def _hits(view: View, point: Breakpoint, first: int, last: int) -> Iterator[int]:
    """Yield the entries that hit a breakpoint, in order."""
    course = view.course
    by_value = point.guard or point.condition or point.property
    before = course.moment(first - 1) if by_value and first <= last else None
    for n in range(first, last + 1):
        after = course.after(n, before) if by_value else None
        if breakpoints.is_hit(course.simulation.system, point, before, after, course.messages(n)):
            yield n
        before = after
