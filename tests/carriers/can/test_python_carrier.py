"""A node in Python on buses of python-can: events, levels, silence, loss and bus-off."""

from __future__ import annotations

import random
import struct
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fsmkit.carriers.can.plugin import PLUGIN
from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime.links import Link, Message
from fsmkit.runtime.links.opening import open_link
from tests.carriers.can.conftest import free_port
from tests.carriers.can.test_can_nodes import write  # noqa: F401  (a fixture)
from tests.reading import load_deployment

pytestmark = pytest.mark.external

HEATER, SET_POWER, STATUS = 0x100, 0x200, 0x300


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def events_of(link: Link) -> Iterator[Message]:
    link.begin_cycle()
    while (message := link.receive()) is not None:
        yield message


def test_a_node_hears_and_answers_on_a_bus(
    write: Callable[..., Path],  # noqa: F811
) -> None:
    import can

    from fsmkit.carriers.can import translator

    clock = Clock()
    deployment = load_deployment(write())
    options = PLUGIN.foreign_options(deployment, "a")
    assert options["heater"]["bus"] == "can0"
    options["heater"] |= {"interface": "virtual", "clock": clock}
    link = open_link(deployment.map, "a", session=1, foreign=options)
    (translated,) = link.translators
    assert isinstance(translated, translator.CanTranslator)
    level = "heater.temperature -> control.temperature"
    with can.Bus(interface="virtual", channel="can0") as heater:

        def send(frame: int, content: bytes, *, is_error: bool = False) -> None:
            heater.send(
                can.Message(
                    arbitration_id=frame,
                    data=content,
                    is_extended_id=is_error,
                    is_error_frame=is_error,
                )
            )

        send(HEATER, struct.pack("<h", 600))
        send(STATUS, bytes((7, 4, 0, 3)))
        send(STATUS, bytes((0, 4, 0, 3)))  # nothing takes it
        (event,) = events_of(link)
        assert (event.event, event.payload) == ("failed", {"code": 4, "mode": "failed"})
        assert link.level(level) == 600
        for content in (struct.pack("<h", 1001), b"\0"):
            send(HEATER, content)
        send(STATUS, bytes((9, 0, 0, 0)))
        send(STATUS, bytes((7, 0, 0, 2)))  # no member of `mode`
        assert list(events_of(link)) == []
        assert (link.malformed, translated.counters.refused) == (4, 4)
        link.send(deployment.map.message("control.set_power -> heater.set_power", percent=77))
        link.end_cycle()
        answer = heater.recv(1)
        assert answer is not None
        assert (answer.arbitration_id, bytes(answer.data)) == (SET_POWER, bytes([77]))
        clock.now = 0.024
        assert list(events_of(link)) == []
        clock.now = 0.025
        assert [event.event for event in events_of(link)] == ["heater_silent"]
        clock.now = 9.0
        assert list(events_of(link)) == []
        send(HEATER, struct.pack("<h", -400))
        assert list(events_of(link)) == []
        assert link.level(level) == -400
        assert link.counters("heater").restarts == 1
        send(0x40, bytes(8), is_error=True)
        assert list(events_of(link)) == []
        assert (translated.counters.bus_errors, translated.counters.bus_off) == (1, 1)
    link.close()


