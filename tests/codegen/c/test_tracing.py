"""The interpreter replays the log of a machine in C, and reports differences."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import pytest

from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.cli import execute
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import Options
from fsmkit.diagnostics import FsmkitError
from fsmkit.plan.image import image_of
from fsmkit.runtime.recording import RESTORE, host_calls, replay, ring_lines
from fsmkit.runtime.script import run_script
from fsmkit.testing.harness import c as harness
from tests.codegen.c.recorded import include_instead, play_all

pytestmark = pytest.mark.cc
SHOP = Path(__file__).parents[2] / "golden/shop.yaml"
TRACED = Options(extras=frozenset({"save", "trace"}))
RANDOM = 25
LOG = """
#define FSM_TRACE_RECORDS 8
#define FSM_LOGGED
#include "fsm_trace.c"
#include <stdio.h>
static FILE *log_file;
void fsm_log_write(const uint8_t *bytes, size_t size) { fwrite(bytes, 1, size, log_file); }
static void open_log(const char *name) { log_file = fopen(name, "wb"); fsm_trace_clear(); }
static void close_log(const char *name)
{
    static uint8_t bytes[FSM_TRACE_BYTES];
    FILE *ring = fopen(name, "wb");
    fwrite(bytes, 1, fsm_trace_dump(bytes), ring);
    fclose(ring);
    fclose(log_file);
}
"""
LAMP = """
chart: Lamp
events: {in: ["press(n 0..9)", ask]}
inputs: {dark: bool = false}
operations: [sense() -> 0..100, click]
data: {light: 0..100 = 0}
initial: off
states:
  off: {on: {press: [{target: on, if: dark and event.n > 3, do: light = sense()}]}}
  on: {entry: click(), after: {20ms: off}}
"""

Job = tuple[Chart, Sequence[str]]
Write = Callable[[Path, Mapping[str, str]], Path]


def logged(
    folder: Path, jobs: Sequence[Job], hosts: Mapping[str, str] = MappingProxyType({})
) -> list[tuple[bytes, bytes]]:
    """Play scripts on logged machines; return the log and the ring of each.

    ``hosts``: replacements of texts in the driver.
    """
    machines = [generate_machine(chart, f"x{i}", TRACED) for i, (chart, _) in enumerate(jobs)]
    harness._write(folder, machines)
    main = (folder / "main.c").read_text()
    main = main.replace('#include "fsm_save.c"\n', '#include "fsm_save.c"\n' + LOG)
    for machine in machines:
        prefix = machine.names.prefix
        driver = include_instead(folder, machine, "trace")
        text = driver.read_text()
        for old, new in hosts.items():
            assert old in text
            text = text.replace(old, new)
        driver.write_text(text)
        play = f"play_{prefix}();"
        main = main.replace(play, f'open_log("{prefix}.log"); {play} close_log("{prefix}.ring");')
    (folder / "main.c").write_text(main)
    play_all(folder, jobs)
    return [
        ((folder / f"x{i}.log").read_bytes(), (folder / f"x{i}.ring").read_bytes())
        for i in range(len(jobs))
    ]


def without_dumps(trace: Sequence[str]) -> list[str]:
    return [line for line in trace if not line.rpartition(": ")[2].startswith("d ")]


@pytest.fixture(scope="module")
def lamp(tmp_path_factory: pytest.TempPathFactory) -> tuple[Chart, bytes, bytes]:
    folder = tmp_path_factory.mktemp("lamp")
    (folder / "lamp.yaml").write_text(LAMP)
    chart = load(folder / "lamp.yaml")
    script = [
        "seed 7", "start 4294967290", "input dark 1", "post press 3", "run 4294967290",
        "post press 9", "run 4294967295", "run 18", "run 19", "dispatch ask",
    ]  # fmt: skip
    ((log, ring),) = logged(folder, [(chart, script)])
    assert list(replay(chart, log)) == run_script(chart, script)
    return chart, log, ring


@pytest.mark.slow
def test_random_charts_are_replayed(tmp_path: Path) -> None:
    cases = (random_case(11, number) for number in range(RANDOM * 2))
    jobs = [(c.chart, c.script) for c in cases if not image_of(c.chart).stores_symbols][:RANDOM]
    for (chart, script), (log, ring) in zip(jobs, logged(tmp_path, jobs), strict=True):
        trace = without_dumps(run_script(chart, script))
        assert list(replay(chart, log)) == trace
        taken = [line for line in trace if line.rpartition(": ")[2].startswith("t ")]
        shown = [line for line in ring_lines(chart, ring) if not line.startswith("(")]
        last = [line.rpartition(": ")[2].split()[1] for line in taken[-8:]]
        assert [line.rpartition(": t ")[2].split()[0] for line in shown] == last


def test_invoked_machines_are_replayed(tmp_path: Path) -> None:
    chart = load(SHOP)
    script = ["start 0", "post go", "run 1", "post order 3", "run 5", "run 400", "post stop",
              "run 401"]  # fmt: skip
    ((log, _),) = logged(tmp_path, [(chart, script)])
    trace = list(replay(chart, log))
    assert trace == without_dumps(run_script(chart, script))
    assert any(": t " in line for line in trace)


@pytest.fixture(scope="module")
def restored(lamp: tuple[Chart, bytes, bytes], tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A log of a machine that is saved while its timer runs, and restored at another time."""
    script = ["start 0", "input dark 1", "dispatch press 9", "run 5", "save", "post press 1",
              "restore 4294967290", "run 4294967295", "post press 2", "run 9"]  # fmt: skip
    ((log, _),) = logged(tmp_path_factory.mktemp("restored"), [(lamp[0], script)])
    return log


