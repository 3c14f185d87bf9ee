"""The plant as an FMU: the run is the same; what is no plant, or no FMU, is refused."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import fsmkit
from fsmkit.cli import execute
from tests.needs import need, where

pytestmark = [pytest.mark.external, pytest.mark.slow]

FMUS = os.environ.get("FSMKIT_FMUS", "")
"""A folder with the Reference FMUs of the Modelica Association, or with others."""
SCHEDULED = frozenset({"Clocks"})
"""They are for scheduled execution only."""
DOUBLER = """
chart: Doubler
inputs: {command: -100..100}
outputs: {sensor: -200..200 = 0, flag: bool = false, level: float64 = 0.0}
initial: a
states:
  a:
    every:
      1ms: {do: sensor = command + command; flag = command > 0; level = command * 1.0}
"""


@pytest.fixture(autouse=True)
def _packages() -> None:
    for package in ("fmpy", "pythonfmu3", "zmq"):
        need(find_spec(package) is not None, package)


def cell(out: Path, *options: str) -> subprocess.CompletedProcess[str]:
    module = "machines.production_cell.simulation"
    command = [sys.executable, "-m", module, "--double", "--out", str(out), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("options", [("--seconds", "4"), ("--seconds", "13", "--fault", "jam")])
def test_a_run_is_the_same(tmp_path: Path, options: tuple[str, ...]) -> None:
    records = []
    for plant in ("itself", "fmu"):
        out = tmp_path / plant
        done = cell(out, "--plant", plant, *options)
        assert done.returncode in (0, 1), done.stdout + done.stderr
        records.append((out / "run.rec").read_bytes())
    assert records[0] == records[1]


def refused(folder: Path, plant: object) -> str:
    done = cell(folder / "out", "--seconds", "1", "--plant", str(plant))
    assert done.returncode == 2, done.stdout
    assert "Traceback" not in done.stdout + done.stderr
    return " ".join(done.stdout.split())


def test_what_is_no_plant_is_refused(tmp_path: Path) -> None:
    assert "there is no FMU" in refused(tmp_path, tmp_path / "nothing.fmu")
    broken = tmp_path / "broken.fmu"
    broken.write_text("no archive")
    assert "cannot be read" in refused(tmp_path, broken)
    (tmp_path / "doubler.yaml").write_text(DOUBLER)
    command = ["compile", str(tmp_path / "doubler.yaml"), "--target", "fmu", "--no-build"]
    assert execute([*command, "--out", str(tmp_path)]) == 0
    assert "the input feeder_belt.pwm is missing" in refused(tmp_path, tmp_path / "Doubler.fmu")


@pytest.mark.cc
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_variables_are_set_and_read_by_their_types(
    tmp_path: Path, version: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from machines.production_cell.simulation import fmu_process
    from machines.production_cell.simulation.signals import Ports

    ports = Ports(("command",), ("sensor", "flag", "level", "not.there"))
    monkeypatch.setattr(fmu_process, "PLANT", ports)
    monkeypatch.setattr(fmu_process, "MEASUREMENTS", ("sensor",))
    (tmp_path / "doubler.yaml").write_text(DOUBLER)
    command = ["compile", str(tmp_path / "doubler.yaml"), "--target", "fmu", "--fmi", version]
    assert execute([*command, "--out", str(tmp_path)]) == 0
    server = fmu_process.FmuServer(tmp_path / "Doubler.fmu", tmp_path / "fmu", seed=1)
    assert server.ports.outputs == ("sensor", "flag", "level")
    assert list(server.initial(np.array([7]))) == [0, 0, 0]
    found = [list(server.step(n, np.array([n - 3]))) for n in range(1, 7)]
    assert found == [[2 * n, int(n > 0), n] for n in range(-2, 4)]
    with pytest.raises(KeyError, match="no variable jam"):
        server.set_parameter("jam", 1)


WATCHER = """
chart: Watcher
inputs: {seen: float64}
data: {crossings: 0..100000 wrap = 0}
initial: below
states:
  below: {always: [{if: seen > 0.5, target: above, do: crossings += 1}]}
  above: {always: [{if: not (seen > 0.5), target: below}]}
"""


@where(FMUS, "FSMKIT_FMUS names no folder with the Reference FMUs")
@pytest.mark.parametrize(
    "path", sorted(Path(FMUS).glob("**/*.fmu")) if FMUS else [], ids=lambda path: path.stem
)
def test_the_fmus_of_others_run_beside_a_chart(path: Path, tmp_path: Path) -> None:
    """A chart watches the first output of the FMU, a step of it each cycle."""
    import fmpy

    description = fmpy.read_model_description(str(path))
    if path.stem in SCHEDULED or description.coSimulation is None:
        assert description.coSimulation is None
        return
    (tmp_path / "watcher.yaml").write_text(WATCHER)
    watcher = fsmkit.Session(fsmkit.read_chart(tmp_path / "watcher.yaml"))
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    experiment = description.defaultExperiment
    step = float(experiment.stepSize or 0.01) if experiment is not None else 0.01
    result = fmpy.simulate_fmu(
        str(path),
        fmi_type="CoSimulation",
        stop_time=100 * step,
        output_interval=step,
        output=outputs,
    )
    crossings = 0
    was_above = False
    for row in result:
        seen = next((float(row[name]) for name in outputs if np.ndim(row[name]) == 0), 0.0)
        watcher.inputs["seen"] = seen
        watcher.advance("1ms")
        crossings += seen > 0.5 and not was_above
        was_above = seen > 0.5
    assert watcher.data["crossings"] == crossings
