"""Priority and processors of the threads of links over ZeroMQ."""

from __future__ import annotations

import os
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from fsmkit.diagnostics import FsmkitError
from tests.runtime.links.conftest import Open

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="threads are looked at in /proc")
PRIORITY = 7


def is_granted() -> bool:
    """Whether a thread of this process may have a priority of SCHED_FIFO."""
    found: list[bool] = []

    def ask() -> None:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
            found.append(True)
        except OSError:
            found.append(False)

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    return found[0]


def threads() -> set[int]:
    return {int(path.name) for path in Path("/proc/self/task").iterdir()}


def test_all_threads_of_a_link_have_its_priority_and_processor(connect: Open) -> None:
    before = threads()
    cpu = max(os.sched_getaffinity(0))
    link: Any = connect("a", priority=PRIORITY, cpus=[cpu])
    new = threads() - before
    assert len(new) >= 4  # sender and receiver; ZeroMQ's reaper and one for input and output
    until = time.monotonic() + 20  # each thread schedules itself, when it comes to run
    while any(os.sched_getaffinity(t) != {cpu} for t in new) and time.monotonic() < until:
        time.sleep(0.01)
    assert {frozenset(os.sched_getaffinity(thread)) for thread in new} == {frozenset({cpu})}
    policies = {os.sched_getscheduler(thread) for thread in new}
    if is_granted():
        assert link.not_granted == ()
        assert policies == {os.SCHED_FIFO}
        assert {os.sched_getparam(thread).sched_priority for thread in new} == {PRIORITY}
    else:
        assert policies == {os.SCHED_OTHER}
        assert link.not_granted == (f"priority {PRIORITY}: Operation not permitted",)


def test_what_is_refused_is_reported_and_the_link_works(
    connect: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    a: Any = connect("a", priority=PRIORITY)
    b: Any = connect("b", cpus=[100_000])
    assert a.not_granted == (f"priority {PRIORITY}: Operation not permitted",)
    assert len(b.not_granted) == 1
    assert b.not_granted[0].startswith("processors 100000: ")
    a.wait_listeners(20)
    b.wait_listeners(20)


def test_without_options_nothing_is_changed(connect: Open) -> None:
    before = threads()
    link: Any = connect("a")
    assert link.not_granted == ()
    assert {os.sched_getscheduler(thread) for thread in threads() - before} == {os.SCHED_OTHER}


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"priority": 100}, "the priority `100`"),
        ({"priority": -1}, "the priority `-1`"),
        ({"priority": "high"}, "the priority `high`"),
        ({"priority": True}, "the priority `True`"),
        ({"cpus": [-1]}, "`-1` is not a number of a processor"),
        ({"cpus": ["x"]}, "`x` is not a number of a processor"),
    ],
)
def test_what_cannot_be_is_refused(connect: Open, options: dict[str, Any], told: str) -> None:
    with pytest.raises(FsmkitError) as error:
        connect("a", **options)
    assert told in str(error.value)
