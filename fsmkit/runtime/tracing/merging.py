"""Merge the traces of several contexts of one program, each with its own ring."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from heapq import merge
from typing import Protocol, TypeVar


class _TimedItem(Protocol):
    @property
    def at(self) -> int: ...


Item = TypeVar("Item", bound=_TimedItem)


def merge_contexts(contexts: Iterable[Iterable[Item]]) -> Iterator[Item]:
    """Yield the items of several contexts by time; at equal times, the first context first.

    The order within a context is kept, even if a time is earlier than its predecessor.
    """
    keyed = (_monotonic(context, number) for number, context in enumerate(contexts))
    return (told for _, _, _, told in merge(*keyed, key=lambda each: each[:3]))


def _monotonic(context: Iterable[Item], number: int) -> Iterator[tuple[int, int, int, Item]]:
    latest: int | None = None
    for place, told in enumerate(context):
        latest = told.at if latest is None else max(latest, told.at)
        yield latest, number, place, told
