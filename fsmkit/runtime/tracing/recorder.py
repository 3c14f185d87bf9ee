"""Record a session of the interpreter in the format of generated C."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fsmkit.runtime.interpreter import Macrostep, Occurrence, Snapshot
from fsmkit.runtime.session import Session
from fsmkit.runtime.tracing.writing import Writer


class Recorder:
    """Writes the trace of a session from now on.

    For a running session, the trace starts with its snapshot, as after a restoration. An event
    that an operation posts is recorded within the step, before the result of that operation.

    Args:
        session: The session.
        put: Function that writes bytes: the ``write`` of a file, the ``extend`` of a ``bytearray``.
        level: 1: transitions; 2: also events, inputs and results.
        saves: At level 2, add a snapshot after each sync.

    """

    def __init__(
        self,
        session: Session,
        put: Callable[[bytes], object],
        level: int = 2,
        *,
        saves: bool = True,
    ) -> None:
        self._writer = Writer(session.chart, level, saves=saves)
        self._put = put
        self._session = session
        session.recorders.append(self)
        if session.snapshot.running:
            self._put_bytes(self._writer.whole(session.snapshot, session.now))

    def close(self) -> None:
        """Stop recording."""
        if self in self._session.recorders:
            self._session.recorders.remove(self)

    # --- called by the session ----------------------------------------------------------------

    def started(self, before: Snapshot, step: Macrostep) -> None:
        """Record a start; ``before``: the previous machine."""
        self._put_bytes(self._writer.started(before, before.inputs, step))

    def posted(self, occurrence: Occurrence) -> None:
        """Record a posted event, whether or not the queue had room."""
        self._put_bytes(self._writer.posted(occurrence))

    def ran(
        self,
        before: Snapshot,
        now: int,
        steps: Sequence[Macrostep],
        dispatched: Occurrence | None = None,
    ) -> None:
        """Record a call that ran the machine or dispatched an event."""
        self._put_bytes(self._writer.ran(before, now, steps, dispatched))

    def restored(self, snapshot: Snapshot, now: int) -> None:
        """Record a restoration."""
        self._put_bytes(self._writer.restored(snapshot, now))

    def _put_bytes(self, data: bytes) -> None:
        if data:
            self._put(data)
