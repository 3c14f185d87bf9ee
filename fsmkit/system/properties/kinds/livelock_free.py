"""``livelock_free``: machines never take infinitely many steps without time passing."""

from __future__ import annotations

from fsmkit.system.properties.property import Builtin, Kind

KIND = Kind("livelock_free", Builtin.LIVELOCK, form=())
