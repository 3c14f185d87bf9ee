"""Transmit frames between nodes of fsmkit by topics of ROS, `std_msgs/msg/UInt8MultiArray`."""

from __future__ import annotations

import struct
import time
from contextlib import suppress
from typing import Any

from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from fsmkit.carriers.ros.domain import Participant, matched_ends
from fsmkit.carriers.ros.standard_structs import Layout, UInt8MultiArray
from fsmkit.carriers.ros.topics import frame_topics
from fsmkit.carriers.ros.translator import UNREADABLE
from fsmkit.runtime.links.faults import Faults
from fsmkit.runtime.links.link import SLOTS, Link, LinkTimeout
from fsmkit.system.deployment.event_map import EventMap

WAITING = 4
"""Frames that wait for a peer, there and here, for each slot of the ring; as ZeroMQ has it."""
POLL = 0.001
"""Seconds between looks at who listens."""


class RosLink(Link):
    """A link of a node; the topic of a node is ``<namespace>/<node>/frames``.

    Frames are published and taken in the calls of the loop, none of which waits. If a peer does not
    read in time, its oldest frames are overwritten, and it counts them as lost. Publishers are not
    authenticated: without `EventMap.is_insecure` the domain is confined to this computer.
    """

    def __init__(
        self,
        event_map: EventMap,
        node: str,
        *,
        session: int,
        faults: Faults | None = None,
        domain: int = 0,
        namespace: str | None = None,
        slots: int = SLOTS,
    ) -> None:
        super().__init__(event_map, node, session, faults, slots, is_proven=False)
        self._joined = Participant(domain, is_insecure=event_map.is_insecure)
        tag = struct.pack("<II", event_map.hash, session)
        qos = Qos(
            Policy.Reliability.Reliable(max_blocking_time=0),
            Policy.Durability.Volatile,
            Policy.IgnoreLocal.Participant,
            Policy.DataRepresentation(use_cdrv0_representation=True),
            Policy.History.KeepLast(WAITING * slots),
            Policy.Userdata(tag),
        )
        names = frame_topics(event_map, namespace)
        topics = {
            place: Topic(self._joined.participant, f"rt{names[place]}", UInt8MultiArray)
            for place in event_map.own_nodes
        }
        self._writer: Any = DataWriter(self._joined.participant, topics[self.node], qos=qos)
        self._readers: dict[int, Any] = {
            place: DataReader(self._joined.participant, topic, qos=qos)
            for place, topic in topics.items()
            if place != self.node
        }

    def wait_listeners(self, timeout: float) -> None:
        """Block until each other node and this one have discovered each other.

        Another node may discover this one a little later; it counts the events that it misses.
        """
        until = time.monotonic() + timeout
        while True:
            listen = len(matched_ends(self._writer.get_matched_subscriptions)) >= len(self._readers)
            deaf = [
                n
                for n, each in self._readers.items()
                if not matched_ends(each.get_matched_publications)
            ]
            if listen and not deaf:
                return
            if time.monotonic() >= until:
                own = self.map.nodes[self.node]
                names = ", ".join(f"`{self.map.nodes[node]}`" for node in deaf or self._readers)
                raise LinkTimeout(f"node `{own}` waited {timeout} s for {names} to listen")
            time.sleep(POLL)

    def close(self) -> None:
        """Leave the domain."""
        super().close()
        self._writer = None
        self._readers.clear()
        self._joined.leave()

    def _wake(self) -> None:
        while (frame := self.next_frame()) is not None:
            with suppress(DDSException):  # the peers count frames that DDS rejects as lost
                self._writer.write(UInt8MultiArray(Layout([], 0), list(frame)))

    def _pass_time(self) -> None:
        """Take received frames, but no more events than there is space for."""
        events = self.receiver.events
        for node, reader in self._readers.items():
            for _ in range(WAITING * events.capacity):
                if len(events) >= events.capacity:
                    break
                try:
                    samples = reader.take(1)
                except UNREADABLE:
                    self.receiver.arrive(node, b"")  # counts as malformed
                    continue
                if not samples:
                    break
                if samples[0].sample_info.valid_data:
                    self.receiver.arrive(node, bytes(samples[0].data))
        super()._pass_time()

    def _take_in(self, node: int, timeout: float) -> bool:  # noqa: ARG002  (of all kinds)
        raise ValueError("a link by topics of ROS is not deterministic: it waits for no frames")
