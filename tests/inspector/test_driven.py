"""What runs elsewhere and is stepped: it is stopped, paced and saved from a session."""

from __future__ import annotations

from pathlib import Path

import pytest

import fsmkit
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.sources import ended
from tests.inspector.conftest import Client
from tests.inspector.following import Elsewhere


class Stepped(Elsewhere):
    """A gate that goes on if it is told to."""

    is_running = True
    speed = 1.0

    def run(self, speed: float) -> None:
        self.is_running, self.speed = True, speed

    def pause(self) -> None:
        self.is_running = False

    def step(self, ticks: int) -> None:
        self.is_running = False
        self.taken.append(("step", ticks))

    def save(self, kind: str) -> str:
        return f"saved as {kind}"


@pytest.fixture
def source(gate: Path) -> Stepped:
    """Something stepped."""
    return Stepped(fsmkit.read_chart(gate), frozenset({"post", "run", "pause", "step"}))


def test_it_is_stopped_and_goes_on(source: Stepped) -> None:
    hub = Hub(source)
    client = Client(hub)
    hub.advance(1000)
    assert client.last("mode")["mode"] == "running"
    client.result("pause")
    stopped = not source.is_running
    assert stopped
    assert (client.last("mode")["mode"], client.last("mode")["why"]) == ("paused", ["asked"])
    client.result("run", speed=10)
    assert source.is_running
    assert (client.last("mode")["mode"], client.last("mode")["speed"]) == ("running", 10)


@pytest.mark.parametrize("speed", [0.2, 0.0, 30.0])
def test_it_goes_on_at_its_speed(source: Stepped, speed: float) -> None:
    source.speed = speed
    hub = Hub(source)
    client = Client(hub)
    hub.advance(1000)
    assert client.last("mode").get("speed", 1.0) == speed
    client.result("pause")
    client.result("run")
    assert source.speed == speed


def test_it_makes_steps(source: Stepped) -> None:
    hub = Hub(source)
    client = Client(hub)
    source.happen(until=0)
    source.happen("open")
    hub.advance(1000)
    assert client.result("step", how="tick") == 1
    assert client.result("step", how="timer") == 4000
    assert source.taken == [("step", 1), ("step", 4000)]


def test_a_frozen_view_leaves_it_alone(source: Stepped) -> None:
    hub = Hub(source)
    client = Client(hub)
    source.happen(until=0)
    hub.advance(1000)
    client.result("seek", n=0)
    assert source.is_running
    assert client.last("mode")["mode"] == "frozen"
    client.result("pause")
    assert source.is_running
    client.result("follow")
    assert client.last("mode")["mode"] == "running"


def test_it_is_saved_as_it_says(source: Stepped) -> None:
    client = Client(Hub(source))
    assert client.result("save", **{"as": "script"}) == "saved as script"


def test_one_that_is_not_stepped_now_is_only_looked_at(gate: Path) -> None:
    source = Stepped(fsmkit.read_chart(gate), frozenset({"post"}))
    hub = Hub(source)
    client = Client(hub)
    hub.advance(1000)
    client.result("pause")
    assert source.is_running
    assert client.last("mode")["mode"] == "frozen"


def test_who_comes_sees_the_last_samples(source: Stepped) -> None:
    source.sampled = {"speed": 1.0}
    hub = Hub(source)
    assert Client(hub).last("signals")["v"] == [1.0]
    source.sampled = {"speed": 2.0}
    hub.advance(20_000)
    client = Client(hub)
    assert client.last("hello")["signals"] == ["speed"]
    assert client.last("signals")["v"] == [2.0]


def test_the_end_is_told(source: Stepped) -> None:
    hub = Hub(source)
    client = Client(hub)
    source.error = ended("the plant was killed by signal 9")
    hub.advance(1000)
    assert client.last("mode")["mode"] == "frozen"
    assert client.last("mode")["why"] == [
        "fault", "source-ended", "the plant was killed by signal 9",
    ]  # fmt: skip
    assert client.say("post", m="Gate", event="open")["k"] == "refused"
