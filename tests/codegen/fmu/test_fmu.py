"""FMUs: valid by the rules of others, and equal to the interpreter."""

from __future__ import annotations

import os
import random
import subprocess
import zipfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from shutil import rmtree
from typing import Any

import pytest

from devtools.differential import random_case
from fsmkit.chart.analysis.host_events import posted_events
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.fmu import generate
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.language.values import to_python
from fsmkit.plugins import plugin
from fsmkit.runtime.script import SeededHost
from tests.codegen.fmu.beside import Beside, build_fmu, named
from tests.codegen.fmu.comparable import can_be_compared

CELL = Path(__file__).parents[3] / "machines" / "production_cell"
CHARTS = (
    *("feeder.yaml", "molder.yaml", "extractor.yaml", "sorter.yaml", "camera.scxml"),
    *("rotator.yaml", "supervisor.yaml", "plant.yaml", "feeder_belt.yaml", "extraction_belt.yaml"),
)
VERSIONS = ("2.0", "3.0")
RANDOM = int(os.environ.get("FSMKIT_FMU_CHARTS", "3"))
ROOM = 64
"""FMU_PENDING: events and calls in a step."""
STEPS = int(os.environ.get("FSMKIT_FMU_STEPS", "60"))
LIVES = 8

pytestmark = [pytest.mark.external, pytest.mark.cc]


