"""The bundled Graphviz draws what the program draws; without both, messages say what to install."""

from __future__ import annotations

import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.graphviz import bundled
from fsmkit.chart.drawing.graphviz.engine import run_graphviz, why_no_drawing
from fsmkit.chart.loading import load
from fsmkit.diagnostics import FsmkitError
from fsmkit.system.views.drawing import draw
from tests import needs
from tests.chart.drawing.geometry import Picture, picture
from tests.chart.drawing.test_layout import CHARTS, HOSTILE, crossing, nested, said
from tests.inspector.conftest import REGIONS, elaborated


@pytest.fixture
def no_program(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Hide all programs of the machine."""
    needs.need(bundled.missing_part() is None, "the bundled Graphviz: make graphviz")
    monkeypatch.setenv("PATH", str(tmp_path))


def seen(chart: Chart) -> Picture:
    svg = draw(chart, Path("x.svg"))
    assert isinstance(svg, bytes)
    return picture(svg)


def check(chart: Chart, found: Picture) -> None:
    """Check that each state lies in its parent, and no text on a border."""
    for state in chart.states[1:]:
        assert f"s{state.index}" in found.boxes
        around = found.boxes.get(f"s{state.parent}")
        assert around is None or around.has(found.boxes[f"s{state.index}"])
    assert crossing(found) == []


@pytest.mark.external
@pytest.mark.usefixtures("no_program")
@pytest.mark.parametrize("path", CHARTS, ids=lambda path: path.stem)
def test_draws_charts_without_the_program(path: Path) -> None:
    chart = load(path)
    check(chart, seen(chart))
    assert why_no_drawing() is None


@pytest.mark.external
@pytest.mark.usefixtures("no_program")
def test_draws_regions_and_systems_without_the_program() -> None:
    chart = nested(3, 5)
    check(chart, seen(chart))


@pytest.mark.external
@pytest.mark.slow
def test_random_charts_have_the_same_texts_as_by_the_program(
    dot: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert dot
    needs.need(bundled.missing_part() is None, "the bundled Graphviz: make graphviz")
    charts = [random_case(78, number).chart for number in range(12)]
    programs = [said(seen(chart)) for chart in charts]
    monkeypatch.setenv("PATH", str(tmp_path))
    assert [said(seen(chart)) for chart in charts] == programs


@pytest.mark.external
@pytest.mark.usefixtures("no_program")
@pytest.mark.parametrize("name", [*HOSTILE, "größe", "状態", "\N{GRINNING FACE}", "&amp;", "a\0b"])
def test_draws_any_name(name: str) -> None:
    text = REGIONS.replace("chart: ", f"doc: {name!a}\nchart: ")
    chart = elaborated(text)
    for state in chart.states[1:]:
        object.__setattr__(state, "id", f"{name}{state.index}")
    found = seen(chart)
    assert {f"s{state.index}" for state in chart.states[1:]} <= found.boxes.keys()


@pytest.mark.external
@pytest.mark.usefixtures("no_program")
def test_equal_texts_give_equal_drawings_in_all_threads() -> None:
    chart = load(CHARTS[0])
    with ThreadPoolExecutor(4) as pool:
        drawings = set(pool.map(lambda _: draw(chart, Path("x.svg")), range(8)))
    assert len(drawings) == 1


@pytest.mark.external
@pytest.mark.usefixtures("no_program")
@pytest.mark.parametrize(
    ("text", "reason"),
    [("digraph {", "syntax error"), ("", "no reason was given"), ("digraph {a -> }", "syntax")],
)
def test_rejects_what_is_no_graph(text: str, reason: str) -> None:
    with pytest.raises(FsmkitError) as raised:
        run_graphviz(text, ("svg",))
    assert raised.value.diagnostics[0].rule.name == "drawing-failed"
    assert reason in raised.value.diagnostics[0].message
    assert run_graphviz("digraph {a}", ("plain",)).startswith(b"graph 1 ")  # still works


def test_without_module_and_program_the_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(bundled, "MODULE", tmp_path / "missing")
    with pytest.raises(FsmkitError) as raised:
        run_graphviz("digraph {a}", ("svg",))
    (finding,) = raised.value.diagnostics
    assert finding.rule.name == "missing-graphviz"
    assert "make graphviz" in finding.message
    assert "apt install graphviz" in (finding.help or "")
    reason = why_no_drawing()
    assert reason is not None
    assert "Install Graphviz" in reason


def test_without_wasmtime_the_message_names_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    for name in ("MODULE", "NAMES"):
        monkeypatch.setattr(bundled, name, Path(__file__))
    monkeypatch.setattr(bundled, "find_spec", lambda _: None)
    assert "the package `wasmtime`" in (why_no_drawing() or "")


@pytest.mark.external
@pytest.mark.usefixtures("no_program")
def test_a_limit_of_time_ends_the_wait() -> None:
    text = "digraph {" + "".join(f"a{k} -> a{k * 7 % 400};" for k in range(400)) + "}"
    with pytest.raises(FsmkitError, match=r"more than 1e-06 s"):
        run_graphviz(text, ("svg",), seconds=1e-6)


def test_the_program_comes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    needs.need(shutil.which("dot") is not None, "dot")
    monkeypatch.setattr(bundled, "MODULE", Path("missing"))
    assert why_no_drawing() is None
