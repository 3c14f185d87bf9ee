"""One link with a carrier for each peer: frames to nodes of fsmkit, translators to foreign ones."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.carriers.in_process import Wire
from fsmkit.carriers.in_process.plugin import InProcess
from fsmkit.cli import execute
from fsmkit.runtime.links import EventMap, Link, opening
from fsmkit.runtime.links.codec import Codec, Frame
from fsmkit.runtime.links.opening import foreign_peers, open_link
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.deployment.event_map import LEVELS
from tests.runtime.links.conftest import HERE, HOSTS, LINKS

OVEN = {
    "oven.yaml": """\
system: Oven
machines: {control: control.yaml, lamp: lamp.yaml, heater: heater.yaml}
connect:
  - heater.warm -> control.warmed
  - control.set_power -> heater.set_power
  - heater.temperature -> control.temperature
  - control.lit -> lamp.lit
environment: {will: [heater]}
""",
    "control.yaml": """\
chart: Control
inputs: {temperature: -400..1000}
outputs: {lit: bool}
events: {in: [warmed(n 0..9)], out: [set_power(percent 0..100)]}
initial: idle
states:
  idle:
    on: {warmed: {if: temperature > 0, do: "lit = not lit; send set_power(percent = 5)"}}
""",
    "lamp.yaml": "chart: Lamp\ninputs: {lit: bool}\ninitial: on\nstates: {on: {}}\n",
    "heater.yaml": """\
chart: Heater
outputs: {temperature: -400..1000 = 0}
events: {in: [set_power(percent 0..100)], out: [warm(n 0..9)]}
initial: on
states:
  on: {after: {10ms: {target: on, do: send warm(n = 1)}}}
""",
}


@pytest.fixture(scope="module")
def oven(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Write a deployment with the nodes, beside its system."""

    def written(nodes: str) -> Path:
        folder = tmp_path_factory.mktemp("oven")
        for name, text in OVEN.items():
            (folder / name).write_text(text)
        (folder / "deployment.yaml").write_text(f"system: oven.yaml\nnodes: {nodes}\n")
        return folder / "deployment.yaml"

    return written


def map_of(path: Path) -> EventMap:
    found = fsmkit.read(path)
    assert isinstance(found, Deployment)
    return found.map


class Heater:
    """A translator that keeps what it is given, and hands over frames that a test has put there."""

    def __init__(self, link: Link, node: int) -> None:
        self.link = link
        self.node = node
        self.codec = Codec(link.map)
        self.taken: list[Frame] = []
        self.coming: list[Frame] = []
        self.is_closed = False

    def take(self, frame: Frame) -> None:
        self.taken.append(frame)

    def poll(self) -> None:
        for frame in self.coming:
            self.link.receiver.arrive(self.node, self.codec.encode(frame))
        self.coming.clear()

    def close(self) -> None:
        self.is_closed = True


class Heaters:
    name = "can"

    def translator(self, link: Link, node: int, options: Any) -> Heater:
        assert options == {"bus": "vcan0"}
        return Heater(link, node)


@pytest.fixture
def heaters(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the translator of these tests serve foreign nodes."""
    kinds = {"can": Heaters(), "in_process": InProcess()}
    monkeypatch.setattr(opening, "plugin", lambda _, name: kinds[name])


@pytest.mark.usefixtures("heaters")
def test_a_peer_of_fsmkit_counts_no_gap_where_a_translator_takes_events(
    oven: Callable[[str], Path],
) -> None:
    event_map = map_of(oven("{a: [control], b: [lamp], can: {machines: [heater], foreign: can}}"))
    assert foreign_peers(event_map, 0) == (2,)
    assert foreign_peers(event_map, 1) == ()
    wire = Wire()
    foreign = {"can": {"bus": "vcan0"}}
    options = {"wire": wire}
    a, b = (
        open_link(event_map, n, session=1, kind="in_process", options=options, foreign=foreign)
        for n in "ab"
    )
    a.wait_listeners(0.1)
    (heater,) = a.translators
    assert isinstance(heater, Heater)
    assert b.translators == ()
    for n in range(20):
        heater.coming.append(Frame(2, 1, 2 * n, n, LEVELS, (300,)))
        heater.coming.append(Frame(2, 1, 2 * n + 1, n, 1, (1,)))
        a.begin_cycle()
        assert a.level("heater.temperature -> control.temperature") == 300
        while (message := a.receive()) is not None:
            assert (message.machine, message.event) == ("control", "warmed")
            a.send(event_map.message("control.set_power -> heater.set_power", percent=n))
        a.end_cycle({"control.lit -> lamp.lit": n % 2 == 1})
        b.begin_cycle()
    powers = [frame.values for frame in heater.taken if frame.message == 2]
    assert powers == [(n,) for n in range(20)]
    counters = b.counters("a")
    assert (counters.frames, counters.lost_frames, counters.lost_events) == (40, 0, 0)
    assert b.level("control.lit -> lamp.lit") is True
    assert a.counters("can").lost_frames == 0
    assert a.silence("can") == 0
    a.close()
    assert heater.is_closed


@pytest.mark.usefixtures("heaters")
def test_a_node_without_a_peer_of_fsmkit_needs_no_other_carrier(
    oven: Callable[[str], Path],
) -> None:
    event_map = map_of(oven("{a: [control, lamp], can: {machines: [heater], foreign: can}}"))
    link = open_link(event_map, "a", session=1, foreign={"can": {"bus": "vcan0"}})
    link.wait_listeners(0.0)
    link.send(event_map.message("control.set_power -> heater.set_power", percent=7))
    link.end_cycle({})
    (heater,) = link.translators
    assert isinstance(heater, Heater)
    assert (LEVELS, ()) in [(frame.message, frame.values) for frame in heater.taken]
    assert (2, (7,)) in [(frame.message, frame.values) for frame in heater.taken]


@pytest.mark.cc
@pytest.mark.parametrize("sanitizers", ["address,undefined", "thread"])
def test_in_c_a_translator_hands_over_in_its_own_thread(
    sanitizers: str,
    oven: Callable[[str], Path],
    tmp_path: Path,
    require_tool: Callable[[str], str],
) -> None:
    path = oven("{a: [control, lamp], can: {machines: [heater], foreign: can}}")
    assert execute(["compile", str(path), "--out", str(tmp_path)]) == 0
    program = tmp_path / "fan_player"
    done = subprocess.run(
        [
            require_tool("gcc"),
            *("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"),
            *(f"-fsanitize={sanitizers}", "-fno-sanitize-recover=all", "-g", "-O1"),
            *(f"-I{folder}" for folder in (LINKS, HOSTS, tmp_path / "a")),
            *(str(LINKS / name) for name in ("fsm_link.c", "fsm_link_fan.c")),
            *map(str, sorted((tmp_path / "a").glob("*.c"))),
            str(HERE / "fan_player.c"),
            *("-pthread", "-o", str(program)),
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    run = subprocess.run([program], capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 0, run.stderr
    # powers, then frames of the session, lost_*, missed, late, doubled, overflow, restarts
    assert run.stdout == "powers 2001 1 0 0 0 0 0 0 1 malformed 2\n"
