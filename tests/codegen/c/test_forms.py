"""Flat charts for size: a grid of answers where that is smaller; the same meaning in any case."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest

import fsmkit
from devtools.differential import Case, compare_all, elaborated
from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.scripts import random_script
from devtools.runtimes import harness
from fsmkit.chart.loading import load
from fsmkit.codegen.c.forms import Form, form_of
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import Options
from fsmkit.diagnostics import FsmkitError
from fsmkit.plan import lower

DENSE = """
chart: Dense
events: {in: [a, b]}
data: {n: uint32 = 0}
initial: s
states:
  s: {on: {a: {target: t, do: n += 1}, b: {if: n > 2, target: s}}}
  t: {on: {a: [{if: n > 5, target: s, do: n = 0}, {target: t, do: n += 2}], b: s}}
"""


def flat_cases(count: int) -> Iterator[Case]:
    """Yield random charts of few states that become a grid, with scripts."""
    number = 0
    while count:
        choices = SeededChoices(f"flat:{number}")
        number += 1
        documents = (random_document(choices, 4),)
        try:
            chart = elaborated(documents)
        except FsmkitError:
            continue
        if form_of(lower(chart), Options(is_small=True)) is Form.GRID:
            count -= 1
            yield Case(documents, chart, random_script(choices, chart), f"flat {number}")


@pytest.mark.external
def test_grids_mean_what_the_charts_mean() -> None:
    totals = compare_all(list(flat_cases(25)), [harness("c-size")])
    assert (totals.divergences, totals.rejected) == ([], 0)
    assert totals.macrosteps > 500


def test_a_transition_that_no_event_takes_is_none_of_a_grid(tmp_path: Path) -> None:
    """Found on chart 2398 of the differential test: a descriptor may match no event."""
    text = (
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">'
        '<state id="a"><transition event="done.*" target="b"/></state><state id="b"/></scxml>'
    )
    (tmp_path / "chart.scxml").write_text(text, encoding="utf-8")
    chart = fsmkit.read_chart(tmp_path / "chart.scxml")
    assert form_of(lower(chart), Options(is_small=True)) is Form.TABLES
    assert fsmkit.compile(chart, "c", optimize="size")


def chart_text(states: int, events: int) -> str:
    """A ring of states, each left on an event of its own."""
    lines = [f"  s{i}: {{on: {{e{i % events}: s{(i + 1) % states}}}}}" for i in range(states)]
    names = ", ".join(f"e{i}" for i in range(events))
    return f"chart: Ring\nevents: {{in: [{names}]}}\ninitial: s0\nstates:\n" + "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "form"),
    [
        (DENSE, Form.GRID),
        (DENSE.replace("n > 2", "n / n > 2"), Form.TABLES),  # a guard that can fail
        (DENSE.replace("  t: {", "  t: {states: {u: {}}, "),
         Form.TABLES),
        (DENSE.replace("  s: {", "  s: {defer: [b], ").replace(", b: {if: n > 2, target: s}", ""),
         Form.TABLES),
        (chart_text(4, 4), Form.GRID),
        (chart_text(30, 30), Form.TABLES),
    ],
)  # fmt: skip
def test_which_form_a_chart_gets(text: str, form: Form, tmp_path: Path) -> None:
    path = tmp_path / "chart.yaml"
    path.write_text(text, encoding="utf-8")
    plan = lower(load(path))
    assert form_of(plan, Options(is_small=True)) is form
    assert form_of(plan, Options()) is Form.FUNCTIONS


def test_what_is_done_does_not_say_where_it_leads(tmp_path: Path) -> None:
    path = tmp_path / "dense.yaml"
    path.write_text(DENSE, encoding="utf-8")
    text = generate_machine(load(path), None, Options(is_small=True)).files["dense.c"]
    grid = text.partition("dense_grid[4] = {\n")[2].partition("\n}")[0]
    assert [line.split(" /*")[0].strip() for line in grid.split("\n")] == ["1u, 2u,", "3u, 4u,"]
    assert "dense_enters[5] = {0u, 2u, 1u, 1u, 1u};" in text
    assert text.count("to = 2u;") == 1  # the second way of state t on event a


NESTED = """
chart: Dense
events: {in: [a, b]}
data: {n: uint32 = 0}
initial: s
states:
  s: {on: {"a b": {target: t, do: n += 1}}, after: {10ms: t}}
  t:
    initial: u
    on: {b: s}
    states:
      u: {on: {a: [{if: n > 5, target: v}, {do: n += 1}]}, always: {if: n > 8, target: v}}
      v: {on: {a: {if: n > 5, target: u}}}
