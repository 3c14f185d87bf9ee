"""The result of an import: a document, and a record of changed, opaque and omitted parts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol, runtime_checkable

from fsmkit.diagnostics import Diagnostic, Findings, Severity, Source, Span, Text
from fsmkit.diagnostics.as_json import location
from fsmkit.document.document import Document, Trigger
from fsmkit.document.walk import states


class Role(Enum):
    """The role of opaque content."""

    ACTION = "action"
    GUARD = "guard"
    DELAY = "delay"


@dataclass(frozen=True, slots=True)
class OpaqueContent:
    """Content that is an operation of the host: its name in the chart, and the foreign text."""

    name: str
    text: Text
    role: Role


@dataclass(frozen=True, slots=True)
class Rewriting:
    """A state or transition that a rewriting changed; ``ids`` are the new states, events, data."""

    rule: str
    at: Span
    ids: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Remark:
    """A part that is lost or differs, and its location."""

    message: str
    at: Span


@dataclass(frozen=True, slots=True)
class Counts:
    """The size of a machine."""

    states: int
    transitions: int
    events: int


def counts(document: Document) -> Counts:
    """Return the size of a document; initial transitions do not count."""
    found = tuple(states(*document.root.children))
    kept = [t for state in found for t in state.transitions if t.trigger is not Trigger.INITIAL]
    return Counts(len(found), len(kept), len({event.name.value for event in document.events}))


@dataclass(frozen=True, slots=True)
class Import:
    """A machine of another tool, read into a document.

    ``read`` is the size before any rewriting. Rejected parts are errors among the findings of the
    reader, and are missing from the document.
    """

    machine: str
    document: Document
    read: Counts
    rewritten: tuple[Rewriting, ...] = ()
    opaque: tuple[OpaqueContent, ...] = ()
    lost: tuple[Remark, ...] = ()
    differs: tuple[Remark, ...] = ()

    @property
    def kept(self) -> Counts:
        """Return the numbers of states, transitions and events that no rewriting changed."""
        changed = {(one.at.start, one.at.end) for one in self.rewritten}
        found = tuple(states(*self.document.root.children))
        spans = {(t.span.start, t.span.end) for state in found for t in state.transitions}
        own = {(state.span.start, state.span.end) for state in found}
        return Counts(
            max(0, self.read.states - len(changed & own)),
            max(0, self.read.transitions - len(changed & (spans - own))),
            self.read.events,
        )


@runtime_checkable
class Importer(Protocol):
    """A reader that records how it imports a machine."""

    name: str

    def decode(self, content: bytes, name: str, findings: Findings) -> Source | None:
        """Return the text of a file."""
        ...

    def import_selected(self, source: Source, findings: Findings) -> Import | None:
        """Return the only machine of a source, or the one that ``--machine`` names."""
        ...


@dataclass
class Recorder:
    """Collects what a reader changes, omits or cannot keep."""

    rewritten: list[Rewriting] = field(default_factory=list)
    lost: list[Remark] = field(default_factory=list)
    differs: list[Remark] = field(default_factory=list)

    def rewrite(self, rule: str, at: Span | Text, *ids: str) -> None:
        """Record a rewriting, and the new names."""
        self.rewritten.append(Rewriting(rule, _span(at), ids))

    def lose(self, message: str, at: Span | Text) -> None:
        """Record what the chart does not have: layout, notes, colours."""
        self.lost.append(Remark(message, _span(at)))

    def differ(self, message: str, at: Span | Text, findings: Findings) -> None:
        """Record a difference that no rewriting removes; it is a warning, too."""
        self.differs.append(Remark(message, _span(at)))
        findings.add("import-differs", message, at, help="check that the difference does no harm")

    def imported(
        self, machine: str, document: Document, read: Counts, opaque: Iterable[OpaqueContent] = ()
    ) -> Import:
        """Return the import with everything that was recorded."""
        return Import(
            machine, document, read, tuple(self.rewritten), tuple(opaque), tuple(self.lost),
            tuple(self.differs),
        )  # fmt: skip


def reject(findings: Findings, message: str, at: Span | Text, fix: str) -> None:
    """Report a construct that no chart can express; the reader omits it from the document."""
    findings.add("foreign-construct", message, at, help=fix)


def _span(at: Span | Text) -> Span:
    return at.span if isinstance(at, Text) else at


# --- the report -----------------------------------------------------------------------------------


def report_data(found: Import, findings: Iterable[Diagnostic]) -> dict[str, object]:
    """Return the report of an import as plain data."""
    return {
        "machine": found.machine,
        "read": _counts_data(found.read),
        "kept": _counts_data(found.kept),
        "rewritten": [
            {"rule": one.rule, "at": location(one.at), "ids": list(one.ids)}
            for one in found.rewritten
        ],
        "opaque": [
            {
                "name": one.name,
                "role": one.role.value,
                "text": one.text.value,
                "at": location(one.text.span),
            }
            for one in found.opaque
        ],
        "rejected": [
            {
                "code": one.rule.code,
                "message": one.message,
                **({} if one.primary is None else {"at": location(one.primary.span)}),
            }
            for one in findings
            if one.severity is Severity.ERROR
        ],
        "lost": [{"message": one.message, "at": location(one.at)} for one in found.lost],
        "differs": [{"message": one.message, "at": location(one.at)} for one in found.differs],
    }


def _counts_data(found: Counts) -> dict[str, int]:
    return {"states": found.states, "transitions": found.transitions, "events": found.events}


def report_lines(found: Import, findings: Iterable[Diagnostic]) -> tuple[str, ...]:
    """Return the report of an import, a line for each item."""
    read, kept = found.read, found.kept
    lines = [
        f"machine    {found.machine}: {_size(read)}",
        f"kept       {_size(kept)}",
    ]
    for rewriting in found.rewritten:
        new = f": {', '.join(rewriting.ids)}" if rewriting.ids else ""
        lines.append(f"rewritten  {rewriting.rule} {_place(rewriting.at)}{new}")
    for one in found.opaque:
        shown = " ".join(one.text.value.split())
        lines.append(f"opaque     {one.name} = {shown[:80]} ({one.role.value})")
    for diagnostic in findings:
        if diagnostic.severity is Severity.ERROR:
            at = "" if diagnostic.primary is None else f" {_place(diagnostic.primary.span)}"
            lines.append(f"rejected   {diagnostic.rule.code}{at}: {diagnostic.message}")
    for kind, remarks in (("lost", found.lost), ("differs", found.differs)):
        lines += [f"{kind:10} {_place(one.at)}: {one.message}" for one in remarks]
    return tuple(lines)


def _size(found: Counts) -> str:
    return f"{found.states} states, {found.transitions} transitions, {found.events} events"


def _place(at: Span) -> str:
    line, column = at.source.position(at.start)
    return f"{line}:{column}"