@pytest.mark.parametrize("version", VERSIONS)
def test_charts_of_the_cell_are_valid_and_compile_without_a_warning(
    version: str, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    from fmpy.validation import validate_fmu

    for chart in CHARTS:
        file = build_fmu(tmp_path, load(CELL / chart), version, is_built=False)
        assert validate_fmu(str(file)) == []
        folder = tmp_path / Path(chart).stem
        zipfile.ZipFile(file).extractall(folder)
        compiler = require_tool("clang" if chart == "feeder.yaml" else "gcc")
        warnings = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow"]
        warnings += ["-Werror", "-std=c99", "-fsyntax-only"]
        sources = sorted((folder / "sources").glob("*.c"))
        done = subprocess.run(
            [compiler, *warnings, *map(str, sources)], capture_output=True, text=True, check=False
        )
        assert done.stderr == ""
    first, again = (build_fmu(tmp_path, load(CELL / "feeder.yaml"), version) for _ in range(2))
    assert first.read_bytes() == again.read_bytes()


LEVEL = """
chart: Level
inputs: {level: float32, count: int64, total: uint64}
outputs: {is_high: bool = false}
initial: low
states:
  low: {always: [{if: level > 1.0, target: high}]}
  high: {entry: is_high = true}
"""


def test_without_fmpy_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(generate, "find_spec", lambda _: None)
    path = tmp_path / "level.yaml"
    path.write_text(LEVEL, encoding="utf-8")
    with pytest.raises(FsmkitError) as caught:
        build_fmu(tmp_path, load(path), "3.0")
    (found,) = caught.value.diagnostics
    assert found.rule.name == "missing-package"
    assert "fsmkit[fmi]" in str(found.help)


@pytest.mark.parametrize("version", VERSIONS)
def test_sources_compile_with_the_cmake_file_of_the_fmu(
    version: str, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    file = build_fmu(tmp_path, load(CELL / "feeder.yaml"), version, is_built=False)
    zipfile.ZipFile(file).extractall(tmp_path / "fmu")
    cmake = require_tool("cmake")
    for words in (["-S", "fmu/sources", "-B", "built"], ["--build", "built"]):
        subprocess.run([cmake, *words], cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "built" / "Feeder.so").is_file()


BLINKING = """
chart: Blinking
outputs: {turns: 0..1000 = 0}
initial: dark
states:
  dark: {after: {700ms: light}}
  light: {entry: turns = turns + 1, after: {300ms: dark}}
"""


def test_a_real_that_its_variable_cannot_hold_is_rejected(tmp_path: Path) -> None:
    from fmpy.fmi1 import FMICallException

    from tests.codegen.fmu.importer import Importer

    path = tmp_path / "level.yaml"
    path.write_text(LEVEL, encoding="utf-8")
    importer = Importer(build_fmu(tmp_path, load(path), "2.0"))
    importer.start({"level": 1e30})
    reference = [importer.by_name["level"].valueReference]
    for value in (-3.4e38, float("inf")):
        importer.fmu.setReal(reference, [value])
        assert importer.fmu.getReal(reference) == [pytest.approx(value)]
    wrong = {
        "level": (1e300, -1e39),
        "count": (1e19, -1e19, 1.5, float("nan")),
        "total": (2e19, -1.0, 0.5),
    }
    for name, values in wrong.items():
        reference = [importer.by_name[name].valueReference]
        for value in values:
            with pytest.raises(FMICallException):
                importer.fmu.setReal(reference, [value])
    for name, value in (("count", -(2.0**53)), ("total", 2.0**53)):
        reference = [importer.by_name[name].valueReference]
        importer.fmu.setReal(reference, [value])
        assert importer.fmu.getReal(reference) == [value]


@pytest.mark.parametrize("version", VERSIONS)
def test_a_simulator_runs_it_for_a_minute(version: str, tmp_path: Path) -> None:
    from fmpy import simulate_fmu

    path = tmp_path / "blinking.yaml"
    path.write_text(BLINKING, encoding="utf-8")
    result = simulate_fmu(
        str(build_fmu(tmp_path, load(path), version)),
        stop_time=60.0, step_size=0.01, output_interval=0.25, output=["state", "turns"],
    )  # fmt: skip
    rows = zip(result["time"], result["state"], result["turns"], strict=True)
    seen = {round(time * 4): (state, turns) for time, state, turns in rows}
    assert len(seen) == 241
    dark, light = 1, 2
    for quarter in range(1, 241):
        whole, part = divmod(quarter, 4)
        expected = (light, whole + 1) if part == 3 else (dark, whole)
        assert seen[quarter] == expected, quarter / 4


def _random_charts(version: str) -> Iterator[tuple[int, Chart]]:
    number = count = 0
    while count < RANDOM:
        number += 1
        chart = random_case(7, number).chart
        if can_be_compared(chart, version) and _lives(chart):
            count += 1
            yield number, chart


def _lives(chart: Chart) -> bool:
    """Return whether the machine has neither stopped nor failed once it has started."""
    session = Beside(chart).session
    session.start()
    return not session.run(0) and session.fault is None and session.is_running


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
def test_random_charts_do_as_in_the_interpreter(
    version: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tests.codegen.fmu.importer import Importer

    # most of the time was gcc's: a quarter of it is left
    monkeypatch.setattr(generate, "FLAGS", (*generate.FLAGS, "-O0"))
    compared = 0
    for number, chart in _random_charts(version):
        folder = tmp_path / str(number)
        folder.mkdir()
        file = build_fmu(folder, chart, version)
        compared += _play(number, chart, partial(Importer, file))
        rmtree(folder)
    assert compared > 5 * RANDOM


def _play(number: int, chart: Chart, instance: Callable[[str], Any]) -> int:
    """Play lives until they have STEPS steps together; return how many were compared.

    A life ends with a fault, in a final state, with events that never end, or for want of room.
    """
    played = 0
    for life in range(LIVES):
        with suppress(TooManyError):
            played += _live(number, life, STEPS - played, chart, instance)
        if played >= STEPS:
            break
    return played


def _live(number: int, life: int, most: int, chart: Chart, instance: Callable[[str], Any]) -> int:
    """Play random events and times on both; return how many steps were compared."""
    choose = random.Random(f"{number}/{life}")
    values = SeededHost(chart, choose.randrange(1 << 30))
    beside = Beside(chart)
    fmu = instance("one")
    tick = chart.capacities.tick / 1e6
    beside.session.start()
    beside.session.run(0)
    _guarded(beside, partial(fmu.start, {}))
    now = 0
    restored_at = choose.randrange(most)
    for step in range(most):
        if beside.session.run(now):  # its events never end
            fmu.close()
            return step
        _compare(number, step, fmu, beside)
        if beside.session.fault is not None or not beside.session.is_running:
            fmu.close()
            return step
        if step == restored_at:
            saved = fmu.saved()
            other = instance("two")
            other.start({})
            other.restore(saved)
            other.time, other.seen, other._counts = fmu.time, fmu.seen, fmu._counts
            fmu.close()
            fmu = other
        events = [chart.events[index] for index in posted_events(chart)]
        if events and choose.random() < 0.7:
            event = choose.choice(events)
            fields: dict[str, object] = {}
            arguments = {}
            for part in event.fields:
                value = values.value(part.type)
                arguments[part.name] = to_python(value, part.type)
                for path, scalar in named(part.type, value):
                    fields[f"{part.name}{path}"] = scalar
            is_rejected = not beside.session.post(event.name, **arguments)
            beside.session.run(now)
            _guarded(beside, partial(fmu.post, event.name, fields), is_rejected=is_rejected)
        else:
            passed = choose.choice((1, 3, 10, 40, 100, 500))
            now += passed
            beside.session.run(now)
            _guarded(beside, partial(fmu.advance, passed * tick))
    fmu.close()
    return most


class TooManyError(Exception):
    """An FMU has no more room for events."""


def _guarded(beside: Beside, step: Callable[[], None], *, is_rejected: bool = False) -> None:
    """Do a step; an error is expected if the machine stopped with a fault.

    Raise `TooManyError` if it is expected because there is no more room: for outgoing events, or
    in a queue that the machine does not process, where the interpreter rejects events, too.
    """
    from fmpy.fmi1 import FMICallException

    try:
        step()
    except FMICallException:
        if beside.session.fault is None:
            assert is_rejected or len(beside.seen) > ROOM
            raise TooManyError from None


def _compare(number: int, step: int, fmu: Any, beside: Beside) -> None:
    where = f"chart {number}, step {step}"
    if beside.session.fault is None:
        expected = beside.states()
        assert {name: fmu[name] for name in expected} == expected, where
        for kind in ("send.", "call."):
            got = [seen for seen in fmu.seen if seen[0].startswith(kind)]
            wanted = [seen for seen in beside.seen if seen[0].startswith(kind)]
            if fmu.is_3:
                assert got == wanted, where
            else:
                assert sorted(n for n, _ in got) == sorted(n for n, _ in wanted), where
    fmu.seen.clear()
    beside.seen.clear()


def test_strings_have_no_variable_and_are_named(tmp_path: Path) -> None:
    path = tmp_path / "mode.yaml"
    path.write_text(
        "chart: Mode\ndata: {mode: symbol = 'idle'}\nevents: {in: ['say(what symbol, n 0..3)']}\n"
        "initial: a\nstates: {a: {on: {say: {do: 'mode = event.what'}}}}\n",
        encoding="utf-8",
    )
    findings = Findings()
    generated = plugin(Target, "fmu").generate(load(path), findings, {})
    assert generated is not None
    (found,) = findings
    assert "`mode`, `say.what`" in found.message


COUNTER = """
chart: Counter
capacity: {queue: 2}
data: {n: 0..1000 = 0}
events: {in: [tick]}
initial: a
states: {a: {on: {tick: {do: n = n + 1}}}}
"""


@pytest.mark.parametrize("version", VERSIONS)
def test_no_event_is_lost_and_damaged_states_are_refused(version: str, tmp_path: Path) -> None:
    from fmpy.fmi1 import FMICallException

    from tests.codegen.fmu.importer import Importer

    path = tmp_path / "counter.yaml"
    path.write_text(COUNTER, encoding="utf-8")
    fmu = Importer(build_fmu(tmp_path, load(path), version))
    fmu.start({})
    if version == "2.0":
        fmu["post.tick"] = 100
        fmu.advance(0.001)
    else:
        for _ in range(100):
            fmu.post("tick", {})
    assert fmu["n"] == 100
    saved = fmu.saved()
    for damaged in (saved[:-1] + b"\xff", saved[:40] + b"\xff" * (len(saved) - 40), saved[1:]):
        with pytest.raises(FMICallException):
            fmu.restore(damaged)
    fmu.restore(saved)
    assert fmu["n"] == 100
    fmu.close()
