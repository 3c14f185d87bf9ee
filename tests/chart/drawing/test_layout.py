"""Layouts as a designer makes them: equal regions, labels off borders, and nothing lost."""

from __future__ import annotations

import html
import re
import subprocess
from pathlib import Path
from random import Random

import pytest

import fsmkit
from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.drawing import Drawing
from fsmkit.chart.drawing.fitting import fitted
from fsmkit.chart.drawing.layout import improve_layout
from fsmkit.chart.loading import load
from fsmkit.document.document import Kind
from fsmkit.plugins import plugin
from fsmkit.system.views.drawing import draw
from tests.chart.drawing.geometry import Box, Picture, picture
from tests.inspector.conftest import REGIONS, elaborated

pytestmark = [pytest.mark.external, pytest.mark.usefixtures("dot")]
ROOT = Path(__file__).parents[3]
CELL = ROOT / "machines/production_cell"
CHARTS = [
    ROOT / "tests/golden/diagram/lamp.yaml",
    *(CELL / f"{name}.yaml" for name in ("feeder", "molder", "sorter", "supervisor")),
]


def seen(model: fsmkit.Chart | fsmkit.System) -> Picture:
    """Return the parts of a picture."""
    svg = draw(model, Path("x.svg"))
    assert isinstance(svg, bytes)
    return picture(svg)


def regions(chart: Chart, found: Picture) -> list[list[Box]]:
    """Return the boxes of the regions of each parallel state."""
    return [
        [found.boxes[f"s{child}"] for child in state.children if chart.states[child].children]
        for state in chart.states
        if state.kind is Kind.PARALLEL
    ]


def crossing(found: Picture) -> list[tuple[str, str]]:
    """Return the texts that stand on the border of a cluster."""
    return [
        (own, text.text)
        for own, texts in found.texts.items()
        for text in texts
        for border in found.clusters().values()
        if text.text.strip() and border.meets(text) and not border.has(text)
    ]


def parallel(random: Random, count: int, depth: int) -> list[str]:
    """Return lines of regions of several lengths, some of which have regions themselves."""
    lines = []
    for number in range(count):
        name = f"r{depth}_{number}_{random.randrange(10**6)}"
        states = [f"{name}_{k}" for k in range(random.randrange(1, 6))]
        lines += [f"{name}:", f"  initial: {states[0]}", "  states:"]
        for state, after in zip(states, [*states[1:], states[0]], strict=True):
            lines += [f"    {state}:", f"      on: {{go: {after}}}"]
            if depth and random.random() < 0.4:
                inner = parallel(random, 2, depth - 1)
                lines += ["      regions:", *(f"        {line}" for line in inner)]
    return lines


def nested(seed: int, count: int) -> Chart:
    """Return a chart with so many regions side by side."""
    lines = parallel(Random(seed), count, 2)
    inner = "\n".join(f"      {line}" for line in lines)
    head = "chart: Many\nevents: {in: [go, stop]}\ninitial: p\nstates:\n"
    return elaborated(
        f"{head}  p:\n    on: {{stop: q}}\n    regions:\n{inner}\n  q: {{on: {{go: p}}}}\n"
    )


@pytest.mark.parametrize(
    ("seed", "count"),
    [(0, 2), (1, 2), (2, 5), (3, 5), pytest.param(4, 20, marks=pytest.mark.slow)],
)
def test_regions_are_equally_high(seed: int, count: int) -> None:
    chart = nested(seed, count)
    found = seen(chart)
    for boxes in regions(chart, found):
        assert len(boxes) > 1
        assert max(box.top for box in boxes) - min(box.top for box in boxes) < 0.5
        assert max(box.bottom for box in boxes) - min(box.bottom for box in boxes) < 0.5
    for state in chart.states[1:]:  # the title and what is in it are in its border
        parent = found.boxes.get(f"s{state.parent}")
        assert parent is None or parent.has(found.boxes[f"s{state.index}"])
    assert crossing(found) == []


@pytest.mark.parametrize(
    "crossings", [{0: 1, 1: 2}, {1: 0, 2: 1}, {0: 2, 1: 1}], ids=["right", "left", "far"]
)
def test_regions_with_arrows_between_them_are_equally_high(crossings: dict[int, int]) -> None:
    text = "chart: Crossed\nevents: {in: [go, cross]}\nstates:\n  p:\n    regions:\n"
    for n in range(3):
        cross = f", cross: {{target: b{crossings[n]}, ordered: true}}" if n in crossings else ""
        states = f"a{n}: {{on: {{go: b{n}{cross}}}}}, b{n}: {{on: {{go: c{n}}}}}, c{n}: {{}}"
        text += f"      r{n}: {{states: {{{states}}}}}\n"
    chart = elaborated(text)
    (boxes,) = regions(chart, seen(chart))
    assert max(box.top for box in boxes) - min(box.top for box in boxes) < 0.5
    assert max(box.bottom for box in boxes) - min(box.bottom for box in boxes) < 0.5


