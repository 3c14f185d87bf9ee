from __future__ import annotations

import os
import re
import shutil
import subprocess
import textwrap
from pathlib import Path

import pytest
from hypothesis import given, settings

from devtools.random_charts.charts import documents
from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.drawing import Drawing
from fsmkit.chart.drawing.states.labels import MOST_LINES, WIDTH, box_lines, is_inside, label
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.format import format_statement
from fsmkit.chart.loading import load
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Document, Kind, Trigger
from fsmkit.emit import dot as dot_texts
from fsmkit.language.statements.tokens import ASSIGNMENT
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.plugins import plugin, plugins

ROOT = Path(__file__).parents[3]
GOLDEN = ROOT / "tests/golden/diagram"
CHARTS = [
    GOLDEN / "lamp.yaml",
    *sorted((ROOT / "machines/production_cell").glob("[fmp]*.yaml")),
]
DRAWINGS = [drawing.name for drawing in plugins(Drawing)]
needs_dot = pytest.mark.usefixtures("dot")


def drawn(name: str, chart: Chart, *active: str) -> str:
    states = {chart.state_index[state] for state in active}
    around = {outer for state in states for outer in chart.ancestors(state)}
    return plugin(Drawing, name).draw(chart, frozenset(states | around))


@pytest.mark.parametrize("name", ["dot", "mermaid", "plantuml"])
def test_golden(name: str) -> None:
    path = GOLDEN / f"lamp{plugin(Drawing, name).suffixes[0]}"
    text = drawn(name, load(GOLDEN / "lamp.yaml"), "left_one", "right_one")
    if os.environ.get("FSMKIT_BLESS"):
        path.write_text(text)
    assert text == path.read_text(), "run `make bless` and look at the difference"


def elements(chart: Chart) -> list[str]:
    """Return the ids of the elements of a drawing in SVG."""
    done = subprocess.run(
        ["dot", "-Tsvg"], input=drawn("dot", chart), capture_output=True, text=True, check=True
    )
    return re.findall(r'<g id="([^"]*)"', done.stdout)


def require_identity(chart: Chart) -> None:
    """Require an element for each state and for each transition, and no id twice."""
    found = elements(chart)
    assert len(found) == len(set(found))
    for state in chart.states[1:]:
        assert f"s{state.index}" in found
    for transition in chart.transitions:
        own = [f"t{transition.index}", f"a_t{transition.index}"]
        # an arrow is in a link of its own, for its tooltip: then that has the id as well
        assert own[0] in found or own[1] in found


@needs_dot
@pytest.mark.external
@pytest.mark.parametrize("path", CHARTS, ids=lambda path: path.stem)
def test_every_state_and_every_transition_has_an_id_in_svg(path: Path) -> None:
    require_identity(load(path))


@needs_dot
@pytest.mark.external
@settings(max_examples=20)
@given(documents())
def test_random_states_and_transitions_have_ids_in_svg(document: Document) -> None:
    findings = Findings()
    chart = elaborate((document,), findings)
    if chart is not None and not findings.has_errors:
        require_identity(chart)


@pytest.mark.parametrize("path", CHARTS, ids=lambda path: path.stem)
def test_every_state_is_declared_once(path: Path) -> None:
    chart = load(path)
    as_dot, as_mermaid, as_plantuml = (drawn(n, chart) for n in ("dot", "mermaid", "plantuml"))
    for state in chart.states[1:]:
        is_cluster = state.kind in (Kind.COMPOUND, Kind.PARALLEL)
        dot = rf"subgraph \"cluster_{state.index}\"" if is_cluster else rf"^ +s{state.index} \["
        is_choice = state.kind is Kind.CHOICE
        mermaid = rf"state s{state.index} <<choice>>" if is_choice else rf'" as s{state.index}\b'
        assert len(re.findall(dot, as_dot, re.MULTILINE)) == 1
        assert len(re.findall(mermaid, as_mermaid)) == 1
        assert len(re.findall(rf'" as s{state.index}\b', as_plantuml)) == 1


@pytest.mark.parametrize("path", CHARTS, ids=lambda path: path.stem)
@pytest.mark.parametrize("name", ["mermaid", "plantuml"])
def test_every_transition_is_an_arrow(path: Path, name: str) -> None:
    chart = load(path)
    arrows = re.findall(
        r"^ *(?:s\d+|fork_\d+) -\S*> (?:s\d+|fork_\d+)", drawn(name, chart), re.MULTILINE
    )
    expected = 0
    for transition in chart.transitions:
        is_default = transition.trigger is Trigger.INITIAL
        if is_inside(transition) or (is_default and not chart.states[transition.source].is_history):
            continue
        expected += 1 if len(transition.targets) == 1 else 1 + len(transition.targets)
    assert len(arrows) == expected


