"""The flat form of UPPAAL: TChecker's grammar derives each expression, and it means the same."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.export.uppaal.network import Edge, Location, Network, Template
from fsmkit.export.uppaal.tchecker import for_tchecker
from fsmkit.export.uppaal.translate import translate
from fsmkit.export.uppaal.writing import write
from fsmkit.system.any_file import load_any
from fsmkit.verify.statespace.closed_system import close
from tests.export.tchecker_grammar import imported, is_guard, is_term
from tests.export.uppaal_compared import compared
from tests.needs import where
from tests.verify.random_systems import random_system
from tests.verify.systems import SYSTEMS

MACHINES = Path(__file__).parents[2] / "machines"
SMALL = ["fischer/fischer", "philosophers/table", "csma_cd/csma_cd",
         pytest.param("fddi/fddi", marks=pytest.mark.slow), "gantry/gantry",
         "train_gate/train_gate", "production_cell/feeder"]  # fmt: skip
CONDITIONS = [
    "a and b and c", "a or b", "a or b or c", "not (a and b)", "not (a or b)", "not not a",
    "a == b", "(a or b) == c", "(n > 1) == a", "n == (a ? 1 : 2)", "(a and b and c) or n == 0",
    "a ? b : c", "not (a ? b or c : c and a and b)", "n + m * 2 - 1 > m % 2", "(a ? n : m) > -1",
    "m == 0 or n / m == 1", "list[n] == 1 or list[m] == 0", "abs(n - m) == 1", "min(n, m, 2) == 1",
]  # fmt: skip
CHART = """
chart: Conditions
data: {{a: bool = false, b: bool = true, c: bool = false, n: 0..3 = 0, m: 0..2 = 1,
       list: "uint8[4] = 0", r: bool = false}}
events: {{in: [e, f, up]}}
initial: s
states:
  s:
    rest: true
    on:
      e: {{if: "{condition}", target: t}}
      f: {{do: "r = {condition}"}}
      up: {{do: "n = (n + 1) % 4; list[n] = 1; a = not b; c = n > m"}}
  t: {{rest: true, always: {{if: "not ({condition})", target: s}}}}
