"""Set priority and processors of a link's threads and of ZeroMQ's, as in ``fsm_link_zmq.c``."""

from __future__ import annotations

import os
import threading
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import zmq

from fsmkit.diagnostics import fail

HIGHEST = 99
"""The greatest priority of SCHED_FIFO on Linux."""


@dataclass(frozen=True, slots=True)
class Scheduling:
    """The scheduling of threads. ``priority``: of SCHED_FIFO, 1 to 99; 0: as the process has.

    ``cpus``: the numbers of the processors on which they may run; empty: on all of the process.
    """

    priority: int = 0
    cpus: frozenset[int] = frozenset()

    def require(self) -> None:
        """Raise `FsmkitError` for an impossible priority or processor."""
        if type(self.priority) is not int or not 0 <= self.priority <= HIGHEST:
            raise fail(
                "link-not-opened",
                f"a link cannot have the priority `{self.priority}`",
                help=f"choose 1 to {HIGHEST}, or 0 for none",
            )
        if any(type(cpu) is not int or cpu < 0 for cpu in self.cpus):
            raise fail(
                "link-not-opened",
                f"`{min(self.cpus, key=str)}` is not a number of a processor",
                help="processors have the numbers 0, 1 and so on",
            )

    def apply(self) -> tuple[str, ...]:
        """Schedule the calling thread; return the rejected settings, with the reason."""
        refused = []
        if self.priority and not hasattr(os, "sched_setscheduler"):
            refused.append(f"priority {self.priority}: this system has no SCHED_FIFO")
        elif self.priority:
            try:
                os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(self.priority))
            except OSError as error:
                refused.append(f"priority {self.priority}: {error.strerror}")
        if self.cpus and not hasattr(os, "sched_setaffinity"):
            refused.append(f"processors {_listed(self.cpus)}: this system cannot bind threads")
        elif self.cpus:
            try:
                os.sched_setaffinity(0, self.cpus)
            except (OSError, OverflowError) as error:
                reason = error.strerror if isinstance(error, OSError) else str(error)
                refused.append(f"processors {_listed(self.cpus)}: {reason}")
        return tuple(refused)

    def apply_to(self, context: zmq.Context[zmq.Socket[bytes]]) -> tuple[str, ...]:
        """Schedule ZeroMQ's threads, before the first socket; return the rejected settings.

        ZeroMQ ends the process if the system rejects them (``posix_assert``), so a thread of our
        own tries first.
        """
        refused: list[str] = []
        trial = threading.Thread(target=lambda: refused.extend(self.apply()))
        trial.start()
        trial.join()
        if self.priority and not any(text.startswith("priority") for text in refused):
            context.set(zmq.THREAD_SCHED_POLICY, os.SCHED_FIFO)
            context.set(zmq.THREAD_PRIORITY, self.priority)
        if not any(text.startswith("processors") for text in refused):
            for cpu in sorted(self.cpus):
                context.set(zmq.THREAD_AFFINITY_CPU_ADD, cpu)
        return tuple(refused)


def _listed(cpus: AbstractSet[int]) -> str:
    return ", ".join(str(cpu) for cpu in sorted(cpus))
