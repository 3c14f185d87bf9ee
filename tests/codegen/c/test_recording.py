"""The interpreter replays the records of a machine in C: the same lines, or an error."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import pytest

from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.limits import report_limits
from fsmkit.diagnostics import Findings
from fsmkit.plan import lower
from fsmkit.plan.image import head, image_of, sealed
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.script import run_script
from fsmkit.runtime.tracing.following import (
    Changed,
    CompleteState,
    Divergence,
    Follower,
    Missing,
    Posted,
    ReplayedStep,
)
from fsmkit.runtime.tracing.merging import merge_contexts
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.records import (
    Lost,
    SnapshotRecord,
    Spoilt,
    Sync,
    TimeRecord,
    TransitionRecord,
)
from fsmkit.runtime.tracing.stream import Line, Stream
from tests.codegen.c.recorded import RECORDED, by_interpreter, followed, lines, recorded, unreported

SHOP = Path(__file__).parents[2] / "golden/shop.yaml"
RANDOM = 30
LAMP = """
chart: Lamp
events: {in: ["press(n 0..9)", ask]}
inputs: {dark: bool = false, level: int16}
operations: [sense() -> 0..100, click]
data: {light: 0..100 = 0}
initial: off
states:
  off: {on: {press: [{target: on, if: dark and event.n > 3, do: light = sense()}]}}
  on: {entry: click(), after: {20ms: off}}
