"""Definitions of the messages between a deployment and its foreign nodes of ROS."""

from __future__ import annotations

from fsmkit.carriers.ros.definitions import idl_file, idl_of, msg_of, srv_of, with_nested
from fsmkit.carriers.ros.messages import STANDARD, STRING
from fsmkit.carriers.ros.network import ros_nodes
from fsmkit.codegen.c.header import NOTICE
from fsmkit.emit import printing
from fsmkit.system.deployment.deployment import Deployment


@printing
def compose_ros(deployment: Deployment) -> dict[str, str]:
    """Return ``msg`` and ``srv`` that no package of ROS has, and ``idl`` of all messages."""
    services = {
        f"srv/{each.type}.srv": srv_of(each.request, each.response, NOTICE)
        for node in ros_nodes(deployment).values()
        for each in node.services
        if each.response is not None
    }
    types = [type_ for node in ros_nodes(deployment).values() for type_ in node.types]
    if not types:
        return services
    own = [type_ for type_ in types if str(type_) not in STANDARD]
    files = services | {f"msg/{type_.name}.msg": msg_of(type_, NOTICE) for type_ in own}
    every = with_nested([*types, STRING])
    return files | {f"idl/{idl_file(type_)}": idl_of(type_, NOTICE) for type_ in every}
