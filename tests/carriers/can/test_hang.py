"""A control loop that hangs falls silent on the bus, in C and in Python, on simulated clocks."""

from __future__ import annotations

import itertools
import random
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.carriers.can.plugin import PLUGIN
from fsmkit.cli import execute
from fsmkit.runtime.links import Link
from fsmkit.runtime.links.opening import open_link
from tests.carriers.can.conftest import FOLDERS, HERE, source_of
from tests.reading import load_deployment

pytestmark = pytest.mark.external

LIFT = {
    "lift.dbc": """\
VERSION ""
BU_: PLC DRIVE
BO_ 512 Command: 3 PLC
 SG_ Target : 0|16@1- (1,0) [-2000|2000] "" DRIVE
 SG_ Enable : 16|1@1+ (1,0) [0|1] "" DRIVE
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 10000;
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_ "GenMsgCycleTime" BO_ 512 CYCLE;
""",
    "plc.yaml": """\
chart: Plc
outputs: {target: -2000..2000 = 0, enable: bool = false}
events: {in: [go]}
initial: idle
states:
  idle: {rest: true, on: {go: turning}}
  turning: {rest: true, entry: target = 800; enable = true}
""",
    "drive.yaml": """\
chart: Drive
inputs: {target: -2000..2000, enable: bool}
initial: off
states:
  off: {rest: true, always: [{if: enable and target > 0, target: on}]}
  on: {rest: true, always: [{if: not enable, target: off}]}
""",
    "lift.yaml": """\
system: Lift
machines: {plc: plc.yaml, drive: drive.yaml}
connect: [plc.target -> drive.target, plc.enable -> drive.enable]
environment: {may: [plc.go], will: [drive]}
""",
    "deployment.yaml": """\
system: lift.yaml
nodes: {a: [plc], drive: {machines: [drive], foreign: can}}
links: {watchdog: WATCHDOGms, foreign: {drive: {bus: can0, dbc: lift.dbc}}}
""",
}
HANG_AT = 1000


def lift(folder: Path, watchdog: int, cycle: int) -> Path:
    for name, text in LIFT.items():
        given = text.replace("CYCLE", str(cycle)).replace("WATCHDOG", str(watchdog))
        (folder / name).write_text(given)
    return folder / "deployment.yaml"


def hangs(count: int) -> list[tuple[int, int, int, int]]:
    """Return bounds, cycles of the message and of the loop, and how long it hangs; in ms."""
    draw = random.Random(11)
    found = [(100, 20, 1, 3000), (100, 10, 50, 500), (4, 1, 1, 100), (60_000, 10, 10, 70_000)]
    while len(found) < count:
        watchdog = draw.choice([4, 20, 50, 100, 250, 1000])
        period = draw.randint(1, watchdog // 2)
        found.append((watchdog, draw.randint(1, 500), period, draw.randint(2, 40) * watchdog))
    return found


def check(
    case: tuple[int, int, int, int], completed: int, last: int, first: int, frames: int
) -> None:
    """Check the last frame of a hang, and the first one after it."""
    watchdog, cycle, period, hang_for = case
    resume = HANG_AT + hang_for
    assert HANG_AT - period < completed <= HANG_AT
    if hang_for > watchdog:
        assert last < completed + watchdog, case
    assert resume <= first <= resume + max(cycle, 1), case
    # it never falls silent before: the frames of the second in which the loop works
    assert frames >= (HANG_AT - period) // cycle, case


@pytest.mark.cc
def test_the_cyclic_messages_of_c_stop_within_the_bound(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    command = [require_tool("gcc"), "-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic"]
    command += ["-Wconversion", "-Wshadow", "-Werror", "-fsanitize=address,undefined", "-pthread"]
    command += [f"-I{folder}" for folder in FOLDERS]
    sources = [source_of(name) for name in ("fsm_link", "fsm_link_fan", "fsm_can")]
    player = tmp_path / "player"
    files = [str(path) for path in (HERE / "hang_player.c", *sources)]
    subprocess.run([*command, *files, "-o", str(player)], check=True)
    cases = hangs(60)
    lines = "\n".join(" ".join(map(str, case)) for case in cases)
    done = subprocess.run([player], input=lines, capture_output=True, text=True, check=True)
    results = [list(map(int, line.split())) for line in done.stdout.splitlines()]
    assert len(results) == len(cases)
    for case, (completed, last, first, hello, next_hello, frames, _) in zip(
        cases, results, strict=True
    ):
        check(case, completed, last, first, frames)
        watchdog, _, _, hang_for = case
        if hang_for > watchdog:
            assert hello < completed + watchdog, case
        assert next_hello <= HANG_AT + hang_for + 100, case


class Clock:
    def __init__(self) -> None:
        self.now = 0

    def __call__(self) -> float:
        return self.now / 1000


class Bus:
    """Notes when the cyclic message is sent."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.times: list[int] = []
        self.contents: list[bytes] = []

    def send(self, message: Any, timeout: float | None = None) -> None:  # noqa: ARG002
        self.times.append(self.clock.now)
        self.contents.append(bytes(message.data))

    def recv(self, timeout: float | None = None) -> None:  # noqa: ARG002
        return None

    def shutdown(self) -> None:
        pass


def opened(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[Link, Clock, Bus, Callable[[], float]]:
    """Return the link of the node on a simulated bus, and what sends its cyclic messages."""
    from fsmkit.carriers.can import translator

    clock = Clock()
    bus = Bus(clock)
    monkeypatch.setattr(translator, "open_bus", lambda *_, **__: bus)
    deployment = load_deployment(path)
    options = PLUGIN.foreign_options(deployment, "a")
    options["drive"] |= {"clock": clock}
    link = open_link(deployment.map, "a", session=1, foreign=options)
    (found,) = link.translators
    assert isinstance(found, translator.CanTranslator)
    return link, clock, bus, found.cyclic.send_due


def test_the_cyclic_messages_of_python_stop_within_the_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for case in hangs(20):
        watchdog, cycle, period, hang_for = case
        path = lift(tmp_path, watchdog, cycle)
        link, clock, bus, send_due = opened(path, monkeypatch)
        levels = {"plc.target -> drive.target": 800, "plc.enable -> drive.enable": True}
        wake, next_cycle, completed, resume = 0.0, 1, 0, HANG_AT + hang_for
        while clock.now < resume + 600:
            if clock.now == next_cycle:
                next_cycle += period
                if HANG_AT < next_cycle < resume:
                    next_cycle = resume
                link.begin_cycle()
                link.end_cycle(levels)
                completed = clock.now if clock.now < resume else completed
                wake = min(wake, clock.now)  # a new content wakes the thread if it is overdue
            if clock.now >= wake:
                wake = clock.now + send_due() * 1000
            clock.now = min(next_cycle, max(clock.now + 1, int(wake)))
        (translated,) = link.translators
        before = [time for time in bus.times if time < resume]
        check(case, completed, before[-1], bus.times[len(before)], len(before))
        assert set(bus.contents) == {bytes((0x20, 0x03, 1))}
        assert translated.counters.sent == len(bus.times)  # type: ignore[attr-defined]
        link.close()


def test_a_loop_that_works_is_never_silent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At half of the bound from cycle to cycle each message goes out in its cycle."""
    link, clock, bus, send_due = opened(lift(tmp_path, 100, 10), monkeypatch)
    levels = {"plc.target -> drive.target": 0, "plc.enable -> drive.enable": False}
    for clock.now in range(1, 5001):
        if clock.now % 50 == 1:
            link.begin_cycle()
            link.end_cycle(levels)
        send_due()
    gaps = [after - time for time, after in itertools.pairwise(bus.times)]
    assert bus.times[0] == 1
    assert set(gaps) <= {9, 10, 11}
    assert len(bus.times) >= 490
    link.close()


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("3ms", "`watchdog` is 4ms to 60s"),
        ("61s", "`watchdog` is 4ms to 60s"),
        ("1500us", "`watchdog` is 4ms to 60s"),
        ("99999999999999999999s", ""),
        ("soon", ""),
        ("-5ms", ""),
    ],
)
def test_a_bound_that_is_no_bound_is_rejected(tmp_path: Path, written: str, message: str) -> None:
    from fsmkit.diagnostics import FsmkitError

    path = lift(tmp_path, 100, 10)
    path.write_text(path.read_text().replace("100ms", written))
    with pytest.raises(FsmkitError) as caught:
        load_deployment(path)
    (finding, *_) = caught.value.diagnostics
    assert finding.primary is not None
    assert message in finding.message