def test_what_a_bus_drops_is_not_counted_as_come(
    write: Callable[..., Path],  # noqa: F811
) -> None:
    """10 % loss, and bus-off for 5 s: counters and silences are those of the bus."""
    import can

    from fsmkit.carriers.can import translator

    clock = Clock()
    deployment = load_deployment(write())
    options = PLUGIN.foreign_options(deployment, "a")
    options["heater"] |= {"interface": "virtual", "bus": "lossy", "clock": clock}
    link = open_link(deployment.map, "a", session=1, foreign=options)
    (translated,) = link.translators
    assert isinstance(translated, translator.CanTranslator)
    draw = random.Random(3)
    carried = gap = silences = expected = 0
    with can.Bus(interface="virtual", channel="lossy") as heater:
        for cycle in range(3000):
            clock.now = cycle * 0.010 + 0.001
            is_off = 1000 <= cycle < 1500
            if cycle == 1000:
                heater.send(can.Message(arbitration_id=0x40, is_error_frame=True, data=bytes(8)))
            if is_off or draw.random() < 0.1:
                gap += 1
                expected += gap == 3  # 30 ms without a frame, and the limit is 25 ms
            else:
                gap = 0
                carried += 1
                content = struct.pack("<h", cycle % 1000)
                heater.send(can.Message(arbitration_id=HEATER, data=content, is_extended_id=False))
            silences += sum(event.event == "heater_silent" for event in events_of(link))
    assert translated.counters.received == carried
    assert (silences, translated.counters.bus_off) == (expected, 1)
    assert silences > 1
    counters = link.counters("heater")
    assert counters.restarts == silences
    assert (counters.lost_frames, counters.lost_events, link.malformed) == (0, 0, 0)
    link.close()


def test_frames_of_multicast_are_those_of_socketcan() -> None:
    import can

    from fsmkit.carriers.can.translator import MulticastBus

    at = f"239.74.163.2:{free_port()}"
    sent = [
        can.Message(arbitration_id=0x7FF, is_extended_id=False, data=b"abc"),
        can.Message(arbitration_id=0x1FFFFFFF, is_extended_id=True, data=b""),
        can.Message(arbitration_id=5, is_extended_id=False, is_fd=True, data=bytes(range(64))),
        can.Message(arbitration_id=0x40, is_extended_id=False, is_error_frame=True, data=bytes(8)),
    ]
    with MulticastBus(at) as one, MulticastBus(at) as other:
        for message in sent:
            one.send(message)
            found = other.recv(5)
            assert found is not None
            assert found.equals(message, timestamp_delta=None, check_direction=False)
        assert other.recv(0) is None


def test_a_bus_that_is_not_there_is_a_finding(write: Callable[..., Path]) -> None:  # noqa: F811
    deployment = load_deployment(write())
    for bus in ("no_such_bus", "udp:10.0.0.1:5", "udp:", "udp:239.74.163.2:x"):
        options = PLUGIN.foreign_options(deployment, "a")
        options["heater"]["bus"] = bus
        with pytest.raises(FsmkitError) as caught:
            open_link(deployment.map, "a", session=1, foreign=options)
        assert [found.rule.name for found in caught.value.diagnostics] == ["link-not-opened"]


@pytest.mark.cc
def test_programs_of_python_can_attach_to_the_bus_of_the_c_carrier(tmp_path: Path) -> None:
    """As the package is installed: its entry point, and a logger of others that prints a frame."""
    import can

    from fsmkit.carriers.can.translator import MulticastBus

    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())
    target = project["project"]["entry-points"]["can.interface"]["fsmkit_udp"]
    installed = tmp_path / "fsmkit_udp-1.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: fsmkit-udp\nVersion: 1\n")
    (installed / "entry_points.txt").write_text(f"[can.interface]\nfsmkit_udp = {target}\n")
    path = f"import sys; sys.path.insert(0, {str(tmp_path)!r})"
    attach = "from can.logger import main; sys.argv[1:] = ['-i', 'fsmkit_udp', '-c', sys.argv[1]]"
    at = f"239.74.163.9:{free_port()}"
    with (
        subprocess.Popen(
            [sys.executable, "-uc", f"{path}; {attach}; main()", at],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        ) as logger,
        MulticastBus(at) as bus,
    ):  # fmt: skip
        try:
            assert logger.stdout is not None
            for line in logger.stdout:
                if line.startswith("Can Logger"):
                    bus.send(can.Message(arbitration_id=0x321, data=b"\x07", is_extended_id=False))
                if " 321 " in line:
                    break
            else:
                pytest.fail("the logger ended")
        finally:
            logger.kill()
    assert "07" in line
