"""Where random charts get their decisions from: a seeded generator, or Hypothesis.

Every decision is an integer, and 0, False and the first element are always the simplest outcome:
so Hypothesis shrinks towards small charts, and a chart is a function of its decisions alone.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from random import Random
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from hypothesis.strategies import DrawFn

Item = TypeVar("Item")


class Choices(ABC):
    """A source of decisions."""

    @abstractmethod
    def integer(self, lo: int, hi: int) -> int:
        """Return one of ``lo..hi``; ``lo`` is the simplest."""

    def chance(self, percent: int) -> bool:
        """Return True in about that many of a hundred cases."""
        return self.integer(0, 99) >= 100 - percent

    def pick(self, items: Sequence[Item]) -> Item:
        """Return one of the items, of which there must be one; the first is the simplest."""
        return items[self.integer(0, len(items) - 1)]

    def some(self, items: Sequence[Item], most: int) -> tuple[Item, ...]:
        """Return up to ``most`` different items in their order, at least one."""
        count = self.integer(1, max(1, min(most, len(items))))
        chosen: set[int] = set()
        for _ in range(count):
            chosen.add(self.integer(0, len(items) - 1))
        return tuple(items[i] for i in sorted(chosen))


class SeededChoices(Choices):
    """Decisions from a seed: the same seed gives the same chart on every machine."""

    def __init__(self, seed: int | str) -> None:
        """Start from the seed."""
        self._random = Random(seed)  # noqa: S311  (test data, not secrets)

    def integer(self, lo: int, hi: int) -> int:
        """Return one of ``lo..hi``, each equally likely."""
        return self._random.randint(lo, hi)


class DrawnChoices(Choices):
    """Decisions drawn by Hypothesis, which can shrink them."""

    def __init__(self, draw: DrawFn) -> None:
        """Draw with the function a composite strategy was given."""
        self._draw = draw

    def integer(self, lo: int, hi: int) -> int:
        """Draw one of ``lo..hi``, each about equally likely."""
        from hypothesis import strategies as st

        return lo if lo == hi else self._draw(st.sampled_from(range(lo, hi + 1)))
