"""A search by several processes (MPI), each with a part of the states (``core/mpi``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import fail
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.storage import Storage
from fsmkit.verify.statespace.symbolic_search import Search

MOST_RANKS = 1 << 15
NEEDS_ONE = "it needs the whole graph in one process: check it without `--mpi`"


@dataclass(frozen=True, slots=True)
class Ranks:
    """How many processes there are, and where.

    ``hostfile``: hosts as ``mpirun`` reads them; None: this machine, or what a batch system gives.
    ``folder``: of checkpoints, from which a search goes on; ``every``: layers from one to the next.
    """

    count: int
    hostfile: Path | None = None
    folder: Path | None = None
    every: int = 16

    def __post_init__(self) -> None:
        """Refuse numbers that mean nothing (``wrong-option``)."""
        if not isinstance(self.count, int) or not 1 <= self.count <= MOST_RANKS or self.every < 1:
            raise fail(
                "wrong-option",
                f"there are no {self.count} ranks with a checkpoint every {self.every} layers",
                help=f"give 1 to {MOST_RANKS:,} ranks, and 1 layer or more",
            )


@dataclass(frozen=True, slots=True)
class Traffic:
    """What ranks sent each other.

    ``told``: states that went to another rank; ``filtered``: those that did not, as they had gone
    there lately; ``sent``: bytes of messages; ``resident``: bytes of memory of all processes;
    ``seconds``: of the search, without its results.
    """

    ranks: int
    told: int
    filtered: int
    sent: int
    resident: int
    seconds: float


def read_traffic(told: Mapping[str, Any] | None) -> Traffic | None:
    """Return what the explorer says of its ranks (``core/mpi/results.c``); None if it has none."""
    if told is None:
        return None
    return Traffic(
        ranks=told["count"],
        told=told["told"],
        filtered=told["filtered"],
        sent=told["sent"],
        resident=told["resident"],
        seconds=told["exploring"],
    )


def why_not_ranks(closed: ClosedSystem, storage: Storage, search: Search) -> str:
    """Return why a system cannot be explored by ranks; empty if it can."""
    if closed.zones:
        return "time is dense"
    if storage is not Storage.EXACT:
        return f"{storage.value} storage is of one process"
    if search is Search.SYMBOLIC:
        return "a decision diagram is of one process"
    return ""
