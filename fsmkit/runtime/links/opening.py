"""Open a link with a transport for fsmkit peers and a translator for each third-party peer.

All frames of a node share one sequence of numbers, and every fsmkit peer receives all of them, so
that none counts a gap. A translator picks the parts that concern its node, and builds frames from
what that node sends. It does not know connections between other nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fsmkit.diagnostics import fail
from fsmkit.plugins import plugin
from fsmkit.runtime.links.faults import Faults
from fsmkit.runtime.links.link import SLOTS, Link, LinkKind, LinkRequest, Translator, TranslatorKind
from fsmkit.system.deployment.carrier import DEFAULT
from fsmkit.system.deployment.event_map import EventMap


class ForeignOnly(Link):
    """The link of a node that has no peer of fsmkit: only translators take its frames."""

    def wait_listeners(self, timeout: float) -> None:
        """Return immediately: a bus has no known listeners."""

    def _wake(self) -> None:
        while self.next_frame() is not None:
            pass

    def _take_in(self, node: int, timeout: float) -> bool:  # noqa: ARG002  (no node sends frames)
        return False


def open_link(
    event_map: EventMap,
    node: str,
    *,
    session: int,
    kind: str = DEFAULT,
    faults: Faults | None = None,
    options: Mapping[str, Any] | None = None,
    foreign: Mapping[str, Mapping[str, Any]] | None = None,
) -> Link:
    """Return the link of a node, with a translator for each connected third-party node.

    Args:
        event_map: The events and levels that cross the nodes of the deployment.
        node: The node whose link is opened.
        session: See `Link`.
        kind: The transport between the fsmkit nodes.
        faults: Seeded faults of arriving frames, including those of translators.
        options: Options of the kind.
        foreign: Options of the translators, by third-party node.

    Raises:
        FsmkitError: ``link-not-opened`` for the link or one of its translators; ``wrong-option``
            for an option that the kind does not have; ``unknown-plugin`` if no plug-in has this
            kind of transport or translator.

    """
    own = event_map.node(node)
    link: Link
    if event_map.own_nodes == (own,):
        link = ForeignOnly(event_map, node, session, faults, SLOTS, is_proven=False)
    else:
        carrier = plugin(LinkKind, kind)
        _require_options(carrier, options or {})
        link = carrier.open(LinkRequest(event_map, node, session, faults, options or {}))
    try:
        translators: list[Translator] = []
        for place in foreign_peers(event_map, own):
            found = plugin(TranslatorKind, event_map.foreign[place])
            given = (foreign or {}).get(event_map.nodes[place], {})
            translators.append(found.translator(link, place, given))
            link.translators = tuple(translators)
    except BaseException:
        link.close()
        raise
    return link


def _require_options(carrier: LinkKind, options: Mapping[str, Any]) -> None:
    for name in sorted(set(options).difference(carrier.options)):
        known = ", ".join(f"`{option}`" for option in carrier.options)
        raise fail(
            "wrong-option",
            f"links of the kind `{carrier.name}` have no option `{name}`",
            help=f"use {known}",
        )


def foreign_peers(event_map: EventMap, node: int) -> tuple[int, ...]:
    """Return the third-party nodes that exchange messages or levels with `node`, in order."""
    ends = {(message.sender, message.receiver) for message in event_map.messages}
    ends |= {(level.sender, level.receiver) for level in event_map.levels}
    return tuple(
        place
        for place, kind in enumerate(event_map.foreign)
        if kind and ((node, place) in ends or (place, node) in ends)
    )
