"""The plug-in; it needs pyzmq only when a link is opened."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fsmkit.carriers.zeromq.keys import LINK_KEYS
from fsmkit.diagnostics import fail
from fsmkit.document.keys import Keys

if TYPE_CHECKING:
    from fsmkit.diagnostics import Findings
    from fsmkit.runtime.links.link import Link, LinkRequest
    from fsmkit.system.deployment.carrier import DeploymentRequest


class ZeroMq:
    """Opens links over ZeroMQ.

    Options: ``endpoints`` by node (else those of the event map), ``bind``, ``is_deterministic``,
    ``keys`` (a folder of CURVE keys), ``slots``, ``priority`` and ``cpus`` of its threads.
    """

    name = "zeromq"
    link_keys: Keys = LINK_KEYS
    required_keys: Mapping[str, str] = MappingProxyType({})
    options: tuple[str, ...] = (
        "endpoints",
        "bind",
        "is_deterministic",
        "keys",
        "slots",
        "priority",
        "cpus",
    )
    library = Path(__file__).parent / "c"

    def read(self, request: DeploymentRequest, findings: Findings) -> None:
        """Return None: links need endpoints only."""

    def open(self, request: LinkRequest) -> Link:
        """Return a link of a node. Raises `FsmkitError` if it cannot be opened."""
        try:
            from fsmkit.carriers.zeromq.link import ZeroMqLink
        except ImportError as error:
            raise fail(
                "link-not-opened",
                "links over ZeroMQ need the package `pyzmq`",
                help="install it: pip install 'fsmkit[links]'",
            ) from error
        return ZeroMqLink(
            request.event_map,
            request.node,
            session=request.session,
            faults=request.faults,
            **request.options,
        )

    def link_options(self, deployment: Any) -> dict[str, Any]:
        """Return the folder of the keys, if the deployment names one."""
        return {} if deployment.keys is None else {"keys": deployment.keys}


PLUGIN = ZeroMq()
