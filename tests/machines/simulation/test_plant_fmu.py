"""The plant as an FMU: the run is the same; what is no plant, or no FMU, is refused."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zmq

import fsmkit
from fsmkit.cli import execute
from machines.production_cell.simulation import nodes
from machines.production_cell.simulation.protocol import step_request
from machines.production_cell.simulation.signals import PLANT
from tests.needs import need, where

pytestmark = [pytest.mark.external, pytest.mark.slow]

FMUS = os.environ.get("FSMKIT_FMUS", "")
"""A folder with the Reference FMUs of the Modelica Association, or with others."""
SCHEDULED = frozenset({"Clocks"})
"""They are for scheduled execution only."""
REALS = frozenset({"Real", "Float32", "Float64"})
INTEGERS = frozenset({"Integer", *(f"{u}Int{bits}" for u in ("", "U") for bits in (8, 16, 32, 64))})
TYPES = REALS | INTEGERS | {"Boolean", "Enumeration"}
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

    ports = Ports(("command",), ("sensor", "flag", "level"))
    monkeypatch.setattr(fmu_process, "PLANT", ports)
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


LAUGHS = "".join(
    f'<!ENTITY {chr(98 + n)} "{f"&{chr(97 + n)};" * 10}">' for n in range(9)
)  # ten times the one before, nine times
SCALAR = '<ScalarVariable name="v" valueReference="1" causality="output"><Real/></ScalarVariable>'
HOSTILE: dict[str, tuple[str, str, str]] = {
    "bomb": (f'<!DOCTYPE l [<!ENTITY a "aaaaaaaaaa">{LAUGHS}]>', "<x>&j;</x>", SCALAR),
    "file": ('<!DOCTYPE l [<!ENTITY a SYSTEM "file:///etc/passwd">]>', "<x>&a;</x>", SCALAR),
    "deep": ("", "<a>" * 100_000 + "</a>" * 100_000, SCALAR),
    "digits": ("", "", SCALAR.replace('"1"', f'"{"9" * 5000}"')),
    "infinite": ("", "", SCALAR.replace("<Real/>", '<Real start="1e400"/>') * 2000),
    "nothing": ("", "", ""),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_description_is_refused_at_once(name: str, tmp_path: Path) -> None:
    from machines.production_cell.simulation.fmu_process import FmuServer, UnfitError

    head, body, variables = HOSTILE[name]
    text = (
        f'<?xml version="1.0"?>{head}<fmiModelDescription fmiVersion="2.0" modelName="x" guid="g">'
        f'{body}<CoSimulation modelIdentifier="x"/><ModelVariables>{variables}</ModelVariables>'
        "<ModelStructure/></fmiModelDescription>"
    )
    with zipfile.ZipFile(tmp_path / "x.fmu", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(DESCRIPTION, text)
    with pytest.raises(UnfitError) as raised:
        FmuServer(tmp_path / "x.fmu", tmp_path / "folder", 1)
    assert len(str(raised.value)) < 500


@pytest.mark.cc
def test_an_archive_leaves_its_folder_and_the_disk_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from machines.production_cell.simulation import fmu_process

    (tmp_path / "doubler.yaml").write_text(DOUBLER)
    command = ["compile", str(tmp_path / "doubler.yaml"), "--target", "fmu"]
    assert execute([*command, "--out", str(tmp_path)]) == 0
    path = tmp_path / "Doubler.fmu"
    with zipfile.ZipFile(path, "a") as archive:
        for name in ("../escaped", "../../escaped", str(tmp_path / "escaped")):
            archive.writestr(name, "x")
    with pytest.raises(fmu_process.UnfitError):
        fmu_process.FmuServer(path, tmp_path / "a" / "b", 1)
    assert list(tmp_path.glob("**/escaped")) in ([], [tmp_path / "a/b" / "escaped"])
    monkeypatch.setattr(fmu_process, "LARGEST_FMU", 2**20)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("large", bytes(2**20 + 1))
    with pytest.raises(fmu_process.UnfitError, match="1048576 are the most"):
        fmu_process.FmuServer(path, tmp_path / "c", 1)


DESCRIPTION, SLAVE = "modelDescription.xml", "resources/fmu_slave.py"


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from machines.production_cell.simulation import plant_fmu

    return plant_fmu.build(tmp_path_factory.mktemp("packed"))


def changed(packed: Path, to: Path, name: str, old: str, new: str) -> Path:
    """Copy an FMU with a text in one of its files replaced."""
    with zipfile.ZipFile(packed) as archive, zipfile.ZipFile(to, "w") as written:
        for each in archive.namelist():
            data = archive.read(each)
            if each == name:
                assert old.encode() in data
                data = data.replace(old.encode(), new.encode())
            written.writestr(each, data)
    return to


def failure(folder: Path, fmu: Path) -> str:
    """Step an FMU as the plant, by itself; return why it fails."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    endpoint, log = f"ipc://{folder / 'plant'}", folder / "plant.log"
    process = nodes.Process(nodes.fmu_program(fmu, 1), endpoint, log, 60.0, context)

    def play() -> None:
        process.begin()
        commands = np.zeros(len(PLANT.inputs), np.int32)
        process.request(b"I", commands.tobytes())
        for number in range(1, 20):
            process.request(b"S", step_request(number, (), commands))
        process.request_json(b"R")

    try:
        with pytest.raises(nodes.CellError) as caught:
            play()
    finally:
        process.end()
        context.destroy(linger=0)
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('name="B_P"', 'name="B_Q"', "the output B_P is missing"),
        ('name="count.lost"', 'name="count.found"', "the output count.lost is missing"),
        ('<Int32 name="B_P"', '<String name="B_P"', "B_P is String, not a number"),
        ('fmiVersion="3.0"', 'fmiVersion="4.0"', "it cannot be read: "),
        ("</fmiModelDescription>", "", "it cannot be read: "),
    ],
)
def test_an_fmu_with_other_variables_is_refused(
    packed: Path, tmp_path: Path, old: str, new: str, told: str
) -> None:
    wrong = changed(packed, tmp_path / "wrong.fmu", DESCRIPTION, old, new)
    text = failure(tmp_path, wrong)
    assert told in text
    assert "Traceback" not in text


