"""Drawings that keep their positions while a chart is edited."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.positions.placement import (
    Arrow,
    Placement,
    Rect,
    hints_path,
    hints_text,
    placement_from_json,
    read_hints,
    renamed,
)
from fsmkit.chart.drawing.positions.placing import Item, place
from fsmkit.chart.loading import load
from fsmkit.system.views.drawing import draw_kept
from tests.chart.drawing.geometry import picture
from tests.chart.drawing.test_layout import CHARTS, HOSTILE, crossing
from tests.inspector.conftest import REGIONS, elaborated

MIXER = """
chart: Mixer
events: {in: [fill, full, stir, stop, fault, reset]}
initial: working
states:
  working:
    on: {fault: broken}
    regions:
      tank:
        initial: empty
        states:
          empty: {on: {fill: filling}}
          filling: {on: {full: empty}}
      motor:
        initial: resting
        states:
          resting: {on: {stir: turning}}
          turning: {on: {stop: resting}}
  broken: {on: {reset: working}}
"""


def moved(before: Placement, after: Placement) -> set[str]:
    """Return the boxes of both that are elsewhere."""
    return {
        name
        for name, box in after.boxes.items()
        if name in before.boxes
        and max(abs(box.x - before.boxes[name].x), abs(box.y - before.boxes[name].y)) > 0.5
    }


def check(chart: Chart, svg: str, placement: Placement) -> None:
    """Check that states lie in their parents and do not overlap."""
    found = picture(svg)
    for state in chart.states[1:]:
        around = found.boxes.get(f"s{state.parent}")
        assert around is None or around.has(found.boxes[f"s{state.index}"])
    for state in chart.states:
        inner = [placement.boxes[chart.states[child].id] for child in state.children]
        for number, one in enumerate(inner):
            assert not any(one.meets(other) for other in inner[number + 1 :])


@pytest.mark.external
@pytest.mark.usefixtures("dot")
@pytest.mark.parametrize("path", CHARTS, ids=lambda path: path.stem)
def test_nothing_moves_without_a_change(path: Path) -> None:
    chart = load(path)
    _, first = draw_kept(chart, None)
    kept = placement_from_json(json.loads(hints_text(first)))
    svg, second = draw_kept(chart, kept)
    assert second.boxes.keys() == first.boxes.keys()
    assert second.arrows.keys() == first.arrows.keys()
    assert moved(first, second) == set()
    check(chart, svg, second)
    assert len(crossing(picture(svg))) == 0


@pytest.mark.external
@pytest.mark.usefixtures("dot")
def test_a_new_state_is_near_its_source_and_others_stay() -> None:
    _, before = draw_kept(elaborated(MIXER), None)
    text = MIXER.replace("resting}}\n", "resting, fault: worn}}\n          worn: {}\n", 1)
    chart = elaborated(text)
    svg, after = draw_kept(chart, before)
    assert moved(before, after) <= {"broken", "working > broken label"}  # `working` grew
    assert after.boxes.keys() - before.boxes.keys() == {"worn"}
    (x, y), (left, top) = after.boxes["worn"].centre, after.boxes["turning"].centre
    assert abs(x - left) + abs(y - top) < 150
    check(chart, svg, after)


@pytest.mark.external
@pytest.mark.usefixtures("dot")
def test_a_composite_state_grows_and_pushes_its_neighbours() -> None:
    _, before = draw_kept(elaborated(MIXER), None)
    more = "".join(f"          more{k}: {{on: {{stop: more{k + 1}}}}}\n" for k in range(6))
    text = MIXER.replace("      motor:", f"{more}          more6: {{}}\n      motor:")
    text = text.replace("{full: empty}", "{full: empty, stop: more0}")
    chart = elaborated(text)
    svg, after = draw_kept(chart, before)
    check(chart, svg, after)
    assert after.boxes["tank"].height > before.boxes["tank"].height
    assert not moved(before, after) & {"empty", "filling", "tank", "working"}


@pytest.mark.external
@pytest.mark.usefixtures("dot")
def test_wrapping_states_leaves_them_where_they_are() -> None:
    text = "chart: W\nevents: {in: [go]}\ninitial: a\nstates:\n  a: {on: {go: b}}\n"
    _, before = draw_kept(elaborated(text + "  b: {on: {go: a}}\n"), None)
    wrapped = text + "  c:\n    initial: b\n    states:\n      b: {on: {go: a}}\n"
    chart = elaborated(wrapped)
    svg, after = draw_kept(chart, before)
    assert moved(before, after) & {"b"} == set()
    assert after.boxes["c"].holds(*after.boxes["b"].centre)
    check(chart, svg, after)


@pytest.mark.external
@pytest.mark.usefixtures("dot")
@pytest.mark.parametrize("name", HOSTILE)
def test_any_name_keeps_its_place(name: str) -> None:
    chart = elaborated(REGIONS)
    for state in chart.states[1:]:
        object.__setattr__(state, "id", f"{name}{state.index}")
    _, before = draw_kept(chart, None)
    kept = placement_from_json(json.loads(hints_text(before)))
    _, after = draw_kept(chart, kept)
    assert after.boxes.keys() == before.boxes.keys()
    assert moved(before, after) == set()


def test_hints_are_read_back(tmp_path: Path) -> None:
    chart = tmp_path / "gate.yaml"
    assert hints_path(chart).name == "gate.layout.json"
    assert read_hints(chart) is None
    arrow = Arrow(((0, 1), (2, 3), (4, 5), (6, 7)), (("e", 8, 9),), (1, 2))
    placement = Placement({"a b": Rect(1, 2, 3, 4)}, {"a > b": arrow})
    hints_path(chart).write_text(hints_text(placement), encoding="utf-8")
    assert read_hints(chart) == placement


@pytest.mark.parametrize(
    "content",
    [
        "", "{", "[]", "{}", '{"layout": 2}', '{"layout": 1}', '{"layout": 1, "boxes": []}',
        '{"layout": 1, "boxes": {"a": [1, 2, 3]}}',
        '{"layout": 1, "boxes": {"a": [1, 2, 3, true]}}',
        '{"layout": 1, "boxes": {"a": [1, 2, 3, 1e400]}}', "[" * 100_000,
        '{"layout": 1, "boxes": {}, "arrows": {"a": {"points": [[1]], "heads": []}}}',
        '{"layout": 1, "boxes": {}, "arrows": {"a": {"points": [], "heads": [["x", 1, 2]]}}}',
    ],
)  # fmt: skip
def test_broken_hints_are_no_hints(content: str, tmp_path: Path) -> None:
    hints_path(tmp_path / "a.yaml").write_text(content, encoding="utf-8")
    assert read_hints(tmp_path / "a.yaml") is None


def test_a_rename_keeps_the_place() -> None:
    box, arrow = Rect(1, 2, 3, 4), Arrow(())
    before = Placement({"a": box, "a initial": box, "ab": box}, {"a > b 2": arrow})
    after = renamed(before, "a", "c")
    assert after == Placement({"c": box, "c initial": box, "ab": box}, {"c > b 2": arrow})


def test_stale_hints_are_of_use_for_what_is_left() -> None:
    old = {"a": Rect(100, 100, 60, 30), "gone": Rect(100, 100, 60, 30)}
    items = [Item("a", "", 60, 30), Item("b", "", 60, 30, ("a",)), Item("c", "", 60, 30, ("gone",))]
    boxes = place(items, old)
    assert boxes["a"] == old["a"]
    assert not boxes["b"].meets(boxes["c"])
    assert not boxes["a"].meets(boxes["b"])


def test_boxes_that_overlap_in_hints_are_parted() -> None:
    same = Rect(10, 10, 60, 30)
    items = [Item(name, "", 60, 30) for name in "abcdefgh"]
    boxes = [*place(items, {item.name: same for item in items}).values()]
    assert boxes[0] == same
    assert not any(a.meets(b) for k, a in enumerate(boxes) for b in boxes[k + 1 :])
    assert replace(same, x=11).right == 71
