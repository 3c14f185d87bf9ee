"""The cell whose modules are filled with a chart for homing: the same states, proved alike."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

import fsmkit
from fsmkit.chart.drawing.states.folding import folded

CELL = Path(__file__).parents[2] / "machines/production_cell"
HOMING = """
chart: Homing
types: {Place: [between, home, offset, far]}
constants: {HOME: 0, OFFSET: 100, SLOW: 20}
inputs: {at: Place}
operations: ["seek(speed 0..100)", "goto(position 0..4000, speed 0..100)"]
events: {in: [limit, arrived]}
initial: seeking
states:
  seeking: {entry: seek(SLOW), on: {limit: backing_off}}
  backing_off:
    entry: goto(OFFSET, SLOW)
    on: {arrived: {if: at == Place.offset, target: settling}}
  settling: {entry: "goto(HOME, SLOW)", on: {arrived: {if: at == Place.home, target: there}}}
  there: {final: true}
"""
USED = """<state id="homing">
      <fk:use src="homing.yaml">
        <fk:with name="HOME" expr="HOME"/>
        <fk:with name="OFFSET" expr="OFFSET"/>
        <fk:with name="SLOW" expr="SLOW"/>
        <fk:bind name="at" to="at"/>
        <fk:bind name="seek" to="seek"/>
        <fk:bind name="goto" to="goto"/>
        <fk:bind name="limit" to="limit"/>
        <fk:bind name="arrived" to="arrived"/>
        <fk:exit name="there" target="inventory">
          <assign location="homed" expr="true"/>
          <send event="is_homed"/>
        </fk:exit>
      </fk:use>
"""
INSIDE = re.compile(r'<state id="homing" initial="seeking">\n')


@pytest.fixture
def cell(tmp_path: Path) -> Path:
    """Give the cell with a module whose state for homing is filled."""
    for name in ("cell", "feeder", "molder", "plant"):
        shutil.copy(CELL / f"{name}.yaml", tmp_path)
    (tmp_path / "homing.yaml").write_text(HOMING)
    text = (CELL / "module.scxml").read_text(encoding="utf-8")
    begin = text.index('<state id="homing" initial="seeking">')
    first = text.index('<state id="seeking">', begin)
    last = text.index("</state>\n    <!-- Nothing moves", begin)
    around = INSIDE.sub(USED, text[begin:first].rstrip() + "\n    ")
    (tmp_path / "module.scxml").write_text(text[:begin] + around + text[last:], encoding="utf-8")
    return tmp_path


def test_its_module_is_shorter_and_it_is_drawn_folded(cell: Path) -> None:
    before = (CELL / "module.scxml").read_text(encoding="utf-8").count("\n")
    assert (cell / "module.scxml").read_text(encoding="utf-8").count("\n") < before
    chart = fsmkit.read_chart(cell / "feeder.yaml")
    drawn, _ = folded(chart)
    assert len(drawn.states) == len(chart.states) - 3
    assert drawn.copies[0].chart == "Homing"


@pytest.mark.cc
@pytest.mark.slow
def test_it_has_the_states_of_the_cell(cell: Path) -> None:
    reports = [
        fsmkit.check(folder / "cell.yaml", engine="c", time="discrete") for folder in (CELL, cell)
    ]
    before, used = (report.exploration for report in reports)
    assert (used.states, used.depth) == (before.states, before.depth)
    assert [report.verdict for report in reports] == [fsmkit.Verdict.HOLDS] * 2