def from_restored(log: bytes) -> bytes:
    """Return a log without what comes before the machine is restored."""
    at = 0
    while log[at] != RESTORE:
        at += 3 + int.from_bytes(log[at + 1 : at + 3], "little")
    return log[at:]


def test_what_is_refused_within_a_step_is_not_logged(tmp_path: Path) -> None:
    (tmp_path / "lamp.yaml").write_text(LAMP)
    chart = load(tmp_path / "lamp.yaml")
    script = ["start 5", "input dark 1", "post press 9", "run 6", "run 30", "post ask", "run 31"]
    within = """FSM_HOST_CALL(m, 1u, NULL, NULL);
    x0_event ask = {0};
    ask.event = X0_EVENT_ASK;
    x0_start(m, 1u);
    x0_run(m, 1000u);
    if (x0_dispatch(m, &ask, 1000u) != FSM_BUSY)
        abort();
"""
    misused = {"FSM_HOST_CALL(m, 1u, NULL, NULL);\n": within}
    (plain,) = logged(tmp_path, [(chart, script)])
    assert logged(tmp_path, [(chart, script)], misused) == [plain]
    assert list(replay(chart, plain[0])) == run_script(chart, script)


def test_a_log_may_begin_at_a_restored_machine(
    lamp: tuple[Chart, bytes, bytes], restored: bytes
) -> None:
    """By hand: lit at 0 for 20 ticks, of which 15 are left when it is restored at 2^32 - 6."""
    whole = list(replay(lamp[0], restored))
    assert list(replay(lamp[0], from_restored(restored))) == [
        "@9 > event press 2", "unhandled press", "= on", "@9 > timeout 2", "- on", "t 2", "+ off",
        "= off",
    ]  # fmt: skip
    assert whole[-8:] == list(replay(lamp[0], from_restored(restored)))


def test_a_restored_machine_of_another_chart_is_refused(restored: bytes, tmp_path: Path) -> None:
    (tmp_path / "other.yaml").write_text(LAMP.replace("20ms", "30ms"))
    for instance in (None, 0):
        with pytest.raises(FsmkitError) as caught:
            list(replay(load(tmp_path / "other.yaml"), from_restored(restored), instance))
        assert caught.value.diagnostics[0].rule.name == "foreign-log"


def test_the_ring_tells_transitions_by_name(lamp: tuple[Chart, bytes, bytes]) -> None:
    chart, _, ring = lamp
    assert list(ring_lines(chart, ring)) == [
        "@4294967295 0 press: t 1 off -> on",
        "@19 0 timeout: t 2 on -> off",
    ]


