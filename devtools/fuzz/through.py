"""Process a fuzzed chart within limits of time and memory.

Any input must end as a chart or with findings, within five seconds and a gigabyte. A chart written
in either notation must equal itself. Any exception but `FsmkitError` is a crash.
"""

from __future__ import annotations

import time

from devtools.fuzz.seeds import PROJECT
from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.loading import read_document, with_invoked
from fsmkit.codegen.c.plugin import PLUGIN as C
from fsmkit.codegen.python.plugin import PLUGIN as PYTHON
from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.diagnostics.diagnostic import render
from fsmkit.document.document import Document
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plan.lower import lower
from fsmkit.plugins import plugins

BASE = read_document(PROJECT / "machines" / "production_cell" / "module.scxml", Findings())
"""The base of charts that extend another."""
FOLDER = PROJECT / "devtools" / "fuzz" / "charts"
"""The folder of the chart; file names lead to a usable chart, or do not exist."""
SECONDS = 5
"""Maximum processor seconds for one input."""


def through(content: bytes, name: str, front_end: FrontEnd) -> None:
    """Take bytes as far as they go: text, Document, Chart, Plan, C and Python."""
    started = time.process_time()
    findings = Findings()
    try:
        chart = _chart(content, name, front_end, findings)
        assert chart is not None or findings.has_errors, "rejected without a finding"
        if chart is not None:
            _written(chart, findings)
    except FsmkitError as error:
        findings.extend(error.diagnostics)
        assert findings.has_errors
    for found in findings:
        render(found)
        if found.primary is not None:
            span = found.primary.span
            assert 0 <= span.start <= span.end <= len(span.source.text) + 1, found
    assert time.process_time() - started < SECONDS, "too slow"


def _chart(content: bytes, name: str, front_end: FrontEnd, findings: Findings) -> Chart | None:
    source = front_end.decode(content, f"{FOLDER}/{name}", findings)
    document = None if source is None else front_end.read(source, findings)
    if document is None:
        return None
    strict = len(content) % 4 == 0
    chart = _meaning(document, findings, strict=strict)
    if chart is not None and len(content) % 3 == 0:
        _converted(document, chart, strict=strict)
    return chart


def _meaning(document: Document, findings: Findings, *, strict: bool) -> Chart | None:
    document = with_invoked(document, findings, (), {})
    bases = () if document.extends is None else (BASE,)
    return elaborate((document, *bases), findings, strict=strict)


def _converted(document: Document, chart: Chart, *, strict: bool) -> None:
    """Check that each notation keeps the chart, or reports that it cannot express it."""
    for notation in plugins(FrontEnd):
        try:
            written = notation.write(document)
        except FsmkitError as error:
            if any(found.rule.name != "not-expressible" for found in error.diagnostics):
                raise AssertionError(document) from error
            continue
        findings = Findings()
        read = notation.read(Source(document.source.name, written), findings)
        assert read is not None, (written, [found.message for found in findings])
        assert _meaning(read, Findings(), strict=strict) == chart, written


def _written(chart: Chart, findings: Findings) -> None:
    lower(chart)
    for target in (C, PYTHON):
        refused = Findings()
        generated = target.generate(chart, refused, {})
        assert generated is not None or refused.has_errors, "not written without a word"
        findings.extend(refused)
        if target is PYTHON and generated is not None:
            for name, text in generated.files.items():
                compile(text, name, "exec")
