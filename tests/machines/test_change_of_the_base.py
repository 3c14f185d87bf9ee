"""A transition added to the base chart appears in every derived chart and every output."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from fsmkit.chart.drawing.drawing import Drawing
from fsmkit.chart.loading import load
from fsmkit.cli import execute
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Origin
from fsmkit.plugins import plugin, plugins

CELL = Path(__file__).parents[2] / "machines" / "production_cell"
OLD = '<transition event="estop" target="emergency" fk:req="CELL-8"/>'
NEW = OLD + '\n    <transition event="door_opened" target="emergency"/>'
EVENT = '<fk:event direction="in" signature="stall"/>'


@pytest.fixture(name="cell")
def cell_with_a_changed_base(tmp_path: Path) -> Path:
    folder = shutil.copytree(CELL, tmp_path / "cell")
    base = folder / "module.scxml"
    text = base.read_text()
    assert OLD in text
    assert EVENT in text
    text = text.replace(OLD, NEW, 1)
    base.write_text(text.replace(EVENT, EVENT + EVENT.replace("stall", "door_opened"), 1))
    return folder


@pytest.mark.parametrize("name", ["feeder", "molder"])
def test_it_is_inherited(cell: Path, name: str) -> None:
    chart = load(cell / f"{name}.yaml")
    before = load(CELL / f"{name}.yaml")
    (added,) = [t for t in chart.transitions if "door_opened" in t.descriptors]
    assert chart.states[added.source].id == "operational"
    assert [chart.states[target].id for target in added.targets] == ["emergency"]
    assert added.origin is Origin.INHERITED
    assert added.span.source.name.endswith("module.scxml")
    assert len(chart.transitions) == len(before.transitions) + 1


@pytest.mark.parametrize("name", ["feeder", "molder"])
@pytest.mark.parametrize("target", ["c", "python"])
def test_every_target_writes_it(cell: Path, name: str, target: str) -> None:
    written, unchanged = (
        plugin(Target, target).generate(load(folder / f"{name}.yaml"), Findings(), {})
        for folder in (cell, CELL)
    )
    assert written is not None
    assert unchanged is not None
    assert "door_opened" in "".join(written.files.values()).lower()
    assert "door_opened" not in "".join(unchanged.files.values()).lower()


@pytest.mark.parametrize("name", ["feeder", "molder"])
@pytest.mark.parametrize("drawing", plugins(Drawing), ids=lambda drawing: drawing.name)
def test_every_drawing_shows_it(cell: Path, name: str, drawing: Drawing) -> None:
    assert "door_opened" in drawing.draw(load(cell / f"{name}.yaml"), frozenset())


@pytest.mark.parametrize("name", ["feeder", "molder"])
def test_show_tells_where_it_comes_from(
    cell: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["show", str(cell / f"{name}.yaml"), "--origin"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if "door_opened" in line]
    assert any("inherited" in line and "module.scxml:" in line for line in lines), lines
