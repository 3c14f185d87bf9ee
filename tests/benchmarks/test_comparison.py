"""The comparison: its computations, and its driver with the C and the Python of today."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from benchmarks.comparison import c_machines, measure_python, python_machines
from benchmarks.comparison.figures import (
    FSMKIT,
    LIMIT,
    Machine,
    Price,
    Results,
    Speed,
    less,
    limit,
    per_event,
    ratio,
)
from benchmarks.comparison.measure_c import Bench, costs, figures, prepare
from benchmarks.comparison.report import markdown, number, sheets
from benchmarks.comparison.saving import machine_name, save, slug
from benchmarks.comparison.tools import (
    HOST,
    UnavailableError,
    code_bytes,
    read_count,
    read_sections,
    run,
)
from benchmarks.yardstick.charts import read_chart
from benchmarks.yardstick.model import Digests, digest
from benchmarks.yardstick.streams import EVENTS, Stream, digests_of
from fsmkit.chart.loading import load

CHART = """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" name="Lamp"
       initial="Off">
 <datamodel>
  <data id="n" expr="0"/>
  <data id="c0" expr="0"/><data id="c1" expr="0"/><data id="c2" expr="0"/><data id="c3" expr="0"/>
 </datamodel>
 <state id="Off">
  <onentry><assign location="c0" expr="c0 + 1"/></onentry>
  <onexit><assign location="c1" expr="c1 + 1"/></onexit>
  <transition event="PUSH" target="On"><assign location="n" expr="n + 3"/></transition>
 </state>
 <state id="On">
  <onentry><assign location="c2" expr="c2 + 1"/></onentry>
  <onexit><assign location="c3" expr="c3 + 1"/></onexit>
  <transition event="PUSH" target="Off"/>
  <transition event="TICK"><assign location="n" expr="n - 1"/></transition>
 </state>
