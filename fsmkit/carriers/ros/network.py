"""The ROS 2 part of a deployment: topics of frames, and foreign nodes."""

from __future__ import annotations

from collections.abc import Mapping

from fsmkit.carriers.ros.messages import lower
from fsmkit.carriers.ros.topics import RosNet, RosNode, frame_topics, is_topic
from fsmkit.diagnostics import Findings, Text
from fsmkit.emit import plain
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.deployment.event_map import EventMap
from fsmkit.system.indices import integer

MOST_DOMAINS = 232
"""The greatest number of a domain whose ports are those of UDP (RTPS 2.3, 9.6.1)."""


def ros_net(options: Mapping[str, Text], map_: EventMap, findings: Findings) -> RosNet:
    """Return the topics by which the nodes of fsmkit exchange frames; mind the findings."""
    domain = domain_of(options.get("domain"), findings)
    given = options.get("namespace")
    namespace: str = lower(map_.system)
    if given is not None and is_topic(given, "namespace", findings):
        namespace = plain(given.value)
    return RosNet(domain, namespace, frame_topics(map_, namespace))


def domain_of(text: Text | None, findings: Findings) -> int:
    """Return the number of a domain; 0 without one, or after an error."""
    number = None if text is None else integer(text, findings)
    if text is not None and number is not None and not 0 <= number <= MOST_DOMAINS:
        findings.add("unexpected-value", f"a domain of ROS is 0 to {MOST_DOMAINS}", text)
    return number or 0


def frames_of(deployment: Deployment) -> RosNet | None:
    """Return the topics by which the nodes of fsmkit exchange frames, if they do."""
    return deployment.network if isinstance(deployment.network, RosNet) else None


def ros_nodes(deployment: Deployment) -> dict[int, RosNode]:
    """Return the foreign nodes of ROS, by their places."""
    networks = deployment.foreign_networks
    return {place: found for place, found in networks.items() if isinstance(found, RosNode)}
