"""``leads_to: [P, Q]``: whenever P holds, Q holds then or later, in every fair run."""

from __future__ import annotations

from fsmkit.system.properties.property import Kind, OverGraph, Part

KIND = Kind(
    "leads_to",
    OverGraph(
        "leads-to",
        is_fair=True,
        violation="on this path, and as it goes on, the second never follows the first",
    ),
    form=(Part.CONDITION, Part.CONDITION),
    example="leads_to: [plant.In(inserted), plant.In(out)]",
)
