"""Findings as an editor shows them: the very ones of the command line."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from lsprotocol import types

import fsmkit
from fsmkit.diagnostics import Diagnostic, Rule, Severity
from fsmkit.editor.context import Context
from fsmkit.editor.index.files import normal

SOURCE = "fsmkit"
SEVERITIES = {
    Severity.ERROR: types.DiagnosticSeverity.Error,
    Severity.WARNING: types.DiagnosticSeverity.Warning,
    Severity.NOTE: types.DiagnosticSeverity.Information,
}
UNNECESSARY = frozenset(
    ("unread-data", "unused-event", "unreachable-state", "dead-transition", "unused-wire")
)
"""Rules about unnecessary code, which editors fade."""


def diagnostics_of(
    context: Context, findings: Iterable[Diagnostic], about: Path
) -> dict[Path, list[types.Diagnostic]]:
    """Return findings by the file that each is in; others are at the head of ``about``."""
    found: dict[Path, list[types.Diagnostic]] = {}
    for finding in findings:
        path = about
        if finding.primary is not None:
            path = Path(normal(Path(finding.primary.span.source.name)))
        found.setdefault(path, []).append(diagnostic_of(context, finding))
    return found


def diagnostic_of(context: Context, finding: Diagnostic) -> types.Diagnostic:
    """Return one finding."""
    start = types.Range(types.Position(0, 0), types.Position(0, 0))
    rule = finding.rule
    return types.Diagnostic(
        range=start if finding.primary is None else context.range(finding.primary.span),
        message=message_of(finding),
        severity=SEVERITIES[finding.severity],
        code=rule.code,
        code_description=types.CodeDescription(explanation(rule).as_uri()),
        source=SOURCE,
        tags=[types.DiagnosticTag.Unnecessary] if rule.name in UNNECESSARY else None,
        related_information=[
            types.DiagnosticRelatedInformation(
                context.location(label.span), label.text or "see here"
            )
            for label in finding.secondary
        ]
        or None,
        data={"rule": rule.name},
    )


def message_of(finding: Diagnostic) -> str:
    """Return the message of a finding with its help."""
    return finding.message if finding.help is None else f"{finding.message}\nhelp: {finding.help}"


def explanation(rule: Rule) -> Path:
    """Return the page of a rule, which is installed with fsmkit."""
    return Path(fsmkit.__file__).parent / "diagnostics/rules" / f"{rule.name}.md"
