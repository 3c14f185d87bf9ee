"""The keys of deployments whose nodes are linked over ZeroMQ."""

from __future__ import annotations

from fsmkit.document.keys import ADDRESS_KEYS, LINKS

LINK_KEYS = {key: LINKS[key] for key in ADDRESS_KEYS}