def test_the_bound_of_a_slow_schedule_is_longer(tmp_path: Path) -> None:
    path = lift(tmp_path, 100, 10)
    system = tmp_path / "lift.yaml"
    system.write_text(system.read_text() + "schedule: {cyclic: [plc], period: 80ms}\n")
    declared = path.read_text()
    path.write_text(declared.replace("watchdog: 100ms, ", ""))
    assert load_deployment(path).watchdog == 320
    from fsmkit.diagnostics import FsmkitError

    path.write_text(declared)
    with pytest.raises(FsmkitError, match="shorter than two cycles"):
        load_deployment(path)


def test_the_time_until_silence_is_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = lift(tmp_path, 50, 20)
    assert execute(["compile", str(path), "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    (response,) = re.findall(r"command \(0x200, every 20 ms\): (\d+) us", told)
    assert f"silent at most {50_000 + int(response)} us after its last cycle" in told
    assert "50u" in (tmp_path / "out/a/lift_a.c").read_text().split("lift_a_map")[1]


DRIVE = """\
chart: Drive
inputs: {target: -2000..2000, enable: bool}
data: {is_stale: bool = false}
events: {in: [command_silent]}
initial: off
states:
  off:
    rest: true
    on: {command_silent: {do: is_stale = true}}
    always: [{if: enable and target > 0 and not is_stale, target: on}]
  on:
    rest: true
    on: {command_silent: {TARGETdo: is_stale = true}}
    always: [{if: not enable, target: off}]
"""


@pytest.mark.cc
@pytest.mark.parametrize(
    ("target", "may", "verdict"),
    [
        ("target: off, ", ", drive.command_silent", "holds"),
        ("", ", drive.command_silent", "violated"),
        ("", "", "holds"),  # a timeout that never comes is not explored
    ],
)
def test_the_timeout_of_a_receiver_is_explored(
    tmp_path: Path, target: str, may: str, verdict: str
) -> None:
    """As `docs/reference/links.md` says: an event of the receiver, listed under `may`."""
    path = lift(tmp_path, 100, 10)
    (tmp_path / "drive.yaml").write_text(DRIVE.replace("TARGET", target))
    system = tmp_path / "lift.yaml"
    text = system.read_text().replace("[plc.go]", f"[plc.go{may}]")
    system.write_text(text + "properties: {stops: {never: drive.In(on) and drive.is_stale}}\n")
    report = fsmkit.check(fsmkit.read_system(path))
    assert {each.name: each.verdict.value for each in report.results}["stops"] == verdict
