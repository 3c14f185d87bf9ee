"""The carrier ``zmq:ADDRESS``: the topic ``trace`` of a publisher, for instance of a node."""

from fsmkit.runtime.tracing.transports import Transport

PLUGIN = Transport("zmq", "zmq:tcp://HOST:PORT", True, f"{__package__}.subscription", "ZmqSource")
