"""Lowering: from a Chart to a Plan, on which no consumer searches the tree of states."""

from fsmkit.plan.features import Features
from fsmkit.plan.lower import lower
from fsmkit.plan.operations import (
    Branch,
    Content,
    Enter,
    Op,
    Reaction,
    Restore,
    Variant,
    Within,
)
from fsmkit.plan.plan import Plan
from fsmkit.plan.regions import Region

__all__ = [
    "Branch",
    "Content",
    "Enter",
    "Features",
    "Op",
    "Plan",
    "Reaction",
    "Region",
    "Restore",
    "Variant",
    "Within",
    "lower",
]
