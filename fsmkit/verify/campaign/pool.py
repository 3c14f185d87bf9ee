"""Workers of a campaign: those of a Dask cluster, or processes of this machine.

A worker that dies loses nothing: its job goes to another one. Only a job during which workers died
repeatedly is given up, with that as its outcome.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from importlib.util import find_spec
from itertools import islice

from fsmkit.diagnostics import fail
from fsmkit.verify.campaign.jobs import Job, Outcome
from fsmkit.verify.campaign.work import perform

TRIES = 3
"""How often a job is started, if its worker dies."""
AHEAD = 64
"""Jobs that a worker of a cluster is given ahead."""
FEW = 8
"""Jobs that are done by one process after one died."""
DIED = f"its worker died {TRIES} times"


def has_dask() -> bool:
    """Return whether Dask is installed, with its scheduler."""
    return find_spec("distributed") is not None


def perform_jobs(jobs: Sequence[Job], scheduler: str | None, workers: int) -> Iterator[Outcome]:
    """Yield the outcomes of all jobs as they arrive.

    ``scheduler``: the address of a Dask scheduler; None: workers of this machine, by Dask if that
    is installed. ``workers``: how many (0: one for each core); a scheduler has its own.
    """
    if scheduler is not None and not has_dask():
        raise fail(
            "no-dask",
            "Dask is not installed, but `--scheduler` needs it",
            help="`pip install 'fsmkit[cluster]'`; without --scheduler the campaign runs here",
        )
    count = workers or os.cpu_count() or 1
    yield from _by_dask(jobs, scheduler, count) if has_dask() else _by_processes(jobs, count)


def _by_dask(jobs: Sequence[Job], scheduler: str | None, workers: int) -> Iterator[Outcome]:
    import dask
    from distributed import Client, LocalCluster
    from distributed import as_completed as coming

    settings = {
        "distributed.scheduler.allowed-failures": TRIES - 1,
        "distributed.logging.distributed": "critical",
    }
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with dask.config.set(settings):
        try:
            cluster = scheduler or LocalCluster(
                n_workers=workers, threads_per_worker=1, dashboard_address=":0",
                silence_logs=logging.CRITICAL, memory_limit=None,
            )  # fmt: skip
            client = Client(cluster)
        except (OSError, ValueError, TypeError) as error:
            raise fail(
                "no-dask",
                f"there is no scheduler at `{scheduler}`: {error}",
                help="`dask scheduler` prints its address, such as tcp://10.0.0.1:8786",
            ) from error
        try:
            waiting = iter(jobs)
            by_key = {job.key: job for job in jobs}
            first = [
                client.submit(perform, job, key=job.key) for job in islice(waiting, AHEAD * workers)
            ]
            done = coming(first)
            for future in done:
                yield _outcome(future, by_key[future.key])
                future.release()
                for job in waiting:
                    done.add(client.submit(perform, job, key=job.key))
                    break
        finally:
            client.close()
            if not isinstance(cluster, str):
                cluster.close()


def _outcome(future: object, job: Job) -> Outcome:
    from distributed import Future as Remote
    from distributed.scheduler import KilledWorker

    assert isinstance(future, Remote)  # noqa: S101  (of `as_completed`)
    error = future.exception() if future.status == "error" else None
    if error is None and future.status == "finished":
        found: Outcome = future.result()
        return found
    why = DIED if isinstance(error, KilledWorker) else f"{type(error).__name__}: {error}"
    return Outcome(job.key, "error", why)


def _by_processes(jobs: Sequence[Job], workers: int) -> Iterator[Outcome]:
    """Without Dask: if one process dies, its whole pool ends.

    Then a few jobs run in one process each, so that the job that ended it is known.
    """
    left = {job.key: job for job in jobs}
    tries: dict[str, int] = dict.fromkeys(left, 0)
    few = False
    while left:
        some = list(left.values())[: FEW if few else len(left)]
        for outcome in _in_a_pool(some, 1 if few else workers):
            del left[outcome.key]
            yield outcome
        lost = [job.key for job in some if job.key in left]
        if lost and (few or workers == 1):
            tries[lost[0]] += 1
            if tries[lost[0]] == TRIES:
                del left[lost[0]]
                yield Outcome(lost[0], "error", DIED)
        few = bool(lost)


def _in_a_pool(jobs: Sequence[Job], workers: int) -> Iterator[Outcome]:
    """Yield the outcomes until a process dies."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        running = [pool.submit(perform, job) for job in jobs]
        for future in as_completed(running):
            with suppress(BrokenProcessPool):
                yield future.result()
