"""Comments that allow a rule and hide nothing."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from fsmkit.diagnostics.allowing import Allow, allows
from fsmkit.diagnostics.diagnostic import Findings
from fsmkit.diagnostics.rules import Rule, Severity, rules
from fsmkit.diagnostics.source import Source
from fsmkit.diagnostics.suggest import suggest

READING = ("FK01", "FK02", "FK03")
"""What the codes of rules begin with that reading breaks."""
EXPLORING = (*READING, "FK05")
"""The same for an exploration."""


def tell_unused(
    sources: Iterable[Source],
    used: Collection[Allow],
    codes: tuple[str, ...],
    findings: Findings,
) -> None:
    """Report the comments that allow what is never found, no rule at all, or an error.

    Args:
        sources: The texts that were read.
        used: The comments that have hidden something, as `counting` collects them.
        codes: What the codes of rules begin with that could have been found.
        findings: Where they are reported.

    """
    known = {key: rule for rule in rules() for key in (rule.name, rule.code)}
    for source in dict.fromkeys(sources):
        for allow in allows(source):
            message = None if allow in used else _wrong(allow, known, codes)
            if message is not None:
                help_ = suggest(allow.name, known) if allow.name not in known else "remove it"
                findings.add("unused-allow", message, allow.span, help=help_)


def _wrong(allow: Allow, known: Mapping[str, Rule], codes: tuple[str, ...]) -> str | None:
    rule = known.get(allow.name)
    if rule is None:
        return f"there is no rule `{allow.name}`"
    if rule.severity is Severity.ERROR:
        return f"`{rule.name}` is an error, which no comment allows"
    if allow.lines[1] < 0:
        return "`allow-file` stands before the first key, `allow` above an entry or behind it"
    if not rule.code.startswith(codes):
        return None
    return f"this hides no finding of `{rule.name}`"