"""
SCRIPT = [
    "seed 7", "start 4294967290", "input dark 1", "post press 3", "run 4294967290", "post press 9",
    "run 4294967295", "run 18", "run 19", "dispatch ask", "input level -5", "run 20",
]  # fmt: skip
OMITTED = ("d ", "saved ", "answer", "full queue")
Write = Callable[[Path, Mapping[str, str]], Path]


@pytest.fixture(scope="module")
def lamp(tmp_path_factory: pytest.TempPathFactory) -> Chart:
    path = tmp_path_factory.mktemp("lamp") / "lamp.yaml"
    path.write_text(LAMP)
    return load(path)


def macrosteps(trace: Sequence[str]) -> list[str]:
    """Return the lines of macrosteps; symbols of the host have numbers in C alone."""
    kept = [line for line in trace if not line.rpartition(": ")[2].startswith(OMITTED)]
    return [re.sub('"[^"]*"', '"?"', line) for line in kept]


def expressible(count: int) -> list[tuple[Chart, Sequence[str]]]:
    """Return random charts that C can express, with scripts.

    No operation posts: where nothing else of the call was recorded yet, a follower takes the event
    for one that was posted between two calls.
    """
    found: list[tuple[Chart, Sequence[str]]] = []
    number = 0
    while len(found) < count:
        case, findings = random_case(11, number), Findings()
        report_limits(case.chart, findings)
        number += 1
        if not findings.has_errors:
            script = [line for line in case.script if not line.startswith("within ")]
            found.append((case.chart, script))
    return found


@pytest.mark.slow
@pytest.mark.cc
def test_random_charts_are_followed(tmp_path: Path) -> None:
    """At level 2 the trace of the interpreter is made again; at level 1 the states."""
    jobs = expressible(RANDOM)
    for (chart, script), data in zip(jobs, recorded(tmp_path, jobs), strict=True):
        found = followed(chart, data)
        assert [each for each in found if isinstance(each, Missing | Divergence)] == []
        assert macrosteps(lines(chart, found)) == macrosteps(run_script(chart, script))


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("level", [1, 2])
def test_the_interpreter_writes_the_same_bytes(level: int, tmp_path: Path) -> None:
    """But for symbols, which have other numbers in C where the host made them."""
    jobs = [job for job in expressible(RANDOM) if not has_symbols(job[0])]
    for (chart, script), data in zip(jobs, recorded(tmp_path, jobs, level=level), strict=True):
        assert by_interpreter(chart, script, level) == data


def has_symbols(chart: Chart) -> bool:
    inner = any(has_symbols(invocation.chart) for invocation in chart.invocations)
    return inner or image_of(chart).stores_symbols


@pytest.mark.slow
@pytest.mark.cc
def test_the_states_of_random_charts_are_followed_at_level_1(tmp_path: Path) -> None:
    """Each sync, one a call here, contains the states that were replayed up to it."""
    jobs = expressible(RANDOM // 2)
    traces = recorded(tmp_path, jobs, level=1, defined="#define FSM_TRACE_SYNC 0")
    compared = 0
    for (chart, _), data in zip(jobs, traces, strict=True):
        at: list[str] | None = None
        running = False
        for each in followed(chart, data):
            assert not isinstance(each, Missing | Divergence)
            if isinstance(each, CompleteState):
                told = active_leaves(chart, each.snapshot)
                # a sync newly reports a start or an end that no transition shows
                assert not (running and each.snapshot.running) or at is None or told == at
                at, running = told, each.snapshot.running
                compared += 1
            if isinstance(each, ReplayedStep) and each.machine == 0:
                at, running = active_leaves(chart, each.macrostep.after), True
    assert compared > RANDOM


@pytest.mark.cc
def test_a_machine_is_followed_across_the_wrap_of_the_clock(lamp: Chart, tmp_path: Path) -> None:
    (data,) = recorded(tmp_path, [(lamp, SCRIPT)])
    found = followed(lamp, data)
    assert lines(lamp, found) == run_script(lamp, SCRIPT)
    posted = [each.occurrence.payload for each in found if isinstance(each, Posted)]
    assert posted == [(3,), (9,)]
    told = [(each.place, each.value) for each in found if isinstance(each, Changed)]
    assert told == [(0, False), (1, 0), (0, True), (1, -5)]
    assert found[-1].at == 2**32 + 20


@pytest.mark.cc
def test_bytes_by_hand(lamp: Chart, tmp_path: Path) -> None:
    """docs/reference/trace.md: the records of a lamp that is pressed."""
    script = ["seed 7", "start 5", "input dark 1", "post press 9", "run 105", "run 125"]
    numbering = Numbering(lamp)
    (two,) = recorded(tmp_path, [(lamp, script)])
    (one,) = recorded(tmp_path, [(lamp, script)], level=1)
    sync = b"\x73\x8c\x00" + numbering.hash + b"\x05\0\0\0\x00"
    assert one == b"".join([sync, b"\0\0\0", b"\x03", b"\xe4\x01", b"\x94\x02"])
    # numbers: 3 transitions, 1 start, posted events from 4, dispatched from 9, inputs 14 and 15
    assert (numbering.first_start, numbering.first_event, numbering.first_input) == (3, 4, 14)
    assert two == b"".join(
        [sync, b"\x04\0\0", b"\x0e\0", b"\x0f\0\0", b"\x03\x76",  # inputs, start, end
         b"\x04\x09", b"\xe4\x0e\x01", b"\x01\x10\x51\x76",  # posted; 100 ticks, dark; t 1, sense
         b"\x94\x02\x76"]
    )  # fmt: skip


@pytest.mark.cc
def test_machines_in_slots_are_followed(tmp_path: Path) -> None:
    chart = load(SHOP)
    script = ["start 0", "post go", "run 1", "post order 3", "run 5", "run 400", "post stop",
              "run 401"]  # fmt: skip
    (data,) = recorded(tmp_path, [(chart, script)])
    found = followed(chart, data)
    assert macrosteps(lines(chart, found)) == macrosteps(run_script(chart, script))
    (data,) = recorded(tmp_path, [(chart, script)], level=1)
    one = followed(chart, data)
    assert any(isinstance(each, ReplayedStep) and each.machine == 2 for each in one)
    assert not [each for each in one if isinstance(each, Missing | Divergence)]


def kept(records: Sequence[object]) -> list[object]:
    """Return the records that are lost if they find no room; others are repeated."""
    again = (TimeRecord, Sync, SnapshotRecord, Lost, Spoilt)
    return [each for each in records if not isinstance(each, again)]


@pytest.mark.cc
@pytest.mark.parametrize("size", [64, 128, 256])
def test_a_ring_that_overruns_anywhere_counts_what_it_drops(
    lamp: Chart, tmp_path: Path, size: int
) -> None:
    """The ring is read after a fixed number of lines, so it overruns between any two bytes.

    The received records, the losses that records report, and the losses that the target counted
    since then add up to the machine's records: nothing is missing or counted twice.
    """
    script = ["seed 3", "start 0"]
    for n in range(1, 120):
        script += [f"input dark {n % 3 > 0:d}", f"post press {n % 10}", f"run {n * 40}"]
    (whole,) = recorded(tmp_path, [(lamp, script)])
    plain = followed(lamp, whole)
    attempted = kept([each.told for each in Stream([Numbering(lamp)]).feed(whole)])
    dropped = 0
    every = {
        each.at: each.macrostep
        for each in plain
        if isinstance(each, ReplayedStep) and each.is_known
    }
    for lines_between in (2, 5, 40, 90):
        (data,) = recorded(tmp_path, [(lamp, script)], size=size, every=lines_between)
        stream = Stream([Numbering(lamp)])
        told = [timed.told for timed in [*stream.feed(data), *stream.end()]]
        assert not [each for each in told if isinstance(each, Spoilt)]
        lost = sum(each.count for each in told if isinstance(each, Lost))
        assert lost == stream.counts.lost
        assert len(kept(told)) + lost + unreported(tmp_path) == len(attempted)
        dropped += lost
        found = followed(lamp, data)
        assert not [each for each in found if isinstance(each, Divergence)]
        for each in found:
            if isinstance(each, ReplayedStep) and each.is_known:
                assert every[each.at] == each.macrostep
    assert dropped


@pytest.mark.cc
def test_after_a_loss_a_saved_machine_makes_all_known_again(lamp: Chart, tmp_path: Path) -> None:
    script = ["seed 3", "start 0", "input dark 1"]
    for n in range(1, 40):
        script += [f"post press {n % 10}", f"run {n * 300}"]
    (data,) = recorded(tmp_path, [(lamp, script)])
    stream = Stream([Numbering(lamp)])
    told = [timed.told for timed in stream.feed(data)]
    assert sum(isinstance(each, Sync) for each in told) == 10  # the start's, then every 1200 ms
    assert sum(isinstance(each, SnapshotRecord) for each in told) == 9
    found = followed(lamp, data[20:])
    steps = [each for each in found if isinstance(each, ReplayedStep) and each.is_known]
    assert isinstance(found[0], Missing)
    assert lines(lamp, found) == run_script(lamp, script)[-len(lines(lamp, found)) :]
    assert steps[0].at < 1400


@pytest.mark.cc
def test_data_that_the_interpreter_does_not_have_are_told(lamp: Chart, tmp_path: Path) -> None:
    """As if something had written into the memory of the machine: a light of 81 is 82."""
    script = ["seed 7", "start 0", "input dark 1", "post press 9", "run 5", "run 1005"]
    (data,) = recorded(tmp_path, [(lamp, script)])
    saved = data.index(b"FSM\x01")
    size = len(image_of(lamp).values) and image_of(lamp).total
    image = bytearray(data[saved : saved + size - 4])
    place = len(head(lamp)) + 2 + 2 * len(lower(lamp).regions)
    assert image[place] == 81
    image[place] = 82
    changed = data[:saved] + sealed(bytes(image)) + data[saved + size :]
    parted = [each for each in followed(lamp, changed) if isinstance(each, Divergence)]
    assert [each.message for each in parted] == ["the target has other data: `light` is 82, not 81"]


@pytest.mark.cc
def test_a_restored_machine_is_followed_from_there(lamp: Chart, tmp_path: Path) -> None:
    script = ["start 0", "input dark 1", "dispatch press 9", "run 5", "save", "post press 1",
              "restore 4294967290", "run 4294967295", "post press 2", "run 9"]  # fmt: skip
    (data,) = recorded(tmp_path, [(lamp, script)])
    found = followed(lamp, data)
    assert macrosteps(lines(lamp, found)) == macrosteps(run_script(lamp, script))
    assert not [each for each in found if isinstance(each, Divergence | Missing)]


@pytest.mark.cc
def test_the_first_difference_is_told(lamp: Chart, tmp_path: Path) -> None:
    (data,) = recorded(tmp_path, [(lamp, SCRIPT)])
    taken = b"\x85\x01\x10"  # 5 ticks, transition 1, a result
    assert data.count(taken) == 1
    found = followed(lamp, data.replace(taken, b"\x85\x02\x10"))
    (parted,) = [each for each in found if isinstance(each, Divergence)][:1]
    assert parted.message == (
        "the interpreter does: transition 1 taken; the target did: transition 2 taken"
    )
    assert not [e for e in found if isinstance(e, ReplayedStep) and e.is_known and e.at > parted.at]


INSTANCES = """
#include <stdio.h>
#include "lamp.h"
static lamp machines[3];
static uint32_t time_now;
uint8_t lamp_sense(lamp *m) { return (uint8_t)(m - machines); }
void lamp_click(lamp *m)
{
    if (m == &machines[0]) /* within a call of another machine */
        (void)lamp_post_ask(&machines[2]), lamp_run(&machines[2], time_now);
}
int main(void)
{
    uint8_t frame[FSM_FRAME_BYTES];
    for (unsigned i = 0u; i < 3u; i++) {
        lamp_init(&machines[i]);
        machines[i].in.dark = i != 1u;
        lamp_start(&machines[i], 0u);
    }
    for (uint32_t now = 1u; now < 6000u; now++) {
        size_t n;
        time_now = now;
        for (unsigned i = 0u; i < 3u; i++) {
            if (now == 5000u || now == 3000u + i)
                (void)lamp_post_press(&machines[i], 9u);
            lamp_run(&machines[i], now);
        }
        while ((n = fsm_records_frame(frame)) > 0u)
            (void)fwrite(frame, 1, n, stdout);
    }
    return 0;
}
"""


@pytest.mark.cc
@pytest.mark.parametrize("level", [1, 2])
def test_several_instances_tell_their_states_each_second(
    lamp: Chart, tmp_path: Path, level: int
) -> None:
    """In frames; a machine that runs within a call of another one, too."""
    machine = generate_machine(lamp, "lamp", RECORDED)
    for name, text in machine.files.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "host.c").write_text(INSTANCES.replace("#include <stdio.h>", '#include "all.h"'))
    (tmp_path / "all.h").write_text('#include <stdio.h>\n#include "fsm_records.h"\n')
    defined = [f"-DFSM_TRACE_LEVEL={level}", '-DFSM_INSTANCE(m)=number_of(m)',
               "-DFSM_TRACE_INSTANCES=2", '-DFSM_HOOKS="hooks.h"']  # fmt: skip
    (tmp_path / "hooks.h").write_text(
        "#include <stddef.h>\n#include <stdint.h>\nuint16_t number_of(const void *m);\n"
    )
    with (tmp_path / "host.c").open("a") as host:
        host.write("uint16_t number_of(const void *m)\n{\n    return (uint16_t)"
                   "((const lamp *)m - machines);\n}\n")  # fmt: skip
    sources = ["host.c", "lamp_records.c", "lamp_info.c", "fsm_records.c", "fsm_save.c", "fsm.c"]
    made = ["gcc", "-std=c99", *defined, "-I.", *sources, "-o", "host"]
    subprocess.run(made, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "host"], check=True, capture_output=True)
    line, follower = Line(Stream([Numbering(lamp)])), Follower()
    timed = [*line.feed(done.stdout), *line.end()]
    syncs = [(each.at, each.instance) for each in timed if isinstance(each.told, Sync)]
    for instance in range(3):
        own = [at for at, of in syncs if of == instance]
        assert all(b - a <= 1001 for a, b in pairwise(own)), own
        assert len(own) >= 6
    found = [e for t in timed for e in follower.follow(t, line.stream.of.get(t.instance))]
    assert not [each for each in found if isinstance(each, Missing | Divergence)]
    taken = [
        (e.instance, e.at) for e in found if isinstance(e, ReplayedStep) and e.macrostep.effects
    ]
    assert {instance for instance, _ in taken} == {0, 1, 2}
    assert line.unframer.spoilt == 0


CONTEXTS = """
#include <stdio.h>
#include "near.h"
#include "far.h"
#include "fsm_records.h"
size_t fsm_records_take_b(uint8_t *bytes, size_t room);
uint8_t near_sense(near *m) { (void)m; return 1u; }
uint8_t far_sense(far *m) { (void)m; return 2u; }
void near_click(near *m) { (void)m; }
void far_click(far *m) { (void)m; }
int main(void)
{
    static near one;
    static far other;
    uint8_t bytes[1000];
    FILE *file = fopen("a.trace", "wb");
    near_init(&one);
    far_init(&other);
    one.in.dark = other.in.dark = true;
    near_start(&one, 0u);
    far_start(&other, 0u);
    for (uint32_t now = 1u; now < 60u; now++) {
        if (now % 25u == 0u)
            (void)near_post_press(&one, 9u);
        if (now % 27u == 0u)
            (void)far_post_press(&other, 9u);
        near_run(&one, now);
        far_run(&other, now);
    }
    (void)fwrite(bytes, 1, fsm_records_take(bytes, sizeof bytes), file);
    (void)fclose(file);
    file = fopen("b.trace", "wb");
    (void)fwrite(bytes, 1, fsm_records_take_b(bytes, sizeof bytes), file);
    (void)fclose(file);
    return 0;
}
"""


@pytest.mark.cc
def test_two_contexts_have_a_ring_each_and_are_merged_by_time(lamp: Chart, tmp_path: Path) -> None:
    (tmp_path / "host.c").write_text(CONTEXTS)
    for prefix, instance, more in (("near", 0, []), ("far", 1, ["-DFSM_TRACE_CONTEXT=b"])):
        for name, text in generate_machine(lamp, prefix, RECORDED).files.items():
            (tmp_path / name).write_text(text)
        flags = ["-std=c99", "-DFSM_TRACE_LEVEL=2", f"-DFSM_INSTANCE(m)={instance}u", *more]
        sources = [f"{prefix}_records.c", f"{prefix}_info.c"]
        subprocess.run(["gcc", *flags, "-c", *sources], cwd=tmp_path, check=True)
        ring = ["-c", "fsm_records.c", "-o", f"{prefix}_ring.o"]
        subprocess.run(["gcc", *flags, *ring], cwd=tmp_path, check=True)
    objects = [
        f"{prefix}_{what}.o" for prefix in ("near", "far") for what in ("records", "info", "ring")
    ]
    made = ["gcc", "-std=c99", "-DFSM_TRACE_LEVEL=2", "host.c", *objects, "fsm_save.c", "fsm.c"]
    subprocess.run([*made, "-o", "host"], cwd=tmp_path, check=True)
    subprocess.run([tmp_path / "host"], cwd=tmp_path, check=True)
    rings = [
        list(Stream([Numbering(lamp)]).feed((tmp_path / f"{c}.trace").read_bytes())) for c in "ab"
    ]
    assert [{each.instance for each in ring} for ring in rings] == [{0}, {1}]
    taken = [
        (each.at, each.instance)
        for each in merge_contexts(rings)
        if isinstance(each.told, TransitionRecord)
    ]
    assert taken == [(25, 0), (27, 1), (45, 0), (47, 1), (50, 0), (54, 1)]


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang", "g++"])
@pytest.mark.parametrize("level", [0, 1, 2])
def test_no_warning(
    tmp_path: Path,
    compiler: str,
    level: int,
    compile_with: Callable[..., object],
    write: Write,
    lamp: Chart,
) -> None:
    sources = ["fsm_records.c"]
    for chart in (load(SHOP), lamp):
        machine = generate_machine(chart, None, RECORDED)
        write(tmp_path, machine.files)
        sources += [f"{machine.names.prefix}_{what}.c" for what in ("records", "info")]
    defined = f"-DFSM_TRACE_LEVEL={level}"
    compile_with(tmp_path, compiler, defined, "-c", *sources)
    more = ("-DFSM_INSTANCE(m)=3u", "-DFSM_TRACE_CONTEXT=b")
    compile_with(tmp_path, compiler, defined, *more, "-c", *sources)


@pytest.mark.cc
def test_at_level_0_it_costs_nothing(lamp: Chart, tmp_path: Path) -> None:
    for name, text in generate_machine(lamp, "lamp", RECORDED).files.items():
        (tmp_path / name).write_text(text)
    made = []
    for source in ("lamp.c", "lamp_records.c"):
        command = ["gcc", "-std=c99", "-Os", "-I.", "-c", source, "-o", "made.o"]
        subprocess.run(command, cwd=tmp_path, check=True)
        subprocess.run(["objcopy", "-O", "binary", "made.o", "made"], cwd=tmp_path, check=True)
        made.append((tmp_path / "made").read_bytes())
    assert made[0] == made[1]
