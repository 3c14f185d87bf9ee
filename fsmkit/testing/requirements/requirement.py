"""A requirement, and the sets of them that files hold."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from fsmkit.diagnostics import Findings, FsmkitError, Source, Span
from fsmkit.emit import guard

MOST = 100_000
"""Requirements in one file."""


@dataclass(frozen=True, slots=True)
class Requirement:
    """A requirement: its id, its text, and other columns of its file by name."""

    id: str
    text: str
    span: Span = field(compare=False, repr=False)
    columns: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        guard(self, "id", "text", "columns")


def one_line(text: str) -> str:
    """Return a text on one line, with single blanks."""
    return " ".join(text.split())


def broken(findings: Findings, message: str, at: Span | None, advice: str) -> None:
    """Report a file of requirements that cannot be read."""
    findings.add("broken-requirements", message, at, help=advice)


def as_broken(found: Findings, kind: str) -> FsmkitError:
    """Return errors of a general reader, such as that of XML, as those of requirements."""
    findings = Findings()
    for one in found:
        at = None if one.primary is None else one.primary.span
        advice = f"export the {kind} again, without this"
        broken(findings, f"the {kind} cannot be read: {one.message}", at, advice)
    return FsmkitError(findings)


def start_of(source: Source) -> Span:
    """Return the location of a whole file: its first character."""
    return Span(source, 0, min(1, len(source.text)))


def merge(
    files: Iterable[tuple[Requirement, ...]], findings: Findings
) -> Mapping[str, Requirement]:
    """Return the requirements of all files by id; an id with two texts is a finding."""
    found: dict[str, Requirement] = {}
    for one in (one for file in files for one in file):
        known = found.setdefault(one.id, one)
        if known.text != one.text:
            findings.add(
                "duplicate-requirement",
                f"the requirement `{one.id}` has two texts; the first counts",
                one.span,
                secondary=[(known.span, "the first")],
                help="remove one of them, or name only the file with the newest text",
            )
        elif known is not one and known.span.source.name == one.span.source.name:
            findings.add(
                "duplicate-requirement",
                f"the requirement `{one.id}` is listed twice",
                one.span,
                secondary=[(known.span, "the first")],
                help="remove one of them",
            )
    return found
