"""Write the results as a Markdown page: clause by clause, failures with their reasons."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from fsmkit.testing.conformance.charts import Reading, meaning, totals
from fsmkit.testing.conformance.conformance import Result, Verdict

BEGIN = "<!-- conformance: written by `fsmkit conformance --markdown`, not by hand -->"
END = "<!-- /conformance -->"
TITLES = {
    "W3C": "Tests of the W3C, by clause of the recommendation",
    "scripted": "Charts with a script, by folder",
}


def write_into(text: str, page: Sequence[str]) -> str:
    """Return a text with the page between its marks, or at its end where it has none."""
    block = "\n".join([BEGIN, "", *page, "", END])
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if begin and end:
        return f"{before}{block}{after}"
    return f"{text.rstrip()}\n\n{block}\n".lstrip()


def page(verdicts: Sequence[Verdict], readings: Sequence[Reading]) -> tuple[str, ...]:
    """Return the lines: for each suite a table of counts and one of failures."""
    lines: list[str] = []
    for suite in dict.fromkeys(verdict.case.suite for verdict in verdicts):
        of_suite = [verdict for verdict in verdicts if verdict.case.suite == suite]
        lines += [f"### {TITLES.get(suite, suite)}", "", *_counts(of_suite), ""]
        if any(verdict.result is not Result.PASSED for verdict in of_suite):
            lines += [*_missed(of_suite), ""]
    if readings:
        lines += ["### Charts as they are found", "", *_charts(readings), ""]
    return tuple(lines[:-1])


def _counts(verdicts: Sequence[Verdict]) -> Iterator[str]:
    targets = list(dict.fromkeys(verdict.target for verdict in verdicts))
    cases = {verdict.case.path: verdict.case for verdict in verdicts}.values()
    links = dict(sorted({case.group: case.link for case in cases}.items(), key=_natural))
    yield "Passed / failed / skipped."
    yield ""
    yield _row("", *targets)
    yield "|---|" + "---:|" * len(targets)
    for group, link in links.items():
        title = f"[{group}]({link})" if link else group or "."
        of_group = [verdict for verdict in verdicts if verdict.case.group == group]
        yield _row(title, *(_count(of_group, target) for target in targets))
    yield _row("all", *(_count(verdicts, target) for target in targets))


def _count(verdicts: Sequence[Verdict], target: str) -> str:
    results = [verdict.result for verdict in verdicts if verdict.target == target]
    return " / ".join(str(results.count(result)) for result in Result)


def _missed(verdicts: Sequence[Verdict]) -> Iterator[str]:
    """Yield a line for each test and reason; the runtimes are named where they differ."""
    targets_of: dict[tuple[str, str, str, str], list[str]] = {}
    for verdict in verdicts:
        if verdict.result is Result.PASSED:
            continue
        key = (verdict.name, verdict.case.group, verdict.result.value, verdict.reason)
        targets_of.setdefault(key, []).append(verdict.target)
    everywhere = len({verdict.target for verdict in verdicts})
    yield _row("test", "of", "is", "why")
    yield "|---|---|---|---|"
    for (name, group, result, reason), targets in targets_of.items():
        where = "" if len(targets) == everywhere else f" ({', '.join(targets)})"
        yield _row(name, group, f"{result}{where}", reason)


def _charts(readings: Sequence[Reading]) -> Iterator[str]:
    yield _row("files", "read", "become a Chart", "compile to C", "of these without a warning")
    yield "|---:|---:|---:|---:|---:|"
    yield _row(*map(str, totals(readings).values()))
    yield ""
    yield "A file without an error of its own is read. If the file of a script is missing, it is no"
    yield "chart (SCXML 5.8)."
    kept = meaning(readings)
    yield ""
    yield f"Every condition and every content is kept in {kept.kept} of {kept.files} files; in the"
    yield f"others {kept.places} places are an error when they are reached."
    if kept.causes:
        yield ""
        yield _row("files", "places", "cause")
        yield "|---:|---:|---|"
        for cause in kept.causes:
            yield _row(str(cause.files), str(cause.places), cause.name)
    stopped = [reading for reading in readings if reading.is_chart and reading.reason]
    if stopped:
        yield ""
        yield _row("file", "gets to", "what stops it")
        yield "|---|---|---|"
        for reading in stopped:
            yield _row(reading.name, reading.stage.name.lower(), reading.reason)


def _row(*cells: str) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def _natural(item: tuple[str, str]) -> tuple[str | int, ...]:
    """Return a key that sorts 3.9 before 3.10, and the appendices last."""
    parts: Iterable[str] = re.split(r"(\d+)", item[0])
    return tuple(int(part) if part.isdigit() else part for part in parts)
