"""The matrix as JSON, CSV, `needs.json` and a page of HTML."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping
from io import StringIO
from typing import Any

from fsmkit.diagnostics import Span
from fsmkit.diagnostics.as_json import location
from fsmkit.emit import html, plain
from fsmkit.emit.html import Markup, element
from fsmkit.emit.lines import json_text
from fsmkit.testing.requirements.items import Item, StatedProperty
from fsmkit.testing.requirements.matrix import CaseResult, Matrix, Row, Status

FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""The first character of a cell that a spreadsheet would compute."""
COLUMNS = (
    *("id", "text", "status", "items", "properties", "verdicts", "tests", "results"),
    *("coverage", "certificates"),
)
STYLES = {
    Status.VERIFIED: "good",
    Status.FAILED: "bad",
    Status.UNDECIDED: "open",
    Status.OPEN: "open",
}


def place(span: Span) -> str:
    """Return a location as `file:line`."""
    return f"{plain(span.source.name)}:{span.source.position(span.start)[0]}"


# --- JSON ---------------------------------------------------------------------------------------


def document(matrix: Matrix) -> dict[str, Any]:
    """Return the rows of the matrix, and what belongs to none, for JSON."""
    return {
        "requirements": [_row(row) for row in matrix.rows],
        "counts": counts(matrix),
        "unknown": [{"id": text.value, "at": location(text.span)} for text in matrix.unknown],
        "unrequired": [_property(one) for one in matrix.unrequired],
    }


def counts(matrix: Matrix) -> dict[str, int]:
    """Return the number of requirements by status."""
    statuses = [row.status for row in matrix.rows]
    return {status.value: statuses.count(status) for status in Status}


def _row(row: Row) -> dict[str, Any]:
    one = row.requirement
    covered = row.coverage
    return {
        "id": one.id,
        "text": one.text,
        "columns": dict(one.columns),
        "status": row.status.value,
        "at": location(one.span),
        "items": [_item(item) for item in row.items],
        "properties": [_property(stated) for stated in row.properties],
        "tests": [_test(test) for test in row.tests],
        "coverage": None if covered is None else {"covered": covered[0], "all": covered[1]},
        "certificates": [
            {"file": c.file, "chart": c.chart, "target": c.target, "result": c.result}
            for c in row.certificates
        ],
    }


def _item(item: Item) -> dict[str, Any]:
    found = {"kind": item.kind, "name": item.name, "at": location(item.span)}
    return found if item.covered is None else {**found, "covered": item.covered}


def _property(one: StatedProperty) -> dict[str, Any]:
    found: dict[str, Any] = {"model": one.file, "name": one.name, "claim": one.claim}
    found["verdict"] = one.verdict
    return found if one.span is None else {**found, "at": location(one.span)}


def _test(one: CaseResult) -> dict[str, Any]:
    return {
        "file": one.file,
        "case": one.name,
        "passed": one.passed,
        "at": location(one.span),
    }


# --- CSV ----------------------------------------------------------------------------------------


