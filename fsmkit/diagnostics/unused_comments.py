"""Comments that allow a rule but suppress nothing."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from fsmkit.diagnostics.allow_comments import AllowComment, allow_comments
from fsmkit.diagnostics.diagnostic import Findings
from fsmkit.diagnostics.rules import Rule, Severity, rules
from fsmkit.diagnostics.source import Source
from fsmkit.diagnostics.suggestions import suggest

READING = ("FK01", "FK02", "FK03")
"""Prefixes of the codes of rules that reading can report."""
EXPLORING = (*READING, "FK05")
"""Prefixes of the codes of rules that an exploration can report."""


def report_unused_comments(
    sources: Iterable[Source],
    used: Collection[AllowComment],
    codes: tuple[str, ...],
    findings: Findings,
) -> None:
    """Report comments that allow an unknown rule, an error, or a rule without a finding.

    Args:
        sources: The sources that were read.
        used: The comments that suppressed a finding, as `record_used` collects them.
        codes: Prefixes of the codes of rules that could have been reported.
        findings: Where they are reported.

    """
    known = {key: rule for rule in rules() for key in (rule.name, rule.code)}
    for source in dict.fromkeys(sources):
        for allow in allow_comments(source):
            message = None if allow in used else _describe_problem(allow, known, codes)
            if message is not None:
                help_ = suggest(allow.name, known) if allow.name not in known else "remove it"
                findings.add("unused-allow", message, allow.span, help=help_)


def _describe_problem(
    allow: AllowComment, known: Mapping[str, Rule], codes: tuple[str, ...]
) -> str | None:
    rule = known.get(allow.name)
    if rule is None:
        return f"rule `{allow.name}` does not exist"
    if rule.severity is Severity.ERROR:
        return f"`{rule.name}` is an error, and comments allow only warnings and notes"
    if allow.lines[1] < 0:
        return (
            "this comment covers nothing; write `allow-file` before the first key, "
            "`allow` above an entry or after it"
        )
    if not rule.code.startswith(codes):
        return None
    return f"this comment suppresses no finding of `{rule.name}`"
