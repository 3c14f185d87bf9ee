"""The page of results: its tables, where it is written, and that the reference holds such a one."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.testing.conformance.charts import Reading, Stage
from fsmkit.testing.conformance.conformance import Case, Result, Verdict
from fsmkit.testing.conformance.expectations import ends_in_pass
from fsmkit.testing.conformance.page import BEGIN, END, page, write_into
from fsmkit.testing.conformance.suites import find_cases
from fsmkit.testing.harness.harness import harnesses

ROOT = Path(__file__).parents[3]
REFERENCE = ROOT / "docs/reference/scxml.md"
KEPT = re.compile(
    r"(?<=kept in )\d+ of (\d+) files; in the\nothers (\d+) places .*?\n\n((?:\|.*\n)+)"
)
"""How many charts keep their meaning, of how many; places that do not, and a table of why."""
COUNTS = re.compile(r"^\| (.+?) \|((?: \d+ / \d+ / \d+ \|)+)$", re.MULTILINE)


def case(name: str, clause: str, suite: str = "W3C") -> Case:
    return Case(name, Path(name), ends_in_pass, suite=suite, group=clause, link=f"#{clause[-1]}")


def test_clauses_are_in_order_and_reasons_told_once() -> None:
    verdicts = [
        Verdict(case("test1", "3.10 b"), "interpreter", Result.PASSED),
        Verdict(case("test1", "3.10 b"), "c", Result.PASSED),
        Verdict(case("test2", "3.9 a"), "interpreter", Result.FAILED, "why | not"),
        Verdict(case("test2", "3.9 a"), "c", Result.FAILED, "why | not"),
        Verdict(case("test3", "C.2 c"), "interpreter", Result.PASSED),
        Verdict(case("test3", "C.2 c"), "c", Result.SKIPPED, "optional"),
    ]
    assert list(page(verdicts, [])) == [
        "### Tests of the W3C, by clause of the recommendation",
        "",
        "Passed / failed / skipped.",
        "",
        "|  | interpreter | c |",
        "|---|---:|---:|",
        "| [3.9 a](#a) | 0 / 1 / 0 | 0 / 1 / 0 |",
        "| [3.10 b](#b) | 1 / 0 / 0 | 1 / 0 / 0 |",
        "| [C.2 c](#c) | 1 / 0 / 0 | 0 / 0 / 1 |",
        "| all | 2 / 1 / 0 | 1 / 1 / 1 |",
        "",
        "| test | of | is | why |",
        "|---|---|---|---|",
        "| test2 | 3.9 a | failed | why \\| not |",
        "| test3 | C.2 c | skipped (c) | optional |",
    ]


def test_charts_are_counted() -> None:
    readings = [
        Reading("a.scxml", Stage.COMPILED, 0, ""),
        Reading("b.scxml", Stage.CHART, 3, "FK0400 x: y", replacement_causes=("other", "other")),
        Reading("pom.xml", Stage.NOWHERE, 0, "not-scxml", is_chart=False),
    ]
    lines = page([], readings)
    assert "| 2 | 2 | 2 | 1 | 1 |" in lines
    assert "Every condition and every content is kept in 1 of 2 files; in the" in lines
    assert "| 1 | 2 | other |" in lines
    assert lines[-1] == "| b.scxml | chart | FK0400 x: y |"


def test_a_page_keeps_its_prose() -> None:
    first = write_into("# Title\n\nProse.\n", ["one"])
    assert first == f"# Title\n\nProse.\n\n{BEGIN}\n\none\n\n{END}\n"
    assert write_into(f"{first}\nMore.\n", ["two"]) == first.replace("one", "two") + "\nMore.\n"
    assert write_into("", ["one"]).startswith(BEGIN)


def test_the_verb_writes_the_page(tmp_path: Path) -> None:
    head = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="pass">'
    (tmp_path / "ecma").mkdir()
    (tmp_path / "ecma/test1.scxml").write_text(f'{head}<final id="pass"/></scxml>')
    target = tmp_path / "page.md"
    assert execute(["conformance", str(tmp_path), "--quiet", "--markdown", str(target)]) == 0
    assert "| all | 1 / 0 / 0 |" in target.read_text()
    assert execute(["conformance", str(tmp_path), "--markdown", str(tmp_path)]) == 1


def test_the_reference_is_such_a_page(shared: Callable[[str], Path]) -> None:
    """Its suites, columns and clauses are those that the tool writes; numbers may be older."""
    text = REFERENCE.read_text(encoding="utf-8")
    assert text.count(BEGIN) == text.count(END) == 1
    written = text[text.index(BEGIN) : text.index(END)]
    targets = [one.name for one in harnesses()]
    passed = [
        Verdict(one, target, Result.PASSED) for one in find_cases(shared(".")) for target in targets
    ]
    fresh = "\n".join(["", *page(passed, [])])
    assert f"|  | {' | '.join(targets)} |" in written
    known, told = numbers(fresh), numbers(written)
    assert {title for title in told if title[1] == "all"} == {
        title for title in known if title[1] == "all"
    }
    assert set(told) <= set(known)
    for title, columns in told.items():
        assert len(columns) == len(targets)
        assert all(sum(column) <= sum(known[title][0]) for column in columns), title


@pytest.mark.slow
@pytest.mark.cc
def test_the_reference_has_the_numbers_of_today(
    shared: Callable[[str], Path], tmp_path: Path
) -> None:
    """Where the data are those of the page: the interpreter's numbers, and how charts are kept."""
    target = tmp_path / "page.md"
    given = ["conformance", str(shared(".")), "--limit", "600", "--quiet"]
    assert execute([*given, "--markdown", str(target)]) in (0, 1)
    fresh, written = (p.read_text(encoding="utf-8") for p in (target, REFERENCE))
    known = numbers(written)
    for title, (found, *_) in numbers(fresh).items():
        if title in known and sum(known[title][0]) == sum(found):
            assert known[title][0] == found, title
    kept, told = (KEPT.search(page) for page in (fresh, written))
    assert kept is not None
    assert told is not None
    assert kept[1] != told[1] or kept.groups() == told.groups()


def numbers(text: str) -> dict[tuple[str, str], list[tuple[int, ...]]]:
    """Return the cells of each row of counts, by the heading above it and its title."""
    found = {}
    for section in text.split("\n### ")[1:]:
        heading = section.partition("\n")[0]
        for title, cells in COUNTS.findall(section):
            counted = [cell.split("/") for cell in cells.split("|") if cell.strip()]
            found[heading, title] = [tuple(map(int, cell)) for cell in counted]
    return found
