"""``deadlock_free``: no reachable state blocks the system while some machine must still move."""

from __future__ import annotations

from fsmkit.system.properties.property import Builtin, Kind

KIND = Kind("deadlock_free", Builtin.DEADLOCK, form=())
