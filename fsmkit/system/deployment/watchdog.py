"""Read the watchdog of nodes: a node whose loop hangs stops sending."""

from __future__ import annotations

from fsmkit.diagnostics import Findings
from fsmkit.language import Scope, read_duration
from fsmkit.yaml.nodes import Node, require_text

WATCHDOG = 100
"""Milliseconds without a completed cycle after which a node that hangs falls silent."""
LOOKS = 4
"""Looks in each bound, at least."""
LEAST_WATCHDOG, MOST_WATCHDOG = 4, 60_000
"""Milliseconds."""


def watchdog_of(node: Node | None, period: int | None, findings: Findings) -> int:
    """Return the milliseconds after its last cycle in which a hanging node stops sending.

    ``period``: of the loops in microseconds. A watchdog accepts cycles up to half its time apart.
    """
    text = require_text(node, "`watchdog`", findings)
    if text is None:
        return max(WATCHDOG, -(-LOOKS * (period or 0) // 1000))
    found = read_duration(text, Scope(tick=1), findings)
    if found is None:
        return WATCHDOG
    if found % 1000 or not LEAST_WATCHDOG <= found // 1000 <= MOST_WATCHDOG:
        findings.add(
            "unexpected-value",
            f"`watchdog` is {LEAST_WATCHDOG}ms to {MOST_WATCHDOG // 1000}s in milliseconds",
            text,
            help=f"write for instance `watchdog: {WATCHDOG}ms`",
        )
        return WATCHDOG
    if period is not None and found < 2 * period:
        findings.add(
            "unexpected-value",
            f"`watchdog` is shorter than two cycles of {period} us, so a node that works would "
            "fall silent",
            text,
            help=f"write `watchdog: {-(-LOOKS * period // 1000)}ms`, or more",
        )
    return found // 1000
