"""Diagnostics as a SARIF 2.1.0 log, which editors and code hosts show beside the source."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path, PurePath
from urllib.parse import quote

from fsmkit.diagnostics.diagnostic import Diagnostic, Label
from fsmkit.diagnostics.fixes import Edit, Fix
from fsmkit.diagnostics.rules import Rule, Severity
from fsmkit.diagnostics.source import Span

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "note"}


def sarif_log(diagnostics: Iterable[Diagnostic], version: str) -> dict[str, object]:
    """Return the log of one run of fsmkit `version` (SARIF 2.1.0, section 3.13)."""
    found = tuple(diagnostics)
    used = tuple(sorted({d.rule for d in found}, key=lambda rule: rule.code))
    driver = {
        "name": "fsmkit",
        "semanticVersion": version,
        "rules": [_rule(rule) for rule in used],
    }
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(d, used.index(d.rule)) for d in found],
    }
    return {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}


def _rule(rule: Rule) -> dict[str, object]:
    """Return a rule (SARIF 3.49), described by the section under its first heading."""
    what = rule.explanation.split("## ")[1].partition("\n")[2].strip()
    return {
        "id": rule.code,
        "name": rule.name,
        "shortDescription": {"text": rule.name.replace("-", " ")},
        "fullDescription": {"text": what},
        "help": {"text": rule.explanation, "markdown": rule.explanation},
        "defaultConfiguration": {"level": LEVELS[rule.severity]},
    }


def _result(diagnostic: Diagnostic, index: int) -> dict[str, object]:
    text = diagnostic.message
    if diagnostic.help is not None:
        text += f"\nhelp: {diagnostic.help}"
    result: dict[str, object] = {
        "ruleId": diagnostic.rule.code,
        "ruleIndex": index,
        "level": LEVELS[diagnostic.severity],
        "message": {"text": text},
    }
    if diagnostic.primary is not None:
        result["locations"] = [_location(diagnostic.primary)]
    if diagnostic.secondary:
        result["relatedLocations"] = [_location(label) for label in diagnostic.secondary]
    if diagnostic.fixes:
        result["fixes"] = [_fix(fix) for fix in diagnostic.fixes]
    return result


def _fix(fix: Fix) -> dict[str, object]:
    """Return a fix (SARIF 3.55): replacements, by file."""
    by_file: dict[str, list[Edit]] = {}
    for edit in fix.edits:
        by_file.setdefault(edit.span.source.name, []).append(edit)
    changes = [
        {
            "artifactLocation": {"uri": _uri(name)},
            "replacements": [
                {"deletedRegion": _region(edit.span), "insertedContent": {"text": edit.text}}
                for edit in edits
            ],
        }
        for name, edits in by_file.items()
    ]
    return {"description": {"text": fix.title}, "artifactChanges": changes}


def _location(label: Label) -> dict[str, object]:
    location: dict[str, object] = {"physicalLocation": _place(label.span)}
    if label.text:
        location["message"] = {"text": label.text}
    return location


def _place(span: Span) -> dict[str, object]:
    return {"artifactLocation": {"uri": _uri(span.source.name)}, "region": _region(span)}


def _region(span: Span) -> dict[str, object]:
    line, column = span.source.position(span.start)
    end_line, end_column = span.source.position(max(span.start, span.end))
    return {
        "startLine": line,
        "startColumn": column,
        "endLine": end_line,
        "endColumn": end_column,
    }


def _uri(name: str) -> str:
    """Return a URI. A relative name gives a relative URI, so that a log can move with its files."""
    if PurePath(name).is_absolute():
        return Path(name).as_uri()
    return quote(PurePath(name).as_posix())
