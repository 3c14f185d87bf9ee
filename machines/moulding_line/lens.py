"""The camera program of the line: DDS with the names of ROS 2, without fsmkit.

It answers each `look` 20 to 40 ms later with a quality, and loses a share of all messages.
"""

# mypy: disable-error-code="misc, call-arg"

import json
import random
import signal
import time
from dataclasses import dataclass

import click
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

EVENTS = Qos(
    Policy.Reliability.Reliable(max_blocking_time=1_000_000_000),
    Policy.Durability.Volatile,
    Policy.History.KeepLast(64),
)


@dataclass
class Look(IdlStruct, typename="fsmkit_line.msg.dds_.LensLook_"):
    """`msg/LensLook.msg`."""

    session: uint32
    sequence: uint32
    events: uint32
    number: uint8


@dataclass
class Seen(IdlStruct, typename="fsmkit_line.msg.dds_.LensSeen_"):
    """`msg/LensSeen.msg`."""

    session: uint32
    sequence: uint32
    events: uint32
    number: uint8
    quality: uint8


@click.command()
@click.argument("domain", type=int)
@click.option("--seconds", type=float, required=True, help="At most; until SIGTERM.")
@click.option("--loss", type=float, default=0.0)
@click.option("--seed", type=int, default=1)
def main(domain: int, seconds: float, loss: float, seed: int) -> None:
    """Run the lens in a domain of DDS."""
    chance = random.Random(seed)  # noqa: S311
    participant = DomainParticipant(domain)
    topic = Topic(participant, "rt/line/lens/look", Look, qos=EVENTS)
    looks = DataReader(participant, topic, qos=EVENTS)
    topic = Topic(participant, "rt/line/lens/seen", Seen, qos=EVENTS)
    writer = DataWriter(participant, topic, qos=EVENTS)
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: ended.append(number))
    end, heard, dropped = time.monotonic() + seconds, 0, 0
    while time.monotonic() < end and not ended:
        for look in looks.take(16):
            if not isinstance(look, Look):
                continue
            heard += 1
            if chance.random() < loss:
                dropped += 1
                continue
            time.sleep(chance.uniform(0.020, 0.040))
            if chance.random() < loss:
                dropped += 1
            else:
                writer.write(Seen(0, 0, 0, look.number, chance.randrange(40, 101)))
        time.sleep(0.002)
    click.echo(json.dumps({"program": "lens", "heard": heard, "dropped": dropped}))


if __name__ == "__main__":
    main()
