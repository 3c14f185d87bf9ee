"""The lanes and paths of the page name what is active, whatever the chart; its scripts in Node."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from random import Random
from typing import Any

import pytest

import fsmkit
from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.document.document import Kind
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.page import HERE
from fsmkit.system.system import System
from tests.inspector.conftest import REGIONS, Client, elaborated
from tests.inspector.test_offline import commands_of

pytestmark = [pytest.mark.external]
CELL = Path(__file__).parents[2] / "machines/production_cell"
SCRIPTS = ("words.js", "model.js", "history.js")
PROGRAM = """\
const { readFileSync } = require("node:fs");
const { scripts, jobs } = JSON.parse(readFileSync(0, "utf8"));
const names = "{ Session, Lanes, pathsOf }";
const { Session, Lanes, pathsOf } = new Function(`${scripts}; return ${names};`)();
const found = jobs.map(({ messages, from, last }) => {
  const session = new Session();
  for (const message of messages) {
    if (["done", "refused"].includes(message.k)) session.isAgain = false;
    else session.take(message);
  }
  const lanes = Object.assign(Object.create(Lanes.prototype), { session });
  const all = lanes.all();
  const stays = lanes.stays(all, from, last);
  const machines = [...session.machines.values()];
  return {
    n: session.mode.n,
    texts: [...session.entries.values()].map(({ text }) => text),
    on: Object.fromEntries(machines.map(({ name, state }) => [name, state.on])),
    paths: Object.fromEntries(machines.map(({ name, state, hash }) =>
      [name, [...pathsOf(session.charts.get(hash), new Set(state.on)).values()]])),
    lanes: all.map(({ machine, region }, i) => [machine.name, region, stays[i]]),
  };
});
process.stdout.write(JSON.stringify(found));
"""
Json = dict[str, Any]


@pytest.fixture(autouse=True)
def node(require_tool: Callable[[str], str]) -> None:
    """Run where there is Node."""
    require_tool("node")


Job = tuple[Hub, Sequence[Json], int, int]
"""A session, the messages of its client, and the first and the last entry of the lanes."""


def in_node(jobs: Sequence[Job]) -> list[Json]:
    """Return for each job what the page shows of it."""
    node = shutil.which("node")
    assert node is not None
    scripts = "".join((HERE / name).read_text(encoding="utf-8") for name in SCRIPTS)
    given = [{"messages": told, "from": first, "last": last} for _, told, first, last in jobs]
    done = subprocess.run(
        [node, "-e", PROGRAM],
        input=json.dumps({"scripts": scripts, "jobs": given}),
        capture_output=True, encoding="utf-8", check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    found: list[Json] = json.loads(done.stdout)
    return found


def region_of(chart: Chart, state: int) -> str | None:
    """Return the region around a state, or the state itself if it is one."""
    at: int | None = state
    while at is not None and (parent := chart.states[at].parent) is not None:
        if chart.states[parent].kind is Kind.PARALLEL:
            return chart.states[at].id
        at = parent
    return None


def innermost(chart: Chart, configuration: frozenset[int]) -> dict[str | None, str]:
    """Return the innermost active state of each active region."""
    return {region_of(chart, s): chart.states[s].id for s in sorted(configuration - {0})}


def agree(jobs: Sequence[Job]) -> int:
    """Compare lanes and paths with the sessions; return how many states were compared."""
    count = 0
    for (hub, _, first, last), found in zip(jobs, in_node(jobs), strict=True):
        charts = dict(zip(hub.simulation.names, hub.simulation.charts, strict=True))
        assert found["n"] == hub.n
        names = list(charts)
        for n in range(first, last + 1):
            moment = hub.view.course.moment(n)
            assert moment is not None
            for name, region, stays in found["lanes"]:
                snapshot = moment.snapshots[names.index(name)]
                shown = [each["on"] for each in stays if each["at"] <= n < each["end"]]
                wanted = innermost(charts[name], snapshot.configuration).get(region)
                assert shown == ([] if wanted is None else [wanted]), (name, region, n)
                count += 1
        moment = hub.view.course.moment(hub.n)
        assert moment is not None
        for place, (name, chart) in enumerate(charts.items()):
            configuration = moment.snapshots[place].configuration
            on = [chart.states[s].id for s in sorted(configuration - {0})]
            assert found["on"][name] == on
            assert sorted(state for path in found["paths"][name] for state in path) == sorted(on)
            ends = {path[-1] for path in found["paths"][name]}
            assert ends == set(innermost(chart, configuration).values())
    return count


def looked_at(model: Chart | System, random: Random, count: int, width: int = 100) -> Job:
    """Return a session that did something, seen by a page that came late, at some entry."""
    hub = Hub(model)
    first = Client(hub)
    for command in commands_of(hub.system, random, count):
        if command["do"] not in ("run", "break", "fork"):
            first.say(**command)
    head = hub.view.history.head
    first.say("seek", n=random.randrange(head + 1))
    client = Client(hub)
    for hash_ in {each["chart"] for each in client.told[0]["machines"]}:
        client.result("chart", chart=hash_, drawn=False)
    low = max(0, hub.n - random.randrange(width))
    high = min(head, hub.n + random.randrange(width))
    client.result("history", **{"from": max(1, low), "last": high})
    return hub, client.told, low, high


def test_random_charts() -> None:
    random = Random(5)
    jobs = [looked_at(random_case(77, k).chart, random, 60) for k in range(40)]
    assert agree(jobs) > 1_500


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cell", "ring"])
def test_systems(name: str) -> None:
    system = fsmkit.read_system(CELL / f"{name}.yaml")
    random = Random(3)
    assert agree([looked_at(system, random, 30) for _ in range(4)]) > 100


@pytest.mark.parametrize("count", [30, 300, 3_000])
def test_a_machine_that_stays_is_named(gate: Path, count: int) -> None:
    hub = Hub(fsmkit.read_chart(gate))
    told = Client(hub)
    told.result("post", m="Gate", event="open")
    for _ in range(count):
        told.result("post", m="Gate", event="close")  # does nothing while it opens
    client = Client(hub)
    client.result("chart", chart=client.told[0]["machines"][0]["chart"], drawn=False)
    (found,) = in_node([(hub, client.told, hub.n - 20, hub.n)])  # no entry came yet
    ((_, _, stays),) = found["lanes"]
    assert stays == [{"on": "opening", "at": hub.n - 20, "end": hub.n + 1}]
    client.result("history", **{"from": hub.n - 20})
    agree([(hub, client.told, hub.n - 20, hub.n)])


def test_regions_have_lanes_of_their_own() -> None:
    hub = Hub(elaborated(REGIONS))
    client = Client(hub)
    for event in ("start", "tick", "lamp", "blink", "blink", "lamp", "tick", "stop", "start"):
        client.result("post", m="Press", event=event)
    client.result("chart", chart=client.told[0]["machines"][0]["chart"], drawn=False)
    client.result("history")
    (found,) = in_node([(hub, client.told, 0, hub.n)])
    assert [region for _, region, _ in found["lanes"]] == [None, "motion", "left", "right", "light"]
    assert found["paths"]["Press"] == [["working"], ["motion", "idle"], ["light", "off"]]
    agree([(hub, client.told, 0, hub.n)])


@pytest.mark.parametrize("is_first", [True, False])
def test_causes_are_named_whenever_the_chart_comes(gate: Path, is_first: bool) -> None:
    hub = Hub(fsmkit.read_chart(gate))
    first = Client(hub)
    first.result("post", m="Gate", event="open")
    first.result("step", how="timer")
    client = Client(hub)
    hash_ = client.told[0]["machines"][0]["chart"]
    commands: list[Json] = [{"do": "chart", "chart": hash_, "drawn": False}, {"do": "history"}]
    for command in commands if is_first else reversed(commands):
        client.result(**command)
    (found,) = in_node([(hub, client.told, 0, hub.n)])
    assert found["texts"][-1].startswith("opening: after T_OPEN (4s)")


def test_one_state_around_all_regions_has_no_lane() -> None:
    text = "chart: Two\ninitial: p\nstates:\n  p:\n    regions:\n"
    text += "      a: {initial: x, states: {x: {}}}\n      b: {initial: y, states: {y: {}}}\n"
    hub = Hub(elaborated(text))
    client = Client(hub)
    client.result("chart", chart=client.told[0]["machines"][0]["chart"], drawn=False)
    (found,) = in_node([(hub, client.told, 0, hub.n)])
    assert [(region, stays[0]["on"]) for _, region, stays in found["lanes"]] == [
        ("a", "x"),
        ("b", "y"),
    ]
