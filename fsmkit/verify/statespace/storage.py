"""Storage of visited states in the explorer in C, and the risk of lossy storage."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from fsmkit.diagnostics import fail

COMPACT_BITS = 24
"""Bits that represent a state in its line of the table (``core/store/hash_compaction.h``)."""
BIT_FUNCTIONS = 3
"""Bitstate: bits of the table that a state sets."""
NEEDS_EXACT = "it needs the whole graph, so exact storage (`--storage exact`)"


class Storage(Enum):
    """The stored form of a visited state."""

    EXACT = "exact"
    HASH_COMPACT = "hash-compact"
    """A hash of it: hash compaction (Wolper and Leroy 1993; Stern and Dill 1996)."""
    BITSTATE = "bitstate"
    """Some bits of one large table: bitstate hashing (Holzmann 1988), a Bloom filter (1970)."""


def read_storage(name: str) -> Storage:
    """Return the storage of that name. Raises `FsmkitError` (``no-such-storage``)."""
    if name not in {storage.value for storage in Storage}:
        known = ", ".join(storage.value for storage in Storage)
        raise fail("no-such-storage", f"there is no storage `{name}`", help=f"use one of {known}")
    return Storage(name)


@dataclass(frozen=True, slots=True)
class LossyTable:
    """A lossy table at the end of a search.

    ``filled``, for each of its parts, all of equal size: for bitstate the number of set bits among
    its ``room`` bits; for hash compaction the stored states that a look-up compares, summed over
    the ``room`` lines of the part where it can start. ``bytes``: of the whole table.
    """

    storage: Storage
    filled: tuple[int, ...]
    room: int
    bytes: int

    @property
    def match_probability(self) -> float:
        """The probability that a new state matches a known one in the current table.

        Hashes are assumed to be uniform and independent. Hash compaction: each compared state
        matches by chance with probability ``2 ** -COMPACT_BITS`` (Stern and Dill 1996); the sum
        over their mean number is a bound. Bitstate: all ``BIT_FUNCTIONS`` bits are set, each with
        probability the share of set bits (Bloom 1970). Earlier the table was emptier, and the
        probability no greater.
        """
        shares = [count / self.room for count in self.filled]
        if self.storage is Storage.BITSTATE:
            shares = [share**BIT_FUNCTIONS for share in shares]
        mean = math.fsum(shares) / len(shares)
        return mean if self.storage is Storage.BITSTATE else mean / 2**COMPACT_BITS


def read_table(record: Mapping[str, Any] | None) -> LossyTable | None:
    """Return the table from the explorer's output (``core/main.c``); None for exact storage."""
    if record is None:
        return None
    storage = Storage(record["storage"])
    return LossyTable(storage, tuple(record["filled"]), record["room"], record["bytes"])


def expected_omissions(match: float, states: int) -> float:
    """Return a bound on the expected number of states that matched a known one.

    Each stored state accounts, in the mean, for ``match / (1 - match)`` earlier trials that were
    not stored, as ``match`` is the greatest probability of that. States that are reachable only
    through those may have been missed, too.
    """
    return states * match / (1 - match) if match < 1 else math.inf


def omission_probability(match: float, depth: int) -> float:
    """Return a bound on the probability that a given reachable state was missed.

    Breadth first, a state is missed only if one on a shortest path to it matched a known one (Stern
    and Dill 1996). If none of the first ``n`` did, the ``n``-th was stored ``n`` steps deep. So the
    first match is at most one step deeper than the search, and at most ``depth + 2`` states of the
    path were looked up for the first time.
    """
    return min(1.0, (depth + 2) * match)
