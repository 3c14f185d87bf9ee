"""Several contexts of one program, each with a ring of its own, as one trace."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from heapq import merge

from fsmkit.runtime.tracing.stream import Timed


def merged(contexts: Iterable[Iterable[Timed]]) -> Iterator[Timed]:
    """Yield what contexts told by its time; at one time the first context first.

    Within a context the order stays, also where a time lies before one that was told earlier.
    """
    keyed = (_monotonic(context, number) for number, context in enumerate(contexts))
    return (timed for _, _, _, timed in merge(*keyed, key=lambda each: each[:3]))


def _monotonic(context: Iterable[Timed], number: int) -> Iterator[tuple[int, int, int, Timed]]:
    latest: int | None = None
    for place, timed in enumerate(context):
        latest = timed.at if latest is None else max(latest, timed.at)
        yield latest, number, place, timed
