"""Domains of DDS as the carriers of a program share them: who can reach them, how they run.

DDS without DDS Security proves of nobody who publishes. A domain is therefore confined to the
loopback interface of this computer, whatever ``CYCLONEDDS_URI`` says, unless it is insecure: then
``CYCLONEDDS_URI`` alone configures it. It is that of ``fsm_dds_domain.c``.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from typing import Any

from cyclonedds.domain import Domain, DomainParticipant

from fsmkit.diagnostics import fail

LOOPBACK = (
    '<General><Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>"
    '<Peers><Peer Address="127.0.0.1"/></Peers><LeaseDuration>2s</LeaseDuration>'
    "<SPDPInterval>500ms</SPDPInterval></Discovery>"
)
"""Of a domain: what confines it to this computer."""


class _Domains:
    """The domains that this program has opened, with how many participants each has."""

    def __init__(self) -> None:
        self.turn = threading.Lock()
        self.opened: dict[int, tuple[Any, bool, int]] = {}

    def join(self, number: int, *, is_insecure: bool) -> None:
        with self.turn:
            domain, known, uses = self.opened.get(number, (None, is_insecure, 0))
            if known != is_insecure:
                raise fail(
                    "link-not-opened",
                    f"the domain {number} is open already, "
                    f"{'beyond' if known else 'confined to'} this computer",
                    help="write `insecure: true` everywhere or nowhere, or take two domains",
                )
            if uses == 0:
                domain = Domain(number, configuration(is_insecure=is_insecure))
            self.opened[number] = domain, known, uses + 1

    def leave(self, number: int) -> None:
        with self.turn:
            domain, known, uses = self.opened.pop(number)
            if uses > 1:
                self.opened[number] = domain, known, uses - 1


def configuration(*, is_insecure: bool) -> str:
    """Return how Cyclone DDS is to be configured."""
    if is_insecure:
        return os.environ.get("CYCLONEDDS_URI", "")
    return f'<CycloneDDS><Domain Id="any">{LOOPBACK}</Domain></CycloneDDS>'


class Joined:
    """A participant of a domain, until it leaves."""

    def __init__(self, number: int, *, is_insecure: bool) -> None:
        self.number = number
        _DOMAINS.join(number, is_insecure=is_insecure)
        try:
            self.participant: Any = DomainParticipant(number)
        except BaseException:
            _DOMAINS.leave(number)
            raise

    def leave(self) -> None:
        """Leave the domain, once what belongs to the participant is dropped."""
        if self.participant is not None:
            self.participant = None
            _DOMAINS.leave(self.number)


_DOMAINS = _Domains()


def matched(ends: Callable[[], list[int]]) -> list[int]:
    """Return the other ends that a reader or writer has now.

    Cyclone's binding counts them and then lists them, and fails where one came in between; the
    list is then made again.
    """
    while True:
        try:
            return ends()
        except IndexError:
            continue
