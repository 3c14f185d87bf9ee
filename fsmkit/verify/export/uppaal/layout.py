"""Positions."""

from __future__ import annotations

from fsmkit.verify.export.uppaal.network import Network


def laid_out(network: Network) -> Network:
    """Return a network with positions."""
    return network
