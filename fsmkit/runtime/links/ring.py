"""A bounded ring between two threads: one puts, the other gets; neither waits."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Ring(Generic[Item]):
    """First in, first out; what finds no room is counted. One thread at each end."""

    __slots__ = ("_items", "capacity", "refused")

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self.refused = 0
        self._items: deque[Item] = deque()

    def __len__(self) -> int:
        return len(self._items)

    def put(self, item: Item) -> bool:
        """Put in an item; False, and counted, if there is no room."""
        if len(self._items) >= self.capacity:
            self.refused += 1
            return False
        self._items.append(item)
        return True

    def get(self) -> Item | None:
        """Take out the oldest item; None if there is none."""
        try:
            return self._items.popleft()
        except IndexError:
            return None
