"""Lowering: from a Chart to a Plan, in which no tree is searched any more."""

from fsmkit.plan.features import Features
from fsmkit.plan.lower import lower
from fsmkit.plan.plan import (
    Branch,
    Content,
    Enter,
    Move,
    Op,
    Plan,
    Region,
    Restore,
    Variant,
    Within,
)

__all__ = [
    "Branch",
    "Content",
    "Enter",
    "Features",
    "Move",
    "Op",
    "Plan",
    "Region",
    "Restore",
    "Variant",
    "Within",
    "lower",
]
