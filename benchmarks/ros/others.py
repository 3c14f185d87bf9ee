"""Other topics in the domain: 32, with 100 messages a second each, between two processes."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

COUNT = 32
PERIOD = 0.01
"""Seconds from one message of a topic to the next."""


@contextmanager
def others(domain: int, *, is_insecure: bool = False) -> Iterator[None]:
    """Let other programs exchange messages in a domain, confined to this computer or not."""
    command = [sys.executable, "-m", "benchmarks.ros.others"]
    command += ["insecure"] if is_insecure else []
    programs = [
        subprocess.Popen([*command, what, str(domain)], stdout=subprocess.PIPE, text=True)
        for what in ("subscribe", "publish")
    ]
    try:
        for program in programs:
            assert program.stdout is not None
            program.stdout.readline()  # it is ready
        yield
    finally:
        for program in programs:
            program.kill()
            program.communicate()


def main(what: str, domain: int, *, is_insecure: bool) -> None:
    """Publish, or subscribe to, all topics until the process is killed."""
    from cyclonedds.core import Policy, Qos
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    from fsmkit.carriers.ros.domain import Participant
    from fsmkit.carriers.ros.messages import STANDARD
    from fsmkit.carriers.ros.structs import message_of, struct_of

    joined = Participant(domain, is_insecure=is_insecure)
    type_ = STANDARD["std_msgs/msg/UInt32"]
    qos = Qos(Policy.Reliability.Reliable(0), Policy.History.KeepLast(10))
    topics = [
        Topic(joined.participant, f"rt/other_{number}", struct_of(type_)) for number in range(COUNT)
    ]
    end = DataReader if what == "subscribe" else DataWriter
    ends = [end(joined.participant, topic, qos=qos) for topic in topics]
    print("ready", flush=True)
    at, number = time.monotonic(), 0
    while True:
        for each in ends:
            if what == "subscribe":
                each.take(20)
            else:
                each.write(message_of(type_, {"data": number}))
        number += 1
        at += PERIOD
        time.sleep(max(0.0, at - time.monotonic()))


if __name__ == "__main__":
    *flags, chosen, number = sys.argv[1:]
    main(chosen, int(number), is_insecure="insecure" in flags)
