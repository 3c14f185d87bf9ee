"""``fsmkit export``: transition systems of the size that `check` tells, whole or not at all."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.export.exporter import Exporter, ExportOptions
from fsmkit.export.transition_system import Arrow
from fsmkit.plugins import plugin, plugins
from fsmkit.system.any_file import load_any
from fsmkit.verify.engines.python.oracle import Oracle
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.statespace.closed_system import close

ROOT = Path(__file__).parents[2]
FISCHER = ROOT / "machines/fischer/fischer.yaml"
TABLE = ROOT / "machines/philosophers/table.yaml"
PAGE = ROOT / "docs/reference/exports.md"
README = ROOT / "README.md"


def said(*arguments: object) -> tuple[int, str, str]:
    """Return the exit code, and what was printed."""
    with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        code = execute([str(a) for a in arguments])
    return code, out.getvalue(), err.getvalue()


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    """The chart of the README."""
    text = re.search(
        r"^```yaml\n(.*?)^```", README.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    assert text is not None
    file = tmp_path / "gate.yaml"
    file.write_text(text[1], encoding="utf-8")
    return file


def read(text: str) -> tuple[int, list[Arrow]]:
    """Return the states that an Aldebaran file counts, and its transitions, as many as it says."""
    header, *lines = text.splitlines()
    count, states = map(int, re.findall(r"des \(0, (\d+), (\d+)\)", header)[0])
    found = [re.fullmatch(r'\((\d+), "([^"]*)", (\d+)\)', line) for line in lines]
    arrows = [Arrow(int(f[1]), f[2], int(f[3])) for f in found if f is not None]
    assert len(lines) == len(arrows) == count
    return states, arrows


@pytest.mark.parametrize("file", [FISCHER, TABLE], ids=["fischer", "philosophers"])
def test_an_aldebaran_file_has_the_states_of_the_explorer(file: Path) -> None:
    code, out, _ = said("export", file, "--to", "aut")
    assert code == 0
    states, arrows = read(out)
    found = check(
        load_any(file, Findings()),
        Findings(),
        options=ExplorationOptions("python", time="discrete"),
    ).exploration
    assert (states, len(arrows)) == (found.states + 1, found.transitions + 1)
    assert {arrow.source for arrow in arrows} | {arrow.target for arrow in arrows} == set(
        range(states)
    )


@pytest.mark.slow
def test_an_aldebaran_file_distinguishes_what_leaves_a_machine() -> None:
    """`check` tries one payload where nothing in the system distinguishes them."""
    camera = ROOT / "machines/production_cell/camera.scxml"
    states, arrows = read(said("export", camera, "--to", "aut", "--time", "untimed")[1])
    system = load_any(camera, Findings())
    observed = Oracle(close(system, untimed=True, observed=True)).run(livelock=False)
    assert (states, len(arrows)) == (observed.states + 1, observed.transitions + 1) == (153, 1524)
    plain = Oracle(close(system, untimed=True)).run(livelock=False)
    assert (plain.states, plain.transitions) == (56, 207)


def test_labels_say_who_does_what() -> None:
    _, out, _ = said("export", FISCHER, "--to", "aut")
    labels = {arrow.label for arrow in read(out)[1]}
    causes = [*(f"leaves {state}" for state in ("idle", "waits", "critical")), "timeout in wants"]
    causes.append("timeout in waits")
    assert labels == {"start", "tick"} | {f"p[{i}]: {cause}" for i in (1, 2) for cause in causes}


def test_the_page_shows_what_is_printed(gate: Path) -> None:
    shown = re.search(
        r"^```console\n\$ fsmkit (.*?)\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL
    )
    assert shown is not None
    code, out, _ = said(*shown[1].replace("gate.yaml", str(gate)).split())
    assert (code, out) == (0, shown[2])


@pytest.mark.external
def test_graphviz_draws_it(gate: Path, require_tool: Callable[[str], str]) -> None:
    _, out, _ = said("export", gate, "--to", "dot", "--time", "untimed")
    drawn = subprocess.run(
        [require_tool("dot"), "-Tsvg"], input=out, capture_output=True, text=True, check=True
    )
    assert drawn.stderr == ""
    assert drawn.stdout.count("opening") >= 1


def test_a_file_is_written_and_told(gate: Path, tmp_path: Path) -> None:
    code, out, _ = said("export", gate, "--to", "aut", "--out", tmp_path / "gate.aut", "--json")
    told = json.loads(out)
    assert code == 0
    assert read((tmp_path / "gate.aut").read_text())[0] == told["states"]


# a deadline that comes while a file is opened leaves it to the garbage collector
@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_part_is_never_written() -> None:
    code, out, err = said("export", FISCHER, "--to", "aut", "--max-states", "10")
    assert (code, out) == (1, "")
    assert "FK0545" in err
    code, _, err = said("export", FISCHER, "--to", "aut", "--timeout", "1ms")
    assert (code, "FK0545" in err) == (1, True)


MOST = {"uppaal": 12, "uppaal-flat": 12}
"""Locations of the philosophers: those of the templates."""


@pytest.mark.cc
@pytest.mark.parametrize(
    "notation",
    ["aut", "dot", "cspm", "promela", "jani"]
    + [pytest.param(name, marks=pytest.mark.external) for name in MOST],
)
def test_more_states_than_most_are_not_written(notation: str, tmp_path: Path) -> None:
    out = tmp_path / "model"
    wanted = ["export", TABLE, "--to", notation, "--time", "untimed", "--out", out]
    states = MOST.get(notation, 280)  # those of `check`
    code, _, err = said(*wanted, "--max-states", states - 1)
    assert (code, out.exists()) == (1, False)
    assert f"more than {states - 1} {'locations' if notation in MOST else 'states'}" in err
    assert said(*wanted, "--max-states", states)[0] == 0
    assert out.exists()


@pytest.mark.cc
@pytest.mark.parametrize("notation", [found.name for found in plugins(Exporter)])
def test_each_exporter_reports_progress_and_is_interrupted(notation: str) -> None:
    seen: list[tuple[int, int]] = []

    def interrupt(states: int, transitions: int) -> None:
        seen.append((states, transitions))
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        plugin(Exporter, notation).export(
            load_any(TABLE, Findings()), ExportOptions(untimed=True, progress=interrupt)
        )
    assert len(seen) == 1


@pytest.mark.cc
def test_only_what_is_asked_for_is_carried_over(tmp_path: Path) -> None:
    model = tmp_path / "fischer.pml"
    assert said("export", FISCHER, "--to", "promela", "--out", model)[0] == 0
    assert len(re.findall(r"^never ", model.read_text(), re.MULTILINE)) > 1
    names = ("--property", "exclusion")
    assert said("export", FISCHER, "--to", "promela", "--out", model, *names)[0] == 0
    assert re.findall(r"^never (\w+)", model.read_text(), re.MULTILINE) == ["exclusion"]
    code, _, err = said("export", FISCHER, "--to", "promela", "--property", "exclusive")
    assert code == 2
    assert "no property `exclusive`" in err


def test_a_machine_runs_another_chart() -> None:
    pair = ROOT / "machines/production_cell/pairs/feeder_belt-feeder.yaml"
    code, _, err = said("export", pair, "--to", "promela", "--replace", "nobody=x.yaml")
    assert code == 2
    assert "nobody" in err


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("notation", [found.name for found in plugins(Exporter)])
def test_the_time_is_for_all_of_an_export(
    notation: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    argv = [
        "export",
        str(ROOT / "machines/production_cell/plant.yaml"),
        "--to",
        notation,
        "-o",
        str(out),
    ]
    assert execute([*argv, "--timeout", "1s"]) == 1
    told = capsys.readouterr().err
    assert "FK0545" in told
    assert re.search(r"the time limit of 1 s was reached \(.*exploring [\d.]+ s\)", told), told
    assert not out.exists()
