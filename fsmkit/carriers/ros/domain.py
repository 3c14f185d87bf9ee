"""Domains of DDS that the carriers of a program share: their reach, and their configuration.

DDS without DDS Security does not authenticate publishers. A domain is therefore confined to the
loopback interface of this computer, whatever ``CYCLONEDDS_URI`` contains, unless it is insecure:
then ``CYCLONEDDS_URI`` alone configures it. It is the same as in ``fsm_dds_domain.c``.
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
"""The configuration that confines a domain to this computer."""


class _Domains:
    """The open domains of this program, with the number of participants of each."""

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
                    help="write `insecure: true` everywhere or nowhere, or use two domains",
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
    """Return the configuration of Cyclone DDS."""
    if is_insecure:
        return os.environ.get("CYCLONEDDS_URI", "")
    return f'<CycloneDDS><Domain Id="any">{LOOPBACK}</Domain></CycloneDDS>'


class Participant:
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
        """Leave the domain, after the participant's entities are dropped."""
        if self.participant is not None:
            self.participant = None
            _DOMAINS.leave(self.number)


_DOMAINS = _Domains()


def matched_ends(ends: Callable[[], list[int]]) -> list[int]:
    """Return the matched remote ends of a reader or writer.

    Cyclone's binding counts them and then lists them, and fails if one was added in between; the
    list is then requested again.
    """
    while True:
        try:
            return ends()
        except IndexError:
            continue