@pytest.mark.parametrize("path", CHARTS, ids=lambda path: path.stem)
def test_no_label_stands_on_a_border(path: Path) -> None:
    chart = load(path)
    found = seen(chart)
    assert crossing(found) == []
    for boxes in regions(chart, found):
        assert max(box.height for box in boxes) - min(box.height for box in boxes) < 0.5


def test_names_of_nodes_stay_in_the_state_around_them() -> None:
    chart = load(CELL / "molder.yaml")
    found = seen(chart)
    choices = [s for s in chart.states if s.kind is Kind.CHOICE]
    assert choices
    for state in choices:
        around = found.boxes[f"s{state.parent}"]
        assert all(around.has(text) for text in found.texts[f"s{state.index}"])


@pytest.mark.slow
def test_random_charts_lose_nothing_and_most_labels_are_free() -> None:
    before = after = 0
    for number in range(16):
        text = plugin(Drawing, "dot").draw(random_case(77, number).chart, frozenset())
        plain = picture(fitted(ran("dot", "-Tsvg", "-Tjson", text=text)))
        better = seen(random_case(77, number).chart)
        assert named(plain.boxes) == named(better.boxes)
        assert said(plain) == said(better)
        for own, box in plain.boxes.items():
            if "cluster" not in box.kind and own.startswith("s"):  # also with two peripheries
                assert box.height == pytest.approx(better.boxes[own].height, abs=1)
        before += len(crossing(plain))
        after += len(crossing(better))
    assert after * 4 < before


HOSTILE = (
    'bb="0,0,1,1"', "subgraph cluster_1 {", '"];', "a\\\nb", "<b>", "lp=<1,1>", "} {", "\\", "]",
    "a -> b", "}\n{\n",
)  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_no_name_is_taken_for_the_text_of_a_layout(name: str) -> None:
    text = plugin(Drawing, "dot").draw(elaborated(REGIONS), frozenset())
    for word in ("motion", "lamp", "idle", "working"):
        text = text.replace(f">{word}<", f">x{html.escape(name.splitlines()[0])}<")
        quoted = name.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
        text = text.replace(f'tooltip="{word},', f'tooltip="{quoted},')
    layout = ran("dot", "-Tdot", "-Tjson", text=text)
    found = picture(fitted(ran("neato", "-n2", "-Tsvg", "-Tjson", text=improve_layout(layout))))
    plain = picture(fitted(ran("dot", "-Tsvg", "-Tjson", text=text)))
    assert said(found) == said(plain)
    assert named(found.boxes) == named(plain.boxes)


@pytest.mark.parametrize("name", ["cell", "ring"])
def test_a_system_is_drawn_like_a_chart(name: str) -> None:
    system = fsmkit.read_system(CELL / f"{name}.yaml")
    found = seen(system)
    assert crossing(found) == []
    for number, machine in enumerate(system.machines):
        texts = [text.text for text in found.texts[f"m{number}"]]
        assert texts == [machine.name, machine.chart.name]
        assert all(found.boxes[f"m{number}"].has(text) for text in found.texts[f"m{number}"])


def test_a_picture_is_no_larger_than_what_graphviz_makes(tmp_path: Path) -> None:
    chart = load(CELL / "molder.yaml")
    text = plugin(Drawing, "dot").draw(chart, frozenset())
    sizes = []
    for svg in (ran("dot", "-Tsvg", text=text), draw(chart, tmp_path / "x.svg")):
        assert isinstance(svg, bytes)
        sizes.append([int(n) for n in re.findall(rb'(?:width|height)="(\d+)pt"', svg)])
    assert all(new <= old * 1.02 for old, new in zip(*sizes, strict=True))


def said(found: Picture) -> list[str]:
    return sorted(text.text for texts in found.texts.values() for text in texts)


def named(boxes: dict[str, Box]) -> set[str]:
    """Return the ids of states; Graphviz numbers all others anew."""
    return {own for own in boxes if re.fullmatch(r"s\d+", own)}


def ran(*command: str, text: str) -> bytes:
    done = subprocess.run(command, input=text.encode(), capture_output=True, check=True)
    assert done.stderr == b""
    return done.stdout


def test_without_json_the_layout_is_drawn_as_it_is() -> None:
    text = plugin(Drawing, "dot").draw(load(CHARTS[0]), frozenset())
    content = ran("dot", "-Tdot", "-Tjson", text=text)
    plain = picture(fitted(ran("dot", "-Tsvg", "-Tjson", text=text)))
    layout = improve_layout(content[: content.rindex(b"}")])
    found = picture(fitted(ran("neato", "-n2", "-Tsvg", "-Tjson", text=layout)))
    assert said(found) == said(plain)
    for own in named(plain.boxes):
        assert found.boxes[own].height == pytest.approx(plain.boxes[own].height, abs=1)