"""


def of_chart(folder: Path, condition: str) -> Network:
    (folder / "chart.yaml").write_text(CHART.format(condition=condition))
    return flat(folder / "chart.yaml")


def flat(path: Path, *, untimed: bool = False) -> Network:
    closed = close(load_any(path, Findings()), untimed=untimed)
    return translate(closed, flat=True, paced=True, draw=False)


def rejected(network: Network) -> list[str]:
    """Return the expressions that TChecker does not read."""
    found = []
    for template in network.templates:
        edges, locations = template.edges, template.locations
        for parts in (*(one.invariant for one in locations), *(one.guard for one in edges)):
            text = " && ".join(parts)
            found += [text] if text and not is_guard(imported(text)) else []
        for update in (update for edge in edges for update in edge.update):
            sides = update.split(" = ", 1)
            found += [update] if not all(is_term(imported(side)) for side in sides) else []
    return found


@pytest.mark.parametrize("condition", CONDITIONS)
def test_tchecker_reads_each_condition(tmp_path: Path, condition: str) -> None:
    network = of_chart(tmp_path, condition)
    assert sum(len(template.edges) for template in network.templates) > 3
    assert rejected(network) == []
    closed = close(load_any(tmp_path / "chart.yaml", Findings()), keeps_dead=True)
    assert compared(closed)[0] > 4


@pytest.mark.parametrize("name", [*SMALL, *sorted({*SYSTEMS} - {"shared"})])
def test_tchecker_reads_each_system(tmp_path: Path, name: str) -> None:
    path = MACHINES / f"{name}.yaml"
    if name in SYSTEMS:
        for file, text in SYSTEMS[name].items():
            (tmp_path / f"{file}.yaml").write_text(text)
        path = tmp_path / f"{next(iter(SYSTEMS[name]))}.yaml"
    assert rejected(flat(path)) == []


@pytest.mark.parametrize("seed", range(6))
def test_tchecker_reads_random_systems(tmp_path: Path, seed: int) -> None:
    files = random_system(seed)
    for file, text in files.items():
        (tmp_path / f"{file}.yaml").write_text(text)
    try:
        network = flat(tmp_path / f"{next(iter(files))}.yaml")
    except FsmkitError:
        return  # it is no system, or UPPAAL cannot express it
    assert rejected(network) == []


REJECTED = ["a && b && c", "!(a || b)", "a || b", "(a && b) == c", "(n > 1) + 1 > 0"]


@pytest.mark.parametrize("text", REJECTED)
def test_the_grammar_rejects_what_tchecker_rejects(text: str) -> None:
    assert not is_guard(imported(text))
    assert not is_term(imported("a == b"))


WORDS = st.sampled_from(["a", "b", "c", "1", "n", "list[n]"])


def expressions() -> st.SearchStrategy[str]:
    operators = st.sampled_from(["&&", "||", "==", "!=", "<", "<=", "+", "-"])
    return st.recursive(
        WORDS,
        lambda inner: st.one_of(
            st.tuples(inner, operators, inner).map(lambda p: f"({p[0]}) {p[1]} ({p[2]})"),
            inner.map(lambda text: f"!({text})"),
            st.tuples(inner, inner, inner).map(lambda p: f"({p[0]}) ? ({p[1]}) : ({p[2]})"),
        ),
        max_leaves=12,
    )


@given(st.lists(expressions(), min_size=1, max_size=4))
def test_tchecker_reads_any_expression(texts: list[str]) -> None:
    edge = Edge("s", "s", guard=tuple(f"({text})" for text in texts),
                update=tuple(f"list[{text}] = {text}" for text in texts))  # fmt: skip
    location = Location("s", "s", invariant=("t <= 3", *edge.guard))
    template = Template("T", "t", (), (location,), "s", (edge,))
    network = Network((), (), (for_tchecker(template),), ())
    assert rejected(network) == []


JUDGES = shutil.which("utot"), shutil.which("tck-syntax")
"""The importer uppaal-to-tchecker, and the parser of TChecker."""


@where(all(JUDGES), "no utot and tck-syntax on the path")
@pytest.mark.cc
@pytest.mark.parametrize("name", SMALL)
def test_the_importer_and_tchecker_accept_it(tmp_path: Path, name: str) -> None:
    (tmp_path / "m.xml").write_text(write(flat(MACHINES / f"{name}.yaml")))
    files = [str(tmp_path / "m.xml"), str(tmp_path / "m.tck")]
    importer, parser = map(str, JUDGES)
    subprocess.run([importer, *files], check=True, capture_output=True)
    done = subprocess.run([parser, "-c", files[1]], check=True, capture_output=True, text=True)
    assert "Syntax OK" in done.stdout + done.stderr


def test_names_stay_unique_when_the_importer_makes_them_global(tmp_path: Path) -> None:
    """It puts `a_` before the names of `a`, which may be those of a queue, or of `a_b`."""
    files = {
        "names": "system: Names\nmachines: {a: one.yaml, a_b: two.yaml}\n"
        "connect: [a.out -> a_b.in, a_b.out -> a.in]\n",
        "one": "chart: One\nevents: {in: [in], out: [out]}\ninitial: s\n"
        "data: {length: 0..3 = 0, events: 0..3 = 0, b_c: 0..3 = 0, overflow: bool = false}\n"
        'states: {s: {entry: "length = 1; events = 1; b_c = 1; overflow = true; send out"}}\n',
        "two": "chart: Two\nevents: {in: [in], out: [out]}\ninitial: s\n"
        "data: {c: 0..3 = 0, length: 0..3 = 0}\n"
        'states: {s: {entry: "length = 1; c = 1", on: {in: {do: send out}}}}\n',
    }
    for name, text in files.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    network = flat(tmp_path / "names.yaml")
    outer = [one.name for one in network.declarations]
    inner = [f"{t.instance}_{one.name}" for t in network.templates for one in t.declarations]
    assert len(inner) >= 6
    assert len({*outer, *inner}) == len(outer) + len(inner)
