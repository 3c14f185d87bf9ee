"""Endpoints as ZeroMQ writes them: whether what is said there can leave this computer."""

from __future__ import annotations

import re

_OCTET = r"(25[0-5]|2[0-4]\d|1?\d?\d)"
_LOOPBACK = re.compile(
    rf"(ipc|inproc)://.+|tcp://(127\.{_OCTET}\.{_OCTET}\.{_OCTET}|localhost|\[::1\]):[\d*]+",
    re.ASCII | re.DOTALL,
)


def is_loopback(endpoint: str) -> bool:
    """Whether an endpoint is of this computer only, by its text; ``fsm_link_zmq_is_loopback`` in C.

    ``ipc`` and ``inproc`` are; of ``tcp`` an address of 127.0.0.0/8 in four numbers (RFC 1122,
    3.2.1.3), ``localhost`` (RFC 6761, 6.3) and ``[::1]``. A wildcard, an interface, another name or
    an address with a source is taken for one that is not.
    """
    return _LOOPBACK.fullmatch(endpoint) is not None
