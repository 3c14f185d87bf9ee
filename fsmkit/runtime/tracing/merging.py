"""Several contexts of one program, each with a ring of its own, as one trace."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from heapq import merge
from typing import Protocol, TypeVar


class _At(Protocol):
    @property
    def at(self) -> int: ...


Told = TypeVar("Told", bound=_At)


def merged(contexts: Iterable[Iterable[Told]]) -> Iterator[Told]:
    """Yield what contexts told by its time; at one time the first context first.

    Within a context the order stays, also where a time lies before one that was told earlier.
    """
    keyed = (_monotonic(context, number) for number, context in enumerate(contexts))
    return (told for _, _, _, told in merge(*keyed, key=lambda each: each[:3]))


def _monotonic(context: Iterable[Told], number: int) -> Iterator[tuple[int, int, int, Told]]:
    latest: int | None = None
    for place, told in enumerate(context):
        latest = told.at if latest is None else max(latest, told.at)
        yield latest, number, place, told
