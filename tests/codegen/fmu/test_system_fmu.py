"""A system as one FMU: valid by the rules of others, and equal to the interpreter."""

from __future__ import annotations

import os
import random
import subprocess
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from devtools.differential import random_case
from fsmkit.chart.analysis.host_events import posted_events, sent_events
from fsmkit.chart.chart import Chart
from fsmkit.cli import execute
from fsmkit.codegen.fmu.generate import surrounded
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.language import ArrayType, RecordType, SymbolType, Type
from fsmkit.language.values import from_python, to_python
from fsmkit.runtime.script import SeededHost
from fsmkit.system.channels import without_channels
from fsmkit.system.limits_of_c import report_limits
from fsmkit.system.machine import EventLink, InputLink, Machine, operation_port, port_fields
from fsmkit.system.system import System
from fsmkit.system.system_file import load_system
from tests.codegen.fmu.beside import SystemBeside, build_fmu, named
from tests.codegen.fmu.comparable import can_be_compared

CELL = Path(__file__).parents[3] / "machines" / "production_cell"
PAIRS = sorted((CELL / "pairs").glob("*-*.yaml"))
VERSIONS = ("2.0", "3.0")
RANDOM = int(os.environ.get("FSMKIT_FMU_SYSTEMS", "1"))
STEPS = int(os.environ.get("FSMKIT_FMU_STEPS", "60"))
ROOM = 64
"""FMU_PENDING: events and calls in a step."""

pytestmark = [pytest.mark.external, pytest.mark.cc]


def of_the_cell(path: Path) -> System:
    return surrounded(without_channels(load_system(path, Findings())))


