"""Translators for foreign nodes of the kind ``ros``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fsmkit.diagnostics import fail
from fsmkit.runtime.links.link import Link, Translator

if TYPE_CHECKING:
    from fsmkit.system.deployment import Deployment


class RosTopics:
    """Opens topics by Cyclone DDS."""

    name = "ros"

    def translator(self, link: Link, node: int, options: Mapping[str, Any]) -> Translator:
        """Return what joins a link with topics; ``options``: those of `ros_options`."""
        try:
            from cyclonedds.core import DDSException

            from fsmkit.runtime.ros.translator import RosTranslator
        except ImportError as error:
            raise fail(
                "missing-package",
                f"topics of ROS need cyclonedds: {error}",
                help="pip install 'fsmkit[ros]'",
            ) from error
        try:
            return RosTranslator(link, node, options["ros"])
        except DDSException as error:
            raise fail(
                "link-not-opened",
                f"the domain {options['ros'].domain} of DDS cannot be joined: {error.msg}",
                help="see CYCLONEDDS_URI, which names the networks and their interfaces",
            ) from error


def ros_options(deployment: Deployment, node: str) -> dict[str, dict[str, Any]]:
    """Return ``foreign`` of `fsmkit.runtime.fan.open_link`, for the topics of a node."""
    own = deployment.nodes.index(node)
    return {
        deployment.nodes[place]: {"ros": found}
        for place, found in deployment.ros.items()
        if any(own in (wire.sender, wire.receiver) for wire in found.wires)
    }


PLUGIN = RosTopics()
