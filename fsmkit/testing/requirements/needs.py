"""Requirements in `needs.json`, which sphinx-needs exports and imports."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from fsmkit.diagnostics import Findings, FsmkitError, Source, Span
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.testing.requirements.requirement import MOST, Requirement, broken, one_line, start_of

TEXTS = ("content", "description", "title")
"""Fields with the text; the first one that is not empty counts."""
LONGEST = 1 << 18
"""Characters of a need, as far as its location is searched."""
ADVICE = "build it with the builder `needs` of Sphinx"


def read(source: Source) -> tuple[Requirement, ...]:
    """Return the needs of the current version; raises `FsmkitError` (``broken-requirements``)."""
    findings = Findings()
    try:
        root = parse_json(source.text)
    except ValueError as error:
        start = error.pos if isinstance(error, json.JSONDecodeError) else 0
        place = Span(source, min(start, len(source.text)), min(start + 1, len(source.text)))
        reason = error.msg if isinstance(error, json.JSONDecodeError) else str(error)
        broken(findings, f"this is not JSON: {reason}", place, ADVICE)
        raise FsmkitError(findings) from error
    needs = _needs(root, source, findings)
    found = []
    at = start_of(source)
    for key, need in needs.items():
        at = _place(source, key, at)
        if not isinstance(need, dict):
            broken(findings, f"the need `{key}` is not an object", at, ADVICE)
            continue
        id_ = need.get("id", key)
        if not isinstance(id_, str) or not id_.strip():
            broken(findings, f"the id of the need `{key}` is not a string", at, ADVICE)
            continue
        texts = [one_line(need[n]) for n in TEXTS if isinstance(need.get(n), str)]
        more = [
            (name, one_line(str(value)))
            for name, value in need.items()
            if isinstance(value, str | int) and name not in ("id", *TEXTS) and str(value)
        ]
        found.append(Requirement(id_.strip(), next(filter(None, texts), ""), at, tuple(more)))
    if findings.has_errors:
        raise FsmkitError(findings)
    return tuple(found)


def _needs(root: Any, source: Source, findings: Findings) -> Mapping[str, Any]:
    """Return the needs of the current version by their keys, or the reason in a finding."""
    versions = root.get("versions") if isinstance(root, dict) else None
    if not isinstance(versions, dict) or not versions:
        broken(findings, "there is no object `versions`", start_of(source), ADVICE)
        return {}
    current = root.get("current_version")
    if len(versions) == 1 and current not in versions:
        current = next(iter(versions))
    version = versions.get(current) if isinstance(current, str) else None
    if not isinstance(version, dict):
        message = f"there is no version `{current}`, which `current_version` names"
        broken(findings, message, start_of(source), ADVICE)
        return {}
    needs = version.get("needs")
    if not isinstance(needs, dict):
        broken(findings, f"version `{current}` has no needs", start_of(source), ADVICE)
        return {}
    if len(needs) > MOST:
        broken(findings, f"it has more than {MOST:,} needs", start_of(source), "export fewer")
        return {}
    return needs


def _place(source: Source, key: str, after: Span) -> Span:
    """Return the location of a key behind that of the one before; that one if it is not found."""
    for written in (json.dumps(key), json.dumps(key, ensure_ascii=False)):
        at = source.text.find(written, after.end, after.end + LONGEST)
        if at >= 0:
            return Span(source, at, at + len(written))
    return after
