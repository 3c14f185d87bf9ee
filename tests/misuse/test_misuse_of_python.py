"""Generated Python, the extension module and a `Session`, each in the hands of an abusive host.

The account is kept outside: the host knows how many events wait, so it knows what each `post` must
return and how many events each `run` must handle.
"""

from __future__ import annotations

import random
import sys
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import pytest

from fsmkit import Session
from fsmkit.chart.loading import load
from fsmkit.codegen.python.loading import load_machine
from fsmkit.diagnostics import FsmkitError
from fsmkit.testing.harness.pyext import load_class
from tests.misuse.conftest import ABUSED, EVENTS

QUEUE, MICROSTEPS, PERIOD = 8, 20, 10
WRAP = 2**32
FAR = 2**31


class SetClock:
    """A clock that says what it is told to, which no clock may."""

    def __init__(self) -> None:
        self.ticks = 0

    def microseconds(self) -> int:
        return 1000 * self.ticks


class OfSession:
    """A session with the members of a generated machine."""

    def __init__(self, host: object) -> None:
        self.clock = SetClock()
        self.session = Session(load(ABUSED), host, self.clock, start=False, keep=10)
        self.post = self.session.post

    def start(self, now: int = 0) -> None:
        self.clock.ticks = now
        self.session.start()

    def run(self, now: int) -> None:
        self.clock.ticks = now
        self.session.run()

    def dispatch(self, event: str, *values: int) -> bool:
        return bool(self.session.dispatch(event, *values))

    def next_deadline(self) -> int | None:
        return self.session.next_deadline

    def is_in(self, state: str) -> bool:
        return self.session.is_in(state)

    def __getattr__(self, name: str) -> Any:
        of_session = {"running": "is_running", "finished": "is_finished", "fault": "fault"}
        if name in of_session:
            return getattr(self.session, of_session[name])
        return self.session[name]


@pytest.fixture(
    params=["session", "python", pytest.param("pyext", marks=pytest.mark.cc)], scope="module"
)
def machine_class(request: pytest.FixtureRequest, require_tool: Callable[[str], str]) -> Any:
    if request.param == "session":
        return OfSession
    if request.param == "pyext":
        require_tool("cc")
        return load_class(load(ABUSED))
    return load_machine(load(ABUSED))


class Abuser:
    """A host with its machine; `posted` is `handled + ignored + refused + given_up`."""

    def __init__(self, machine_class: Any) -> None:
        self.is_modulo = machine_class is not OfSession
        self.machine: Any = machine_class(self)
        self.draw = random.Random(7).randrange
        self.posted = self.handled = self.ignored = self.refused = self.given_up = 0
        self.waiting = self.number = self.order = self.nested = self.now = 0
        self.is_nesting = False

    def touched(self, number: int) -> None:
        """Do within a step all that must not be done there."""
        assert number > self.order
        self.order = number
        self.handled += 1
        self.waiting -= 1
        if not self.is_nesting:
            return
        refused: list[object] = []

        def step() -> None:
            machine = self.machine
            calls = ((machine.run, (self.now + 1000,)), (machine.dispatch, ("tap", 0)),
                     (machine.start, (0,)))  # fmt: skip
            for call, arguments in calls:
                try:
                    refused.append(call(*arguments))
                except (RuntimeError, FsmkitError) as error:
                    refused.append(error)

        clock = self.now
        step()
        if self.draw(100) == 0:  # and so must another thread not
            other = threading.Thread(target=step)
            other.start()
            other.join()
        assert all(isinstance(error, (RuntimeError, FsmkitError)) for error in refused)
        self.nested += len(refused)
        if isinstance(self.machine, OfSession):
            self.machine.clock.ticks = clock
        for _ in range(self.draw(3)):
            self.tap()

    def tap(self) -> bool:
        self.posted += 1
        self.number += 1
        has_room = bool(self.machine.running) and self.waiting < QUEUE
        assert self.machine.post("tap", self.number) is has_room
        self.waiting += has_room
        self.refused += not has_room
        return bool(has_room)

    def run(self, now: int) -> None:
        self.now = now % WRAP if self.is_modulo else now
        self.machine.run(now)

    def anew(self, now: int = 0) -> None:
        self.given_up += self.waiting
        self.waiting = 0
        self.now = now
        self.machine.start(now)
        machine = self.machine
        assert (machine.running, machine.finished, machine.fault) == (True, False, None)
        assert machine.is_in("idle")
        assert machine.handled == 0

    def is_stopped(self, fault: str | None) -> None:
        handled = self.machine.handled
        for _ in range(self.draw(4)):
            assert not self.tap()
        self.run(self.draw(1000))
        assert not self.machine.dispatch("tap", 0)
        assert self.machine.handled == handled
        assert (self.machine.running, self.machine.fault) == (False, fault)


def before_start(host: Abuser, machine_class: Any) -> None:
    host.given_up += host.waiting
    host.waiting = 0
    host.machine = machine_class(host)
    for _ in range(host.draw(9)):
        host.is_stopped(None)
    host.anew(host.draw(1000))
    host.tap()
    host.run(0)
    assert host.machine.handled == 1


