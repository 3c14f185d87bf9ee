"""The tables of ``fsm_link_rclc.h``: the topics between a node and foreign ones, by rclc.

Structs of messages are those that ``rosidl_generator_c`` generates from ``msg``.
"""

from __future__ import annotations

import re

from fsmkit.carriers.ros.dds_tables import QOS, Tables, wires_with
from fsmkit.carriers.ros.messages import RosType
from fsmkit.carriers.ros.network import ros_nodes
from fsmkit.carriers.ros.topics import RosTopic
from fsmkit.codegen.c.header import NOTICE
from fsmkit.codegen.system.node import Node
from fsmkit.emit import Emitter, printing
from fsmkit.emit.c import comment


def tables_of(node: Node) -> dict[int, str]:
    """Return the names of the tables by foreign node."""
    return {
        peer: f"{node.prefix}_rclc_{node.words[peer].lower()}"
        for peer, ros in ros_nodes(node.deployment).items()
        if wires_with(node, ros)
    }


@printing
def compose_rclc(node: Node) -> dict[str, str]:
    """Return header and source of the tables."""
    file = f"{node.prefix}_rclc"
    guard = f"{file.upper()}_H"
    tables = tables_of(node)
    head, out = Emitter(), Emitter()
    head.line(f"/* {file}.h: topics of the node {comment(node.name)}. {NOTICE} */")
    head.lines([f"#ifndef {guard}", f"#define {guard}", "", '#include "fsm_link_rclc.h"', ""])
    out.line(f"/* {file}.c: see {file}.h. {NOTICE} */")
    out.lines([f'#include "{file}.h"', ""])
    wires = {peer: wires_with(node, ros_nodes(node.deployment)[peer]) for peer in tables}
    types = dict.fromkeys(wire.topic.type for own in wires.values() for wire in own)
    for type_ in types:
        out.line(f"#include <{header_of(type_)}>")
    out.lines(["#include <string.h>", ""])
    for type_ in types:
        with out.function(f"static const rosidl_message_type_support_t *{_support(type_)}(void)"):
            support = f"ROSIDL_GET_MSG_TYPE_SUPPORT({type_.package}, msg, {type_.name})"
            out.line(f"return {support};")
    for peer, name in tables.items():
        head.line(f"extern const fsm_link_rclc_node {name}; /* {comment(node.map.nodes[peer])} */")
        _Tables(out, node, peer, wires[peer], name).print()
    head.lines(["", "#endif"])
    return {f"{file}.h": head.finish(), f"{file}.c": out.finish()}


class _Tables(Tables):
    KIND = "fsm_link_rclc"
    RESULT = "rcl_ret_t"
    WRITER = "const rcl_publisher_t *writer"
    WRITE = "rcl_publish(writer, &m, NULL)"

    def print(self) -> None:
        out, name = self.out, self.name
        self.require("TOPICS", len(self.topics))
        for place, topic in enumerate(self.topics.values()):
            if topic.name not in self.sent:
                out.line(f"static {self.struct(topic.type)} {name}_message_{place};")
        out.line()
        self.print_wires()
        levels, start_values = self.print_start()
        with out.block(f"const fsm_link_rclc_node {name} = {{", "};"):
            out.line(f"{self.peer}u, {levels}u, {start_values},")
            out.line(f"{len(self.topics)}u, {len(self.wires)}u, {name}_topics, {name}_wires")
        out.line()

    def struct(self, type_: RosType) -> str:
        return f"{type_.package}__msg__{type_.name}"

    def topic_row(self, topic: RosTopic) -> str:
        place = list(self.topics).index(topic.name)
        is_sent = topic.name in self.sent
        message = "NULL" if is_sent else f"&{self.name}_message_{place}"
        flags = topic.is_event, is_sent, topic.type.is_counted
        said = ", ".join(str(flag).lower() for flag in flags)
        return f'{{"{topic.name}", {_support(topic.type)}, {message}, {QOS[topic.qos]}, {said}}},'


def _support(type_: RosType) -> str:
    return f"support_of_{type_.package}__{type_.name}"


def header_of(type_: RosType) -> str:
    """Return the header of a message, which ``rosidl_cmake`` names after it."""
    name = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", type_.name)
    name = re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name).lower()
    return f"{type_.package}/msg/{name}.h"
