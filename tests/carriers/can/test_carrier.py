"""A node on a bus of UDP multicast: events, levels, silence, and what is refused and counted."""

from __future__ import annotations

import socket
import struct
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.carriers.can.conftest import HEATER as HEATER_FILE
from tests.carriers.can.conftest import built, free_port
from tests.carriers.can.test_can_nodes import write  # noqa: F401  (a fixture)

pytestmark = [pytest.mark.external, pytest.mark.cc]

GROUP = "239.74.163.2"
HEATER, SET_POWER, STATUS = 0x100, 0x200, 0x300
BUS_OFF = 0x20000040
SOURCES = "fsm_link", "fsm_link_fan", "fsm_can", "fsm_can_bus", "fsm_link_can"


class Bus:
    """The foreign end: frames as `struct can_frame`."""

    def __init__(self, port: int) -> None:
        self.at = GROUP, port
        self.out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        own = socket.inet_aton("127.0.0.1")
        self.out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, own)
        self.out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.into = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.into.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.into.bind(self.at)
        join = socket.inet_aton(GROUP) + own
        self.into.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, join)

    def send(self, frame: int, content: bytes) -> None:
        self.out.sendto(struct.pack("<IB3x8s", frame, len(content), content), self.at)

    def wait(self, frame: int, every: Callable[[], None] | None = None) -> bytes:
        """Return the content of the next frame with this identifier; ``every``: done each 5 ms."""
        end = time.monotonic() + 10.0
        self.into.settimeout(0.005)
        while time.monotonic() < end:
            if every is not None:
                every()
            try:
                number, length, content = struct.unpack("<IB3x8s", self.into.recv(72))
            except TimeoutError:
                continue
            if number == frame:
                return bytes(content[:length])
        raise AssertionError(f"no frame {frame:#x}")

    def close(self) -> None:
        self.out.close()
        self.into.close()


@pytest.fixture
def bus() -> Iterator[Bus]:
    made = Bus(free_port())
    yield made
    made.close()


@pytest.fixture
def build(
    write: Callable[..., Path],  # noqa: F811
    tmp_path: Path,
    require_tool: Callable[[str], str],
) -> Callable[[str], Path]:
    """Build the node for a DBC file."""
    return lambda dbc: built(write(dbc=dbc), tmp_path, require_tool("gcc"), SOURCES, "bus_player.c")


def test_a_node_hears_and_answers_a_controller_on_the_bus(
    build: Callable[[str], Path], bus: Bus
) -> None:
    player = build(HEATER_FILE.read_text())
    for name in ("udp:10.0.0.1:5", "udp:239.0.0.1:0", "udp:", "no_such_bus"):
        done = subprocess.run([player, name], capture_output=True, check=False)
        assert (done.returncode, done.stdout[:6]) == (1, b"error ")
    command = [str(player), f"udp:{GROUP}:{bus.at[1]}"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as node:
        assert node.stdout is not None
        assert node.stdin is not None
        assert node.stdout.readline() == "ready\n"
        # silence from the start: heater_silent -> off
        assert bus.wait(SET_POWER) == b"\0"
        bus.send(HEATER, struct.pack("<h", 600))
        bus.send(HEATER, struct.pack("<h", 1001))  # out of range: -400..1000
        bus.send(HEATER, b"\0")  # too short
        bus.send(STATUS, bytes((9, 0, 0, 0)))  # no message of the multiplexer
        bus.send(STATUS, bytes((0, 0, 0, 0)))  # one that nothing takes
        bus.send(0x101, b"\1")  # of nobody
        bus.send(BUS_OFF, bytes(8))
        time.sleep(0.1)
        node.stdin.close()
        counted = node.stdout.read()
    received, sent, unsent, refused, errors, off = map(int, counted.split()[:6])
    assert (received, sent, unsent, refused, errors, off) == (5, 1, 0, 3, 1, 1)
    assert counted.split()[6:] == ["malformed", "3", "restarts", "1", "temperature", "600"]


def test_levels_switch_a_machine_and_its_event_is_a_frame(
    build: Callable[[str], Path], bus: Bus
) -> None:
    player = build(HEATER_FILE.read_text().replace("BO_ 256 10;", "BO_ 256 400;"))
    command = [str(player), f"udp:{GROUP}:{bus.at[1]}"]
    hot = struct.pack("<h", 600)
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as node:
        assert bus.wait(SET_POWER, every=lambda: bus.send(HEATER, hot)) == b"\0"
        assert bus.wait(SET_POWER) == b"\0"  # after 1 s of silence
        assert node.stdin is not None
        node.stdin.close()
        assert node.stdout is not None
        assert "malformed 0" in node.stdout.read()
