"""Counters in generated code: they are those of the interpreter, and damaged ones are refused."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from devtools.coverage import Totals, compared
from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.cli import execute
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import read_options
from fsmkit.codegen.python.loading import load_machine
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import read_chart
from fsmkit.testing.coverage.counters import read_counters
from fsmkit.testing.coverage.record import ChartCoverage, Recorder, load
from fsmkit.testing.coverage.reports import figures, lines
from fsmkit.testing.machines import make_machine
from tests import needs
from tests.codegen.c.conftest import WARNINGS

MANY = " or ".join(f"n == {number}" for number in range(9))
CHART = f"""\
chart: Valve
inputs: {{high: bool, low: bool, n: 0..9}}
events: {{in: [tick, tock]}}
initial: shut
states:
  shut:
    on:
      tick: [{{if: high and not low, target: open}}, {{if: not low}}]
      tock: {{if: "high or (low and 8 / n > 1)", target: open}}
      error.execution: shut
  open:
    on: {{tick: {{if: {MANY}, target: shut}}, tock: shut}}
    after: {{10s: late}}
  late: {{}}
"""
SCRIPT: tuple[tuple[str, bool, bool, int], ...] = (
    ("tick", False, True, 0), ("tick", False, False, 0), ("tock", False, True, 0),
    ("tock", False, True, 4), ("tick", True, True, 9), ("tick", True, True, 8),
    ("tick", True, False, 3), ("tock", True, False, 3),
)  # fmt: skip


@pytest.fixture
def valve(tmp_path: Path) -> Path:
    (tmp_path / "valve.yaml").write_text(CHART)
    return tmp_path / "valve.yaml"


def chart_of(path: Path) -> Chart:
    return read_chart(path, Findings())


def counted(path: Path) -> Any:
    """Return a generated machine in Python that did the script."""
    machine = load_machine(chart_of(path), covered=True)()
    machine.start()
    for event, machine.high, machine.low, machine.n in SCRIPT:
        machine.dispatch(event)
    return machine


def interpreted(path: Path) -> ChartCoverage:
    recorder = Recorder()
    machine = make_machine(path, None, recorder)
    for event, high, low, number in SCRIPT:
        machine.inputs.update({"high": high, "low": low, "n": number})
        machine.dispatch(event)
    (found,) = recorder.coverage()
    return found


def ignoring_counts(coverage: ChartCoverage) -> tuple[object, ...]:
    """What generated code counts of ways through guards is left out: C notes them only."""
    decisions = [(d.true, d.false, [way for way, _ in d.seen]) for d in coverage.decisions]
    return coverage.fingerprint, coverage.states, coverage.transitions, decisions


def test_generated_python_counts_as_the_interpreter(valve: Path, tmp_path: Path) -> None:
    data = tmp_path / "counters"
    data.write_bytes(b"noise" + counted(valve).coverage())
    (found,) = read_counters(data, [chart_of(valve)])
    assert ignoring_counts(found) == ignoring_counts(interpreted(valve))
    assert figures(found) == figures(interpreted(valve))
    # tock with n == 0 cannot be evaluated: it counts as nothing, and leaves nothing behind
    assert [d.true + d.false for d in found.decisions] == [3, 2, 1, 2]


def test_a_counter_stops_where_it_is_full(valve: Path, tmp_path: Path) -> None:
    machine = counted(valve)
    for _ in range(300):
        machine.start()
    data = tmp_path / "counters"
    data.write_bytes(machine.coverage())
    (found,) = read_counters(data, [chart_of(valve)])
    assert found.states[0].count == 255


@pytest.mark.external
@pytest.mark.cc
@pytest.mark.parametrize("optimize", ["", "size"])
def test_python_and_c_count_random_charts_as_the_interpreter(optimize: str) -> None:
    totals = Totals()
    cases = [random_case(3, number) for number in (4, 8, 12)]
    assert list(compared(cases, totals, optimize)) == []
    assert totals.items > 50


@pytest.mark.cc
def test_counters_of_c_come_into_the_report(
    valve: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = generate_machine(chart_of(valve), None, read_options({"with": "coverage"}))
    for name, text in made.files.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "valve.h"\n'
        "static void put(void *arg, const uint8_t *bytes, size_t count)\n"
        "{\n    (void)fwrite(bytes, 1, count, arg);\n}\n"
        "int main(void)\n{\n    static valve m;\n    valve_init(&m);\n    valve_start(&m, 0u);\n"
        "    valve_coverage(put, stdout);\n    valve_coverage_clear();\n    m.in.low = true;\n"
        "    valve_event e = VALVE_NO_EVENT;\n    e.event = VALVE_EVENT_TICK;\n"
        "    (void)valve_dispatch(&m, &e, 0u);\n    valve_coverage(put, stdout);\n"
        "    return sizeof(valve) > 0u && VALVE_COVERAGE_BYTES > 0u ? 0 : 1;\n}\n"
    )
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
    sources = [name for name in (*made.files, "main.c") if name.endswith(".c")]
    subprocess.run(["cc", *flags, *sources, "-o", "run"], cwd=tmp_path, check=True)
    data = tmp_path / "counters"
    data.write_bytes(subprocess.run([tmp_path / "run"], check=True, capture_output=True).stdout)
    folder = str(tmp_path / "counts")
    assert execute(["coverage", folder, "--add", str(valve), str(data), "--missing"]) == 0
    told = capsys.readouterr().out
    assert "1 of 3" in told
    assert "guard never true: high and not low" in told
    assert "guard never false: high and not low" not in told
    assert execute(["coverage", folder, "--only-reachable", str(valve)]) == 0
    capsys.readouterr()


def test_damaged_and_foreign_counters_are_refused(valve: Path, tmp_path: Path) -> None:
    whole = counted(valve).coverage()
    data = tmp_path / "counters"
    for content, message in (
        (b"", "there are no counters"),
        (whole[:-1], "cut off"),
        (whole[:10], "cut off"),
        (whole[:30] + bytes([whole[30] ^ 1]) + whole[31:], "check of those at byte 0 is wrong"),
    ):
        data.write_bytes(content)
        with pytest.raises(FsmkitError, match=message):
            read_counters(data, [chart_of(valve)])
    data.write_bytes(whole)
    valve.write_text(CHART.replace("10s", "11s"))
    with pytest.raises(FsmkitError, match="which is not `Valve`"):
        read_counters(data, [chart_of(valve)])
    with pytest.raises(FsmkitError, match="cannot be read"):
        read_counters(tmp_path / "absent", [])


def test_without_the_part_nothing_of_c_knows_of_it(valve: Path) -> None:
    chart = chart_of(valve)
    for optimize in ("", "size"):
        options = {"optimize": optimize, "with": "save,trace,records"}
        plain = generate_machine(chart, None, read_options(options)).files
        assert not [n for n, text in plain.items() if "coverage" in text or "counters" in text]
        options["with"] += ",coverage"
        more = generate_machine(chart, None, read_options(options)).files
        assert {n for n in more if n not in plain} == {"fsm_coverage.c", "fsm_coverage.h"}


@pytest.mark.parametrize("name", ["coverage", "COVERAGE_BYTES"])
def test_what_the_part_needs_is_not_taken_from_the_chart(name: str, tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    declared = f"constants: {{{name}: 3}}" if name.isupper() else f"operations: [{name}()]"
    path.write_text(
        f"chart: A\n{declared}\nevents: {{in: [go]}}\n"
        "states: {a: {on: {go: {do: coverage()}}}}\n".replace(
            "{do: coverage()}", "a" if name.isupper() else "{do: coverage()}"
        )
        + "initial: a\n"
    )
    chart = chart_of(path)
    generate_machine(chart)
    with pytest.raises(FsmkitError, match="equal in C to one of the part"):
        generate_machine(chart, None, read_options({"with": "coverage"}))


@pytest.mark.cc
def test_what_no_run_reaches_leaves_the_denominator(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(
        "chart: A\ndata: {n: 0..3 = 0}\nevents: {in: [go]}\ninitial: a\nstates:\n"
        "  a: {on: {go: [{if: n > 2, target: b}, {do: n = 1}]}}\n"
        "  b: {on: {go: {if: n > 1, target: a}}}\n"
    )
    (tmp_path / "a.test.yaml").write_text(
        "tests: A\nchart: a.yaml\ncases:\n  goes:\n    - post go\n    - expect: {in: a}\n"
    )
    counts = str(tmp_path / "counts")
    assert execute(["test", str(tmp_path), "--cov", "--cov-folder", counts]) == 0
    capsys.readouterr()
    assert execute(["coverage", counts, "--only-reachable", str(path)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "A 1 of 1 1 of 1 1 of 2 0 of 1" in told
    assert "A: out of reach are 1 state, 2 transitions and 1 guard: `fsmkit check" in told


def test_items_of_copies_count_for_each_and_summed_on_their_lines(tmp_path: Path) -> None:
    (tmp_path / "axis.yaml").write_text(
        "chart: Axis\nevents: {in: [go]}\ninitial: idle\nstates:\n"
        "  idle: {on: {go: busy}}\n  busy: {}\n"
    )
    (tmp_path / "press.yaml").write_text(
        "chart: Press\nevents: {in: [left, right]}\ninitial: work\nstates:\n  work:\n    regions:\n"
        "      one: {use: axis.yaml, bind: {go: left}}\n"
        "      two: {use: axis.yaml, bind: {go: right}}\n"
    )
    recorder = Recorder()
    machine = make_machine(tmp_path / "press.yaml", None, recorder)
    machine.dispatch("left")
    coverage = recorder.coverage()
    (press,) = coverage
    of_axis = [item for item in press.states if item.at.file.endswith("axis.yaml")]
    assert [item.count for item in of_axis if "busy" in item.text] == [1, 0]
    (file,) = (name for name in lines(coverage) if name.endswith("axis.yaml"))
    assert lines(coverage)[file][6].hits == 1
    assert lines(coverage)[file][5].hits == 3


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang", "g++"])
def test_ways_through_guards_in_c_are_one_expression(tmp_path: Path, compiler: str) -> None:
    """A condition that is a choice keeps its ends, and no compiler warns of the whole."""
    text = CHART.replace("{if: not low}", '{if: "(high if low else n > 3) or low"}')
    (tmp_path / "valve.yaml").write_text(text)
    options = read_options({"with": "coverage"})
    machine = generate_machine(chart_of(tmp_path / "valve.yaml"), "valve", options)
    source = machine.files["valve.c"]
    assert "((m->in.low ? m->in.high : m->in.n > 3) ? " in source
    for name, each in machine.files.items():
        (tmp_path / name).write_text(each)
    standard = ["-x", "c++"] if compiler == "g++" else ["-std=c99"]
    done = subprocess.run(
        [needs.tool(compiler), *standard, *WARNINGS, "-c", "valve.c"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("target", ["python", pytest.param("c", marks=pytest.mark.cc)])
def test_tested_code_counts_itself(
    target: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.yaml").write_text(
        "chart: A\nevents: {in: [go, no]}\ndata: {n: 0..9 = 0}\ninitial: a\nstates:\n"
        "  a: {on: {go: {if: n == 0, target: b}, no: b}}\n  b: {on: {go: a}}\n"
    )
    steps = "    - post go\n" * 600
    (tmp_path / "a.test.yaml").write_text(
        f"tests: A\nchart: a.yaml\ncases:\n  goes:\n{steps}    - expect: {{in: a}}\n"
        "  starts:\n    - expect: {in: a}\n"
    )
    found, counts = {}, {}
    for one in ("interpreter", target):
        folder = tmp_path / one
        arguments = ["test", str(tmp_path), "--cov", "--cov-folder", str(folder), "--json"]
        assert execute([*arguments, "--target", one]) == 0
        found[one] = json.loads(capsys.readouterr().out)["coverage"]
        (chart,) = load(folder)
        counts[one] = [item.count for item in chart.transitions]
    assert found[target] == found["interpreter"]
    assert counts["interpreter"] == [300, 0, 300]
    assert counts[target] == [255, 0, 255]  # a byte for each, which stops there
