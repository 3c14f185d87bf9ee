"""``reachable: P``: P holds in some state that can be reached; the way there is shown."""

from __future__ import annotations

from fsmkit.system.properties.property import AtStates, Kind

KIND = Kind("reachable", AtStates(wanted=True), refuted="cannot be reached")
