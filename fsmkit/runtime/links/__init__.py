"""Exchange events and levels between the machines of different nodes.

A plug-in (a `LinkKind`) opens a `Link` for a node of an `EventMap`. The map comes from a
deployment (`fsmkit.system.deployment`), or from the ``links.json`` that ``compile`` writes. The
bytes equal those of ``runtime/c/links``; docs/reference/links.md describes them.
"""

from fsmkit.runtime.links.faults import Faults
from fsmkit.runtime.links.link import (
    Link,
    LinkKind,
    LinkRequest,
    LinkTimeout,
    Translator,
    TranslatorKind,
)
from fsmkit.runtime.links.receiving import Counters
from fsmkit.system.deployment.event_map import EventMap, LevelType, Message, MessageType

__all__ = [
    "Counters",
    "EventMap",
    "Faults",
    "LevelType",
    "Link",
    "LinkKind",
    "LinkRequest",
    "LinkTimeout",
    "Message",
    "MessageType",
    "Translator",
    "TranslatorKind",
]