</scxml>
"""
PATTERN = bytes([0, 1, 1, 0, 0])


@cache
def lamp(events: bytes) -> Digests:
    """Do by hand what the chart says."""
    n, is_on, counters, order, path = 0, False, [1, 0, 0, 0], 0, 2166136261
    for event in events:
        if event == 0:
            left, entered = (3, 0) if is_on else (1, 2)
            counters[left] += 1
            counters[entered] += 1
            order = ((order * 31 + left) * 31 + entered) & 0xFFFFFFFF
            n += 0 if is_on else 3
            is_on = not is_on
        elif is_on:
            n -= 1
        path = ((path ^ (n & 0xFF)) * 16777619) & 0xFFFFFFFF
    return Digests(digest([n, *counters]), f"{path:08x}", f"{order:08x}")


@pytest.fixture
def stream(tmp_path: Path) -> Stream:
    (tmp_path / "L.scxml").write_text(CHART)
    events = PATTERN * (EVENTS // len(PATTERN))
    (tmp_path / "ev_L.bin").write_bytes(events)
    chart = read_chart(tmp_path / "L.scxml")
    return Stream("L", chart, ("PUSH", "TICK"), tmp_path / "ev_L.bin", events, lamp(events))


@pytest.fixture
def machine(stream: Stream) -> c_machines.Machine:
    chart = load(stream.file.parent / "L.scxml")
    return c_machines.generate(chart, c_machines.VARIANTS[0])


def bench(folder: Path, notes: list[str]) -> Bench:
    return Bench(folder, notes.append)


@pytest.mark.cc
def test_the_driver_sees_the_work_the_path_and_the_order_of_generated_c(
    stream: Stream, machine: c_machines.Machine, tmp_path: Path,
    require_tool: Callable[[str], str],
) -> None:  # fmt: skip
    require_tool("gcc")
    made = prepare(bench(tmp_path, []), machine, stream)
    verifier = made.program("verify", made.sources(), "-DBENCH_VERIFY")
    did = run([verifier, stream.file, "verify"], made.folder).split()
    assert Digests(*did) == stream.digests
    # the machine that stands for the loop does nothing
    empty = made.program("idle", ["bench_empty.c"], "-DBENCH_VERIFY")
    idle = run([empty, stream.file, "verify"], made.folder).split()
    assert idle[0] == digest([0] * 5)
    assert idle[2] == "00000000"


@pytest.mark.slow
@pytest.mark.external
def test_figures_of_generated_c(
    stream: Stream, machine: c_machines.Machine, tmp_path: Path,
    require_tool: Callable[[str], str],
) -> None:  # fmt: skip
    for tool in ("gcc", "valgrind", "arm-none-eabi-gcc"):
        require_tool(tool)
    notes: list[str] = []
    here = bench(tmp_path, notes)
    made = prepare(here, machine, stream)
    found = figures(here, made)
    assert notes == []
    assert found.is_correct
    assert found.is_ordered
    assert found.instructions is not None
    assert 3 < found.instructions < 1000
    assert found.code_m0 is not None
    assert found.code_x64 is not None
    assert 50 < found.code_m0 < found.code_x64 * 2
    assert found.ram_m0 is not None
    assert 0 < found.ram_m0 < 200
    # a machine that did something else is not taken for correct
    wrong = replace(stream, digests=replace(stream.digests, work="0" * 8))
    assert not figures(here, prepare(here, machine, wrong)).is_correct


@pytest.mark.cc
def test_parts_cost_nothing_less_than_nothing(
    stream: Stream, machine: c_machines.Machine, tmp_path: Path,
    require_tool: Callable[[str], str],
) -> None:  # fmt: skip
    require_tool("gcc")
    made = prepare(bench(tmp_path, []), machine, stream)
    found = costs(made, HOST)
    assert found
    assert min(found.values()) >= 0
    objects = made.objects(HOST)
    assert made.linked(HOST, objects, ("init",)) < made.linked(HOST, objects, c_machines.VERBS)


@pytest.mark.cc
@pytest.mark.parametrize("target", ["python", "pyext"])
def test_python_is_evaluated_by_the_same_digests(
    stream: Stream, tmp_path: Path, require_tool: Callable[[str], str], target: str
) -> None:
    require_tool("cc")
    chart = tmp_path / "L.scxml"
    contender = python_machines.by_fsmkit(chart, stream, tmp_path, FSMKIT, target)
    events = PATTERN * 50
    assert python_machines.is_correct(contender, events, lamp(events))
    assert not python_machines.is_correct(contender, events, lamp(events[:-1]))
    assert measure_python.seconds(contender, events) > 0


@pytest.mark.cc
def test_a_note_says_what_is_missing(
    stream: Stream, machine: c_machines.Machine, tmp_path: Path,
    require_tool: Callable[[str], str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    bin_folder = tmp_path / "bin"
    bin_folder.mkdir()
    for tool in ("gcc", "as", "ld", "size"):
        (bin_folder / tool).symlink_to(require_tool(tool))
    monkeypatch.setenv("PATH", str(bin_folder))
    notes: list[str] = []
    here = bench(tmp_path, notes)
    found = figures(here, prepare(here, machine, stream))
    assert found.is_correct
    assert (found.instructions, found.code_m0) == (None, None)
    assert found.code_x64 is not None
    assert set(notes) == {
        f"{tool} is not installed; `make tools` installs it"
        for tool in ("valgrind", "arm-none-eabi-gcc")
    }


def test_calls_follow_the_prototypes_of_the_header(machine: c_machines.Machine) -> None:
    header = (
        "uint8_t bench_lamp_dispatch(bench_lamp *m, bench_lamp_event e);\n"
        "void bench_lamp_start(bench_lamp *m, uint32_t now);\n"
        "void bench_lamp_init(double volts);\n"
    )
    changed = replace(machine, files={**machine.files, "bench_lamp.h": header})
    assert c_machines.call(changed, "dispatch") == "bench_lamp_dispatch(&machine, events[i])"
    assert c_machines.call(changed, "start") == "bench_lamp_start(&machine, 0)"
    with pytest.raises(UnavailableError, match="cannot pass `double volts`"):
        c_machines.call(changed, "init")
    with pytest.raises(UnavailableError, match="no function bench_lamp_run"):
        c_machines.call(changed, "run")


def test_variants_of_equal_text_are_one(machine: c_machines.Machine) -> None:
    first, second = c_machines.VARIANTS[:2]
    other = replace(machine, variant=second, files={**machine.files, "bench_lamp.c": "/**/"})
    kept, same = c_machines.different([machine, replace(machine, variant=second), other])
    assert kept == [machine, other]
    assert same == [f"`{second.name}` is `{first.name}`"]


def test_macros_that_leave_something_out_are_found(machine: c_machines.Machine) -> None:
    text = "#ifndef FSM_NO_QUEUE\n#if X && !defined(FSM_NO_GUARD)\n#ifndef FSM_NO_NAMES\n"
    text += "/* FSM_NO_X is nothing that is tested */\n"
    changed = replace(machine, files={"bench_lamp.h": text})
    assert c_machines.switches(changed) == ["FSM_NO_GUARD", "FSM_NO_QUEUE"]
    assert "FSM_NO_GUARD" in c_machines.without(changed, "FSM_NO_GUARD").variant.macros


def test_the_model_interprets_a_chart(stream: Stream) -> None:
    assert digests_of(stream, PATTERN * 50) == lamp(PATTERN * 50)
    assert digests_of(stream, PATTERN * 50) != lamp(PATTERN * 50 + PATTERN[:1])


@pytest.mark.cc
def test_what_tools_print_is_read() -> None:
    assert read_count("==7== I   refs:      29,871,269\n") == 29_871_269
    with pytest.raises(UnavailableError, match="counted nothing"):
        read_count("==7== error\n")
    listed = (
        "m.o  :\nsection   size  addr\n.text.a   12  0\n.text.a   3  0\n.rodata.T  64  0\n"
        ".data  2  0\n.eh_frame  56  0\n.textual  9  0\n.bss  5  0\nTotal  151\n"
    )
    found = read_sections(listed)
    assert found[".text.a"] == 15
    assert "Total" not in found
    assert code_bytes(found) == 15 + 64 + 2
    with pytest.raises(UnavailableError, match="no-such-tool is not installed"):
        run(["no-such-tool"], Path())
    with pytest.raises(UnavailableError, match=r"failed \(1\)"):
        run([shutil.which("false") or "false"], Path())


def test_the_loop_is_taken_away_but_not_the_return() -> None:
    assert per_event(once=100_030, twice=200_030, loop=70_000, count=10_000) == 4.0


def made(name: str, kind: str, **figures: Any) -> Machine:
    return Machine("A", name, kind, **{"is_correct": True, "is_ordered": True, **figures})


def test_the_limit_is_the_best_of_those_that_do_the_same() -> None:
    machines = [
        made("a", LIMIT, instructions=20.0, code_m0=300),
        made("b", LIMIT, instructions=16.0, code_m0=400),
        made("other order", LIMIT, instructions=1.0, is_ordered=False),
        made("wrong", LIMIT, instructions=2.0, is_correct=False),
        made("ours", FSMKIT, instructions=3.0),
        replace(made("other chart", LIMIT, instructions=4.0), chart="B"),
    ]
    assert limit(machines, "A", "instructions") == 16.0
    assert limit(machines, "A", "code_m0") == 300.0
    assert limit(machines, "A", "ram_m0") is None
    assert ratio(24.0, 16.0) == 1.5
    assert ratio(None, 16.0) is None
    assert ratio(3.0, 0.0) is None
    assert less(5, 3) == 2
    assert less(5, None) is None


def test_a_ratio_is_of_the_same_round() -> None:
    assert measure_python.median_ratio([10.0, 90.0, 30.0], [20.0, 100.0, 30.0]) == 0.9


def test_without_a_history_its_events_enter_by_default(stream: Stream) -> None:
    other = replace(stream, names=("ON", "RESUME", "OFF"))
    assert measure_python.without_history(other, bytes([0, 1, 2, 1])) == bytes([0, 0, 2, 0])
    assert measure_python.without_history(stream, bytes([0, 1])) == bytes([0, 1])


RESULTS = Results(
    "2026-11-21", "x86_64 Some CPU", {"gcc": "gcc 12", "valgrind": ""},
    [
        made("flat", LIMIT, instructions=15.0, code_m0=348, ram_m0=4),
        made("fsmkit", FSMKIT, instructions=30.0, code_m0=390, ram_m0=36),
        made("fsmkit, size", FSMKIT, is_correct=False),
    ],
    [Price("A", "fsmkit", "queue", code_m0=20, code_x64=30)],
    [Speed("A", "fsmkit", FSMKIT, 1000, 5e5, 0.71, is_correct=True)],
    ["valgrind is not installed"],
)  # fmt: skip


def test_the_tables_say_ratios_aims_and_verdicts() -> None:
    instructions, sizes, prices, speeds = sheets(RESULTS)
    assert instructions.rows == (
        ("A", "flat (by hand)", "15.0", "1.00", "", "equal"),
        ("A", "fsmkit", "30.0", "2.00", "17 missed", "equal"),
        ("A", "fsmkit, size", "-", "-", "17", "WRONG"),
    )
    assert sizes.rows[1] == ("A", "fsmkit", "390", "1.12", "400 met", "-", "36", "-", "4 missed")
    assert prices.columns == ("machine", "part", "M0 A", "x64 A")
    assert prices.rows == (("fsmkit", "queue", "+20", "+30"),)
    assert speeds.rows[0][3:5] == ("0.7100", "0.7 met")
    assert not RESULTS.is_correct
    assert number(12345.6) == "12,346"


def test_what_is_kept(tmp_path: Path) -> None:
    json_file, page = save(RESULTS, tmp_path)
    assert json_file.name == "2026-11-21-x86-64-some-cpu.json"
    kept = json.loads(json_file.read_text())
    assert kept["machines"][1]["instructions"] == 30.0
    assert kept["notes"] == RESULTS.notes
    text = page.read_text()
    assert text == markdown(RESULTS)
    assert "| A | fsmkit | 30.0 | 2.00 | 17 missed | equal |" in text
    assert "* valgrind is not installed" in text
    widths = {line.count("|") for line in text.splitlines() if "instr/event" in line}
    assert widths == {7}


def test_the_name_of_a_machine_is_its_processor() -> None:
    name = machine_name("processor : 0\nmodel name\t: Intel(R) Xeon(R)  CPU @ 2.2GHz\n")
    assert name.endswith(" Intel(R) Xeon(R) CPU @ 2.2GHz")
    assert slug("x86_64 Intel(R) Xeon(R) CPU @ 2.2GHz") == "x86-64-intel-xeon-cpu-2-2ghz"
