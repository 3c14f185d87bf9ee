"""A node in Python and a program of Cyclone DDS in another process, on topics named as in ROS."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import fsmkit
from fsmkit.carriers.ros.plugin import PLUGIN
from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime.links import Link, Message
from fsmkit.runtime.links.opening import open_link
from fsmkit.system.deployment.deployment import Deployment
from tests.carriers.ros.cell import DEPLOYMENT, written
from tests.needs import need

if TYPE_CHECKING:
    from fsmkit.carriers.ros.translator import RosTranslator

pytestmark = [pytest.mark.external, pytest.mark.slow]

PEER = Path(__file__).with_name("peer.py")
LOOPBACK = """<CycloneDDS><Domain Id="any">
<General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>
<Peers><Peer Address="127.0.0.1"/></Peers><LeaseDuration>2s</LeaseDuration>
<SPDPInterval>500ms</SPDPInterval></Discovery>
</Domain></CycloneDDS>"""
LOOK = "camera.look -> lens.look"
LEVELS = {"belt.position -> lens.encoder": 0, "belt.pause -> lens.pause": 3}


@pytest.fixture(autouse=True)
def _loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    need(find_spec("cyclonedds") is not None, "cyclonedds")
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)


@pytest.fixture(scope="module")
def domain() -> int:
    """Return a domain that no other test of this computer uses."""
    return 10 + os.getpid() % 200


@contextmanager
def opened(folder: Path, domain: int, **changes: str) -> Iterator[tuple[Deployment, Link]]:
    text = changes.pop("deployment", DEPLOYMENT).replace("domain: 7", f"domain: {domain}")
    deployment = fsmkit.read(written(folder, deployment=text, **changes))
    assert isinstance(deployment, Deployment)
    link = open_link(
        deployment.map, "b", session=1, foreign=PLUGIN.foreign_options(deployment, "b")
    )
    try:
        yield deployment, link
    finally:
        link.close()


@contextmanager
def peer(*arguments: object) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, str(PEER), *map(str, arguments)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def said(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


def go(process: subprocess.Popen[str]) -> None:
    """Let a program begin."""
    assert process.stdin is not None
    process.stdin.write("go\n")


def does(process: subprocess.Popen[str], *commands: str) -> None:
    assert process.stdin is not None
    for command in commands:
        process.stdin.write(f"{command}\n")
        assert said(process) == "done"


def cycle(link: Link, levels: dict[str, int] | None = None) -> Iterator[Message]:
    link.begin_cycle()
    while (message := link.receive()) is not None:
        yield message
    link.end_cycle(LEVELS if levels is None else levels)


def until(
    is_so: Callable[[], object],
    link: Link,
    seconds: float = 30,
    levels: dict[str, int] | None = None,
) -> list[Message]:
    """Cycle until something is so; return the events that came."""
    found = []
    end = time.monotonic() + seconds
    while not is_so():
        found += list(cycle(link, levels))
        assert time.monotonic() < end, "nothing has come"
        time.sleep(0.001)
    return found


def translator(link: Link) -> RosTranslator:
    from fsmkit.carriers.ros.translator import RosTranslator

    (found,) = link.translators
    assert isinstance(found, RosTranslator)
    return found


def test_ten_thousand_events_each_way_come_once_and_in_order(tmp_path: Path, domain: int) -> None:
    count = 10_000
    with opened(tmp_path, domain) as (deployment, link), peer("exchange", domain, count) as lens:
        topics = translator(link)
        until(lambda: "/cell/lens/look" not in topics.unheard, link)
        until(lambda: "/cell/lens/judged" not in topics.unserved, link)
        assert said(lens) == "ready"
        go(lens)
        look = deployment.map.message(LOOK, near=True)
        found: list[int] = []
        sent, cycles = 0, 0
        waits = topics._sent["/cell/lens/look"].waiting
        while len(found) < count or topics.counters.sent < count + len(LEVELS):
            for message in cycle(link):
                assert message.payload["verdict"] == "bad_2"
                found.append(message.values[1])  # type: ignore[arg-type]
            for _ in range(min(50, count - sent) if len(waits) < 100 else 0):
                sent += link.send(look)
            cycles += 1
            assert cycles < 200_000
        assert said(lens) == f"{count} True"
        assert found == [number % 251 for number in range(count)]
        counters = link.counters("vision")
        assert (counters.lost_frames, counters.lost_events, counters.doubled) == (0, 0, 0)
        assert (counters.late, counters.overflow, counters.restarts) == (0, 0, 0)
        assert (link.malformed, link.refused) == (0, 0)
        assert topics.counters.received == count
        assert topics.counters.unsent == 0


def test_levels_come_and_silence_grows_until_another_run(tmp_path: Path, domain: int) -> None:
    light = "lens.light -> camera.light"
    with opened(tmp_path, domain) as (_, link):
        with peer("obey", domain) as lens:
            assert said(lens) == "ready"
            does(lens, "light 417")
            until(lambda: link.level(light) == 417, link)
            assert link.level("lens.is_sharp -> camera.is_sharp") is True  # its start value
            does(lens, "judged 3", "wait", "judged 4")
            until(lambda: link.counters("vision").frames >= 2, link)
            until(lambda: not list(cycle(link)), link)
        for silent in range(150):
            assert link.silence("vision") >= silent
            list(cycle(link))
        assert link.counters("vision").restarts == 0
        with peer("obey", domain) as lens:
            assert said(lens) == "ready"
            does(lens, "light 5")
            until(lambda: link.level(light) == 5, link)
            assert link.silence("vision") <= 1
            assert link.counters("vision").restarts == 1
            does(lens, "judged 8", "wait", "judged 9")
            events: list[Message] = []
            while not events or events[-1].payload["quality"] != 9:
                events += list(cycle(link))
            assert link.counters("vision").restarts == 1


def test_gaps_are_lost_and_what_is_out_of_range_is_malformed(tmp_path: Path, domain: int) -> None:
    with opened(tmp_path, domain) as (_, link), peer("obey", domain) as lens:
        topics = translator(link)
        assert said(lens) == "ready"
        does(lens, "light 1001", "light 65535")
        until(lambda: link.malformed == 2 or topics.counters.refused, link)
        assert link.malformed in (1, 2)  # of a level the last value is kept
        refused = link.malformed
        does(lens, "light 1000")
        until(lambda: link.level("lens.light -> camera.light") == 1000, link)
        does(lens, "judged 1 5 0 2")  # there are two verdicts
        does(lens, "wait")
        does(lens, "judged 1 7 0", "judged 2 7 1", "judged 9 7 0", "judged 3 7 4")
        found = until(lambda: topics.counters.late == 1, link)
        found += until(lambda: link.counters("vision").lost_events == 2, link)
        found += list(cycle(link))
        assert [event.payload["quality"] for event in found] == [1, 2, 3]
        assert link.counters("vision").lost_frames == 2
        assert link.malformed <= refused + 1


def test_a_late_subscriber_has_what_is_kept(tmp_path: Path, domain: int) -> None:
    with opened(tmp_path, domain) as (_, link):
        topics = translator(link)
        topics.show({"camera": "waiting"})
        for position in (1, 2, -99_999):
            levels = {"belt.position -> lens.encoder": position, "belt.pause -> lens.pause": 2500}
            list(cycle(link, levels))
        with peer("late", domain) as lens:
            assert said(lens) == "Int32(data=-99999)"
            assert said(lens) == "Duration(sec=2, nanosec=500000000)"
            assert said(lens) == "String(data='waiting')"
            assert float(said(lens)) <= 1
        assert topics.counters.sent == 5


def test_a_domain_that_cannot_be_joined_is_a_finding(
    tmp_path: Path, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK.replace('name="lo"', 'name="none"'))
    with opened(tmp_path, domain):
        pass  # it is confined to the loopback interface, whatever is said there
    insecure = DEPLOYMENT.replace("domain: 7", "domain: 7\n        insecure: true")
    with pytest.raises(FsmkitError) as caught, opened(tmp_path, domain, deployment=insecure):
        pass
    assert [found.rule.name for found in caught.value.diagnostics] == ["link-not-opened"]