def test_what_stands_out() -> None:
    chart = load(ROOT / "machines/production_cell/feeder.yaml")
    text = drawn("dot", chart, "pushing")
    lines = text.splitlines()
    active = [line for line in lines if "#ffd66b" in line]
    assert len(active) == 1
    assert "pushing" in active[0]
    assert sum("#fff8e1" in line for line in lines) == 3  # operational, running, working
    inherited = next(line for line in lines if "<b>unhomed</b>" in line)
    own = next(line for line in lines if "<b>withdrawing</b>" in line)
    assert "#8490a0" in inherited
    assert "#8490a0" not in own
    assert sum("dashed" in line for line in lines) >= 3  # watchdogs


def test_parallel_regions_histories_finals_and_forks() -> None:
    text = drawn("dot", load(GOLDEN / "lamp.yaml"))
    assert text.count("rounded,filled,dashed") == 2
    assert 'label="H*"' in text
    assert 'label="H"' in text
    assert "doublecircle" in text
    assert "diamond" in text
    assert len(re.findall(r"fork_\d+ -> ", text)) == 2
    assert "[else]" in text


def test_delays_are_drawn_as_they_are_written(tmp_path: Path) -> None:
    path = tmp_path / "paced.yaml"
    path.write_text(
        "chart: Paced\nconstants: {T: 1500ms}\ninitial: a\n"
        'states:\n  a: {every: {0.25s: {do: log "tick"}}, after: {1500ms: b}}\n'
        "  b: {after: {T: a}}\n"
    )
    chart = load(path)
    told = [" ".join(label(chart, each).trigger) for each in chart.transitions]
    assert sorted(filter(None, told)) == ["after 1500ms", "after T (1500ms)", "every 0.25s"]


SIGNS = [*sorted({sign for sign in ASSIGNMENT.values() if sign})]


@pytest.mark.parametrize("sign", SIGNS)
@pytest.mark.parametrize("value", ["1", "x - 2", "(x + 1) * 2", "b"])
def test_assignments_are_drawn_as_they_are_written(tmp_path: Path, sign: str, value: str) -> None:
    path = tmp_path / "signs.yaml"
    statements = (f"x {sign}= {value}", f"x = x {sign} ({value})", f"x = {value}")
    text = (
        "chart: Signs\ndata: {x: int32 = 1, b: int8 = 2}\nevents: {in: [go]}\ninitial: a\nstates:\n"
    )
    path.write_text(f"{text}  a: {{on: {{go: {{do: {'; '.join(statements)}}}}}}}\n")
    chart = load(path)
    spelled = [format_statement(each, chart) for each in chart.transitions[1].content]
    assert spelled[0] == statements[0]
    assert "=" in spelled[1]
    assert f"{sign}=" not in spelled[1]
    assert spelled[2] == statements[2]
    assert fingerprint(chart) == fingerprint(load(path))
    for name in DRAWINGS:
        assert drawn(name, chart)


def test_texts_are_escaped() -> None:
    chart = load(GOLDEN / "lamp.yaml")
    assert "a &amp; b &lt;" in drawn("dot", chart)
    assert "a #38; b #60;" in drawn("mermaid", chart)
    assert "a & b <U+003C>" in drawn("plantuml", chart)


def test_a_label_of_brackets_alone_is_one_that_graphviz_reads() -> None:
    assert dot_texts.escaped("]") == "&#93;"  # ] there: syntax error in line 1


@pytest.mark.slow
@settings(max_examples=25)
@given(documents())
def test_labels_are_wrapped(document: Document) -> None:
    chart = elaborate((document,), Findings())
    assert chart is not None
    for transition in chart.transitions:
        text = label(chart, transition)
        assert len(text.actions) <= MOST_LINES
        for line in text.lines:
            words = line.split()
            assert len(line) <= WIDTH or len(words) <= 3  # a long word stands alone
    for state in chart.states:
        assert all(line.strip() for line in box_lines(chart, state))
    for name in DRAWINGS:
        assert drawn(name, chart) == drawn(name, chart)


@pytest.mark.external
def test_names_from_anywhere(tmp_path: Path) -> None:
    path = tmp_path / "odd.yaml"
    path.write_text(
        'chart: "a\\"b<c>"\ninitial: "x\\\\y"\nstates:\n  "x\\\\y": {on: {e: "</b>&"}}\n'
        '  "</b>&": {on: {e: "é{}"}}\n  "é{}": {}\nevents: {in: [e]}\n'
    )
    chart = load(path)
    for name in DRAWINGS:
        assert drawn(name, chart)
    assert "&lt;/b&gt;&amp;" in drawn("dot", chart)
    if shutil.which("dot"):
        assert layout(drawn("dot", chart)) == ""


