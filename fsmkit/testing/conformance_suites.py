"""Where the tests of the public suites are, and what is known of each."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from pathlib import Path

from fsmkit.diagnostics import fail
from fsmkit.testing.conformance import Case, ends_in_pass, follows, read_script


def find_cases(folder: Path) -> tuple[Case, ...]:
    """Return the tests below a folder; `FsmkitError` where there is none."""
    if not folder.is_dir():
        raise fail("unreadable-file", f"cannot read `{folder}`: it is no folder")
    suites = sorted(found.parent for found in folder.rglob("ecma") if found.is_dir())
    if folder.name == "ecma":
        suites.append(folder.parent)
    cases = [case for suite in suites for case in w3c_cases(suite)]
    taken = {case.path for case in cases}
    cases += [case for case in scripted_cases(folder) if case.path not in taken]
    if not cases:
        raise fail(
            "no-conformance-tests",
            f"there are no conformance tests in `{folder}`",
            help="give a folder with the W3C's `ecma/test*.scxml`, or with charts and `.json` each",
        )
    return tuple(cases)


def w3c_cases(suite: Path) -> Iterator[Case]:
    """Yield the tests of a folder that holds ``ecma`` and, as a rule, ``classification.tsv``."""
    known = _classification(suite / "classification.tsv")
    for path in sorted((suite / "ecma").glob("test[0-9]*.scxml")):
        if "sub" in path.stem:
            continue
        row = known.get(path.stem, {})
        note = row.get("note", "")
        is_dynamic = row.get("judgement") == "dynamic"
        reasons = [
            *(["a person must judge it"] if row.get("manual") == "yes" else []),
            *(["it cannot be compiled ahead of time"] if is_dynamic else []),
        ]
        yield Case(
            path.stem,
            path,
            ends_in_pass,
            skip=", ".join(reasons),
            must_be_rejected="must reject" in note,
        )


def _classification(path: Path) -> Mapping[str, Mapping[str, str]]:
    """Return the rows of the table by name of the test's file, without its suffix."""
    if not path.is_file():
        return {}
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t"))
    return {Path(name).stem: row for row in rows for name in row["files"].split(",")}


def scripted_cases(folder: Path) -> Iterator[Case]:
    """Yield the charts that have a script of the same name beside them."""
    for path in sorted(folder.rglob("*.scxml")):
        script = read_script(path.with_suffix(".json"))
        if script is not None:
            name = path.relative_to(folder).with_suffix("").as_posix()
            names = tuple(entry["event"]["name"] for entry in script["events"])
            yield Case(name, path, follows(script), events=names)
