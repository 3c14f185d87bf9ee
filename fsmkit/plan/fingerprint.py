"""The hash of a chart: the same for charts that mean the same, in every process and runtime."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from enum import Enum
from hashlib import sha256

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Source, Span

MEMO = "_fingerprint"
"""Where a chart keeps its hash, like a cached property."""


def fingerprint(chart: Chart) -> str:
    """Return a hash of what a chart means; places and comments do not count."""
    if MEMO not in chart.__dict__:
        chart.__dict__[MEMO] = sha256(_canonical(chart).encode()).hexdigest()
    return str(chart.__dict__[MEMO])


def _canonical(node: object) -> str:
    """Spell a value without places and in the same way in every process."""
    match node:
        case Enum():
            return f"{type(node).__name__}.{node.name}"
        case Span() | Source():
            return ""
        case tuple():
            return f"({','.join(map(_canonical, node))})"
        case frozenset():
            return f"{{{','.join(sorted(map(_canonical, node)))}}}"
        case _ if is_dataclass(node):
            parts = (
                f"{part.name}={_canonical(getattr(node, part.name))}"
                for part in fields(node)
                if part.compare and part.name not in ("doc", "origin")
            )
            return f"{type(node).__name__}({','.join(parts)})"
        case _:
            return repr(node)