def layout(text: str) -> str:
    """Lay a graph out and return what Graphviz complains about."""
    done = subprocess.run(
        ["dot", "-Tplain"], input=text, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stderr


FORKS = {
    "event": "initial: out\nstates:\n  out: {on: {go: {target: [TARGETS]}}}\nPARALLEL",
    "no event": "initial: out\nstates:\n  out: {always: {target: [TARGETS]}}\nPARALLEL",
    "timer": "initial: out\nstates:\n  out: {after: {1s: {target: [TARGETS]}}}\nPARALLEL",
    "initial": "initial: [TARGETS]\nstates:\nPARALLEL",
    "inner initial": "states:\n  out:\n    initial: [TARGETS]\n    states:\nPARALLEL",
    "history": "states:\nPARALLEL      last: {history: deep, default: [TARGETS]}\n",
}
"""Charts with a parallel state, one for each kind of transition that can have several targets."""
BARS = {"dot": r'fork_\d+ \[shape="box", style="filled", label=""'}


@pytest.mark.parametrize("count", [2, 20])
@pytest.mark.parametrize("kind", FORKS)
@pytest.mark.parametrize("name", ["dot", "mermaid", "plantuml"])
def test_each_fork_is_a_bar(tmp_path: Path, name: str, kind: str, count: int) -> None:
    regions = (
        f"      r{n}: {{states: {{a{n}: {{on: {{go: b{n}}}}}, b{n}: {{}}}}}}\n"
        for n in range(count)
    )
    parallel = f"  p:\n    regions:\n{''.join(regions)}"
    if kind == "inner initial":
        parallel = textwrap.indent(parallel, "    ")
    chart = FORKS[kind].replace("TARGETS", ", ".join(f"b{n}" for n in range(count)))
    path = tmp_path / "forked.yaml"
    path.write_text(f"chart: Forked\nevents: {{in: [go]}}\n{chart.replace('PARALLEL', parallel)}")
    text = drawn(name, load(path))
    (bar,) = set(re.findall(r"fork_\d+", text))
    assert len(re.findall(BARS.get(name, r"state fork_\d+ <<fork>>"), text)) == 1
    assert len(re.findall(rf"{bar} -\S*> ", text)) == count
    assert len(re.findall(rf"-> {bar}\b", text)) == 1


@pytest.mark.external
@needs_dot
@pytest.mark.parametrize("path", CHARTS, ids=lambda path: path.stem)
def test_graphviz_has_nothing_to_complain_about(path: Path) -> None:
    assert layout(drawn("dot", load(path))) == ""


@pytest.mark.external
@needs_dot
@settings(max_examples=10)
@given(documents())
def test_graphviz_lays_out_random_charts(document: Document) -> None:
    chart = elaborate((document,), Findings())
    assert chart is not None
    assert layout(drawn("dot", chart)) == ""


@pytest.mark.parametrize("name", DRAWINGS)
def test_what_a_state_invokes_stands_in_it(name: str) -> None:
    chart = load(ROOT / "tests/golden/shop.yaml")
    text = drawn(name, chart)
    assert re.search(r"invoke press(:|#58;|#colon;) Press", text)
    assert "feeder" not in text


CROSSING = """
chart: Crossing
events: {in: [go, back]}
initial: p
states:
  p:
    regions:
      left: {initial: a, states: {a: {on: {go: {target: out}}}, b: {on: {go: c}}}}
      right: {initial: c, states: {c: {on: {go: d}}, d: {}}}
  out: {on: {back: [b], go: {target: [b, d]}}}
"""


def test_plantuml_draws_the_arrow_of_a_region_to_itself_within_it(tmp_path: Path) -> None:
    path = tmp_path / "chart.yaml"
    regions = "{one: {on: {e: one}}, two: {initial: a, states: {a: {on: {e: a}}}}}"
    path.write_text(
        f"chart: C\nevents: {{in: [e]}}\ninitial: p\nstates: {{p: {{regions: {regions}}}}}"
    )
    chart = load(path)
    lines = drawn("plantuml", chart).splitlines()
    one, inside = (f"s{chart.state_index[name]}" for name in ("one", "a"))
    assert lines.index(f"  {one} --> {one} : e") < lines.index("  --")
    assert f"{inside} --> {inside} : e" in lines


def test_plantuml_draws_no_arrow_across_the_border_of_a_region(tmp_path: Path) -> None:
    """PlantUML rejects a diagram with one: it ends at the parallel state, and its label says so."""
    (tmp_path / "crossing.yaml").write_text(CROSSING)
    chart = load(tmp_path / "crossing.yaml")
    lines = drawn("plantuml", chart).splitlines()
    p, out = (f"s{chart.state_index[name]}" for name in ("p", "out"))
    arrows = [line for line in lines if line.startswith("s") and "-->" in line]
    assert f"{p} --> {out} : go from a" in [line.replace(r"\n", " ") for line in arrows]
    assert f"{out} --> {p} : back to b" in [line.replace(r"\n", " ") for line in arrows]
    (fork,) = (f"fork_{t.index}" for t in chart.transitions if len(t.targets) > 1)
    assert f"{out} --> {fork} : go" in arrows
    assert {f"{fork} --> {p} : to b", f"{fork} --> {p} : to d"} <= set(lines)
    assert f"{p} --> {p} : go from b to c" in [line.replace(r"\n", " ") for line in arrows]
    assert sum(line.endswith(" : go") for line in arrows) == 2  # also within the right region
