"""Nodes of fsmkit on one bus: layout, DBC file, C with Python, and what is lost and counted."""

from __future__ import annotations

import random
import struct
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.carriers.can.deployment import bus_of, times_of_buses
from fsmkit.carriers.can.plugin import PLUGIN
from fsmkit.cli import execute
from fsmkit.diagnostics import FsmkitError
from fsmkit.language import LONGEST_DURATION
from fsmkit.runtime.links import Link, LinkTimeout
from fsmkit.runtime.links.opening import open_link
from fsmkit.system.deployment.deployment import Deployment
from tests.carriers.can.conftest import built, free_port
from tests.carriers.can.counts import COUNTS, TOTALS
from tests.reading import load_deployment

pytestmark = pytest.mark.external

FIELDS = (
    "flag bool, mode Mode, small -7..1000, wide -9223372036854775808..9223372036854775807, "
    "pause duration, ratio float32, exact float64"
)
NAMES = "flag", "mode", "small", "wide", "pause", "ratio", "exact"
VALUES = ", ".join(f"{name} = event.{name}" for name in NAMES)
ECHO = f"""\
chart: Echo
types: {{Mode: [slow, fast, off_2]}}
inputs: {{wanted: -40..1000}}
events:
  in: ["put({FIELDS})", halt]
  out: ["got({FIELDS})", halted]
outputs: {{seen: -7..1000 = 0, odd: bool = false}}
initial: idle
states:
  idle:
    on:
      put: {{do: "seen = event.small; odd = not odd; send got({VALUES})"}}
      halt: {{if: wanted >= -40, do: send halted}}
"""
DESK = f"""\
chart: Desk
types: {{Mode: [slow, fast, off_2]}}
inputs: {{seen: -7..1000, odd: bool}}
events:
  in: ["got({FIELDS})", halted, "press({FIELDS})"]
  out: ["put({FIELDS})", halt]
outputs: {{wanted: -40..1000 = -7}}
initial: idle
states:
  idle:
    on:
      press: {{do: "send put({VALUES})"}}
      got: {{if: seen > 0 and odd, do: "wanted = 999; send halt"}}
      halted: {{do: wanted = 3}}
"""
LINE = """\
system: Line
machines: {echo: echo.yaml, desk: desk.yaml}
connect:
  - desk.put -> echo.put
  - {desk.halt -> echo.halt: {priority: 0}}
  - echo.got -> desk.got
  - echo.halted -> desk.halted
  - echo.seen -> desk.seen
  - echo.odd -> desk.odd
  - desk.wanted -> echo.wanted
environment: {may: [desk.press]}
"""
DEPLOYMENT = """\
system: line.yaml
nodes: {a: [echo], b: [desk]}
links: {kind: can, bus: can0, base: 0x120}
"""
PUT, HALT, GOT = "desk.put -> echo.put", "desk.halt -> echo.halt", "echo.got -> desk.got"
WANTED = "desk.wanted -> echo.wanted"
SOURCES = "fsm_link", "fsm_can", "fsm_can_bus", "fsm_link_net"
BUS_OFF, PASSIVE = 0x40, 0x04  # CAN_ERR_BUSOFF, CAN_ERR_CRTL


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write a deployment; arguments are other contents of its files."""

    def write(deployment: str = DEPLOYMENT, line: str = LINE, echo: str = ECHO) -> Path:
        files = {"line": line, "echo": echo, "desk": DESK, "deployment": deployment}
        for name, text in files.items():
            (tmp_path / f"{name}.yaml").write_text(text)
        return tmp_path / "deployment.yaml"

    return write


def refused(path: Path) -> list[tuple[str, str]]:
    with pytest.raises(FsmkitError) as caught:
        load_deployment(path)
    return [(found.rule.name, found.message) for found in caught.value.diagnostics]


def payload(draw: random.Random) -> dict[str, Any]:
    """Return random values of `FIELDS`, ends of ranges often among them."""

    def integer(lo: int, hi: int) -> int:
        return draw.choice([lo, hi, draw.randint(lo, hi)])

    (ratio,) = struct.unpack("<f", struct.pack("<f", draw.uniform(-1e9, 1e9)))
    return {
        "flag": draw.random() < 0.5,
        "mode": draw.choice(["slow", "fast", "off_2"]),
        "small": integer(-7, 1000),
        "wide": integer(-(2**63), 2**63 - 1),
        "pause": integer(0, LONGEST_DURATION),
        "ratio": ratio,
        "exact": draw.uniform(-1e300, 1e300),
    }


def levels_of(node: str, value: int = 0) -> dict[str, object]:
    if node == "b":
        return {WANTED: value}
    return {"echo.seen -> desk.seen": value, "echo.odd -> desk.odd": False}


# --- what is on the bus --------------------------------------------------------------------------


def test_the_identifiers_are_those_of_the_ranks(write: Callable[..., Path]) -> None:
    net = bus_of(load_deployment(write()))
    assert net is not None
    found = [
        (w.message.frame, w.message.name, w.message.length, w.message.is_fd) for w in net.wires
    ]
    assert found == [
        (0x120, "desk_halt", 1, False),  # by its priority
        (0x121, "desk_put", 32, True),
        (0x122, "echo_got", 32, True),
        (0x123, "echo_halted", 1, False),
        (0x124, "a_levels", 3, False),
        (0x125, "b_levels", 3, False),
        (0x126, "a_hello", 8, False),
        (0x127, "b_hello", 8, False),
    ]
    other = bus_of(load_deployment(write(DEPLOYMENT.replace("0x120", "0x121"))))
    assert other is not None
    assert net.hash != other.hash


def test_a_tool_decodes_what_a_node_sends(write: Callable[..., Path], tmp_path: Path) -> None:
    import can
    import cantools

    path = write()
    assert execute(["compile", str(path), "--out", str(tmp_path / "out")]) == 0
    tool = cantools.database.load_file(tmp_path / "out/line.dbc")
    deployment = load_deployment(path)
    draw = random.Random(5)
    options = {**PLUGIN.link_options(deployment), "interface": "virtual", "bus": "tool"}
    link = open_link(deployment.map, "b", session=0x12345, kind="can", options=options)
    with can.Bus(interface="virtual", channel="tool") as watcher:
        for round_ in range(300):
            sent = payload(draw)
            link.begin_cycle()
            link.send(deployment.map.message(PUT, **sent))
            link.end_cycle({WANTED: round_})
            found = {}
            while (frame := watcher.recv(0)) is not None:
                message = tool.get_message_by_frame_id(frame.arbitration_id)
                assert (message.is_fd, message.length) == (frame.is_fd, len(frame.data))
                found[message.name] = message.decode(frame.data, decode_choices=True)
            put = dict(found["desk_put"])
            assert put.pop("count") == round_ % 256
            assert {**put, "mode": str(put["mode"]), "flag": bool(put["flag"])} == sent
            assert found["b_levels"] == {"count": round_ % 256, "desk_wanted": round_}
    link.close()


@pytest.mark.parametrize(
    ("deployment", "rule", "words"),
    [
        (DEPLOYMENT.replace("kind: can", "kind: carrier_pigeon"), "unexpected-value", "no links"),
        (DEPLOYMENT.replace("bus: can0, ", ""), "broken-deployment", "need a `bus`"),
        (DEPLOYMENT.replace("kind: can, ", ""), "broken-deployment", "`zeromq` have no `bus`"),
        (DEPLOYMENT.replace("base:", "insecure: true, base:"), "broken-deployment", "`can`"),
        (DEPLOYMENT.replace("0x120", "0x7f9"), "unexpected-value", "identifier 0x800"),
        (DEPLOYMENT.replace("0x120", "0x800"), "unexpected-value", "0 to 0x7ff"),
        (DEPLOYMENT.replace("a: [echo], b: [desk]", "a: [echo, desk]"), "broken-deployment", "two"),
        (DEPLOYMENT.replace("base: 0x120", "bitrate: 5"), "unexpected-value", "bits per second"),
        (DEPLOYMENT.replace("base: 0x120", "period: 2s"), "unexpected-value", "1us to 1s"),
        (DEPLOYMENT.replace("base: 0x120", "period: 1ms, bitrate: 100000"), "late-message", "no"),
    ],
)  # fmt: skip
def test_what_no_bus_has_is_a_finding(
    write: Callable[..., Path], deployment: str, rule: str, words: str
) -> None:
    found = refused(write(deployment))
    assert rule in [name for name, _ in found]
    assert any(words in text for _, text in found), found


def test_more_than_a_frame_has_is_a_finding(write: Callable[..., Path]) -> None:
    many = ", ".join(f"more{n} float64" for n in range(5))
    path = write(line=LINE, echo=ECHO.replace(FIELDS, f"{FIELDS}, {many}"))
    desk = path.with_name("desk.yaml")
    desk.write_text(desk.read_text().replace(FIELDS, f"{FIELDS}, {many}"))
    for name in ("echo", "desk"):
        file = path.with_name(f"{name}.yaml")
        values = ", ".join(f"more{n} = event.more{n}" for n in range(5))
        file.write_text(
            file.read_text().replace("exact = event.exact", f"exact = event.exact, {values}")
        )
    found = refused(path)
    assert [name for name, _ in found] == ["long-message", "long-message"]
    assert "`desk_put` has 67 bytes" in found[0][1]


def test_the_check_has_the_response_times_of_the_bus(write: Callable[..., Path]) -> None:
    found = load_deployment(write())
    (times,) = times_of_buses(found)
    late = {message.name: time for message, time in times.responses}
    channels = {m.name: m.chart for m in found.written.machines if m.is_channel}
    assert len(channels) == 4
    assert all(late[name] is not None for name in late)
    assert late["desk_halt"] < late["desk_put"] < late["b_hello"]  # type: ignore[operator]
    slow = load_deployment(
        write(DEPLOYMENT.replace("base: 0x120", "bitrate: 250000, period: 100ms"))
    )
    (times,) = times_of_buses(slow)
    assert times.responses[0][1] >= 2 * late["desk_halt"]  # type: ignore[operator]


# --- loss ----------------------------------------------------------------------------------------


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


class Between:
    """Stands between the buses of both nodes."""

    def __init__(self, one: Any, other: Any) -> None:
        self.one = one
        self.other = other

    def carry(self, is_dropped: Callable[[Any, str], bool] = lambda _frame, _sender: False) -> None:
        """Carry all frames but those that are dropped."""
        for source, target, name in ((self.one, self.other, "a"), (self.other, self.one, "b")):
            while (frame := source.recv(0)) is not None:
                if not is_dropped(frame, name):
                    target.send(frame)

    def report(self, kind: int) -> None:
        """Let the controller of `a` report an error."""
        import can

        self.one.send(can.Message(arbitration_id=kind, is_error_frame=True, data=bytes(8)))


@contextmanager
def two_nodes(
    a: Deployment, b: Deployment, clock: Clock, channel: str
) -> Iterator[tuple[Link, Link, Between]]:
    """Open both nodes on two buses, and yield what stands between: it drops what it is said to."""
    import can

    with (
        can.Bus(interface="virtual", channel=channel + "a") as one,
        can.Bus(interface="virtual", channel=channel + "b") as other,
    ):
        links = []
        for node, deployment in (("a", a), ("b", b)):
            options = {
                **PLUGIN.link_options(deployment),
                "interface": "virtual",
                "bus": channel + node,
            }
            options["clock"] = clock
            link = open_link(deployment.map, node, session=1, kind="can", options=options)
            links.append(link)
        try:
            yield links[0], links[1], Between(one, other)
        finally:
            for link in links:
                link.close()


def test_what_the_bus_drops_is_what_is_counted(write: Callable[..., Path]) -> None:
    """10 % loss, and bus-off for 5 s: events, frames, silence and error frames."""
    deployment = load_deployment(write())
    clock = Clock()
    draw = random.Random(11)
    dropped: Counter[str] = Counter()
    is_off = False

    def is_dropped(frame: Any, sender: str) -> bool:
        is_lost = is_off or draw.random() < 0.1
        if sender == "b" and is_lost and frame.arbitration_id != 0x127:
            dropped["frames"] += 1
            dropped["events"] += frame.arbitration_id in (0x120, 0x121)
        return is_lost

    with two_nodes(deployment, deployment, clock, "lossy") as (a, b, between):
        between.carry()
        sent = taken = longest = errors = 0
        for cycle in range(3000):
            clock.now += 0.01
            is_off = 1000 <= cycle < 1500
            if cycle == 1000:
                between.report(BUS_OFF)
            elif draw.random() < 0.01:
                between.report(PASSIVE)
                errors += 1
            b.begin_cycle()
            if cycle < 2900:
                sent += sum(b.send(deployment.map.message(HALT)) for _ in range(cycle % 3))
                sent += b.send(deployment.map.message(PUT, **payload(draw)))
            b.end_cycle({WANTED: 3})
            between.carry(is_dropped)
            a.begin_cycle()
            longest = max(longest, a.silence("b"))
            while a.receive() is not None:
                taken += 1
            a.end_cycle(levels_of("a"))
        found = a.counters("b")
        assert taken + dropped["events"] == sent
        assert found.lost_events == dropped["events"] > 1000
        # in one piece 500 levels were lost; the counter of a message has one byte
        assert (dropped["frames"] - found.lost_frames) % 256 == 0
        assert found.lost_frames > 1000
        assert longest >= 500
        assert (found.missed, found.doubled, found.late, found.restarts) == (0, 0, 0, 0)
        assert (a.malformed, a.foreign) == (0, 0)
        assert (a.bus_off, a.bus_errors) == (1, errors + 1)


def test_a_frame_that_comes_again_is_doubled(write: Callable[..., Path]) -> None:
    deployment = load_deployment(write())
    clock = Clock()
    with two_nodes(deployment, deployment, clock, "twice") as (a, b, between):
        between.carry()
        for _ in range(3):
            b.begin_cycle()
            b.send(deployment.map.message(HALT))
            b.end_cycle({WANTED: 3})
            while (frame := between.other.recv(0)) is not None:
                between.one.send(frame)
                if frame.arbitration_id == 0x120:
                    between.one.send(frame)
        a.begin_cycle()
        assert [message.event for message in iter(a.receive, None)] == ["halt"] * 3
        found = a.counters("b")
        assert (found.doubled, found.lost_events, found.lost_frames) == (3, 0, 0)


def test_a_node_that_comes_later_or_again_is_counted_as_such(write: Callable[..., Path]) -> None:
    deployment = load_deployment(write())
    clock = Clock()
    halt = deployment.map.message(HALT)

    def play(b: Link, times: int) -> None:
        for _ in range(times):
            b.begin_cycle()
            b.send(halt)
            clock.now += 0.01
            b.end_cycle({WANTED: 3})

    with two_nodes(deployment, deployment, clock, "again") as (a, b, between):
        play(b, 20)
        between.carry(lambda _frame, _sender: True)  # before `a` was there
        play(b, 20)
        between.carry()
        a.begin_cycle()
        seen = len(list(iter(a.receive, None)))
        found = a.counters("b")
        assert (seen + found.missed + found.lost_events, found.restarts) == (40, 0)
        assert found.missed >= 20
        options = {**PLUGIN.link_options(deployment), "interface": "virtual", "bus": "againb"}
        options["clock"] = clock
        other = open_link(deployment.map, "b", session=2, kind="can", options=options)
        play(other, 5)
        between.carry()
        a.begin_cycle()
        assert len(list(iter(a.receive, None))) == 5
        found = a.counters("b")
        assert (found.restarts, found.lost_events, found.session) == (1, 0, 2)
        other.close()


def test_a_node_with_another_map_is_foreign(write: Callable[..., Path], tmp_path: Path) -> None:
    deployment = load_deployment(write())
    wider = write(echo=ECHO.replace("-7..1000", "-8..1000"))
    for name in ("desk", "echo"):
        file = tmp_path / f"{name}.yaml"
        file.write_text(file.read_text().replace("-7..1000", "-8..1000"))
    other = load_deployment(wider)
    clock = Clock()
    with two_nodes(deployment, other, clock, "foreign") as (a, b, between):
        between.carry()
        for _ in range(4):
            b.begin_cycle()
            b.end_cycle({WANTED: 3})
        between.carry()
        a.begin_cycle()
        assert (a.foreign, a.malformed, a.silence("b")) == (5, 0, 1)
        assert a.counters("b").frames == 0
        a._clock = iter(range(9)).__next__  # type: ignore[attr-defined]  # time goes on
        with pytest.raises(LinkTimeout, match="waited"):
            a.wait_listeners(3)


def test_machines_of_two_nodes_talk_on_the_bus(write: Callable[..., Path]) -> None:
    deployment = load_deployment(write())
    clock = Clock()
    options = {"interface": "virtual", "bus": "machines", "clock": clock}
    with (
        fsmkit.Node(deployment, "a", session=1, options=options) as a,
        fsmkit.Node(deployment, "b", session=1, options=options) as b,
    ):

        def cycle(now: int) -> None:
            clock.now = now / 1000
            for node in (a, b):
                node.cycle(now)

        for now in range(0, 200, 10):
            cycle(now)
        b.machines.post("desk", "press", **payload(random.Random(1)) | {"small": 77})
        for now in range(200, 300, 10):
            cycle(now)
        assert a.machines.value("echo", "seen") == 77
        assert b.machines.value("desk", "wanted") == 3  # echo.halted came
        counters = a.link.counters("b")
        assert (counters.lost_events, counters.lost_frames) == (0, 0)


# --- C with Python -------------------------------------------------------------------------------


@pytest.fixture
def build(write: Callable[..., Path], tmp_path: Path, require_tool: Callable[[str], str]) -> Path:
    return built(write(), tmp_path, require_tool("gcc"), SOURCES, "net_player.c")


@contextmanager
def played(node: Path, at: str, session: int) -> Iterator[subprocess.Popen[str]]:
    command = [str(node), f"udp:{at}", str(session)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield process
        assert process.stdin is not None
        if not process.stdin.closed:
            process.stdin.close()


def counted(process: subprocess.Popen[str]) -> dict[str, int]:
    """End a node, and return what it has counted."""
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.close()
    numbers = map(int, process.stdout.read().split("\n")[-2].split())
    return dict(zip([*COUNTS, *TOTALS, "session", "wanted"], numbers, strict=True))


def step(link: Link, wanted: int = 3) -> list[Any]:
    """Play a cycle of 1 ms, and return what has come in."""
    link.begin_cycle()
    found = list(iter(link.receive, None))
    link.end_cycle({WANTED: wanted})
    time.sleep(0.001)
    return found


@pytest.mark.cc
def test_a_node_in_c_and_one_in_python_understand_each_other(
    build: Path, write: Callable[..., Path]
) -> None:
    deployment = load_deployment(write())
    draw = random.Random(2)
    at = f"239.74.163.2:{free_port()}"
    options = {**PLUGIN.link_options(deployment), "bus": f"udp:{at}"}
    link = open_link(deployment.map, "b", session=0x12345, kind="can", options=options)
    with played(build, at, 0x54321) as process:
        link.wait_listeners(10)
        assert process.stdout is not None
        for _ in range(200):  # it is heard within 100 ms
            step(link)
        assert process.stdout.readline() == "ready\n"
        for _ in range(200):
            sent = payload(draw)
            link.begin_cycle()
            link.send(deployment.map.message(PUT, **sent))
            link.end_cycle({WANTED: 999})
            end = time.monotonic() + 10
            while not (came := step(link, 999)):
                assert time.monotonic() < end
            (answer,) = came
            assert (answer.name, answer.payload) == (GOT, sent)
            while link.level("echo.seen -> desk.seen") != sent["small"]:
                step(link, 999)
                assert time.monotonic() < end
        own = link.counters("a")
        assert own.session == 0x4321
        assert (own.lost_events, own.lost_frames, link.malformed, link.foreign) == (0, 0, 0, 0)
        found = counted(process)
    link.close()
    assert (found["session"], found["wanted"]) == (0x2345, 999)
    quiet = (
        "lost_frames lost_events missed late doubled overflow restarts refused malformed foreign"
    )
    assert {name: found[name] for name in quiet.split()} == dict.fromkeys(quiet.split(), 0)


@pytest.mark.cc
def test_a_node_in_c_counts_as_one_in_python_does(build: Path, write: Callable[..., Path]) -> None:
    """Loss, doubled and broken frames, errors, another run, another map."""
    from fsmkit.carriers.can.translator import MulticastBus

    deployment = load_deployment(write())
    at, beyond = (f"239.74.163.2:{free_port()}" for _ in range(2))
    draw = random.Random(4)
    options: dict[str, Any] = {**PLUGIN.link_options(deployment), "interface": "virtual"}
    twin = open_link(deployment.map, "a", session=9, kind="can", options={**options, "bus": "twin"})
    import can

    with (
        MulticastBus(at) as bus,
        can.Bus(interface="virtual", channel="twin") as other,
        can.Bus(interface="virtual", channel=beyond) as sent,
        played(build, at, 9) as process,
    ):
        while True:  # until it is there
            hello = bus.recv(10)
            assert hello is not None
            if hello.arbitration_id == 0x126:
                break
        for session in (5, 6):
            link = open_link(
                deployment.map,
                "b",
                session=session,
                kind="can",
                options={**options, "bus": beyond},
            )
            for cycle in range(400):
                link.begin_cycle()
                link.send(deployment.map.message(HALT))
                link.send(deployment.map.message(PUT, **payload(draw)))
                link.end_cycle({WANTED: 7})
                while (frame := sent.recv(0)) is not None:
                    times = draw.choice([0, 1, 1, 1, 1, 1, 1, 2]) if cycle > 2 else 1
                    if frame.arbitration_id == 0x127:
                        times = 1
                    elif draw.random() < 0.02:
                        frame.data[1:] = b"\xff" * (len(frame.data) - 1)  # out of range
                    for _ in range(times):
                        bus.send(frame)
                        other.send(frame)
                if cycle % 100 == 50:
                    error = can.Message(arbitration_id=BUS_OFF, is_error_frame=True, data=bytes(8))
                    bus.send(error)
                    other.send(error)
                twin.begin_cycle()
                while twin.receive() is not None:
                    pass
                time.sleep(0.001)
            link.close()
        time.sleep(0.3)
        found = counted(process)
    own = twin.counters("b")
    expected = {name: getattr(own, name) for name in COUNTS}
    expected |= {name: getattr(twin, name) for name in ("malformed", "bus_errors", "bus_off")}
    assert {name: found[name] for name in expected} == expected
    assert min(own.lost_events, own.doubled, own.restarts, twin.malformed, twin.bus_off) > 0
    twin.close()
