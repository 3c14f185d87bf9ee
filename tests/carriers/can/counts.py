"""The counts that players of a bus print, in their order."""

COUNTS = [
    "frames",
    "lost_frames",
    "lost_events",
    "missed",
    "late",
    "doubled",
    "overflow",
    "restarts",
]
"""Of a peer."""
TOTALS = ["sent", "refused", "malformed", "foreign", "bus_errors", "bus_off"]
