"""Imports of foreign machines as tests use them: from a string to a chart and its calls."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, FsmkitError, Severity
from fsmkit.foreign.imports import Import, Role
from fsmkit.foreign.notation import ForeignNotation
from fsmkit.plugins import plugin
from fsmkit.runtime.session import Session

CORPORA = Path(
    os.environ.get(
        "FSMKIT_FOREIGN", Path(__file__).parents[3] / "shared" / "conformance" / "foreign"
    )
)
"""The machines of other tools; a test reads what is there."""


def imported(
    reader: str, content: str | bytes, name: str, machine: str | None = None
) -> tuple[Import | None, Findings]:
    """Return the import of a file's content, and the findings."""
    notation = plugin(ForeignNotation, reader)
    findings = Findings()
    data = content.encode() if isinstance(content, str) else content
    source = notation.decode(data, name, findings)
    if source is None:
        return None, findings
    found = notation.machines(source, findings)
    wished = machine if machine is not None else found[0] if found else None
    if wished is None:
        return None, findings
    return notation.import_machine(source, wished, findings), findings


def messages(findings: Findings) -> list[str]:
    """Return the messages of errors."""
    return [each.message for each in findings if each.severity is Severity.ERROR]


def chart_of(reader: str, content: str | bytes, name: str) -> tuple[Chart, Import]:
    """Return the chart of a file that is carried whole; raises the findings otherwise."""
    found, findings = imported(reader, content, name)
    findings.stop_on_errors()
    if found is None:
        raise FsmkitError(findings)
    chart = elaborate((found.document,), findings)
    findings.stop_on_errors()
    if chart is None:
        raise FsmkitError(findings)
    return chart, found


def calls(
    chart: Chart, found: Import, events: Sequence[str], *, true: Sequence[str] = ()
) -> list[str]:
    """Return the texts of all operations that a run calls, and the active states at its end.

    Guards are true if ``true`` has their text.
    """
    called: list[str] = []
    texts = {one.name: one.text.value.strip().rstrip(";") for one in found.opaque}
    guards = {one.name for one in found.opaque if one.role is Role.GUARD}

    def operation(name: str) -> object:
        def call(*_: object) -> bool | None:
            if name in guards:
                return texts[name] in true
            called.append(texts[name])
            return None

        return call

    session = Session(chart, {name: operation(name) for name in texts})
    for event in events:
        session.post(event)
        session.run()
    assert session.fault is None
    return [*called, *session.active]


def corpus(folder: str, suffixes: tuple[str, ...]) -> Iterator[Path]:
    """Yield the files of a corpus, in order."""
    for path in sorted((CORPORA / folder).rglob("*")):
        if path.is_file() and path.name.endswith(suffixes):
            yield path
