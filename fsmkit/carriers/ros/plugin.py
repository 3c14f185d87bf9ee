"""ROS 2: links between nodes by topics, and translators for foreign nodes of ROS."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fsmkit.carriers.ros.keys import FOREIGN_KEYS, LINK_KEYS
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.document.keys import Keys

if TYPE_CHECKING:
    from fsmkit.codegen.system.node import Node
    from fsmkit.diagnostics import Findings
    from fsmkit.runtime.links.link import Link, LinkRequest, Translator
    from fsmkit.system.deployment.carrier import DeploymentRequest, ForeignNetwork, Network
    from fsmkit.system.deployment.deployment import Deployment


class Ros:
    """Reads the ROS 2 part of a deployment, opens topics by Cyclone DDS, and writes tables in C.

    Options of a link: ``domain``, ``namespace``, ``slots``.
    """

    name = "ros"
    link_keys: Keys = LINK_KEYS
    required_keys: Mapping[str, str] = MappingProxyType({})
    foreign_keys: Keys = FOREIGN_KEYS
    options: tuple[str, ...] = ("domain", "namespace", "slots")
    library = Path(__file__).parent / "c"
    package = "ros2"

    # --- a deployment ------------------------------------------------------------------------

    def read(self, request: DeploymentRequest, findings: Findings) -> Network | None:
        """Return the topics by which the nodes of fsmkit exchange frames."""
        from fsmkit.carriers.ros.network import ros_net

        return ros_net(request.options, request.map, findings)

    def read_foreign(
        self, place: int, request: DeploymentRequest, network: Network | None, findings: Findings
    ) -> ForeignNetwork | None:
        """Return the topics of a foreign node."""
        from fsmkit.carriers.ros.foreign import ros_node

        del network
        kind = request.foreign[place]
        if kind is None:
            return None
        options, tables = kind.options, kind.tables
        return ros_node(place, kind.span, options, tables, request.system, request.wires, findings)

    # --- links -------------------------------------------------------------------------------

    def open(self, request: LinkRequest) -> Link:
        """Return a link of a node. Raises `FsmkitError` if it cannot be opened."""
        with findings(int(request.options.get("domain", 0))):
            from fsmkit.carriers.ros.link import RosLink

            return RosLink(
                request.event_map,
                request.node,
                session=request.session,
                faults=request.faults,
                **request.options,
            )

    def translator(self, link: Link, node: int, options: Mapping[str, Any]) -> Translator:
        """Return the translator between a link and topics, by `foreign_options`."""
        with findings(options["ros"].domain):
            if options["ros"].needs_rclpy:
                from fsmkit.carriers.ros.rclpy_translator import RclpyTranslator

                return RclpyTranslator(link, node, options["ros"])
            from fsmkit.carriers.ros.translator import RosTranslator

            return RosTranslator(link, node, options["ros"])

    def link_options(self, deployment: Any) -> dict[str, Any]:
        """Return domain and namespace of a deployment whose nodes exchange frames by topics."""
        from fsmkit.carriers.ros.network import frames_of

        topics = frames_of(deployment)
        if topics is None:
            return {}
        return {"domain": topics.domain, "namespace": topics.namespace}

    def foreign_options(self, deployment: Any, node: str) -> dict[str, dict[str, Any]]:
        """Return, by foreign node, the topics that a node exchanges with it."""
        from fsmkit.carriers.ros.network import ros_nodes

        own = deployment.nodes.index(node)
        return {
            deployment.nodes[place]: {"ros": found}
            for place, found in ros_nodes(deployment).items()
            if own in found.peers(deployment.map)
        }

    # --- files -------------------------------------------------------------------------------

    def files(self, deployment: Deployment) -> dict[str, str]:
        """Return the definitions of messages and services."""
        from fsmkit.carriers.ros.definition_files import compose_ros

        return compose_ros(deployment)

    def node_files(self, node: Node) -> dict[str, str]:
        """Return the tables of ``fsm_link_dds.h`` and ``fsm_link_ros.h``."""
        from fsmkit.carriers.ros.dds_tables import compose_dds

        return compose_dds(node)

    def rejection(self, deployment: Deployment, target: str) -> FsmkitError | None:
        """Return why C cannot offer services and lifecycles of nodes, which need rclpy."""
        from fsmkit.carriers.ros.network import ros_nodes

        for place, ros in ros_nodes(deployment).items():
            if target == "c" and ros.needs_rclpy:
                return fail(
                    "unfit-message",
                    f"`{deployment.nodes[place]}` has services or a life, which a node in C does "
                    "not offer",
                    help="run the node in Python (`fsmkit.Node`), or send events in place of them",
                )
        return None

    def packed(
        self,
        deployment: Deployment,
        machines: Mapping[str, Mapping[str, str]],
        nodes: Sequence[Node],
    ) -> dict[str, str]:
        """Return a package of ROS, whose programs are by rclc."""
        from fsmkit.carriers.ros.package import ros_package

        return ros_package(deployment, machines, nodes)


@contextmanager
def findings(domain: int) -> Iterator[None]:
    """Convert errors of DDS to findings."""
    try:
        from cyclonedds.core import DDSException
    except ImportError as error:
        raise fail(
            "missing-package",
            f"topics of ROS need cyclonedds: {error}",
            help="pip install 'fsmkit[ros]'",
        ) from error
    try:
        yield
    except DDSException as error:
        raise fail(
            "link-not-opened",
            f"the domain {domain} of DDS cannot be joined: {error.msg}",
            help="see CYCLONEDDS_URI, which names the networks and their interfaces",
        ) from error


PLUGIN = Ros()