def within_a_step(host: Abuser, _: Any) -> None:
    if not host.machine.is_in("beating"):
        assert host.machine.dispatch("beat_on")
    host.is_nesting = True
    for _ in range(host.draw(12)):
        host.tap()
    host.run(host.now + host.draw(30))
    host.is_nesting = False
    assert host.machine.is_in("beating")


def beats(host: Abuser, now: int, due: int) -> int:
    """Run; the timer fires once for each of its deadlines. Returns the one that is next."""
    before, fired = host.machine.beats, 0
    while due <= now:
        due += PERIOD
        fired += 1
    host.tap()
    host.run(now)
    assert host.machine.beats == before + fired
    assert host.machine.next_deadline() == (due % WRAP if host.is_modulo else due)
    assert host.waiting == 0
    return due


def backwards(host: Abuser, _: Any) -> None:
    now = FAR + host.draw(FAR)
    due = now + PERIOD
    host.anew(now)
    assert host.machine.dispatch("beat_on")
    for _ in range(50):
        due = beats(host, now - (host.draw(200) if host.draw(4) else host.draw(FAR - 256)), due)
        now += host.draw(200)
        due = beats(host, now, due)


def wrap(host: Abuser, _: Any) -> None:
    now = WRAP - 1 - host.draw(300)
    due = now + PERIOD
    host.anew(now)
    assert host.machine.dispatch("beat_on")
    for _ in range(50):
        now += host.draw(30)
        due = beats(host, now, due)


def full(host: Abuser, _: Any) -> None:
    for i in range(3 * QUEUE):
        assert host.tap() is (i < QUEUE)
    host.run(host.now + host.draw(30))
    assert host.waiting == 0


def deferred(host: Abuser, _: Any) -> None:
    assert host.machine.dispatch("hold")
    for i in range(2 * QUEUE):
        assert host.tap() is (i < QUEUE)
        host.run(host.now + host.draw(3))
    assert host.waiting == QUEUE
    assert host.machine.dispatch("release")
    host.run(host.now)
    assert host.waiting == 0


def endless(host: Abuser, _: Any) -> None:
    for _ in range(host.draw(12)):
        host.tap()
    assert host.machine.dispatch(("whirl", "circle")[host.draw(2)])
    assert host.machine.loops <= MICROSTEPS
    host.is_stopped("microsteps")
    host.anew()


def to_itself(host: Abuser, _: Any) -> None:
    host.anew()
    assert host.machine.post("echo")
    host.posted += 1
    host.waiting += 1
    for _ in range(host.draw(9)):
        loops = host.machine.loops
        host.tap()
        host.run(host.now + 1)
        assert loops < host.machine.loops <= loops + MICROSTEPS + QUEUE
        assert host.waiting == 1
    host.anew()


def after_the_end(host: Abuser, _: Any) -> None:
    for _ in range(host.draw(12)):
        host.tap()
    assert host.machine.dispatch("finish")
    assert host.machine.finished
    host.is_stopped(None)
    host.anew()


def no_event(host: Abuser, _: Any) -> None:
    host.posted += 1
    if host.draw(3):
        with pytest.raises((ValueError, FsmkitError)):
            host.machine.post("nosuch")
        host.refused += 1
        return
    assert host.machine.post("other")
    host.run(host.now)
    assert host.machine.is_in("idle")
    host.ignored += 1


MISUSES = [before_start, within_a_step, backwards, wrap, full, deferred, endless, to_itself,
           after_the_end, no_event]  # fmt: skip


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("misuse", MISUSES, ids=lambda misuse: misuse.__name__)
def test_every_event_is_accounted_for(
    misuse: Callable[[Abuser, Any], None], machine_class: Any
) -> None:
    host = Abuser(machine_class)
    host.machine.start(0)
    while host.posted < EVENTS // len(MISUSES):
        misuse(host, machine_class)
    host.anew()
    parts = ("handled", "ignored", "refused", "given_up")
    counts = {part: getattr(host, part) for part in parts}
    sys.stdout.write(f"{machine_class.__name__} {misuse.__name__}: posted {host.posted}, {counts}, "
                     f"calls from within {host.nested}\n")  # fmt: skip
    assert host.posted == sum(counts.values())


def test_what_another_thread_hands_over_arrives(machine_class: Any) -> None:
    """Events of another thread go through a queue of Python: the machine is of one thread."""
    host = Abuser(machine_class)
    inbox: SimpleQueue[int] = SimpleQueue()

    def hand_over() -> None:
        for number in range(EVENTS // 10):
            inbox.put(number)

    other = threading.Thread(target=hand_over)
    other.start()
    host.machine.start(0)
    for number in range(EVENTS // 10):
        assert inbox.get() == number
        if not host.tap():
            host.run(host.now + 1)
    other.join()
    host.run(host.now + 1)
    assert host.handled + host.refused == EVENTS // 10


def test_what_was_posted_by_a_step_of_a_session_that_raised_is_gone_with_it() -> None:
    class RaisesOnce:
        error: OSError | None = OSError("once")

        def touched(self, number: int) -> None:
            if self.error is not None:
                session.post("tap", number + 1)
                error, self.error = self.error, None
                raise error

    session = Session(load(ABUSED), RaisesOnce())
    session.post("tap", 1)
    with pytest.raises(OSError, match="once"):
        session.run()
    counts = [session["handled"]]
    for _ in range(2):
        session.run()
        counts.append(session["handled"])
    assert counts == [0, 1, 1]
