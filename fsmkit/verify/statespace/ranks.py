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
    """The number of processes, and their hosts.

    ``hostfile``: hosts as ``mpirun`` reads them; None: this machine, or those of a batch system.
    ``folder``: of checkpoints, from which a search continues; ``every``: layers between two of
    them.
    """

    count: int
    hostfile: Path | None = None
    folder: Path | None = None
    every: int = 16

    def __post_init__(self) -> None:
        """Reject invalid numbers (``wrong-option``)."""
        if not isinstance(self.count, int) or not 1 <= self.count <= MOST_RANKS or self.every < 1:
            raise fail(
                "wrong-option",
                f"{self.count} ranks with a checkpoint every {self.every} layers are not possible",
                help=f"give 1 to {MOST_RANKS:,} ranks, and 1 layer or more",
            )


@dataclass(frozen=True, slots=True)
class Traffic:
    """The messages between ranks.

    ``forwarded``: states sent to another rank; ``filtered``: those sent there recently;
    ``sent``: bytes of messages; ``resident``: bytes of memory of all processes; ``seconds``: of the
    search, without its results.
    """

    ranks: int
    forwarded: int
    filtered: int
    sent: int
    resident: int
    seconds: float


def read_traffic(found: Mapping[str, Any] | None) -> Traffic | None:
    """Parse the explorer's output on traffic (``core/mpi/results.c``); None without ranks."""
    if found is None:
        return None
    return Traffic(
        ranks=found["count"],
        forwarded=found["forwarded"],
        filtered=found["filtered"],
        sent=found["sent"],
        resident=found["resident"],
        seconds=found["exploring"],
    )


def why_not_ranks(closed: ClosedSystem, storage: Storage, search: Search) -> str:
    """Return why a system cannot be explored by ranks; empty if it can."""
    if closed.zones:
        return "time is dense"
    if storage is not Storage.EXACT:
        return f"{storage.value} storage needs one process"
    if search is Search.SYMBOLIC:
        return "a decision diagram needs one process"
    return ""
