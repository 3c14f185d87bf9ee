"""Composite states drawn as boxes."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from devtools.random_charts.charts import documents
from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.drawing import Drawing
from fsmkit.chart.drawing.states.boxes import boxed, composites, shown
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.loading import load
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Document, Trigger
from fsmkit.plugins import plugin, plugins

FEEDER = Path(__file__).parents[3] / "machines/production_cell/feeder.yaml"
DRAWINGS = [drawing.name for drawing in plugins(Drawing)]
SITES = {
    "dot": r'id="s(\d+)"',
    "mermaid": r'" as s(\d+)\b|state s(\d+) <<',
    "plantuml": r'" as s(\d+)\b',
}


def hidden_in(chart: Chart, folds: frozenset[int]) -> set[int]:
    """Return the states that lie in folded ones."""
    return {state.index for state in chart.states[1:] if folds & set(chart.ancestors(state.index))}


def require_folded(chart: Chart, folds: frozenset[int]) -> None:
    """Require each shown state once, no hidden one at all, each arrow across a border."""
    made, hidden = boxed(chart, folds), hidden_in(chart, folds)
    assert shown(made) == {state.index for state in chart.states} - hidden
    for name in DRAWINGS:
        text = plugin(Drawing, name).draw(made, frozenset())
        found = [int("".join(each)) for each in re.findall(SITES[name], text)]
        assert sorted(found) == sorted(shown(made) - {0})
        ends = re.findall(r"^ *(\w+) -\S*> (\w+)", text, re.MULTILINE)
        assert not {f"s{state}" for state in hidden} & {end for arrow in ends for end in arrow}
    text = plugin(Drawing, "dot").draw(made, frozenset())
    for transition in chart.transitions:
        if transition.trigger is Trigger.INITIAL:
            continue
        source, *targets = (
            next((f for f in (*reversed(chart.ancestors(s)), s) if f in folds), s)
            for s in (transition.source, *transition.targets)
        )
        is_within = source != transition.source and set(targets) <= {source}
        assert bool(re.search(rf'[" #]t{transition.index}"', text)) is not is_within


@pytest.mark.parametrize("names", ["homing", "running", "homing working", "operational"])
def test_a_chart_of_the_cell_is_folded(names: str) -> None:
    chart = load(FEEDER)
    require_folded(chart, frozenset(chart.state_index[name] for name in names.split()))
    assert boxed(chart, ()) is chart


@pytest.mark.slow
@settings(max_examples=30, phases=(Phase.generate,))
@given(documents(), st.data())
def test_random_charts_are_folded(document: Document, data: st.DataObject) -> None:
    findings = Findings()
    chart = elaborate((document,), findings)
    if chart is None or findings.has_errors or not composites(chart):
        return
    require_folded(chart, data.draw(st.frozensets(st.sampled_from(sorted(composites(chart))))))


@pytest.mark.external
@pytest.mark.usefixtures("dot")
def test_graphviz_draws_what_is_folded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "feeder.svg"
    assert execute(["draw", str(FEEDER), "--fold", "running", "--out", str(out)]) == 0
    chart, text = load(FEEDER), out.read_text()
    drawn = {int(number) for number in re.findall(r'<g id="s(\d+)"', text)}
    assert chart.state_index["homing"] in drawn
    assert not drawn & hidden_in(chart, frozenset({chart.state_index["running"]}))
    assert " states inside</text>" in text
    assert execute(["draw", str(FEEDER), "--fold", "*"]) == 0
    dot = capsys.readouterr().out
    done = subprocess.run(["dot", "-Tsvg"], input=dot, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert not re.search(r'id="s\d+" class="cluster', done.stdout)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--fold", "homin"], "did you mean `homing`?"),
        (["--fold", "unhomed"], "`unhomed` of `Feeder` has no states in it"),
    ],
)
def test_what_cannot_be_folded(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["draw", str(FEEDER), *arguments]) == 2
    assert told in capsys.readouterr().err
