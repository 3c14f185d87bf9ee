from __future__ import annotations

from itertools import combinations
from pathlib import Path

import pytest
from lxml import etree

from fsmkit.diagnostics import Findings
from fsmkit.export.uppaal.layout import COMMITTED, TO_HUB, block, hubs_of, labels
from fsmkit.export.uppaal.network import Edge, Template
from fsmkit.export.uppaal.translate import translate
from fsmkit.system.any_file import load_any
from fsmkit.verify.statespace.closed_system import close
from tests.export.uppaal_picture import label_boxes, location_boxes, overlap, picture

CELL = Path(__file__).parents[2] / "machines/production_cell"
needs_dot = pytest.mark.external


def drawn(name: str) -> Template:
    (template,) = translate(close(load_any(CELL / f"{name}.yaml", Findings()))).templates
    return template


@pytest.fixture(scope="module", params=["feeder", "molder"])
def template(request: pytest.FixtureRequest) -> Template:
    return drawn(request.param)


@needs_dot
def test_nothing_lies_on_a_label(template: Template) -> None:
    boxes = [*label_boxes(template), *location_boxes(template)]
    assert len(boxes) > 300
    upon = [(a, b) for (one, a), (other, b) in combinations(boxes, 2) if overlap(one, other)]
    assert upon == []


@needs_dot
def test_edges_to_hubs_are_one_grey_bend_for_each_source(template: Template) -> None:
    names = {loc.id: loc.name for loc in template.locations}
    hubs = hubs_of(template)
    assert {"error", "latched", "paused"} <= {names[hub] for hub in hubs}
    bends: dict[tuple[str, str], set[object]] = {}
    for edge in template.edges:
        if edge.target in hubs and edge.source != edge.target:
            assert edge.color == TO_HUB
            bends.setdefault((edge.source, edge.target), set()).add(edge.nails)
    assert len(bends) > 20
    assert all(len(of) == 1 and len(next(iter(of))) == 1 for of in bends.values())  # type: ignore[arg-type]


@needs_dot
def test_committed_locations_have_a_color(template: Template) -> None:
    assert {loc.color for loc in template.locations if loc.committed} == {COMMITTED}


@needs_dot
def test_a_drawing_fits_on_a_large_screen(template: Template) -> None:
    root = etree.fromstring(picture(template).encode())
    assert int(root.get("width", "0")) < 5000
    assert int(root.get("height", "0")) < 3200


@needs_dot
def test_the_picture_shows_all_there_is(template: Template) -> None:
    root = etree.fromstring(picture(template).encode())
    texts = {text for one in root.iter("{*}text") if (text := one.text)}
    wanted = {line for edge in template.edges for text in labels(edge).values()
              for line in text.split("\n")}  # fmt: skip
    assert wanted <= texts
    assert {loc.name for loc in template.locations if loc.name} <= texts


def test_without_graphviz_a_grid_is_as_free(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    template = drawn("feeder")
    boxes = [*label_boxes(template), *location_boxes(template)]
    assert not any(overlap(a, b) for (a, _), (b, _) in combinations(boxes, 2))


# --- parts ---


def test_a_long_label_has_several_lines() -> None:
    edge = Edge("a", "b", update=tuple(f"variable_{n} = {n}" for n in range(6)), comment="go")
    (text,) = [text for text in labels(edge).values() if "variable" in text]
    assert max(map(len, text.split("\n"))) <= 52
    assert text.replace("\n", " ") == ", ".join(edge.update)
    assert block(edge, 40).height == 17 * (1 + len(text.split("\n")))