"""
DEFERRING = """
chart: Dense
events: {in: [a, b, c]}
data: {n: uint32 = 0}
initial: s
states:
  s: {defer: [b], on: {a: {target: t, do: n += 1}}}
  t: {on: {b: {target: s, do: n += 10}, "a c": {do: n += 100}}}
"""

ONLY_DEFERRING = """
chart: Dense
events: {in: [a]}
initial: s
states:
  s: {defer: [a]}
"""
TEXTS = [DENSE, NESTED, DEFERRING, ONLY_DEFERRING]


@pytest.mark.cc
@pytest.mark.parametrize("text", TEXTS, ids=["grid", "tables", "deferring", "only deferring"])
@pytest.mark.parametrize("is_small", [False, True], ids=["speed", "size"])
@pytest.mark.parametrize("compiler", ["gcc", "clang", "g++"])
def test_code_compiles_without_a_warning(
    tmp_path: Path,
    compiler: str,
    text: str,
    *,
    is_small: bool,
    compile_with: Callable[..., object],
    write: Callable[[Path, Mapping[str, str]], Path],
) -> None:
    path = tmp_path / "dense.yaml"
    path.write_text(text, encoding="utf-8")
    write(tmp_path, generate_machine(load(path), None, Options(is_small=is_small)).files)
    compile_with(tmp_path, compiler, "-c", "dense.c")


def test_one_region_needs_no_number_in_its_rows(tmp_path: Path) -> None:
    """By hand: s handles a and b, t handles b, u handles a twice and no event, v handles a."""
    path = tmp_path / "dense.yaml"
    path.write_text(NESTED, encoding="utf-8")
    text = generate_machine(load(path), None, Options(is_small=True)).files["dense.c"]
    names = ["row_event", "row_guard", "row_first"]
    tables = {
        n: text.partition(f"dense_{n}[")[2].partition("{")[2].partition("}")[0] for n in names
    }
    events, guards, first = (tables[n].replace("u", "").split() for n in names)
    assert events[:2] == ["1,", "2,"]
    assert [int(x[:-1]) for x in first] == [0, 0, 2, 3, 6, 7]
    assert [int(x[:-1]) for x in guards] == [0, 0, 0, 1, 0, 2, 1]  # equal guards have one number


def test_events_that_nobody_defers_are_straight_code(tmp_path: Path) -> None:
    path = tmp_path / "dense.yaml"
    path.write_text(DEFERRING, encoding="utf-8")
    text = generate_machine(load(path)).files["dense.c"]
    react = text.partition("dense_react(")[2].partition("\n}")[0]
    assert "case DENSE_EVENT_B:\n            break;\n" in react
    assert "return dense_respond(m, e);" in react
    selected = text.partition("dense_state_1(")[2].partition("\n}")[0]
    assert "DENSE_EVENT_B" in selected
    assert "DENSE_EVENT_A" not in selected
    at_t = text.partition("dense_at_t(")[2].partition("\n}")[0]
    assert "DENSE_EVENT_C" in at_t
    assert "DENSE_EVENT_B" not in at_t


def deferring_cases(count: int) -> Iterator[Case]:
    """Yield random charts that defer events, and have straight code for others."""
    number = 0
    while count:
        choices = SeededChoices(f"defer:{number}")
        number += 1
        documents = (random_document(choices),)
        try:
            chart = elaborated(documents)
        except FsmkitError:
            continue
        selection = lower(chart).selection
        if selection.deferred and selection.has_straight:
            count -= 1
            yield Case(documents, chart, random_script(choices, chart), f"defer {number}")


@pytest.mark.slow
@pytest.mark.external
def test_deferral_beside_straight_code_means_what_the_charts_mean() -> None:
    totals = compare_all(list(deferring_cases(15)), [harness("c")])
    assert (totals.divergences, totals.rejected) == ([], 0)
    assert totals.macrosteps > 500
