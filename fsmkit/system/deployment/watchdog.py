"""When a node whose loop hangs falls silent."""

WATCHDOG = 100
"""Milliseconds without a completed cycle after which a node that hangs falls silent."""
LOOKS = 4
"""Looks in each bound, at least."""