@pytest.mark.parametrize("version", VERSIONS)
def test_systems_of_the_cell_are_valid_and_compile_without_a_warning(
    version: str, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    from fmpy.validation import validate_fmu

    for path in (CELL / "ring.yaml", *PAIRS):
        file = build_fmu(tmp_path, of_the_cell(path), version, is_built=False)
        assert validate_fmu(str(file)) == [], path
    folder = tmp_path / "ring"
    zipfile.ZipFile(tmp_path / "Ring.fmu").extractall(folder)
    warnings = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow"]
    warnings += ["-Werror", "-std=c99", "-fsyntax-only"]
    sources = sorted(map(str, (folder / "sources").glob("*.c")))
    for compiler in ("gcc", "clang"):
        command = [require_tool(compiler), *warnings, *sources]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.stderr == ""


def test_one_file_is_written_for_a_system(tmp_path: Path) -> None:
    command = ["compile", str(PAIRS[0]), "-t", "fmu", "--out", str(tmp_path), "--quiet"]
    assert execute(command) == 0
    (file,) = tmp_path.iterdir()
    assert file.suffix == ".fmu"


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
def test_the_pairs_of_the_cell_do_as_in_the_interpreter(version: str, tmp_path: Path) -> None:
    from tests.codegen.fmu.importer import Importer

    chosen = PAIRS if "FSMKIT_FMU_SYSTEMS" in os.environ else PAIRS[:2]
    for seed, path in enumerate(chosen):
        folder = tmp_path / path.stem
        folder.mkdir()
        system = of_the_cell(path)
        file = build_fmu(folder, system, version)
        assert _play(seed, system, partial(Importer, file)) == STEPS, path


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
def test_random_systems_do_as_in_the_interpreter(version: str, tmp_path: Path) -> None:
    from tests.codegen.fmu.importer import Importer

    compared = linked = 0
    systems = _random_systems(version)
    for _ in range(RANDOM):
        seed, system = next(systems)
        folder = tmp_path / str(seed)
        folder.mkdir()
        file = build_fmu(folder, system, version)
        compared += _play(seed, system, partial(Importer, file))
        linked += len(system.event_links) + len(system.input_links)
    assert compared > 5 * RANDOM
    assert linked >= RANDOM


# --- random systems ------------------------------------------------------------------------------


def _charts(version: str) -> Iterator[Chart]:
    number = 0
    while True:
        number += 1
        chart = random_case(11, number).chart
        if can_be_compared(chart, version):
            yield chart


def _random_systems(version: str) -> Iterator[tuple[int, System]]:
    """Yield systems of three random charts, of which all is connected that fits."""
    charts = _charts(version)
    seed = 0
    while True:
        seed += 1
        choose = random.Random(seed)
        machines = tuple(Machine(f"m{n}", next(charts)) for n in range(3))
        if len({machine.chart.capacities.tick for machine in machines}) > 1:
            continue
        events: list[EventLink] = []
        inputs: list[InputLink] = []
        for source, machine in enumerate(machines):
            chart = machine.chart
            ports = list(sent_events(chart))
            ports += [operation_port(chart, o.name) for o in chart.operations if o.result is None]
            for port in ports:
                found = [
                    EventLink(source, port, target, event, arguments)
                    for target, other in enumerate(machines)
                    for event in posted_events(other.chart)
                    if (arguments := _arguments(chart, port, other.chart, event)) is not None
                ]
                events += choose.sample(found, min(len(found), choose.randrange(2)))
            for target, other in enumerate(machines):
                for number, wanted in enumerate(other.chart.inputs):
                    fits = [n for n, o in enumerate(chart.outputs) if o.type == wanted.type]
                    is_free = all((i.target, i.input) != (target, number) for i in inputs)
                    if fits and is_free and target != source and _is_scalar(wanted.type):
                        inputs.append(InputLink(source, choose.choice(fits), target, number))
        system = System("Together", machines, tuple(events), tuple(inputs))
        if (events or inputs) and report_limits(system, Findings()):
            yield seed, system


def _is_scalar(type_: Type) -> bool:
    return not isinstance(type_, ArrayType | RecordType | SymbolType)


def _arguments(chart: Chart, port: int, other: Chart, event: int) -> tuple[int, ...] | None:
    """Return which value of a port each field of an event takes; None where one has none."""
    given = port_fields(chart, port)
    found = []
    for field in other.events[event].fields:
        fits = [n for n, each in enumerate(given) if each.type == field.type]
        if not fits or not _is_scalar(field.type):
            return None
        found.append(fits[0])
    return tuple(found)


# --- playing -------------------------------------------------------------------------------------


def _play(seed: int, system: System, instance: Callable[[str], Any]) -> int:
    """Play random events, inputs and times on both; return how many steps were compared."""
    from fmpy.fmi1 import FMICallException

    choose = random.Random(seed)
    beside = SystemBeside(system)
    fmu = instance("one")
    hosts = [SeededHost(machine.chart, seed) for machine in system.machines]
    tick = system.machines[0].chart.capacities.tick / 1e6
    posts = _posted(fmu, system)
    free = [
        (machine, number)
        for machine, one in enumerate(system.machines)
        for number in range(len(one.chart.inputs))
        if all((i.target, i.input) != (machine, number) for i in system.input_links)
    ]
    now = 0
    restored_at = choose.randrange(STEPS)
    what: Any = None
    kind = "start"
    for step in range(STEPS):
        is_refused = False
        try:
            if kind == "start":
                beside.start()
                beside.run(0)
            elif kind == "post":
                machine, event, arguments = what
                is_refused = not beside.session.post(machine, event, **arguments)
                beside.run(now)
            elif kind == "drive":
                machine, number, value = what
                name = system.machines[machine].name
                beside.session.drive(name, number, value)
                beside.run(now)
            else:
                beside.run(now)
        except FsmkitError:  # they do not come to rest
            fmu.close()
            return step
        try:
            _do(fmu, system, kind, what, tick)
        except FMICallException:
            assert beside.fault is not None or is_refused or len(beside.seen) > ROOM
            return step
        if beside.fault is not None:
            return step
        _compare(f"system {seed}, step {step}", fmu, beside)
        if step == restored_at:
            saved = fmu.saved()
            other = instance("two")
            other.start({})
            other.restore(saved)
            other.time, other.seen, other._counts = fmu.time, fmu.seen, fmu._counts
            fmu.close()
            fmu = other
        kind, what, now = _chosen(choose, system, hosts, posts, free, now)
    fmu.close()
    return STEPS


def _posted(fmu: Any, system: System) -> list[tuple[int, int]]:
    """Return the events that an importer can post: machine and event."""
    return [
        (number, event)
        for number, machine in enumerate(system.machines)
        for event in posted_events(machine.chart)
        if f"{machine.name}.post.{machine.chart.events[event].name}" in fmu.by_name
    ]


def _chosen(
    choose: random.Random,
    system: System,
    hosts: list[SeededHost],
    posts: list[tuple[int, int]],
    free: list[tuple[int, int]],
    now: int,
) -> tuple[str, Any, int]:
    roll = choose.random()
    if posts and roll < 0.6:
        number, event = choose.choice(posts)
        machine = system.machines[number]
        fields = machine.chart.events[event].fields
        arguments = {f.name: to_python(hosts[number].value(f.type), f.type) for f in fields}
        return "post", (machine.name, machine.chart.events[event].name, arguments), now
    if free and roll < 0.7:
        number, place = choose.choice(free)
        wanted = system.machines[number].chart.inputs[place]
        if _is_scalar(wanted.type):
            return "drive", (number, place, hosts[number].value(wanted.type)), now
    passed = choose.choice((1, 3, 10, 40, 100, 500))
    return "pass", passed, now + passed


def _do(fmu: Any, system: System, kind: str, what: Any, tick: float) -> None:
    if kind == "start":
        fmu.start({})
    elif kind == "post":
        name, event, arguments = what
        machine = next(each for each in system.machines if each.name == name)
        declared = machine.chart.events[machine.chart.event_index[event]]
        fields: dict[str, object] = {}
        for part in declared.fields:
            value = from_python(arguments[part.name], part.type)
            for path, scalar in named(part.type, value):
                fields[f"{part.name}{path}"] = scalar
        fmu.tick(f"{name}.post.{event}", fields)
    elif kind == "drive":
        number, place, value = what
        machine = system.machines[number]
        fmu[f"{machine.name}.{machine.chart.inputs[place].name}"] = value
        fmu.look()
    else:
        fmu.advance(what * tick)


def _compare(where: str, fmu: Any, beside: SystemBeside) -> None:
    expected = beside.states()
    assert {name: fmu[name] for name in expected} == expected, where
    for kind in (".send.", ".call."):
        got = [seen for seen in fmu.seen if kind in seen[0]]
        wanted = [seen for seen in beside.seen if kind in seen[0]]
        if fmu.is_3:
            assert got == wanted, where
        else:
            assert sorted(n for n, _ in got) == sorted(n for n, _ in wanted), where
    fmu.seen.clear()
    beside.seen.clear()
