"""Links by topics, and translators for foreign nodes, of the kind ``ros``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from fsmkit.diagnostics import fail
from fsmkit.runtime.links.faults import Faults
from fsmkit.runtime.links.link import Link, Translator
from fsmkit.system.deployment.event_map import EventMap


class RosTopics:
    """Opens topics by Cyclone DDS: of a foreign node, or between nodes of fsmkit.

    Options of a link: ``domain``, ``namespace``, ``slots``.
    """

    name = "ros"

    def open(
        self,
        event_map: EventMap,
        node: str,
        *,
        session: int,
        faults: Faults | None = None,
        options: Mapping[str, Any],
    ) -> Link:
        """Return a link of a node; `FsmkitError` where it cannot be opened."""
        with findings(int(options.get("domain", 0))):
            from fsmkit.runtime.ros.link import RosLink

            return RosLink(event_map, node, session=session, faults=faults, **options)

    def translator(self, link: Link, node: int, options: Mapping[str, Any]) -> Translator:
        """Return what joins a link with topics; ``options``: those of `foreign_options`."""
        with findings(options["ros"].domain):
            if options["ros"].needs_rclpy:
                from fsmkit.runtime.ros.rclpy_translator import RclpyTranslator

                return RclpyTranslator(link, node, options["ros"])
            from fsmkit.runtime.ros.translator import RosTranslator

            return RosTranslator(link, node, options["ros"])

    def link_options(self, deployment: Any) -> dict[str, Any]:
        """Return domain and namespace of a deployment whose nodes exchange frames by topics."""
        topics = deployment.topics
        if topics is None:
            return {}
        return {"domain": topics.domain, "namespace": topics.namespace}

    def foreign_options(self, deployment: Any, node: str) -> dict[str, dict[str, Any]]:
        """Return, by foreign node, the topics that a node exchanges with it."""
        own = deployment.nodes.index(node)
        return {
            deployment.nodes[place]: {"ros": found}
            for place, found in deployment.ros.items()
            if own in found.peers(deployment.map)
        }


@contextmanager
def findings(domain: int) -> Iterator[None]:
    """Turn what goes wrong into findings."""
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


PLUGIN = RosTopics()
