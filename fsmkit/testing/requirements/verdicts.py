"""Verdicts of `fsmkit check --json` documents, for properties that were checked before."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import FsmkitError, Source, Span, fail
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.testing.requirements.items import StatedProperty

Verdicts = Mapping[str, str]
"""Verdicts by the names of properties."""
Reports = Sequence[tuple[str | None, Verdicts]]
"""The verdicts of each report, with its file where the document names it."""


def read_reports(paths: Iterable[Path]) -> Reports:
    """Return the reports of documents; raises `FsmkitError` (``broken-report``)."""
    return [report for path in paths for report in _read(path)]


def _read(path: Path) -> Iterator[tuple[str | None, Verdicts]]:
    content = read_bytes(path)
    try:
        root = parse_json(content)
    except ValueError as error:
        raise _broken(path, content, f"is not JSON: {error}") from error
    listed = root.get("files") if isinstance(root, dict) else None
    for one in listed if isinstance(listed, list) else [root]:
        properties = one.get("properties") if isinstance(one, dict) else None
        if isinstance(one, dict) and one.get("verdict") == "error":
            continue
        if not isinstance(properties, list) or not all(map(_is_result, properties)):
            raise _broken(path, content, "is not a document of `fsmkit check --json`")
        file = one.get("file")
        yield (
            file if isinstance(file, str) else None,
            {each["name"]: each["verdict"] for each in properties},
        )


def _is_result(one: Any) -> bool:
    return isinstance(one, dict) and all(isinstance(one.get(k), str) for k in ("name", "verdict"))


def _broken(path: Path, content: bytes, reason: str) -> FsmkitError:
    source = Source(str(path), content.decode(errors="replace"))
    at = Span(source, 0, min(1, len(source.text)))
    advice = "write it with `fsmkit check MODEL --json`"
    return fail("broken-report", f"`{path}` {reason}", at, help=advice)


def with_verdicts(
    file: str, properties: Sequence[StatedProperty], reports: Reports
) -> tuple[StatedProperty, ...]:
    """Return the properties of a model with the verdicts of the report of that model.

    A report that names no file belongs to the model if it has all its properties.
    """
    names = {one.name for one in properties}
    real = os.path.realpath(file)
    found: Verdicts = {}
    for named, verdicts in reports:
        is_own = names <= verdicts.keys() if named is None else os.path.realpath(named) == real
        if is_own:
            found = verdicts
    return tuple(replace(one, verdict=found.get(one.name)) for one in properties)
