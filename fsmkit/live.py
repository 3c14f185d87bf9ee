"""Sessions of a program, seen while they run: ``fsmkit.live.show(session)``."""

from fsmkit.inspector.showing import Shown, show

__all__ = ["Shown", "show"]