def test_the_first_difference_is_told(lamp: tuple[Chart, bytes, bytes]) -> None:
    chart, log, _ = lamp
    taken = bytes([6, 4, 0, 0, 0, 1, 0])
    assert log.count(taken) == 1
    with pytest.raises(FsmkitError, match="does: transition 1 taken; the C did: transition 2"):
        list(replay(chart, log.replace(taken, bytes([6, 4, 0, 0, 0, 2, 0]))))
    with pytest.raises(FsmkitError, match="calls `sense`; the C click called"):
        list(replay(chart, log.replace(bytes([5, 5, 0, 0, 0, 0, 0]), bytes([5, 5, 0, 0, 0, 1, 0]))))


def test_a_log_may_end_anywhere(lamp: tuple[Chart, bytes, bytes]) -> None:
    chart, log, _ = lamp
    whole = [call.lines for call in host_calls(chart, log)]
    for end in range(20, len(log)):
        found = [call.lines for call in host_calls(chart, log[:end])]
        assert found == whole[: len(found)]


def test_what_is_no_log_of_the_chart_is_refused(
    lamp: tuple[Chart, bytes, bytes], tmp_path: Path
) -> None:
    chart, log, ring = lamp
    (tmp_path / "other.yaml").write_text(LAMP.replace("20ms", "30ms"))
    other = load(tmp_path / "other.yaml")
    for data, rule in ((log, "foreign-log"), (ring, "unreadable-log"), (b"", "foreign-log")):
        with pytest.raises(FsmkitError) as caught:
            list(replay(other, data))
        assert caught.value.diagnostics[0].rule.name == rule
    with pytest.raises(FsmkitError, match="unreadable-log"):
        list(ring_lines(chart, log))


@pytest.mark.parametrize("number", [0, 99, 0xFFFFFFFF])
def test_an_event_that_the_chart_does_not_have_is_named(number: int, tmp_path: Path) -> None:
    path = tmp_path / "lamp.yaml"
    path.write_text(LAMP)
    chart = load(path)
    post = "play_script(&"
    unknown = f"x0_event none = X0_NO_EVENT; none.event = {number}u; x0_init(&machine); "
    unknown += (
        f"x0_start(&machine, 0u); (void)x0_post(&machine, &none); x0_run(&machine, 1u); {post}"
    )
    ((log, ring),) = logged(tmp_path, [(chart, ("start 0", "run 1"))], {post: unknown})
    assert list(ring_lines(chart, ring)) == []
    with pytest.raises(FsmkitError, match="an event that the chart does not have"):
        list(replay(chart, log))


def test_the_verb_run_replays(
    lamp: tuple[Chart, bytes, bytes], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    _, log, ring = lamp
    path = tmp_path / "lamp.yaml"
    path.write_text(LAMP)
    for name, data in (("log", log), ("ring", ring), ("cut", log[:-30]), ("bad", b"x" * 40)):
        (tmp_path / name).write_bytes(data)
    assert execute(["run", str(path), "--replay", str(tmp_path / "log")]) == 0
    told = capfd.readouterr().out.splitlines()
    assert told[0] == "@4294967290 > start"
    assert told[-3:] == ["@19 > event ask", "unhandled ask", "= off"]
    assert execute(["run", str(path), "--replay", str(tmp_path / "ring")]) == 0
    assert capfd.readouterr().out.splitlines()[-1] == "@19 0 timeout: t 2 on -> off"
    assert execute(["run", str(path), "--replay", str(tmp_path / "cut")]) == 0
    assert execute(["run", str(path), "--replay", str(tmp_path / "bad")]) == 1
    assert "unreadable-log" in capfd.readouterr().err
    assert execute(["run", str(path), "--replay", str(tmp_path / "log"), "--events", "ask"]) == 2


@pytest.mark.parametrize("compiler", ["gcc", "clang", "g++"])
@pytest.mark.parametrize("defined", [(), ("-DFSM_LOGGED",), ("-DFSM_TRACE_RECORDS=0",)])
def test_no_warning(
    tmp_path: Path,
    compiler: str,
    defined: tuple[str, ...],
    compile_with: Callable[..., object],
    write: Write,
) -> None:
    machine = generate_machine(load(SHOP), None, TRACED)
    write(tmp_path, machine.files)
    sources = ("shop_trace.c", "shop_info.c", "fsm_save.c", "fsm_trace.c")
    compile_with(tmp_path, compiler, *defined, "-c", *sources)
