"""Diagnostics as plain data, for ``--json`` and for programs."""

from __future__ import annotations

from fsmkit.diagnostics.diagnostic import Diagnostic, Label
from fsmkit.diagnostics.source import Span


def as_json(diagnostic: Diagnostic) -> dict[str, object]:
    """Return a finding as data; absent parts are omitted."""
    found: dict[str, object] = {
        "code": diagnostic.rule.code,
        "rule": diagnostic.rule.name,
        "severity": diagnostic.severity.value,
        "message": diagnostic.message,
    }
    if diagnostic.primary is not None:
        found["at"] = _label_as_json(diagnostic.primary)
    if diagnostic.secondary:
        found["see"] = [_label_as_json(label) for label in diagnostic.secondary]
    if diagnostic.help is not None:
        found["help"] = diagnostic.help
    return found


def _label_as_json(label: Label) -> dict[str, object]:
    told = {"label": label.text} if label.text else {}
    return {**location(label.span), **told}


def location(span: Span) -> dict[str, object]:
    """Return a location as data. Lines and columns count from one; the end is exclusive."""
    line, column = span.source.position(span.start)
    end_line, end_column = span.source.position(max(span.start, span.end))
    return {
        "file": span.source.name,
        "line": line,
        "column": column,
        "end_line": end_line,
        "end_column": end_column,
    }