@pytest.mark.parametrize(
    ("new", "told"),
    [
        ("import os; os.kill(os.getpid(), 11)", "plant was killed by signal 11"),
        ("raise ValueError('the belt is torn')", "ValueError('the belt is torn')"),
        ("return Fmi3StepResult(status=2)", "fmi3DoStep failed with status 2 (discard)"),
        ("return Fmi3StepResult(terminateSimulation=True)", "it ends the simulation at 0.001 s"),
    ],
)
def test_an_fmu_that_fails_ends_the_run_with_its_reason(
    packed: Path, tmp_path: Path, new: str, told: str
) -> None:
    wrong = changed(packed, tmp_path / "wrong.fmu", SLAVE, "del current_time", new)
    text = failure(tmp_path, wrong)
    assert told in text
    assert "Traceback" not in text


@pytest.mark.parametrize("text", ["", "{}", "[1]", '[{"time": 1}]', '[{"time": "1"}]'])
def test_events_that_are_none_are_refused(text: str) -> None:
    from machines.production_cell.simulation.fmu_process import UnfitError, read_events

    event = {"time": 1.5, "kind": "dropped", "block": 3, "detail": ""}
    assert read_events(json.dumps([event])) == [event]
    with pytest.raises(UnfitError, match="no list of events"):
        read_events(text)


@pytest.mark.parametrize("value", [2.0**31, -1e300, float("inf"), float("nan")])
def test_a_value_beyond_32_bits_is_refused(value: float) -> None:
    from machines.production_cell.simulation.fmu_process import UnfitError, _whole

    assert _whole("level", 2.0**31 - 1) == 2**31 - 1
    with pytest.raises(UnfitError, match=r"level is .*, beyond 32 bits"):
        _whole("level", value)


WATCHER = """
chart: Watcher
inputs: {seen: float64}
outputs: {push: float64 = 0.0}
data: {crossings: 0..100000 wrap = 0}
initial: below
states:
  below: {always: [{if: seen > 0.5, target: above, do: [push = 1.0, crossings += 1]}]}
  above: {always: [{if: not (seen > 0.5), target: below, do: push = 0.0}]}
"""
STEPS = 100
ENDING = {"Stair": 9.0}
"""When FMUs end their simulation themselves: Stair once its counter reaches 10."""


def watched(path: Path, folder: Path) -> int:
    """Let a chart watch the first number of an FMU and drive its first real input, each cycle.

    Return how often the chart saw it rise, after it was compared with the record.
    """
    import fmpy

    description = fmpy.read_model_description(str(path))
    (folder / "watcher.yaml").write_text(WATCHER)
    watcher = fsmkit.Session(fsmkit.read_chart(folder / "watcher.yaml"))
    numbers = [
        v for v in description.modelVariables
        if v.type in TYPES and not v.dimensions and not v.shape and not v.clocks
    ]  # fmt: skip
    outputs = [v.name for v in numbers if v.causality == "output"][:1]
    driven = [v for v in numbers if v.causality == "input" and v.type in REALS][:1]
    experiment = description.defaultExperiment
    step = float(experiment.stepSize or 0.01) if experiment is not None else 0.01

    def exchange(time: float, recorder: Any) -> bool:
        del time
        watcher.inputs["seen"] = float(recorder.rows[-1][1]) if outputs else 0.0
        watcher.advance("1ms")
        for v in driven:
            setter = getattr(recorder.fmu, f"set{v.type}")
            setter([v.valueReference], [watcher.outputs["push"]])
        return True

    result = fmpy.simulate_fmu(
        str(path),
        fmi_type="CoSimulation",
        stop_time=STEPS * step,
        output_interval=step,
        output=outputs,
        step_finished=exchange,
    )
    end = ENDING.get(path.stem, STEPS * step)
    assert result["time"][-1] == pytest.approx(end, abs=step / 2)
    is_above = [bool(row[outputs[0]] > 0.5) if outputs else False for row in result[1:]]
    rises = sum(now and not old for now, old in zip(is_above, [False, *is_above], strict=False))
    assert watcher.data["crossings"] == rises
    return rises


TANK = """
chart: Tank
inputs: {push: float64}
outputs: {level: float64 = 0.0}
initial: a
states: {a: {every: {10ms: {do: level = level + (0.1 - 0.3 * push)}}}}
"""


@pytest.mark.cc
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_chart_and_an_fmu_drive_each_other(version: str, tmp_path: Path) -> None:
    (tmp_path / "tank.yaml").write_text(TANK)
    command = ["compile", str(tmp_path / "tank.yaml"), "--target", "fmu", "--fmi", version]
    assert execute([*command, "--out", str(tmp_path)]) == 0
    assert watched(tmp_path / "Tank.fmu", tmp_path) > 10


@where(FMUS, "FSMKIT_FMUS names no folder with the Reference FMUs")
@pytest.mark.parametrize(
    "path", sorted(Path(FMUS).glob("**/*.fmu")) if FMUS else [], ids=lambda path: path.stem
)
def test_the_fmus_of_others_run_beside_a_chart(path: Path, tmp_path: Path) -> None:
    import fmpy

    description = fmpy.read_model_description(str(path))
    if path.stem in SCHEDULED or description.coSimulation is None:
        assert description.coSimulation is None
        return
    watched(path, tmp_path)
