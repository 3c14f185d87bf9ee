"""The matrix: for each requirement its items, properties, tests and certificates."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TypeVar

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.emit import guard
from fsmkit.testing.requirements.certificates import Certificate
from fsmkit.testing.requirements.items import Item, StatedProperty
from fsmkit.testing.requirements.requirement import Requirement


@dataclass(frozen=True, slots=True)
class CaseResult:
    """A case of a test file. ``passed``: on the interpreter."""

    file: str
    name: str
    span: Span = field(compare=False, repr=False)
    req: tuple[Text, ...]
    passed: bool

    def __post_init__(self) -> None:
        guard(self, "file", "name")


class Status(Enum):
    """The conclusion from the evidence of a requirement."""

    VERIFIED = "verified"
    FAILED = "failed"
    UNDECIDED = "undecided"
    """A property without a verdict, or with the verdict `undecided`, and none failed."""
    OPEN = "open"
    """Neither a property nor a test."""


@dataclass(frozen=True, slots=True)
class Row:
    """A requirement and the parts that name it."""

    requirement: Requirement
    items: tuple[Item, ...] = ()
    properties: tuple[StatedProperty, ...] = ()
    tests: tuple[CaseResult, ...] = ()
    certificates: tuple[Certificate, ...] = ()

    @property
    def status(self) -> Status:
        """The worst result of its properties and tests."""
        verdicts = {one.verdict for one in self.properties}
        if "violated" in verdicts or not all(one.passed for one in self.tests):
            return Status.FAILED
        if not self.properties and not self.tests:
            return Status.OPEN
        return Status.VERIFIED if verdicts <= {"holds"} else Status.UNDECIDED

    @property
    def coverage(self) -> tuple[int, int] | None:
        """Covered states and transitions among its items, of so many; None if not counted."""
        counted = [one.covered for one in self.items if one.covered is not None]
        return (sum(counted), len(counted)) if counted else None


@dataclass(frozen=True, slots=True)
class Matrix:
    """The rows, and the items and properties that belong to none."""

    rows: tuple[Row, ...]
    unknown: tuple[Text, ...]
    """Ids of items that are not among the requirements."""
    unrequired: tuple[StatedProperty, ...]
    """Properties that name no requirement."""


def matrix_of(
    requirements: Mapping[str, Requirement],
    items: Sequence[Item],
    properties: Sequence[StatedProperty],
    tests: Sequence[CaseResult],
    certificates: Sequence[Certificate],
    known: Collection[str] = (),
) -> Matrix:
    """Return the matrix, its rows in the order of the requirements.

    ``known``: the ids of requirements that have no row but are valid.
    """
    rows = []
    by_item, by_property, by_test = _by_id(items), _by_id(properties), _by_id(tests)
    for id_, requirement in requirements.items():
        own = tuple(by_item.get(id_, ()))
        charts = {item.chart for item in own}
        rows.append(
            Row(
                requirement,
                own,
                tuple(by_property.get(id_, ())),
                tuple(by_test.get(id_, ())),
                tuple(one for one in certificates if one.fingerprint in charts),
            )
        )
    lists = [part.req for parts in (items, properties, tests) for part in parts]
    texts = [text for listed in lists for text in listed]
    unknown = {
        (text.span.source.name, text.span.start): text
        for text in texts
        if text.value not in requirements and text.value not in known
    }
    unrequired = tuple(one for one in properties if not one.req)
    return Matrix(tuple(rows), tuple(unknown.values()), unrequired)


Part = TypeVar("Part", Item, StatedProperty, CaseResult)


def _by_id(parts: Iterable[Part]) -> dict[str, list[Part]]:
    found: dict[str, list[Part]] = {}
    for part in parts:
        for id_ in dict.fromkeys(text.value for text in part.req):
            found.setdefault(id_, []).append(part)
    return found


def report_gaps(matrix: Matrix, findings: Findings, *, strict: bool) -> None:
    """Report requirements without evidence and ids without a requirement.

    ``strict``: also properties without a requirement.
    """
    known = [row.requirement.id for row in matrix.rows]
    for text in matrix.unknown:
        findings.add(
            "unknown-requirement",
            f"no file of requirements has `{text}`",
            text,
            help=suggest(text.value, known, "name an id of these files, or remove it"),
        )
    for row in matrix.rows:
        if row.status is Status.OPEN:
            one = row.requirement
            findings.add(
                "untested-requirement",
                f"no property states `{one.id}`, and no test case tests it",
                one.span,
                secondary=[
                    (item.span, f"this {item.kind} implements it") for item in row.items[:3]
                ],
                help=f"write `req: {one.id}` at a property or a test case",
            )
    for stated in matrix.unrequired if strict else ():
        findings.add(
            "unrequired-property",
            f"the property `{stated.name}` names no requirement",
            stated.span,
            help="write `req: ID` beside its kind",
        )
