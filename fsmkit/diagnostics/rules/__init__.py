"""The rules: one Markdown file each, found in this folder.

The first line of a file is ``# CODE kebab-name severity``. The sections *What it does*, *Why it
matters*, *Example* and *Instead* follow. ``fsmkit explain CODE`` and the reference page print them.
The prefix of a code is its stage: FK01 reading, FK02 names and structure, FK03 types and behaviour,
FK04 limits of a target, FK05 verification.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from pathlib import Path


class Severity(Enum):
    """The severity of a finding; only errors stop the pipeline."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class Rule:
    """A kind of finding: a stable code, a readable name, a severity, and the explanation."""

    code: str
    name: str
    severity: Severity
    explanation: str = field(repr=False, compare=False)


@cache
def rules() -> tuple[Rule, ...]:
    """Return every rule, in order of its code."""
    files = Path(__file__).parent.glob("*.md")
    return tuple(sorted((_read(path) for path in files), key=lambda rule: rule.code))


@cache
def rule(name: str) -> Rule:
    """Return the rule with this kebab-case name or code; raise `LookupError` if it is unknown."""
    for candidate in rules():
        if name in (candidate.name, candidate.code):
            return candidate
    raise LookupError(name)


def _read(path: Path) -> Rule:
    heading, _, explanation = path.read_text(encoding="utf-8").partition("\n")
    code, name, severity = heading.removeprefix("# ").split()
    return Rule(code, name, Severity(severity), explanation.strip())
