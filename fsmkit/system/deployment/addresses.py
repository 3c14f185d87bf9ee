"""Validate the endpoints at which nodes publish and report their health, and their protection."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from fsmkit.diagnostics import Findings, Text
from fsmkit.yaml.nodes import Node, check_keys, require_mapping, require_text

SCHEMES = ("tcp", "ipc", "inproc")
MOST_IPC = 107
"""Bytes of the path of a local socket (``sun_path`` of Linux, without its zero)."""
MOST = 255
"""Bytes of an endpoint."""
MOST_PORT = 65_535

_TCP = re.compile(r"(?:[^;]*;)?(?P<host>\[[0-9A-Fa-f:.]+(?:%\w+)?\]|[^:\[\]/]+)(?::(?P<port>.*))?")


@dataclass(frozen=True, slots=True)
class Rejection:
    """The reason why other nodes cannot reach an endpoint, and the correction."""

    why: str
    fix: str


def rejection_of(endpoint: str) -> Rejection | None:
    """Return the reason why no node can connect to an endpoint; None if it is valid."""
    if not endpoint or any(not each.isprintable() or each.isspace() for each in endpoint):
        return Rejection("is empty or contains blanks", "write it as in `tcp://127.0.0.1:5571`")
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
            "does not have the form `tcp://HOST:PORT`",
            "write it as in `tcp://192.168.1.10:5571`, and IPv6 as in `tcp://[::1]:5571`",
        )
    host, port = found["host"], found["port"]
    if host == "*":
        fix = "write the address by which other nodes reach it; bind to all by the option `bind`"
        return Rejection("is not an address to which other nodes can connect", fix)
    if not port:
        return Rejection("has no port", f"write it as in `tcp://{host}:5571`")
    is_number = port.isascii() and port.isdecimal() and len(port) <= len(str(MOST_PORT))
    if not is_number or not 1 <= int(port) <= MOST_PORT:
        return Rejection(
            f"has no port from 1 to {MOST_PORT}", f"write it as in `tcp://{host}:5571`"
        )
    return None


_OCTET = r"(25[0-5]|2[0-4]\d|1?\d?\d)"
_LOOPBACK = re.compile(
    rf"(ipc|inproc)://.+|tcp://(127\.{_OCTET}\.{_OCTET}\.{_OCTET}|localhost|\[::1\]):[\d*]+",
    re.ASCII | re.DOTALL,
)


def is_loopback(endpoint: str) -> bool:
    """Whether an endpoint is local to this computer, by its text. The C library has the same rule.

    ``ipc`` and ``inproc`` are. For ``tcp``, an address of 127.0.0.0/8 in four numbers (RFC 1122,
    3.2.1.3), ``localhost`` (RFC 6761, 6.3) and ``[::1]`` are. A wildcard, an interface, another
    name and an address with a source count as remote.
    """
    return _LOOPBACK.fullmatch(endpoint) is not None


def read_insecure(text: Text | None, findings: Findings) -> bool:
    """Return whether remote endpoints may be used without keys."""
    if text is not None and text.value not in ("true", "false"):
        findings.add("unexpected-value", "`insecure` is `true` or `false`", text)
    return text is not None and text.value == "true"


def endpoints_of(
    node: Node | None,
    nodes: tuple[str, ...],
    own: tuple[str, ...],
    findings: Findings,
    *,
    is_guarded: bool,
) -> tuple[str, ...]:
    """Return the endpoint of each node, "" for a foreign one.

    Without ``is_guarded``, remote endpoints are reported.
    """
    found = _addresses(node, "endpoints", own, findings, None if is_guarded else KEYLESS)
    if node is None:
        return ()
    missing = [name for name in own if name not in found]
    if missing and not findings.has_errors:
        findings.add(
            "broken-deployment",
            f"{', '.join(f'`{name}`' for name in missing)} has no endpoint",
            node.span,
            help="write for instance `b: tcp://127.0.0.1:5572`",
        )
    return tuple(found.get(name, "") for name in nodes)


def health_of(
    node: Node | None,
    nodes: tuple[str, ...],
    own: tuple[str, ...],
    findings: Findings,
    *,
    is_guarded: bool,
) -> tuple[str, ...]:
    """Return the health endpoint of each node, "" for nodes without one."""
    found = _addresses(node, "health", own, findings, None if is_guarded else LOCAL)
    return tuple(found.get(name, "") for name in nodes) if found else ()


KEYLESS = (
    "the links have no keys",
    "name a folder of keys with `curve: keys`, or write `insecure: true`",
)
LOCAL = (
    "health endpoints have no keys",
    "name an address of 127.0.0.1, to be reached by a tunnel, or write `insecure: true` in `links`",
)


def _addresses(
    node: Node | None,
    key: str,
    nodes: Sequence[str],
    findings: Findings,
    beyond: tuple[str, str] | None,
) -> dict[str, str]:
    """Return endpoints by node; ``beyond``: why a remote one is not allowed, and the fix."""
    mapping = require_mapping(node, f"`{key}`", findings)
    if mapping is None:
        return {}
    check_keys(mapping, nodes, f"`{key}`", findings)
    found = {}
    places: dict[str, Text] = {}
    for name, value in mapping.entries:
        text = require_text(value, f"the endpoint of `{name}`", findings)
        if text is not None:
            found[name.value] = text.value
            if (rejection := rejection_of(text.value)) is not None:
                findings.add(
                    "broken-deployment",
                    f"the endpoint `{text}` {rejection.why}",
                    text,
                    help=rejection.fix,
                )
                continue
            if (other := places.setdefault(text.value, text)) is not text:
                findings.add(
                    "broken-deployment",
                    f"`{text}` is the endpoint of two nodes",
                    text,
                    secondary=[(other, "the other one")],
                    help="give each node an endpoint of its own",
                )
            if beyond is not None and not is_loopback(text.value):
                why, way_out = beyond
                findings.add(
                    "unguarded-endpoint",
                    f"`{text}` is not of this computer only, and {why}",
                    text,
                    help=way_out,
                )
    return found
