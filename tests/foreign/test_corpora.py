"""Files of other tools, where they are: each is read, or rejected with a location.

`python -m devtools.foreign` reads all of them and counts; here it is each `EACH`th small one.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings
from tests.foreign.imports import CORPORA, corpus, imported
from tests.needs import where

EACH = 8
LARGEST = 60_000
FOLDERS = {
    "statesmith": (
        "StateSmith__StateSmith",
        (".puml", ".plantuml", ".drawio", ".drawio.svg", ".graphml"),
    ),
    "mermaid": ("mermaid-js__mermaid", (".mmd",)),
}
FILES = [
    (reader, path)
    for reader, (folder, suffixes) in FOLDERS.items()
    for path in [p for p in corpus(folder, suffixes) if p.stat().st_size < LARGEST][::EACH]
]


@pytest.mark.slow
@where(FILES, "the files of other tools are not there; set FSMKIT_FOREIGN")
@pytest.mark.parametrize(
    ("reader", "path"), FILES, ids=lambda each: each.name if isinstance(each, Path) else each
)
def test_a_file(reader: str, path: Path) -> None:
    found, findings = imported(reader, path.read_bytes(), str(path.relative_to(CORPORA)))
    assert all(one.primary is not None for one in findings)
    if found is not None and not findings.has_errors:
        own = Findings()
        elaborate((found.document,), own)
        own.stop_on_errors()
