"""Requirements in CSV: a header with `id`, and one requirement in each row."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from io import StringIO

from fsmkit.diagnostics import Findings, FsmkitError, Source, Span
from fsmkit.testing.requirements.requirement import MOST, Requirement, broken, one_line, start_of

DELIMITERS = ",;\t|"
TEXTS = ("text", "description", "title", "name")
"""Names of the column with the text; the first one that is there counts."""
HEADER = "start the file with a header such as `id,text`"


def read(source: Source) -> tuple[Requirement, ...]:
    """Return the requirements of a table; raises `FsmkitError` (``broken-requirements``).

    The delimiter is a comma, a semicolon, a tab or a bar, whichever the header has most of.
    """
    findings = Findings()
    found = tuple(_read(source, findings))
    if findings.has_errors:
        raise FsmkitError(findings)
    return found


def _read(source: Source, findings: Findings) -> Iterator[Requirement]:
    first = next((line for line in source.text.splitlines() if line.strip()), "")
    delimiter = max(DELIMITERS, key=first.count)
    rows = csv.reader(StringIO(source.text, newline=""), delimiter=delimiter, strict=True)
    starts = _line_starts(source.text)
    header: tuple[str, ...] = ()
    columns: dict[str, int] = {}
    line = count = 0
    while True:
        before = line
        try:
            row = next(rows, None)
        except csv.Error as error:
            at = _line(source, starts, before)
            broken(findings, f"the table breaks here: {error}", at, "close the quotes of the row")
            return
        line = rows.line_num
        if row is None:
            break
        at = _line(source, starts, before)
        if not any(cell.strip() for cell in row):
            continue
        if not header:
            header = tuple(cell.strip() for cell in row)
            columns = {name.lower(): place for place, name in reversed([*enumerate(header)])}
            if "id" not in columns:
                broken(findings, "the table has no column `id`", at, HEADER)
                return
            continue
        count += 1
        if count > MOST:
            broken(findings, f"the table has more than {MOST:,} rows", at, "split the file")
            return
        if (one := _requirement(row, header, columns, at, findings)) is not None:
            yield one
    if not header:
        broken(findings, "the table is empty", start_of(source), HEADER)


def _requirement(
    row: Sequence[str],
    header: Sequence[str],
    columns: dict[str, int],
    at: Span,
    findings: Findings,
) -> Requirement | None:
    if len(row) > len(header):
        broken(
            findings,
            f"the row has {len(row)} cells, and the header {len(header)}",
            at,
            "put quotes around a text with a separator",
        )
        return None
    cells = [*map(one_line, row), *[""] * (len(header) - len(row))]
    id_ = cells[columns["id"]]
    if not id_:
        broken(findings, "the row has no id", at, "fill in the column `id`, or remove the row")
        return None
    name = next((name for name in TEXTS if name in columns), None)
    text = "" if name is None else cells[columns[name]]
    used = {"id", name}
    more = [(n, c) for n, c in zip(header, cells, strict=True) if n.lower() not in used and c]
    return Requirement(id_, text, at, tuple(more))


def _line_starts(text: str) -> list[int]:
    starts = [0]
    for line in StringIO(text, newline=""):
        starts.append(starts[-1] + len(line))
    return starts


def _line(source: Source, starts: list[int], number: int) -> Span:
    """Return the location of a line, counted from 0."""
    start = starts[min(number, len(starts) - 1)]
    found = source.text.find("\n", start)
    end = len(source.text) if found < 0 else found
    return Span(source, start, end - (end > start and source.text[end - 1] == "\r"))
