"""Links between the machines of different nodes: what crosses them, in which bytes, and how.

A `Link` is opened by a plug-in (`zeromq`, `in_process`) for a node of an `EventMap`, which comes
from a deployment (`fsmkit.composition.deployment`) or from the ``links.json`` that ``compile``
writes. The bytes are those of ``runtime/c/links``; docs/reference/links.md describes them.
"""

from fsmkit.runtime.channels.event_map import EventMap, LevelType, Message, MessageType
from fsmkit.runtime.channels.faults import Faults
from fsmkit.runtime.channels.link import Link, LinkKind, LinkTimeout
from fsmkit.runtime.channels.receiving import Counters

__all__ = [
    "Counters",
    "EventMap",
    "Faults",
    "LevelType",
    "Link",
    "LinkKind",
    "LinkTimeout",
    "Message",
    "MessageType",
]
