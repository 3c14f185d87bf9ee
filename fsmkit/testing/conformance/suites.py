"""Find the tests of the public suites.

The content of a folder, at any depth, identifies it. An ``ecma`` with ``test*.scxml`` is a suite
of the W3C; a chart with a script of the same name is a scripted test; any other file of a chart
notation is a chart without a test.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from pathlib import Path

from fsmkit.diagnostics import fail
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plugins import plugins
from fsmkit.testing.conformance.conformance import Case
from fsmkit.testing.conformance.expectations import (
    assessed_log,
    ends_in_pass,
    follow_script,
    read_script,
)

RECOMMENDATION = "https://www.w3.org/TR/scxml/"

SKIPPED = (
    ("manual", "yes", "a person must assess it"),
    ("mandatory", "no", "optional"),
    ("judgement", "dynamic", "needs information available only at run time"),
)
"""Columns and values of the classification for which a failure does not count, and why."""
SHOWN = {"test178": "send event1 2 3"}
"""Tests that a person must assess, and the line of the trace to assess."""


def find_cases(folder: Path) -> tuple[Case, ...]:
    """Return the tests below a folder, perhaps none; `FsmkitError` where it is no folder."""
    if not folder.is_dir():
        raise fail("unreadable-file", f"cannot read `{folder}`: it is not a folder")
    cases = [case for suite in w3c_suites(folder) for case in w3c_cases(suite)]
    taken = {case.path for case in cases}
    cases += [case for case in scripted_cases(folder) if case.path not in taken]
    return tuple(cases)


def find_charts(folder: Path) -> tuple[Path, ...]:
    """Return the files below a folder that look like charts and belong to no test."""
    suffixes = {suffix for front_end in plugins(FrontEnd) for suffix in front_end.suffixes}
    suites = w3c_suites(folder)
    tests = {case.path for case in scripted_cases(folder)}
    return tuple(
        path
        for path in sorted(folder.rglob("*"))
        if path.suffix.lower() in suffixes
        and path.is_file()
        and path not in tests
        and not any(path.is_relative_to(suite) for suite in suites)
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
    )


def w3c_suites(folder: Path) -> tuple[Path, ...]:
    """Return the folders below a folder, or above it, that hold an ``ecma`` with tests."""
    found = [path for path in folder.rglob("ecma") if path.is_dir()]
    if folder.resolve().name == "ecma":
        found.append(folder)
    return tuple(sorted(path.parent for path in found if any(path.glob("test[0-9]*.scxml"))))


def w3c_cases(suite: Path) -> Iterator[Case]:
    """Yield the tests of a folder with ``ecma`` and, usually, ``classification.tsv``.

    Only failures of mandatory tests count. Failures of tests that are optional, that a person must
    assess, or that need run-time information, are reported only.
    """
    known = _classification(suite / "classification.tsv")
    for path in sorted((suite / "ecma").glob("test[0-9]*.scxml")):
        if "sub" in path.stem:
            continue
        row = known.get(path.stem, {})
        note = row.get("note", "")
        reasons = [why for key, value, why in SKIPPED if row.get(key) == value]
        anchor = row.get("specid", "").removeprefix("#")
        yield Case(
            path.stem,
            path,
            ends_in_pass if path.stem not in SHOWN else assessed_log(SHOWN[path.stem]),
            skip=", ".join(reasons),
            must_be_rejected="must reject" in note,
            note=note.removeprefix("manual; "),
            suite="W3C",
            group=f"{row.get('section', '')} {anchor}".strip(),
            link=f"{RECOMMENDATION}#{anchor}" if anchor else "",
        )


def _classification(path: Path) -> Mapping[str, Mapping[str, str]]:
    """Return the rows of the table by name of the test's file, without its suffix."""
    if not path.is_file():
        return {}
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t"))
    return {Path(name).stem: row for row in rows for name in row["files"].split(",")}


def scripted_cases(folder: Path) -> Iterator[Case]:
    """Yield the charts that have a script of the same name."""
    for path in sorted(folder.rglob("*.scxml")):
        script = read_script(path.with_suffix(".json"))
        if script is not None:
            name = path.relative_to(folder).with_suffix("").as_posix()
            names = tuple(entry["event"]["name"] for entry in script["events"])
            group = path.relative_to(folder).parent.as_posix()
            yield Case(
                name, path, follow_script(script), events=names, suite="scripted", group=group
            )
