"""``never: P``: P holds in no reachable state."""

from __future__ import annotations

from fsmkit.system.properties.property import AtStates, Kind

KIND = Kind("never", AtStates(), is_local=True)
