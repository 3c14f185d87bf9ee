"""The seeds of the fuzz targets: charts and sources of the project.

These are the charts of machines in both notations, small random charts, and the strings of the
tests, which contain most constructs of charts, valid and invalid.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import SeededChoices
from fsmkit.chart.loading import read_document
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.document.document import Document
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plugins import plugin_for, plugins

PROJECT = Path(__file__).parents[2]
RANDOM_CHARTS = 100
LONGEST = 6_000
"""Maximum size of a seed in bytes; longer ones slow down the search."""


def charts(suffix: str) -> Iterator[str]:
    """Yield charts in the notation of a suffix."""
    front_end = plugin_for(FrontEnd, Path("chart" + suffix))
    for document in _documents():
        try:
            yield front_end.write(document)
        except FsmkitError:
            continue


def _documents() -> Iterator[Document]:
    known = {suffix for front_end in plugins(FrontEnd) for suffix in front_end.suffixes}
    for folder in ("machines", "tests"):
        for path in sorted((PROJECT / folder).rglob("*")):
            if path.suffix in known:
                try:
                    yield read_document(path, Findings())
                except FsmkitError:
                    continue
    for number in range(RANDOM_CHARTS):
        yield random_document(SeededChoices(number), 2 + number % 8)


@cache
def strings_of_tests(*folders: str) -> tuple[str, ...]:
    """Return the literals in the tests of some folders."""
    found: dict[str, None] = {}
    for folder in folders or ("",):
        for path in sorted((PROJECT / "tests" / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Constant) and isinstance(node.value, str):
                    found[node.value] = None
    return tuple(found)


def write_corpus(folder: Path, seeds: Iterator[str]) -> None:
    """Write the seeds into a folder, each once."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(dict.fromkeys(seeds)):
        content = seed.encode("utf-8", errors="replace")
        if len(content) <= LONGEST:
            (folder / f"seed_{number:04}").write_bytes(content)
