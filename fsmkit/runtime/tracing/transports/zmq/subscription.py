"""Messages of a ZeroMQ publisher: the topic ``trace``, then a part with frames.

A slow subscriber loses messages; the sequence of the frames shows how many.
"""

from __future__ import annotations

from fsmkit.diagnostics import fail
from fsmkit.runtime.tracing.transports import ended, wrong_endpoint

TOPIC = b"trace"
PARTS = 2
MOST = 1_000
"""Maximum number of messages per read."""


class ZmqSource:
    """A subscription."""

    def __init__(self, address: str) -> None:
        """Subscribe; raises `FsmkitError` without pyzmq, or for an invalid address."""
        try:
            import zmq
        except ImportError as error:
            raise fail(
                "missing-package", "`zmq:` needs the package pyzmq, which is not installed",
                help="pip install 'fsmkit[links]'",
            ) from error  # fmt: skip
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.SUB)
        self._again, self._error, self._flag = zmq.Again, zmq.ZMQError, zmq.NOBLOCK
        self._socket.setsockopt(zmq.LINGER, 0)
        self._socket.setsockopt(zmq.SUBSCRIBE, TOPIC)
        try:
            self._socket.connect(address)
        except zmq.ZMQError as error:
            self.close()
            raise wrong_endpoint(f"`{address}`: {error}", "use zmq:tcp://HOST:PORT") from error

    def read(self) -> bytes | None:
        """Return the bytes that have arrived."""
        found = bytearray()
        for _ in range(MOST):
            try:
                parts = self._socket.recv_multipart(self._flag)
            except self._again:
                break
            except self._error as error:
                raise ended(f"the subscription broke: {error}") from error
            if len(parts) == PARTS and parts[0] == TOPIC:
                found += parts[1]
        return bytes(found)

    def close(self) -> None:
        """Close it."""
        self._socket.close()
        self._context.term()
