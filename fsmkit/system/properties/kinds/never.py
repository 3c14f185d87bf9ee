"""``never: P``: P holds in no state that can be reached."""

from __future__ import annotations

from fsmkit.system.properties.property import AtStates, Kind

KIND = Kind("never", AtStates(), is_local=True)
