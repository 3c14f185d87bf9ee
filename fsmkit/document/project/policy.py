"""The levels of rules that a project sets, as a policy."""

from __future__ import annotations

from fsmkit.diagnostics import Policy
from fsmkit.document.project.project import Project


def with_levels(policy: Policy, project: Project | None) -> Policy:
    """Return a policy with a project's levels for the rules that it does not name itself.

    Args:
        policy: The levels that take precedence, such as the options of a command line.
        project: The project of the file that is read; None without one.

    """
    if project is None or not project.rules:
        return policy
    given = policy.errors | policy.allowed | policy.warnings | policy.notes

    def rules_at(level: str) -> frozenset[str]:
        return frozenset(name for name, one in project.rules.items() if one == level) - given

    return Policy(
        policy.errors | rules_at("error"),
        policy.allowed | rules_at("off"),
        policy.warnings | rules_at("warning"),
        policy.notes | rules_at("note"),
    )
