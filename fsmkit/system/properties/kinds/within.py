"""``within: [P, T, Q]``: once P holds, Q holds after at most T."""

from __future__ import annotations

from fsmkit.system.properties.property import Kind, OverGraph, Part

KIND = Kind(
    "within",
    OverGraph("within", is_timed=True),
    form=(Part.CONDITION, Part.DURATION, Part.CONDITION),
    example="within: [plant.In(hot), 500ms, plant.In(cold)]",
    is_local=True,
)
