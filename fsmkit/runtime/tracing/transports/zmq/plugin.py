"""The carrier ``zmq:ADDRESS``: the topic ``trace`` of a publisher, for instance of a node."""

from __future__ import annotations

from fsmkit.runtime.tracing.transports import Source


class ZmqCarrier:
    """Subscribes: each message is the topic, then records."""

    name = "zmq"
    form = "zmq:tcp://HOST:PORT"
    framed = True

    def open_source(self, address: str) -> Source:
        """Subscribe."""
        from fsmkit.runtime.tracing.transports.zmq.subscription import ZmqSource

        return ZmqSource(address)


PLUGIN = ZmqCarrier()
