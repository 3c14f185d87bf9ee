"""The estimator as a separate program: it reads pictures and writes verdicts on topics of ROS 2.

``python -m machines.production_cell.vision.estimator 18``. It uses the topics, but not fsmkit. It
answers each picture, 30 a second, at once with the block that is before the sorter then, estimated
from its movement since it was last seen. An invalid picture is skipped.
"""

# mypy: disable-error-code="misc, call-arg"

import json
import os
import signal
import struct
import sys
from dataclasses import dataclass

import click
from cyclonedds.core import (
    DDSException,
    InstanceState,
    Policy,
    Qos,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import int16, int32, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from ..simulation.camera import UNKNOWN, Sighting, at_sorter, with_seen

EVENTS = Qos(
    Policy.Reliability.Reliable(max_blocking_time=1_000_000_000),
    Policy.Durability.Volatile,
    Policy.History.KeepLast(64),
)
UNREADABLE = (DDSException, struct.error, ValueError, TypeError, IndexError, AttributeError)
"""The errors raised for an invalid message."""
WAIT = 500_000_000
"""Interval in ns of the check whether the parent program is gone."""


@dataclass
class Picture(IdlStruct, typename="fsmkit_sighting.msg.dds_.EstimatorPicture_"):
    """`msg/EstimatorPicture.msg`; ``block`` 0: none is seen."""

    session: uint32
    sequence: uint32
    events: uint32
    number: uint32
    encoder: int32
    block: uint8
    at: int16
    verdict: uint8


@dataclass
class Estimated(IdlStruct, typename="fsmkit_sighting.msg.dds_.EstimatorEstimated_"):
    """`msg/EstimatorEstimated.msg`; ``number``: of the picture that is answered."""

    session: uint32
    sequence: uint32
    events: uint32
    number: uint32
    block: uint8
    verdict: uint8


class Following:
    """The blocks that were seen, in one life of the cell."""

    def __init__(self, drift: float) -> None:
        self.drift = drift
        self.session = 0
        self.sightings: tuple[Sighting, ...] = ()
        self.answered = self.refused = 0

    def answer(self, picture: Picture) -> Estimated | None:
        """Return what is before the sorter at the time of a picture; None if it makes no sense."""
        if picture.verdict > UNKNOWN:
            self.refused += 1
            return None
        if picture.session != self.session:  # encoders of another life have another zero
            self.session, self.sightings = picture.session, ()
        if picture.block:
            seen = Sighting(picture.block, picture.at, picture.encoder, picture.verdict)
            self.sightings = with_seen(self.sightings, seen, self.drift)
        found = at_sorter(self.sightings, picture.encoder, self.drift)
        self.answered += 1
        return Estimated(0, 0, 0, picture.number, found.block, found.verdict)


@click.command()
@click.argument("domain", type=click.IntRange(0, 232))
@click.option("--drift", type=float, default=0.0)
def main(domain: int, drift: float) -> None:
    """Follow blocks in a domain of DDS, until SIGTERM or the death of the parent."""
    following, parent = Following(drift), os.getppid()
    participant = DomainParticipant(domain)
    topic = Topic(participant, "rt/cell/estimator/picture", Picture, qos=EVENTS)
    pictures = DataReader(participant, topic, qos=EVENTS)
    topic = Topic(participant, "rt/cell/estimator/estimated", Estimated, qos=EVENTS)
    writer = DataWriter(participant, topic, qos=EVENTS)
    waiting = WaitSet(participant)
    waiting.attach(ReadCondition(pictures, SampleState.Any | ViewState.Any | InstanceState.Any))
    ended: list[int] = []
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # its parent decides when it ends
    signal.signal(signal.SIGTERM, lambda number, _: ended.append(number))
    while not ended and os.getppid() == parent:
        waiting.wait(WAIT)
        try:
            taken = pictures.take(64)
        except UNREADABLE:
            following.refused += 1
            continue
        for picture in taken:
            if not isinstance(picture, Picture):
                continue
            answer = following.answer(picture)
            if answer is not None:
                try:
                    writer.write(answer)
                except DDSException as error:  # the cell does not read: it receives the next one
                    print(f"not sent: {error}", file=sys.stderr)
    print(json.dumps({"answered": following.answered, "refused": following.refused}))


if __name__ == "__main__":
    main()