def csv_text(matrix: Matrix) -> str:
    """Return the matrix as a table; no cell starts like a formula of a spreadsheet."""
    found = StringIO(newline="")
    writer = csv.writer(found, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in matrix.rows:
        writer.writerow([_safe(cell) for cell in _cells(row)])
    return found.getvalue()


def _safe(cell: str) -> str:
    return f"'{cell}" if cell.startswith(FORMULA) else cell


def _cells(row: Row) -> Iterator[str]:
    yield plain(row.requirement.id)
    yield plain(row.requirement.text)
    yield row.status.value
    yield _joined(f"{item.kind} {plain(item.name)} ({place(item.span)})" for item in row.items)
    yield _joined(plain(one.name) for one in row.properties)
    yield _joined(one.verdict or "unknown" for one in row.properties)
    yield _joined(plain(one.name) for one in row.tests)
    yield _joined("passed" if one.passed else "failed" for one in row.tests)
    yield _ratio(row)
    yield _joined(f"{plain(c.chart)} on {plain(c.target)}: {c.result}" for c in row.certificates)


def _joined(parts: Iterable[str]) -> str:
    return "; ".join(parts)


def _ratio(row: Row) -> str:
    covered = row.coverage
    return "" if covered is None else f"{covered[0]} of {covered[1]}"


# --- needs.json -----------------------------------------------------------------------------------


def needs_text(matrix: Matrix, project: str) -> str:
    """Return the matrix as a `needs.json` that sphinx-needs imports.

    Each requirement is a need with its status. Fields whose names start with `fsmkit_` hold the
    evidence. The columns of the requirements are kept.
    """
    needs: dict[str, Mapping[str, str]] = {}
    for row in matrix.rows:
        cells = dict(zip(COLUMNS, _cells(row), strict=True))
        one = row.requirement
        needs[plain(one.id)] = {
            "type": "req",
            **{plain(name): plain(value) for name, value in one.columns},
            "id": plain(one.id),
            "title": plain(one.text)[:80],
            "description": plain(one.text),
            "status": row.status.value,
            **{f"fsmkit_{name}": cells[name] for name in COLUMNS[3:]},
        }
    return json_text({
        "current_version": "1",
        "project": project,
        "versions": {"1": {"needs": needs, "needs_amount": len(needs)}},
    })  # fmt: skip


# --- HTML -----------------------------------------------------------------------------------------


def page(matrix: Matrix, title: str) -> str:
    """Return a page with the matrix, which loads nothing."""
    return html.page(
        title,
        element("h1", "Requirements and evidence"),
        element("p", title, class_="soft"),
        cards(matrix),
        table(matrix),
        *rest(matrix),
    )


def cards(matrix: Matrix) -> Markup:
    """Return the number of requirements by status as cards."""
    found = [_card(str(len(matrix.rows)), "requirements")]
    for status in Status:
        number = counts(matrix)[status.value]
        found.append(_card(str(number), status.value, STYLES[status] if number else ""))
    return element("div", *found, class_="cards")


def _card(figure: str, label: str, class_: str = "") -> Markup:
    return element(
        "div", element("b", figure, class_=class_), element("span", label), class_="card"
    )


def mark(word: str, class_: str) -> Markup:
    """Return a word with a coloured dot."""
    return element("span", word, class_=f"mark {class_}")


VERDICTS = {"holds": "good", "violated": "bad"}


def verdict_mark(verdict: str | None) -> Markup:
    """Return a verdict with a coloured dot."""
    return mark(verdict or "unknown", VERDICTS.get(verdict or "", "open"))


def table(matrix: Matrix) -> Markup:
    """Return the matrix as a table."""
    heads = ("requirement", "status", "implemented by", "properties", "tests", "coverage")
    return html.table(heads, (_html_row(row) for row in matrix.rows))


def _html_row(row: Row) -> tuple[Markup | str, ...]:
    one = row.requirement
    certified = [
        element("span", f"certified on {c.target}: {c.result}", class_="soft")
        for c in row.certificates
    ]
    return (
        html.join([element("b", one.id), element("div", one.text, class_="soft")]),
        mark(row.status.value, STYLES[row.status]),
        html.listing(
            html.join([f"{i.kind} ", element("code", i.name), *_at(i.span)]) for i in row.items
        ),
        html.listing(
            html.join([
                verdict_mark(p.verdict), " ", element("code", p.name),
                element("div", p.claim, class_="mono soft"),
            ])
            for p in row.properties
        ),
        html.listing(
            html.join([
                mark("passed", "good") if t.passed else mark("failed", "bad"), f" {t.name}",
                *_at(t.span),
            ])
            for t in row.tests
        ),
        html.listing([_ratio(row), *certified] if _ratio(row) else certified),
    )  # fmt: skip


def _at(span: Span) -> tuple[Markup, ...]:
    return (element("div", place(span), class_="mono soft"),)


def rest(matrix: Matrix) -> Iterator[Markup]:
    """Yield the ids without a requirement, and the properties without one."""
    if matrix.unknown:
        yield element("h2", "Ids that no file of requirements has")
        yield html.table(("id", "location"), ((t.value, place(t.span)) for t in matrix.unknown))
    if matrix.unrequired:
        yield element("h2", "Properties that name no requirement")
        rows = ((p.file, p.name, p.claim, verdict_mark(p.verdict)) for p in matrix.unrequired)
        yield html.table(("model", "property", "claim", "verdict"), rows)
