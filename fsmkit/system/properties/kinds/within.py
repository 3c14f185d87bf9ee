"""``within: [P, T, Q]``: from where P begins to hold it takes at most T until Q holds."""

from __future__ import annotations

from fsmkit.system.properties.property import Kind, OverGraph, Part

KIND = Kind(
    "within",
    OverGraph("within", is_timed=True),
    form=(Part.CONDITION, Part.DURATION, Part.CONDITION),
    example="within: [plant.In(hot), 500ms, plant.In(cold)]",
    is_local=True,
)
