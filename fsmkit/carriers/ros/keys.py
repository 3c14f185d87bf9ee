"""The keys of deployments with ROS 2: of the links of nodes, and of foreign nodes."""

from __future__ import annotations

from fsmkit.document.keys import LINKS, Form, Key, named, table

BINDING = {
    **named(
        topic="its name; one without `/` at the left is within the namespace",
        type="the type of its messages, such as std_msgs/msg/UInt8",
    ),
    "fields": Key("fields", "for each value the field of the message that holds it", Form.TABLE),
    **named(qos="default, state or sensor"),
}
"""An entry of `bind`."""
LIFECYCLE = named(
    configure="when the node is configured",
    activate="when it becomes active",
    deactivate="when it is deactivated",
    cleanup="when it is cleaned up",
    shutdown="when it ends",
)
"""The transitions of `lifecycle`."""
LINK_KEYS = {
    **named(
        domain="the number of the domain (default: 0)",
        namespace="the prefix of its topics (default: the system)",
    ),
    "insecure": LINKS["insecure"],
}
FOREIGN_KEYS = table(
    Key("domain", "the number of the domain (default: 0)"),
    Key("namespace", "the prefix of its topics (default: the name of the node)"),
    Key(
        "insecure",
        "true: also with programs beyond this computer, without authentication",
        Form.FLAG,
    ),
    Key("bind", "connections whose topics have other names or types", Form.RECORDS, rows=BINDING),
    Key("way", "dds (default) or rclpy, which adds services and the lifecycle"),
    Key(
        "lifecycle",
        "the connection whose event each transition of the node's lifecycle posts",
        Form.RECORD,
        rows=LIFECYCLE,
    ),
)
