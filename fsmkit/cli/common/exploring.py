"""The options of verbs that explore: subject, method and limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any

import click

from fsmkit.cli.common.interrupts import start_time
from fsmkit.cli.common.options import (
    REPLACE,
    SILENT,
    TIMEOUT,
    OneOf,
    project_for,
    read_max_pending,
    read_size,
    value_or_default,
)
from fsmkit.verify.explore import REDUCTIONS, ExplorationOptions
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.resources.time import TIMES
from fsmkit.verify.statespace.ranks import MOST_RANKS, Ranks
from fsmkit.verify.statespace.storage import Storage
from fsmkit.verify.statespace.symbolic_search import SEARCHES, Search

MODEL = ("time", "max_pending", "silent", "parameters", "replacing")
SEARCH = ("search", "engine", "storage", "memory", "workers", "order", "without")
COMPUTERS = ("mpi", "hostfile", "checkpoints", "checkpoint_every")
"""Names of parameters, by headings."""


@dataclass(frozen=True, slots=True)
class Exploring:
    """The values of the options. ``names``: the properties to evaluate; empty: all."""

    options: ExplorationOptions
    names: frozenset[str]
    replacing: Mapping[str, Path]
    deadline: Deadline


def exploring_options(body: Callable[..., int]) -> Callable[..., int]:
    """Add the options to a verb with the argument ``file`` or ``files``; it gets `Exploring`."""

    @click.option(
        "--property",
        "names",
        multiple=True,
        metavar="NAME",
        help="Evaluate only this property; repeatable.",
    )
    @TIMEOUT
    @click.option(
        "--time",
        type=OneOf("kind of time", TIMES),
        default="zones",
        show_default=True,
        help="Choose dense time, ticks, or no time.",
    )
    @click.option(
        "--max-pending",
        metavar="N|none",
        callback=read_max_pending,
        help="Hold external events while more than N are queued.",
    )
    @SILENT
    @REPLACE
    @click.option(
        "--search",
        type=OneOf("search", SEARCHES),
        default=Search.AUTO.value,
        show_default=True,
        help="Store single states or a decision diagram.",
    )
    @click.option(
        "--engine",
        type=OneOf("engine", ("c", "python")),
        help="Explore with generated C (default) or the interpreter.",
    )
    @click.option(
        "--storage",
        type=OneOf("storage", [storage.value for storage in Storage]),
        default=Storage.EXACT.value,
        show_default=True,
        help="Store states whole, or as hashes (lossy).",
    )
    @click.option(
        "--memory", callback=read_size, default="4G", show_default=True, help="Use at most this."
    )
    @click.option(
        "--workers",
        type=click.IntRange(1, 64),
        default=1,
        show_default=True,
        help="Use this many cores.",
    )
    @click.option(
        "--order",
        metavar="MACHINE,...",
        default="",
        help="Order the machines of a decision diagram, from the top.",
    )
    @click.option(
        "--no-reduction",
        "without",
        multiple=True,
        type=OneOf("reduction", REDUCTIONS),
        help="Disable this reduction (same verdicts); repeatable.",
    )
    @click.option(
        "--mpi",
        type=click.IntRange(1, MOST_RANKS),
        metavar="N",
        help="Explore in N MPI processes of --memory each.",
    )
    @click.option(
        "--hostfile",
        type=click.Path(path_type=Path, exists=True, dir_okay=False),
        help="Run the processes of --mpi on these hosts.",
    )
    @wraps(body)
    def whole(
        *arguments: Any,
        names: tuple[str, ...],
        timeout: float,
        time: Any,
        max_pending: int | None,
        silent: bool,
        replacing: Mapping[str, Path],
        search: str,
        engine: str | None,
        storage: str,
        memory: int,
        workers: int,
        order: str,
        without: tuple[str, ...],
        mpi: int | None,
        hostfile: Path | None,
        **more: Any,
    ) -> int:
        files = more.get("files") or (more["file"],)
        project, context = project_for(files), click.get_current_context()
        if project is not None:
            timeout = value_or_default(context, "timeout", timeout, project.check.get("timeout"))
            memory = value_or_default(context, "memory", memory, project.check.get("memory"))
        deadline = Deadline(timeout, start_time())
        if silent and time != "untimed":
            raise click.UsageError("--assume-watchdogs-silent needs --time untimed")
        if mpi is None and hostfile is not None:
            raise click.UsageError("--hostfile goes with --mpi")
        options = ExplorationOptions(
            engine or "",
            time=time,
            assume_watchdogs_silent=silent,
            memory=memory,
            timeout=timeout,
            workers=workers,
            reductions=frozenset(REDUCTIONS).difference(without),
            storage=Storage(storage),
            search=Search(search),
            order=tuple(name.strip() for name in order.split(",") if name.strip()),
            max_pending=max_pending,
            ranks=None if mpi is None else Ranks(mpi, hostfile),
        )
        exploring = Exploring(options, frozenset(names), replacing, deadline)
        return body(*arguments, exploring=exploring, **more)

    return whole
