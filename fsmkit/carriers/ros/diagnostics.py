"""Publish the counters of a node on ``/diagnostics`` of ROS 2, as ``fsm_dds_diagnostics.c``.

By Cyclone DDS, or by rclpy: Cyclone DDS for Python and Fast DDS, the default of ROS, describe the
type `diagnostic_msgs/msg/DiagnosticArray` differently, and do not match.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import asdict, dataclass
from typing import Any, Protocol

from fsmkit.runtime.node import Node

OK, WARNING, ERROR = 0, 1, 2
"""As in `diagnostic_msgs/msg/DiagnosticStatus`."""
OF_PEER = (
    *("lost_frames", "lost_events", "missed", "late"),
    *("doubled", "overflow", "restarts"),
)
"""The counters of a peer that are shown."""
TOPIC = "diagnostics"
DEPTH = 10
"""Messages that are kept for a subscriber, as ROS itself has it."""


@dataclass(frozen=True, slots=True)
class Status:
    """A `diagnostic_msgs/msg/DiagnosticStatus`."""

    name: str
    level: int
    message: str
    values: Mapping[str, str]


class Publisher(Protocol):
    """Publishes messages of ``/diagnostics``."""

    def publish(self, hardware: str, statuses: tuple[Status, ...]) -> None:
        """Publish statuses of one instant. Must not block."""
        ...

    def close(self) -> None:
        """Leave the domain."""
        ...


class Diagnostics(AbstractContextManager["Diagnostics"]):
    """Publishes a status of a node, of its link to each other node, and of each machine.

    A status is an error if the machine has stopped by a fault, and a warning if a counter has
    increased since the previous message.

    Args:
        node: The node.
        domain: The domain of DDS; with rclpy that of ``ROS_DOMAIN_ID``.
        is_insecure: Whether the domain extends beyond this computer; see
            `fsmkit.carriers.ros.domain`.
        way: ``dds`` or ``rclpy``.
        period: Seconds between messages.
        clock: Returns seconds.

    Raises:
        FsmkitError: ``missing-package``; ``link-not-opened``.

    """

    def __init__(
        self,
        node: Node,
        *,
        domain: int = 0,
        is_insecure: bool = False,
        way: str = "dds",
        period: float = 1.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        if way not in ("dds", "rclpy"):
            raise ValueError(f"`way` is `dds` or `rclpy`, not `{way}`")
        self._node = node
        self._period = period
        self._clock = clock
        self._due = clock() + period
        self._before: dict[str, dict[str, int]] = {}
        self._overruns = 0
        self._publisher: Publisher = (
            _Rclpy(self._own) if way == "rclpy" else _Dds(domain, is_insecure=is_insecure)
        )

    @property
    def _own(self) -> str:
        deployment = self._node.deployment
        return f"{deployment.system.name}/{deployment.nodes[self._node.place]}"

    def update(self, *, overruns: int = 0) -> None:
        """Publish if it is time; in each cycle. ``overruns``: late cycles so far."""
        self._overruns = overruns
        now = self._clock()
        if now >= self._due:
            self._due = max(self._due + self._period, now)
            self._publisher.publish(self._own, self.statuses())

    def statuses(self) -> tuple[Status, ...]:
        """Return the statuses, compared with the previous call."""
        deployment, link = self._node.deployment, self._node.link
        own = {"refused": link.refused, "malformed": link.malformed, "foreign": link.foreign}
        found = [self._counters(self._own, own | {"overruns": self._overruns}, {})]
        for place, peer in enumerate(deployment.nodes):
            if place != self._node.place:
                counted = asdict(link.counters(peer))
                shown = {name: int(counted[name]) for name in OF_PEER}
                silence = {"silence": str(link.silence(peer))}
                found.append(self._counters(f"{self._own}: {peer}", shown, silence))
        for machine in self._node.system.machines:
            fault = self._node.machines.snapshot(machine.name).fault
            name = f"{self._own}: {machine.name}"
            text = "runs" if fault is None else f"stopped by the fault {fault}"
            found.append(Status(name, OK if fault is None else ERROR, text, {}))
        return tuple(found)

    def _counters(self, name: str, values: dict[str, int], more: dict[str, str]) -> Status:
        before = self._before.setdefault(name, dict.fromkeys(values, 0))
        moved = [key for key, value in values.items() if before[key] != value]
        self._before[name] = values
        text = f"moved: {', '.join(moved)}" if moved else "no counter moved"
        shown = {key: str(value) for key, value in values.items()}
        return Status(name, WARNING if moved else OK, text, shown | more)

    def close(self) -> None:
        """Leave the domain."""
        self._publisher.close()

    def __exit__(self, *_: object) -> None:
        self.close()


class _Dds:
    """By Cyclone DDS."""

    def __init__(self, domain: int, *, is_insecure: bool) -> None:
        from fsmkit.carriers.ros.plugin import findings

        with findings(domain):
            from cyclonedds.core import Policy, Qos
            from cyclonedds.pub import DataWriter
            from cyclonedds.topic import Topic

            from fsmkit.carriers.ros import standard_structs
            from fsmkit.carriers.ros.domain import Participant

            self._types: Any = standard_structs
            self._joined = Participant(domain, is_insecure=is_insecure)
            qos = Qos(
                Policy.Reliability.Reliable(max_blocking_time=0),
                Policy.History.KeepLast(DEPTH),
                Policy.DataRepresentation(use_cdrv0_representation=True),
            )
            topic: Any = Topic(
                self._joined.participant, f"rt/{TOPIC}", standard_structs.DiagnosticArray
            )
            self._writer: Any = DataWriter(self._joined.participant, topic, qos=qos)

    def publish(self, hardware: str, statuses: tuple[Status, ...]) -> None:
        from cyclonedds.core import DDSException

        types, now = self._types, time.time_ns()
        content = [
            types.DiagnosticStatus(
                each.level,
                each.name,
                each.message,
                hardware,
                [types.KeyValue(key, value) for key, value in each.values.items()],
            )
            for each in statuses
        ]
        stamp = types.Time(now // 1_000_000_000, now % 1_000_000_000)
        with suppress(DDSException):  # the next message includes this one
            self._writer.write(types.DiagnosticArray(types.Header(stamp, ""), content))

    def close(self) -> None:
        self._writer = None
        self._joined.leave()


class _Rclpy:
    """By rclpy, with the messages of an installation of ROS 2."""

    def __init__(self, name: str) -> None:
        from fsmkit.carriers.ros.rclpy_node import RclpyNode

        self._joined = RclpyNode(name)
        self._types: Any = self._joined.package("diagnostic_msgs.msg")
        self._publisher = self._joined.node.create_publisher(
            self._types.DiagnosticArray, f"/{TOPIC}", DEPTH
        )

    def publish(self, hardware: str, statuses: tuple[Status, ...]) -> None:
        types = self._types
        message = types.DiagnosticArray()
        message.header.stamp = self._joined.node.get_clock().now().to_msg()
        message.status = [
            types.DiagnosticStatus(
                level=bytes([each.level]),
                name=each.name,
                message=each.message,
                hardware_id=hardware,
                values=[types.KeyValue(key=key, value=value) for key, value in each.values.items()],
            )
            for each in statuses
        ]
        self._publisher.publish(message)

    def close(self) -> None:
        self._joined.leave()
