"""Copies of used charts as boxes: all that is said of one stands in its box."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import fsmkit
from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.drawing import Drawing
from fsmkit.chart.drawing.states.folding import folded
from fsmkit.plugins import plugin
from fsmkit.system.views.drawing import draw
from tests.chart.drawing.geometry import picture

AXIS = """\
chart: Axis
events: {in: [go, halt]}
entries: {ENTRY: halted}
initial: idle
states:
  idle: {on: {go: moving}}
  moving: {on: {halt: halted, go: there}}
  halted: {on: {go: moving, halt: jammed}}
  there: {final: true}
  jammed: {final: true}
"""


def press(folder: Path, copies: int, entry: str = "resumed") -> Chart:
    """Return a chart that uses another so many times: one in the states, the others in regions."""
    (folder / "axis.yaml").write_text(AXIS.replace("ENTRY", entry), encoding="utf-8")
    path = folder / "press.yaml"
    path.write_text(
        "chart: Press\nevents: {in: [start, resume]}\ninitial: idle\nstates:\n"
        f"  idle: {{on: {{start: left, resume: left.{entry}}}}}\n"
        "  left: {use: axis.yaml, exits: {there: both, jammed: idle}}\n"
        "  both:\n    on: {done.state.both: idle}\n    regions:\n"
        f'      "axis[i in 0..{copies - 1}]": {{use: axis.yaml}}\n',
        encoding="utf-8",
    )
    return fsmkit.read_chart(path)


def dot(chart: Chart) -> str:
    """Return the text for Graphviz, with all copies folded."""
    return plugin(Drawing, "dot").draw(*folded(chart))


@pytest.mark.parametrize("copies", [2, 20, 200])
def test_points_stand_in_the_box_of_their_copy(tmp_path: Path, copies: int) -> None:
    chart = press(tmp_path, copies)
    shown, _ = folded(chart)
    text = dot(chart)
    nodes = dict(re.findall(r"^ +(s\d+) \[(.*)\];$", text, re.MULTILINE))
    points = set()
    for copy in shown.copies:
        box = nodes[f"s{copy.state}"]
        assert "3 states inside" in box
        assert f"<b>{copy.name}: Axis</b>" in box
        for state in shown.states[copy.state].children:
            points.add(state)
            assert f'port="p{state}"' in box
    assert len(points) == 3 * (copies + 1)
    assert not {f"s{point}" for point in points} & nodes.keys()
    ends = {int(port) for port in re.findall(r"s\d+:p(\d+)", text)}
    assert {shown.states[state].id for state in ends} == {
        "left.resumed", "left.there", "left.jammed",
    }  # fmt: skip


def test_an_active_copy_says_where_it_is(tmp_path: Path) -> None:
    chart = press(tmp_path, 2)
    active = frozenset({chart.state_index["left"], chart.state_index["left.moving"]})
    text = plugin(Drawing, "dot").draw(*folded(chart, (), active))
    assert "in moving" in text


@pytest.mark.external
@pytest.mark.usefixtures("dot")
@pytest.mark.parametrize("entry", ["resumed", "an_entry_point_with_a_long_name_of_its_own"])
def test_no_text_of_a_copy_leaves_its_box(tmp_path: Path, entry: str) -> None:
    chart = press(tmp_path, 3, entry)
    shown, _ = folded(chart)
    svg = draw(chart, Path("press.svg"))
    assert isinstance(svg, bytes)
    found = picture(svg)
    for copy in shown.copies:
        box, texts = found.boxes[f"s{copy.state}"], found.texts[f"s{copy.state}"]
        said = " ".join(text.text for text in texts)
        assert all(word in said for word in (entry, "there", "jammed", "Axis"))
        assert all(box.has(text) for text in texts)
