"""The levels of rules that a project sets, as a policy."""

from __future__ import annotations

from fsmkit.diagnostics import Policy
from fsmkit.document.project.project import Project


def with_levels(policy: Policy, project: Project | None) -> Policy:
    """Return a policy with the levels of a project for the rules that it does not name itself.

    Args:
        policy: What counts in any case, such as the options of a command line.
        project: The project of the file that is read; None without one.

    """
    if project is None or not project.rules:
        return policy
    given = policy.errors | policy.allowed | policy.warnings | policy.notes

    def made(level: str) -> frozenset[str]:
        return frozenset(name for name, one in project.rules.items() if one == level) - given

    return Policy(
        policy.errors | made("error"),
        policy.allowed | made("off"),
        policy.warnings | made("warning"),
        policy.notes | made("note"),
    )
