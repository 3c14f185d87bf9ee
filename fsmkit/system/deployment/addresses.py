"""Forms of the endpoints at which nodes publish, and answer how they are, over ZeroMQ."""

from __future__ import annotations

import re
from dataclasses import dataclass

SCHEMES = ("tcp", "ipc", "inproc")
MOST_IPC = 107
"""Bytes of the path of a local socket (``sun_path`` of Linux, without its zero)."""
MOST = 255
"""Bytes of an endpoint."""
MOST_PORT = 65_535

_TCP = re.compile(r"(?:[^;]*;)?(?P<host>\[[0-9A-Fa-f:.]+(?:%\w+)?\]|[^:\[\]/]+)(?::(?P<port>.*))?")


@dataclass(frozen=True, slots=True)
class Rejection:
    """Why other nodes cannot reach an endpoint, and how to correct it."""

    why: str
    fix: str


def rejection_of(endpoint: str) -> Rejection | None:
    """Return why no node can connect to an endpoint, by its text; None if it has a valid form."""
    if not endpoint or any(not each.isprintable() or each.isspace() for each in endpoint):
        return Rejection("has blanks or no characters", "write such as `tcp://127.0.0.1:5571`")
    if len(endpoint.encode(errors="replace")) > MOST:
        return Rejection(f"has more than {MOST} bytes", "write a shorter endpoint")
    scheme, separator, rest = endpoint.partition("://")
    if not separator:
        kind = "ipc" if endpoint.startswith(("/", "./", "@")) else "tcp"
        known = re.match(r"(tcp|ipc|inproc):/?", endpoint, re.IGNORECASE)
        kind = known[1].lower() if known is not None else kind
        bare = endpoint if known is None else endpoint[known.end() :]
        return Rejection("has no scheme", f"write `{kind}://{bare}`")
    if scheme not in SCHEMES:
        other = scheme.lower() if scheme.lower() in SCHEMES else "tcp"
        return Rejection(
            f"has the scheme `{scheme}`, which links do not use", f"write `{other}://{rest}`"
        )
    if not rest:
        return Rejection("has no address", f"write the address after `{scheme}://`")
    if scheme == "tcp":
        return _tcp_rejection(rest)
    if scheme == "ipc" and len(rest.encode(errors="replace")) > MOST_IPC:
        return Rejection(f"has a path of more than {MOST_IPC} bytes", "choose a shorter path")
    return None


def _tcp_rejection(rest: str) -> Rejection | None:
    found = _TCP.fullmatch(rest)
    if found is None:
        return Rejection(
            "has no form `tcp://HOST:PORT`",
            "write such as `tcp://192.168.1.10:5571`, and IPv6 as `tcp://[::1]:5571`",
        )
    host, port = found["host"], found["port"]
    if host == "*":
        fix = "write the address by which other nodes reach it; bind to all by the option `bind`"
        return Rejection("is no address to which other nodes can connect", fix)
    if not port:
        return Rejection("has no port", f"write such as `tcp://{host}:5571`")
    is_number = port.isascii() and port.isdecimal() and len(port) <= len(str(MOST_PORT))
    if not is_number or not 1 <= int(port) <= MOST_PORT:
        return Rejection(f"has no port from 1 to {MOST_PORT}", f"write such as `tcp://{host}:5571`")
    return None


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
