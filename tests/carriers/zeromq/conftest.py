"""Fixtures of links for the tests of ZeroMQ."""

from tests.runtime.links.conftest import (
    build,
    connect,
    deployment,
    endpoints,
    generated,
    play,
    ring,
)

__all__ = ["build", "connect", "deployment", "endpoints", "generated", "play", "ring"]
