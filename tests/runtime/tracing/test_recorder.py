"""What a session records: what C records of the same script, and what a follower makes of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from fsmkit.chart.chart import Chart, every_operation
from fsmkit.chart.loading import load
from fsmkit.runtime.clock import SimulatedClock
from fsmkit.runtime.interpreter import Macrostep
from fsmkit.runtime.script import SeededHost, read_line, script_texts
from fsmkit.runtime.session import Session
from fsmkit.runtime.tracing.following import Divergence, Missing, ReplayedStep
from fsmkit.runtime.tracing.recorder import Recorder
from tests.codegen.c.recorded import by_interpreter, followed, recorded
from tests.codegen.c.test_recording import LAMP, expressible, has_symbols

SCRIPT = [
    "seed 7", "start 5", "input dark 1", "post press 3", "run 5", "post press 9", "run 50",
    "run 60", "run 70", "dispatch ask", "input level -5", "run 80", "save", "post press 9",
    "restore 80", "run 2100", "post ask", "run 2100",
]  # fmt: skip


def by_session(chart: Chart, script: Sequence[str], level: int = 2) -> bytes:
    """Play a script on a session that is recorded."""
    clock, host, data, saved = SimulatedClock(), SeededHost(chart, 1), bytearray(), b""
    none = {name: lambda *_: None for name in every_operation(chart)}
    session = Session(chart, none, clock, start=False)
    session._host = host  # type: ignore[assignment]  # values as a script's
    Recorder(session, data.extend, level)
    tick = chart.capacities.tick
    for line in script_texts(script):
        read = read_line(chart, line)
        if read.verb in ("start", "run", "restore"):
            clock.advance(read.number * tick - clock.microseconds())
        match read.verb:
            case "start":
                session.start()
            case "run":
                session.run()
            case "post":
                session.enqueue(read.event)
            case "dispatch":
                fields = chart.events[read.event.event].fields
                assert not fields
                session.dispatch(chart.events[read.event.event].name)
            case "input":
                session.drive(read.number, read.value)
            case "seed":
                host.state = read.number
            case "save":
                saved = session.save_bytes()
            case "restore":
                session.restore(saved)
            case _:
                raise AssertionError(line)
    return bytes(data)


@pytest.fixture
def lamp(tmp_path: Path) -> Chart:
    path = tmp_path / "lamp.yaml"
    path.write_text(LAMP)
    return load(path)


@pytest.mark.cc
@pytest.mark.parametrize("level", [1, 2])
def test_a_session_and_c_record_the_same_bytes(lamp: Chart, tmp_path: Path, level: int) -> None:
    (data,) = recorded(tmp_path, [(lamp, SCRIPT)], level=level)
    assert by_session(lamp, SCRIPT, level) == data


def plain(script: Sequence[str]) -> list[str]:
    """Return the lines of a script that a session without payloads can play, times in order."""
    kept, now = [], 0
    for line in script:
        verb, _, rest = line.partition(" ")
        if verb in ("start", "run"):
            now = max(now, int(rest) % 2**20)
            kept.append(f"{verb} {now}")
        elif verb in ("post", "input", "seed"):
            kept.append(line)
    return kept


@pytest.mark.slow
def test_sessions_of_random_charts_record_what_the_interpreter_does() -> None:
    jobs = [(chart, plain(script)) for chart, script in expressible(25) if not has_symbols(chart)]
    assert len(jobs) > 3
    for chart, script in jobs:
        assert by_session(chart, script) == by_interpreter(chart, script)


class Host:
    """Posts from within a step."""

    session: Session

    def sense(self) -> int:
        self.session.post("press", n=5)
        return 50

    def click(self) -> None:
        self.session.post("ask")


def test_what_an_operation_posts_is_followed(lamp: Chart) -> None:
    """It enters the queue after the step, and so is told after it."""
    host, data, clock = Host(), bytearray(), SimulatedClock()
    host.session = session = Session(lamp, host, clock, inputs={"dark": True})
    session.post("press", n=9)
    recorder = Recorder(session, data.extend)
    assert not [
        each for each in followed(lamp, bytes(data)) if isinstance(each, Missing | Divergence)
    ]
    for _ in range(30):
        session.advance("100ms")
    found = followed(lamp, bytes(data))
    assert not [each for each in found if isinstance(each, Missing | Divergence)]
    steps: list[Any] = [each.macrostep for each in found if isinstance(each, ReplayedStep)]
    did: list[Macrostep] = list(session.trace)[1:]
    assert [each.effects for each in steps] == [each.effects for each in did]
    recorder.close()
    session.advance("100ms")
    assert followed(lamp, bytes(data)) == found


def test_a_session_is_recorded_from_the_middle(lamp: Chart) -> None:
    session, data = Session(lamp, Host(), start=False), bytearray()
    Recorder(session, data.extend)
    assert data == b""
    session.post("ask")
    assert len(data) == 1
