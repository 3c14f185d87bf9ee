"""Drawings of hundreds of states: laid out by composite states, folded, and changed by edits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.graphviz import bundled, engine
from fsmkit.chart.drawing.positions import nesting, pieces, routing
from fsmkit.chart.drawing.positions.placement import Rect
from fsmkit.chart.drawing.states.boxes import MOST_OPENED, composites, opening_folds, shown
from fsmkit.system.views.drawing import draw_kept
from tests.chart.drawing.test_positions import check, moved
from tests.inspector.conftest import elaborated

pytestmark = [pytest.mark.external, pytest.mark.usefixtures("dot")]


def rings(groups: int, size: int, more: str = "") -> Chart:
    """Return a chart of composite states in a ring, each a ring of states."""
    lines = ["chart: Rings", "events: {in: [go, back, ring, jump]}", "states:"]
    for group in range(groups):
        lines += [f"  g{group}:", f"    on: {{ring: g{(group + 1) % groups}}}", "    states:"]
        lines += (
            f"      g{group}s{n}: {{on: {{go: g{group}s{(n + 1) % size}, back: g{group}s"
            f"{max(n - 1, 0)}{more if (group, n) == (0, 1) else ''}}}}}"
            for n in range(size)
        )
    return elaborated("\n".join(lines))


def test_composites_in_a_ring_are_drawn() -> None:
    """Graphviz ends with a segmentation fault or without memory on 30 of them as one graph."""
    chart = rings(30, 9)
    svg, placement = draw_kept(chart, None)
    check(chart, svg, placement)
    boxes = placement.boxes.values()
    width = max(b.right for b in boxes) - min(b.x for b in boxes)
    height = max(b.bottom for b in boxes) - min(b.y for b in boxes)
    assert 0.3 < width / height < 4


def test_an_edit_of_many_states_draws_few(monkeypatch: pytest.MonkeyPatch) -> None:
    _, first = draw_kept(rings(30, 9), None)
    runs: list[str] = []

    def counted(text: str, *rest: Any, **more: Any) -> bytes:
        runs.append(text)
        return run(text, *rest, **more)

    run = engine.run_graphviz
    for module in (pieces, routing, nesting):
        monkeypatch.setattr(module, "run_graphviz", counted)
    _, second = draw_kept(rings(30, 9), first)
    assert runs == []
    assert second.arrows == first.arrows
    svg, third = draw_kept(rings(30, 9, ", jump: g7s4"), second)
    assert 'class="edge' in svg
    assert len(third.arrows) == len(first.arrows) + 1
    assert moved(second, third) == set()
    assert 1 <= len(runs) <= 2 + routing.ROUNDS
    assert all(text.count("pos=") < 150 for text in runs)


@pytest.mark.parametrize(
    ("groups", "size", "folds"), [(3, 4, 0), (30, 9, 0), (30, 10, 30), (1, 400, 1), (120, 3, 120)]
)
def test_large_charts_open_folded(groups: int, size: int, folds: int) -> None:
    chart = rings(groups, size)
    found = opening_folds(chart)
    assert len(found) == folds
    assert not folds or len(shown(chart, found)) <= max(MOST_OPENED, groups) + 1


def test_outer_levels_open_while_there_is_room() -> None:
    inner = ", ".join(f"x{{0}}y{{1}}z{n}: {{{{}}}}" for n in range(10))
    middle = "\n".join(
        f"      x{x}y{y}: {{states: {{{inner.format(x, y)}}}}}" if y else f"  x{x}:\n    states:"
        for x in range(9)
        for y in range(5)
    )
    chart = elaborated(f"chart: Levels\nevents: {{}}\nstates:\n{middle}\n")
    found = opening_folds(chart)
    assert {chart.states[state].id for state in found} == {
        f"x{x}y{y}" for x in range(9) for y in range(1, 5)
    }


def test_folded_states_keep_the_places_inside() -> None:
    chart = rings(8, 5)
    fold = composites(chart)
    open_ = fold - {chart.state_index["g3"]}
    _, first = draw_kept(chart, None, fold=fold)
    _, second = draw_kept(chart, first, fold=open_)
    assert second.boxes["g3"].height > 3 * first.boxes["g3"].height
    for name in ("g3s0", "g3s4", "g3 initial"):
        assert second.boxes["g3"].holds(*second.boxes[name].centre)
    _, third = draw_kept(chart, second, fold=fold)
    assert moved(second, third) == set()
    assert third.boxes["g3"].height == first.boxes["g3"].height
    _, fourth = draw_kept(chart, third, fold=open_)
    assert fourth.boxes == second.boxes


def test_an_opened_state_moves_what_is_below() -> None:
    chart = rings(6, 6)
    fold = composites(chart)
    _, first = draw_kept(chart, None, fold=fold)
    _, second = draw_kept(chart, first, fold=fold - {chart.state_index["g2"]})
    names = [f"g{n}" for n in range(6)]
    for number, name in enumerate(names):
        for other in names[number + 1 :]:
            assert not second.boxes[name].meets(second.boxes[other])
    below = {n for n in names if first.boxes[n].y > first.boxes["g2"].bottom}
    shifts = {round(second.boxes[n].y - first.boxes[n].y) for n in below}
    assert len(shifts) == 1


@pytest.mark.parametrize("count", range(1, 9))
def test_arrows_avoid_states_between(count: int) -> None:
    nodes = {
        f"n{n}": routing.Node(Rect(n * 90.0, 0, 50, 30), 'shape=box, fixedsize=true, label=""')
        for n in range(count + 2)
    }
    link = routing.Link("a", "n0", f"n{count + 1}")
    (arrow,) = routing.route('digraph "x" {', [link], nodes).values()
    assert arrow.heads[0][0] == "e"
    met = routing._met(arrow, link, nodes)
    assert met == set()


def test_arrows_of_the_same_ends_are_apart() -> None:
    nodes = {
        name: routing.Node(Rect(x, 0, 50, 30), 'shape=box, fixedsize=true, label=""')
        for name, x in (("a", 0.0), ("b", 200.0))
    }
    links = [routing.Link(f"l{n}", *(("a", "b") if n % 2 else ("b", "a"))) for n in range(3)]
    found = routing.route('digraph "x" {', links, nodes)
    heights = sorted(sum(y for _, y in arrow.points[1:-1]) for arrow in found.values())
    assert all(low + 10 < high for low, high in pairwise(heights))


def test_the_program_draws_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the bundled Graphviz the program measures and routes."""
    monkeypatch.setattr(bundled, "missing_part", lambda: "this test does without it")
    monkeypatch.setattr(pieces, "_pieces", {})
    chart = rings(3, 4)
    svg, placement = draw_kept(chart, None)
    check(chart, svg, placement)
    _, again = draw_kept(chart, placement)
    assert again.arrows == placement.arrows


@pytest.mark.parametrize("text", ["a%b %s %% %(x)s", "</g></svg>", 'id="k0" href="#0"', "&#37;"])
def test_pieces_keep_hostile_texts(text: str) -> None:
    chart = rings(2, 2)
    states = [replace(state, doc=text) for state in chart.states]
    states[2] = replace(states[2], id=text)
    names: Sequence[str] = [state.id for state in states]
    odd = replace(chart, states=tuple(states))
    svg, placement = draw_kept(odd, None)
    assert text in names
    assert draw_kept(odd, placement)[0] == svg
