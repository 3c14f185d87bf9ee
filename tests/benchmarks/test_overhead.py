"""Prices: a part costs something where it is used, and nothing where it is not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.comparison.tools import UnavailableError
from benchmarks.overhead.__main__ import BEGIN, END, PAGE, placed, priced, table
from benchmarks.overhead.measure import Figures, Meter
from benchmarks.overhead.parts import PARTS, Part
from benchmarks.overhead.pump import CALLING, PLAIN, pump, unguarded

QUICK = [part for part in PARTS if part.name in ("timers", "run-to-completion guard")]


@pytest.mark.external
@pytest.mark.parametrize("part", QUICK, ids=lambda part: part.name)
def test_a_part_is_free_where_it_is_not_used(
    part: Part, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    for tool in ("arm-none-eabi-gcc", "gcc", "valgrind"):
        require_tool(tool)
    price = priced(part, Meter(tmp_path))
    assert price.used.code > 0
    assert price.used.instructions > 0
    assert price.unused == Figures(0, 0, 0.0)


def test_the_guard_is_cut_out_whole() -> None:
    cut = unguarded(pump(CALLING))
    assert "busy" in pump(CALLING).files["pump.c"]
    assert not any("busy" in cut.files[name] for name in ("pump.c", "pump.h"))
    assert unguarded(pump(PLAIN)) == pump(PLAIN)


def test_a_guard_of_another_form_is_not_measured() -> None:
    made = pump(CALLING)
    text = made.files["pump.c"].replace("m->fsm.busy = true;", "set_busy(m);")
    with pytest.raises(UnavailableError, match="another form"):
        unguarded(type(made)({**made.files, "pump.c": text}, made.sources, made.calls, made.turn))


def test_the_page_has_a_place_for_the_table() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page.count(BEGIN) == page.count(END) == 1
    assert placed(f"a\n{BEGIN}old\n{END}b\n", "new\n") == f"a\n{BEGIN}new\n{END}b\n"
    heads = [line.split(" | ")[0].lstrip("| ") for line in page.split("\n")]
    assert [part.name for part in PARTS if part.name not in heads] == []
    assert table([], []).startswith("| part |")
