"""The records of a session: what the interpreter does for a Python program, as C records it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fsmkit.runtime.interpreter import Macrostep, Occurrence, Snapshot
from fsmkit.runtime.session import Session
from fsmkit.runtime.tracing.writing import Writer


class Recorder:
    """Gives a carrier the bytes of what a session does, from now on.

    A session that runs already is recorded whole, as a machine that was restored. An event that an
    operation posts is recorded within the step, before the result of that operation.

    Args:
        session: The session.
        put: Takes bytes: the ``write`` of a file, the ``extend`` of a ``bytearray``.
        level: 1: transitions; 2: what came in, too.
        saves: At level 2 saved machines follow whole states.

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
            self._told(self._writer.whole(session.snapshot, session.now))

    def close(self) -> None:
        """Record nothing more."""
        if self in self._session.recorders:
            self._session.recorders.remove(self)

    # --- told by the session ----------------------------------------------------------------------

    def started(self, before: Snapshot, step: Macrostep) -> None:
        """Take a start; ``before``: the machine that was there till then."""
        self._told(self._writer.started(before, before.inputs, step))

    def posted(self, occurrence: Occurrence) -> None:
        """Take an event that was posted, whether it found room or not."""
        self._told(self._writer.posted(occurrence))

    def ran(
        self,
        before: Snapshot,
        now: int,
        steps: Sequence[Macrostep],
        dispatched: Occurrence | None = None,
    ) -> None:
        """Take a call that ran the machine, or dispatched an event to it."""
        self._told(self._writer.ran(before, now, steps, dispatched))

    def restored(self, snapshot: Snapshot, now: int) -> None:
        """Take a machine that was restored."""
        self._told(self._writer.restored(snapshot, now))

    def _told(self, data: bytes) -> None:
        if data:
            self._put(data)
