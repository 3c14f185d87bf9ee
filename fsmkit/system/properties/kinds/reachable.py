"""``reachable: P``: P holds in some reachable state; the report shows a path to it."""

from __future__ import annotations

from fsmkit.system.properties.property import AtStates, Kind

KIND = Kind("reachable", AtStates(existential=True), refuted="cannot be reached")
