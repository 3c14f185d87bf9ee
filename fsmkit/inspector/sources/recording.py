"""Something recorded, as all readers of files return it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from fsmkit.inspector.simulation import Moment
from fsmkit.inspector.sources import Entry
from fsmkit.runtime.live.messages import Json
from fsmkit.system.system import System


@dataclass(frozen=True, slots=True)
class Recording:
    """A `Recorded` source."""

    system: System
    begin: Moment | None
    entries: Sequence[Entry]
    at_end: bool = False
    why: list[Json] = field(default_factory=list)
    time: str = "recorded"
