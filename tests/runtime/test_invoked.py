"""`Session` and snapshots of machines that invoke others (SCXML 6.4)."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime import saving
from fsmkit.runtime.clock import SimulatedClock
from fsmkit.runtime.host_methods import Delivery
from fsmkit.runtime.session import Session, bind

SHOP = Path(__file__).parents[1] / "golden/shop.yaml"
TWINS = """\
chart: Twins
events: {in: [go]}
data: {n: uint8 = 0}
initial: a
states:
  a:
    defer: o
    invoke:
      - id: left
        finalize: n += 1
        content: CONTENT
      - id: right
        finalize: n += 10
        content: CONTENT
    on:
      go: {do: 'send go to "#_left" after 1ms; send go to "#_right" after 2ms'}
    after: {50ms: b}
  b:
    on: {o: {do: n += 100}}
""".replace(
    "CONTENT",
    "{chart: Inner, events: {in: [go], out: [o]}, initial: i,"
    " states: {i: {on: {go: {do: 'send o to \"#_parent\" after 10ms'}}}}}",
)


class Shop:
    """Performs what the press asks for."""

    def __init__(self) -> None:
        self.told: list[object] = []

    def stamp(self, n: int) -> None:
        self.told.append(n)

    def measure(self) -> int:
        return 4

    def on_pressed(self, n: int) -> None:
        self.told.append(("pressed", n))


@pytest.fixture
def shop() -> Chart:
    return load(SHOP)


def test_the_host_hears_of_invoked_machines_and_of_nothing_between_them(shop: Chart) -> None:
    heard: list[Delivery] = []
    host = Shop()
    machine = Session(shop, host, on_event=heard.append)
    machine.post("go")
    machine.run()
    machine.post("hint", 3)
    machine.run()
    machine.post("stop")
    machine.run()
    assert host.told == [8, ("pressed", 3)]
    assert [one.event for one in heard] == ["pressed", "sold"]
    assert "press: out ready 8 to #_parent" in machine.trace_text()


def test_operations_of_invoked_machines_are_demanded(shop: Chart) -> None:
    with pytest.raises(FsmkitError) as error:
        Session(shop, {"stamp": print})
    assert "measure" in str(error.value)
    with pytest.raises(FsmkitError):
        bind(shop)(type("Nothing", (), {}))


def test_what_runs_is_told_by_id(shop: Chart) -> None:
    machine = Session(shop, Shop())
    assert machine.invoked == {}
    machine.post("go")
    machine.run()
    assert machine.invoked == {"press": ("up",), "press: feeder": ("full",)}
    assert machine.configuration == ("work",)
    assert machine.next_deadline == 50
    machine.post("stop")
    machine.run()
    assert machine.invoked == {}


def test_invoked_machines_are_saved_with_their_timers(shop: Chart) -> None:
    machine = Session(shop, Shop())
    machine.post("go")
    machine.run()
    machine.advance("20ms")
    machine.post("hint", 3)
    machine.run()
    saved = json.loads(json.dumps(machine.save()))
    clock = SimulatedClock()
    clock.advance(7_000_000)
    other = Session(shop, Shop(), clock)
    other.restore(saved)
    assert other.invoked == machine.invoked
    assert other.next_deadline == 7030
    machine.trace.clear()
    machine.advance("200ms")
    other.trace.clear()
    other.advance("200ms")
    shifted = [line.partition(" > ")[2] or line for line in other.trace_text().splitlines()]
    wanted = [line.partition(" > ")[2] or line for line in machine.trace_text().splitlines()]
    assert shifted == wanted
    assert len(wanted) > 20
    assert other.snapshot.data == machine.snapshot.data


def test_events_of_one_name_keep_their_invocations(
    build: Callable[[str], Chart],
) -> None:
    chart = build(TWINS)
    machine = Session(chart)
    machine.post("go")
    machine.run()
    clock = SimulatedClock()
    saved = json.loads(json.dumps(machine.save()))
    assert [timer["invocations"] for timer in saved["timers"] if "event" in timer] == [[0], [1]]
    other = Session(chart, None, clock)
    other.restore(saved)
    other.advance("20ms")
    assert other["n"] == 11
    queued = [event.get("invocation") for event in other.save()["deferred"]]
    assert queued == [0, 1]
    third = Session(chart, None, clock)
    third.restore(json.loads(json.dumps(other.save())))
    assert third.snapshot.deferred == other.snapshot.deferred
    third.advance("50ms")
    assert third["n"] == 211, "what is recalled is not finalized again"


def test_a_damaged_snapshot_of_an_invoked_machine_is_refused(shop: Chart) -> None:
    machine = Session(shop, Shop())
    machine.post("go")
    machine.run()
    damages: tuple[Callable[[dict[str, Any]], object], ...] = (
        lambda saved: saved["invoked"].clear(),
        lambda saved: saved["invoked"][0].pop("timers"),
        lambda saved: saved["queue"].append({"event": "ready", "invocation": 7, "fields": {}}),
    )
    for damage in damages:
        saved = machine.save()
        damage(saved)
        with pytest.raises(FsmkitError) as error:
            saving.restore(shop, saved, 0)
        assert "foreign-snapshot" in str(error.value)
