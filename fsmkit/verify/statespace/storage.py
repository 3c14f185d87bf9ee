"""How the explorer in C keeps the states it has passed, and what it risks where it keeps less."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from fsmkit.diagnostics import fail

COMPACT_BITS = 24
"""Bits that stand for a state in its line of the table (``core/store/hash_compaction.h``)."""
BIT_FUNCTIONS = 3
"""Bitstate: bits of the table that a state sets."""
NEEDS_EXACT = "it needs the whole graph, so exact storage (`--storage exact`)"


class Storage(Enum):
    """What is kept of a state that was passed."""

    EXACT = "exact"
    HASH_COMPACT = "hash-compact"
    """A hash of it: hash compaction (Wolper and Leroy 1993; Stern and Dill 1996)."""
    BITSTATE = "bitstate"
    """Some bits of one large table: bitstate hashing (Holzmann 1988), a Bloom filter (1970)."""


def read_storage(name: str) -> Storage:
    """Return the storage of that name, else raise `FsmkitError` (``no-such-storage``)."""
    if name not in {storage.value for storage in Storage}:
        known = ", ".join(storage.value for storage in Storage)
        raise fail("no-such-storage", f"there is no storage `{name}`", help=f"use one of {known}")
    return Storage(name)


@dataclass(frozen=True, slots=True)
class LossyTable:
    """A lossy table at the end of a search.

    ``filled``, for each of its parts, of which all are equally large: for bitstate how many of its
    ``room`` bits are set; for hash compaction how many stored states a look-up compares, added up
    over the ``room`` lines of the part that it can begin at. ``bytes``: of the whole table.
    """

    storage: Storage
    filled: tuple[int, ...]
    room: int
    bytes: int

    @property
    def match_probability(self) -> float:
        """The probability that a new state is taken for a known one, with the table as it is now.

        Its hashes are taken for uniform and independent. Hash compaction: each stored state that is
        compared is equal by chance with probability ``2 ** -COMPACT_BITS`` (Stern and Dill 1996);
        the sum over the mean number of them is a bound. Bitstate: all ``BIT_FUNCTIONS`` bits are
        set, each with the share of bits that are (Bloom 1970). Before, the table was emptier, and
        the probability no greater.
        """
        shares = [count / self.room for count in self.filled]
        if self.storage is Storage.BITSTATE:
            shares = [share**BIT_FUNCTIONS for share in shares]
        mean = math.fsum(shares) / len(shares)
        return mean if self.storage is Storage.BITSTATE else mean / 2**COMPACT_BITS


def read_table(told: Mapping[str, Any] | None) -> LossyTable | None:
    """Return the table that the explorer tells of (``core/main.c``); None if it stored exactly."""
    if told is None:
        return None
    storage = Storage(told["storage"])
    return LossyTable(storage, tuple(told["filled"]), told["room"], told["bytes"])


def expected_omissions(match: float, states: int) -> float:
    """Return a bound on how many states are expected to have been taken for known ones.

    Each state that was stored stands, in the mean, for ``match / (1 - match)`` trials before it
    that were not, as ``match`` is the greatest probability of that. Further states may have been
    missed for being reached only through those.
    """
    return states * match / (1 - match) if match < 1 else math.inf


def omission_probability(match: float, depth: int) -> float:
    """Return a bound on the probability that any one reachable state was missed.

    Breadth first, a state is missed only if one of those on a shortest path to it was taken for a
    known one (Stern and Dill 1996). If none of the first ``n`` was, the ``n``-th was stored ``n``
    steps deep; so the first that was taken for a known one is at most a step deeper than the search
    came, and at most ``depth + 2`` states of the path were looked up for the first time.
    """
    return min(1.0, (depth + 2) * match)
