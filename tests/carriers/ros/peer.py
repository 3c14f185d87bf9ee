"""A program of Cyclone DDS that knows nothing of fsmkit: the lens, by the names that ROS has."""

# mypy: disable-error-code="misc, call-arg"

import sys
import time
from dataclasses import dataclass
from typing import Any

from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float32, int32, uint8, uint16, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

EVENTS = Qos(
    Policy.Reliability.Reliable(max_blocking_time=2_000_000_000),
    Policy.Durability.Volatile,
    Policy.History.KeepAll,
    Policy.ResourceLimits(max_samples=1000),
)
STATE = Qos(
    Policy.Reliability.Reliable(max_blocking_time=2_000_000_000),
    Policy.Durability.TransientLocal,
    Policy.History.KeepLast(1),
)


@dataclass
class Duration(IdlStruct, typename="builtin_interfaces.msg.dds_.Duration_"):
    sec: int32
    nanosec: uint32


@dataclass
class Judged(IdlStruct, typename="fsmkit_cell.msg.dds_.LensJudged_"):
    session: uint32
    sequence: uint32
    events: uint32
    quality: uint8
    verdict: uint8
    took: Duration
    ratio: float32


@dataclass
class Look(IdlStruct, typename="fsmkit_cell.msg.dds_.LensLook_"):
    session: uint32
    sequence: uint32
    events: uint32
    near: bool


@dataclass
class UInt16(IdlStruct, typename="std_msgs.msg.dds_.UInt16_"):
    data: uint16


@dataclass
class Int32(IdlStruct, typename="std_msgs.msg.dds_.Int32_"):
    data: int32


@dataclass
class String(IdlStruct, typename="std_msgs.msg.dds_.String_"):
    data: str


def say(*found: object) -> None:
    sys.stdout.write(" ".join(map(str, found)) + "\n")
    sys.stdout.flush()


class Lens:
    """The lens, with each of its topics when it is first needed."""

    def __init__(self, domain: int) -> None:
        self.participant = DomainParticipant(domain)
        self.ends: dict[str, Any] = {}

    def writer(self, name: str, type_: Any, qos: Qos) -> Any:
        if name not in self.ends:
            topic = Topic(self.participant, f"rt/cell/lens/{name}", type_)
            self.ends[name] = DataWriter(self.participant, topic, qos=qos)
        return self.ends[name]

    def reader(self, name: str, type_: Any, qos: Qos) -> Any:
        if name not in self.ends:
            topic = Topic(self.participant, f"rt/cell/{name}", type_)
            self.ends[name] = DataReader(self.participant, topic, qos=qos)
        return self.ends[name]

    def judged(self, quality: int, session: int = 0, sequence: int = 0, verdict: int = 1) -> None:
        message = Judged(session, sequence, 0, quality, verdict, Duration(1, 500), 0.25)
        while True:
            try:
                self.writer("judged", Judged, EVENTS).write(message)
                return
            except DDSException as error:
                if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                    raise

    def light(self, value: int) -> None:
        self.writer("light", UInt16, STATE).write(UInt16(value))

    def matched(self) -> bool:
        return all(
            end.get_matched_subscriptions()
            if isinstance(end, DataWriter)
            else end.get_matched_publications()
            for end in self.ends.values()
        )


def exchange(lens: Lens, count: int) -> None:
    """Publish so many events while as many come; print what came, and in which order."""
    lens.writer("judged", Judged, EVENTS)
    looks = lens.reader("lens/look", Look, EVENTS)
    while not lens.matched():
        time.sleep(0.01)
    say("ready")
    sys.stdin.readline()  # the other side knows of both topics, too
    numbers: list[int] = []
    for number in range(count):
        lens.judged(number % 251, session=9, sequence=number)
        numbers += [sample.sequence for sample in looks.take(100) if isinstance(sample, Look)]
    until = time.monotonic() + 60
    while len(numbers) < count and time.monotonic() < until:
        numbers += [sample.sequence for sample in looks.take(100) if isinstance(sample, Look)]
        time.sleep(0.001)
    time.sleep(0.2)
    numbers += [sample.sequence for sample in looks.take(100) if isinstance(sample, Look)]
    say(len(numbers), numbers == list(range(count)))
    sys.stdin.readline()


def obey(lens: Lens) -> None:
    """Do what lines of the input say: a method with integers."""
    say("ready")
    for line in sys.stdin:
        name, *arguments = line.split()
        if name == "wait":
            while not lens.matched():
                time.sleep(0.01)
        else:
            getattr(lens, name)(*map(int, arguments))
        say("done")


def late(lens: Lens) -> None:
    """Print what a late subscriber has of each topic that is kept, and after how many seconds."""
    begin = time.monotonic()
    for name, type_ in (
        ("lens/encoder", Int32),
        ("lens/pause", Duration),
        ("camera/state", String),
    ):
        reader = lens.reader(name, type_, STATE)
        while not (found := reader.take(1)):
            time.sleep(0.005)
        say(found[0])
    say(time.monotonic() - begin)


if __name__ == "__main__":
    own = Lens(int(sys.argv[2]))
    if sys.argv[1] == "exchange":
        exchange(own, int(sys.argv[3]))
    elif sys.argv[1] == "obey":
        obey(own)
    else:
        late(own)
