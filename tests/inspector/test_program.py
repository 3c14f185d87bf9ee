"""A session of a program is shown while it runs, and the program does not wait."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import fsmkit
import fsmkit.live
from devtools.differential import random_case
from fsmkit.chart.chart import every_operation
from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.showing import COMMANDS
from fsmkit.inspector.sources import Followed, program
from fsmkit.inspector.sources.program import ProgramSource
from fsmkit.language import default_value
from fsmkit.language.values import to_python
from fsmkit.runtime.live.messages import Set, Step
from fsmkit.runtime.script import is_received
from fsmkit.runtime.session import Session
from fsmkit.runtime.system_session import SystemSession
from tests.inspector.conftest import GATE, Client, elaborated
from tests.inspector.test_server import joined, messages, until
from tests.parameters import sampled

CHART = elaborated(GATE)
CELL = Path(__file__).parents[2] / "machines/production_cell/cell.yaml"
TICK = 16_000


def test_what_a_program_does_is_shown() -> None:
    session = Session(CHART, start=False)
    source = ProgramSource(session)
    assert isinstance(source, Followed)
    client = Client(Hub(source))
    session.start()
    session.inputs["blocked"] = True
    session.inputs["blocked"] = False
    session.post("open")
    session.run()
    session.advance("4s")
    client.hub.advance(TICK)
    told = [m for m in client.told if m["k"] in ("step", "post", "set")]
    assert [m["k"] for m in told] == ["step", "set", "set", "post", "step", "step"]
    assert told[-1]["at"] == 4000
    assert client.hub.moment is not None
    assert client.hub.moment.snapshots[0] == session.snapshot
    assert client.result("watch", expression="count")["value"] == 1
    saved = session.save()
    session.dispatch("close")
    session.restore(saved)
    client.hub.advance(TICK)
    assert client.last("state")["on"] == ["wide"]
    source.close()
    session.dispatch("close")
    client.hub.advance(TICK)
    assert client.last("state")["on"] == ["wide"]


def test_a_session_may_have_begun_before() -> None:
    session = Session(CHART)
    session.post("open")
    session.run()
    client = Client(Hub(ProgramSource(session)))
    assert client.last("state")["on"] == ["opening"]
    client.result("fork")
    client.result("step", how="timer")
    assert client.last("step")["on"] == ["wide"]
    assert session.active == ("opening",)


def test_commands_are_done_where_the_program_says_so() -> None:
    session = Session(CHART)
    source = ProgramSource(session, COMMANDS)
    client = Client(Hub(source))
    assert client.result("post", m="Gate", event="open") == "sent"
    assert client.result("set", m="Gate", input="blocked", value=True) is None
    assert session.active == ("closed",)
    assert source.obey() == 2
    assert session["blocked"] is True
    session.run()
    client.hub.advance(TICK)
    assert [m["k"] for m in client.told if m["k"] in ("post", "set", "step")] == [
        "post",
        "set",
        "step",
    ]
    for _ in range(program.MOST_ASKED):
        client.result("post", m="Gate", event="open")
    assert client.say("post", m="Gate", event="open")["k"] == "refused"
    assert source.obey() == program.MOST_ASKED


def test_what_is_too_much_is_lost_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "MOST_WAITING", 10)
    session = Session(CHART)
    client = Client(Hub(ProgramSource(session)))
    for _ in range(30):
        session.dispatch("close")
    client.hub.advance(TICK)
    assert client.last("lost")["count"] == 20
    session.dispatch("open")
    client.hub.advance(TICK)
    assert client.result("watch", expression="motor")["value"] is True


@pytest.mark.parametrize("number", sampled(range(20), every=4))
def test_random_charts_are_told_as_they_ran(number: int) -> None:
    chart = random_case(7, number).chart
    session = Session(chart, answers(chart), start=False)
    source = ProgramSource(session)
    session.start()
    for event in chart.events:
        if is_received(event) and not event.fields:
            session.post(event.name)
            session.run()
            session.advance(10)
    entries = source.receive()
    steps = [entry.stepped.macrostep for entry in entries if entry.stepped is not None]
    assert steps == list(session.trace)
    assert entries[-1].moment is not None
    assert entries[-1].moment.snapshots == (session.snapshot,)


def answers(chart: fsmkit.Chart) -> dict[str, Callable[..., object]]:
    """Return operations that answer with the least value of their type."""
    found: dict[str, Callable[..., object]] = {}
    for name, operation in every_operation(chart).items():
        type_ = operation.result
        value = None if type_ is None else to_python(default_value(type_), type_)
        found[name] = lambda *_, value=value: value
    return found


def test_a_system_is_shown_machine_by_machine() -> None:
    system = fsmkit.read_system(CELL)
    session = SystemSession(system)
    source = ProgramSource(session)
    done = [*session.start(), *session.run(1_000)]
    session.post("plant", "press_start")
    done += session.run(30_000)
    entries = source.receive()
    told = [entry for entry in entries if entry.stepped is not None]
    assert [e.stepped.macrostep for e in told if e.stepped] == [h.macrostep for h in done]
    assert entries[-1].moment is not None
    assert entries[-1].moment.snapshots == session.snapshots
    passed = [p for e in told if e.stepped for p in e.stepped.passed]
    assert passed
    assert all(each.has_room for each in passed)
    driven = [m for e in told for m in e.messages if isinstance(m, Set)]
    assert driven
    assert all(isinstance(e.messages[0], Step) for e in told)
    client = Client(Hub(ProgramSource(session)))
    client.result("break", m="feeder", on="taken", what=1)
    assert client.last("hello")["time"] == "live"


def test_it_is_served_by_a_thread_of_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    session = Session(CHART)
    with fsmkit.live.show(session) as shown:
        assert shown.address in capsys.readouterr().out
        with joined(shown._server) as client:
            assert [m["k"] for m in messages(client)] == ["hello", "state", "mode"]
            session.dispatch("open")
            assert until(client, "step")["on"] == ["opening"]
            client.send(json.dumps({"id": 1, "do": "back"}))
            assert until(client, "mode")["mode"] == "frozen"
            begin = time.perf_counter()
            for _ in range(1_000):
                session.dispatch("close")
            assert time.perf_counter() - begin < 20
        port = shown._server.port
        with pytest.raises(FsmkitError), fsmkit.live.show(Session(CHART), port=port):
            pass
    assert not any(thread.name == "fsmkit.live" for thread in threading.enumerate())
    assert not session.observers
