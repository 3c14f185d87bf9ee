"""``deadlock_free``: no state is reached in which nothing can happen and some machine must."""

from __future__ import annotations

from fsmkit.system.properties.property import Builtin, Kind

KIND = Kind("deadlock_free", Builtin.DEADLOCK, form=())
