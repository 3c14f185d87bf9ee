"""The POSIX host: exactly, under a simulated clock; and with threads and a signal in real time."""

from __future__ import annotations

import json
import os
import re
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from tests.boards.conftest import HOSTS, ROOT, Build, Run

HOST = HOSTS / "posix/fsm_posix.c"
TESTS = ROOT / "tests/boards"
WRAPPED = "-Wl,--wrap=clock_gettime,--wrap=clock_nanosleep,--wrap=getrusage,--wrap=pselect"
ADDRESS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g")
THREADS = ("-fsanitize=thread", "-g", "-O1")


def simulated(
    folder: Path, build: Build, kind: str, lines: Sequence[str], *options: str
) -> list[str]:
    files = (HOST, TESTS / "posix_simulated.c")
    program = build(folder, "gcc", *ADDRESS, "-pthread", *files, WRAPPED)
    done = subprocess.run(
        [program, kind, *options],
        input="\n".join(lines),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.splitlines()


@pytest.mark.cc
def test_periodic(tmp_path: Path, build: Build) -> None:
    """Late by little, an overrun of 2.5 periods, one of exactly none, and a wrap of the ticks."""
    lines = ["0 100", "1 0", "3 50", "signal 0", "1023 5", "1024 2500000", "0 1000000"]
    lines += ["0 1000001", "7 4294967296000000", "0 0"]
    assert simulated(tmp_path, build, "periodic", lines) == [
        "step 1 at 1000000",
        "step 2 at 2000001",
        "step 3 at 3000003",
        "step 4 at 4001023",
        "step 5 at 5001024",  # ends at 7.5 ms: 6 and 7 are missed
        "step 8 at 8000000",  # ends when 9 begins: in time
        "step 9 at 9000000",  # ends 1 ns after 10 began
        "step 11 at 11000007",
        "step 12 at 4294967308000000",  # modulo 2^32
        "real-time priority: not requested",
        "locked memory: not requested",
        f"cycles 9, overruns 3, missed deadlines {2 + 1 + 2**32}",
        "overruns by reason: step long 3",
        "cycle 5: woken 1024 ns late, step 2500000 ns: step long",
        "cycle 7: woken 0 ns late, step 1000001 ns: step long",
        "cycle 8: woken 7 ns late, step 4294967296000000 ns: step long",
        "longest step 4294967296000000 ns, worst jitter 1024 ns",
        "jitter: p50 1 ns, p99 1024 ns, p99.9 1024 ns",
        "late by          0 ns or more: 7",
        "late by        512 ns or more: 1",
        "late by       1024 ns or more: 1",
        "bytes left in the pipe: 1",
    ]


@pytest.mark.cc
def test_no_jitter_is_beyond_the_histogram(tmp_path: Path, build: Build) -> None:
    lines = [f"{2**k} 0" for k in range(34)]
    printed = simulated(tmp_path, build, "periodic", lines)
    buckets = [line for line in printed if line.startswith("late by")]
    assert [line.split()[-1] for line in buckets] == ["4"] + ["1"] * 27 + ["3"]
    assert buckets[-1].split()[2] == str(2**31)


@pytest.mark.cc
def test_a_bucket_is_at_most_a_sixteenth_wide(tmp_path: Path, build: Build) -> None:
    late = [3, 16, 17, 31, 32, 33, 1000, 123_456, 99_999_999, 4_000_000_000, 2**34]
    printed = simulated(tmp_path, build, "periodic", [f"{n} 0" for n in late], "json")
    report = json.loads(printed[len(late)])
    bounds = [(low, high) for low, high, count in report["jitter_ns"] for _ in range(count)]
    assert len(bounds) == len(late)
    for (low, high), at in zip(bounds[:-1], late[:-1], strict=True):
        assert low <= at < high
        assert high - low <= max(1, low / 16)


@pytest.mark.cc
def test_percentiles(tmp_path: Path, build: Build) -> None:
    printed = simulated(tmp_path, build, "periodic", ["10 0"] * 98 + ["900 0", "90000 0"])
    assert "jitter: p50 10 ns, p99 927 ns, p99.9 90000 ns" in printed


@pytest.mark.cc
def test_reasons_of_overruns(tmp_path: Path, build: Build) -> None:
    lines = [
        "1500000 400",  # the step alone would have been in time
        "0 3000000",
        "0 3000000 4",
        "0 3000000 4 9",  # nine faults do not take so long
        "0 3000000 0 9",  # but of large pages they may
        "0 3000000 2 3000",
        "0 3000000 2 0 1",  # a page came from disk
        "10 20 9 9 9",  # in time
    ]
    report = json.loads(simulated(tmp_path, build, "periodic", lines, "json")[len(lines)])
    reasons = {"woken late": 1, "step long": 1, "preempted": 2, "page fault": 3}
    assert report["reasons"] == reasons
    assert [(it["reason"], it["times"]) for it in report["last_overruns"]] == [
        ("woken late", 0),
        ("step long", 0),
        ("preempted", 4),
        ("preempted", 4),
        ("page fault", 9),
        ("page fault", 3000),
        ("page fault", 1),
    ]
    assert report["overruns"] == 7
    assert report["missed"] == 1 + 2 * 6


@pytest.mark.cc
def test_the_last_overruns_are_kept(tmp_path: Path, build: Build) -> None:
    report = json.loads(simulated(tmp_path, build, "periodic", ["0 1500000"] * 40, "json")[40])
    assert [it["cycle"] for it in report["last_overruns"]] == list(range(25, 41))
    assert report["overruns"] == 40


@pytest.mark.cc
@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("sleep", "step long"),
        ("busy", "preempted"),
        ("page", "page fault"),
        ("suspend", "woken late"),
    ],
)
def test_overruns_made_on_purpose(
    kind: str, reason: str, tmp_path: Path, build: Build, run: Run
) -> None:
    program = build(tmp_path, "gcc", "-O2", "-pthread", HOST, TESTS / "posix_overruns.c")
    report = json.loads(run(program, kind).splitlines()[-1])
    # A busy computer adds overruns of its own, so not each of the ten need have the reason.
    assert report["overruns"] >= 8
    assert report["reasons"][reason] >= 6, report


@pytest.mark.cc
def test_tickless(tmp_path: Path, build: Build) -> None:
    lines = ["0 100", "wake 3000000 10", "1500 0", "wake 7000000 9000000", "0 0"]
    assert simulated(tmp_path, build, "tickless", lines) == [
        "step 0 at 0",
        "step 5 at 5000000",
        "step 8 at 8000100",  # woken; the timer is armed anew
        "step 13 at 13001500",  # arms no timer
        "step 20 at 20001500",  # woken; lasts beyond the timer at 25
        "step 29 at 29001500",
        "real-time priority: not requested",
        "locked memory: not requested",
        "cycles 6, overruns 0, missed deadlines 0",
        "longest step 9000000 ns, worst jitter 4001500 ns",
        "jitter: p50 1535 ns, p99 4001500 ns, p99.9 4001500 ns",
        "late by          0 ns or more: 1",
        "late by       1024 ns or more: 1",
        "late by    2097152 ns or more: 1",
        "bytes left in the pipe: -1",
    ]


@pytest.mark.cc
def test_nothing_armed_sleeps_a_day_at_a_time(tmp_path: Path, build: Build) -> None:
    printed = simulated(tmp_path, build, "tickless", ["0 0", "0 0", "0 0", "0 0", "0 0"])
    assert printed[4] == f"step {15 + 86_400_000} at {(15 + 86_400_000) * 10**6}"
    assert "late by          0 ns or more: 4" in printed  # a day's end is no timer


TALLY = """\
chart: Tally
data: {sum: uint32 = 0, ticks: uint32 = 0}
events: {in: [hit(weight uint32)]}
initial: on
states:
  on:
    on: {hit: {do: sum = sum + event.weight}}
    after: {1ms: {target: on, do: ticks = ticks + 1}}
"""


@pytest.fixture
def threads(tmp_path: Path) -> tuple[Path, ...]:
    """Return the sources of the program with threads, for a machine written to a folder."""
    (tmp_path / "tally.yaml").write_text(TALLY, encoding="utf-8")
    for name, text in generate_machine(load(tmp_path / "tally.yaml")).files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return (*sorted(tmp_path.glob("*.c")), HOST, TESTS / "posix_threads.c")


def judge(printed: str, kind: str) -> None:
    assert "sum 500500 ticks 1\n" in printed
    cycles = int(re.search(r"cycles (\d+)", printed)[1])  # type: ignore[index]
    late = sum(int(line.split()[-1]) for line in printed.splitlines() if line.startswith("late"))
    assert late == cycles if kind == "periodic" else 0 < late <= cycles
    assert re.search(r"real-time priority: (granted|denied: \w)", printed)
    assert re.search(r"locked memory: (granted|denied: \w)", printed)


@pytest.mark.external
@pytest.mark.parametrize("kind", ["periodic", "tickless"])
@pytest.mark.parametrize("sanitizer", [ADDRESS, THREADS], ids=["address", "thread"])
def test_threads(
    kind: str,
    sanitizer: tuple[str, ...],
    threads: tuple[Path, ...],
    tmp_path: Path,
    build: Build,
    run: Run,
) -> None:
    judge(run(build(tmp_path, "clang", *sanitizer, "-pthread", *threads), kind), kind)


@pytest.mark.external
@pytest.mark.parametrize("kind", ["periodic", "tickless"])
def test_threads_on_arm_linux(
    kind: str,
    threads: tuple[Path, ...],
    tmp_path: Path,
    build: Build,
    run: Run,
    require_tool: Callable[[str], str],
) -> None:
    emulator = require_tool("qemu-arm")
    program = build(tmp_path, "arm-linux-gnueabihf-gcc", "-O2", "-static", "-pthread", *threads)
    judge(run(emulator, program, kind), kind)


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang", "arm-linux-gnueabihf-gcc"])
def test_no_warning(compiler: str, tmp_path: Path, build: Build) -> None:
    build(tmp_path, compiler, "-O2", "-c", HOST)


@pytest.mark.cc
def test_what_is_refused_is_said(tmp_path: Path, build: Build, run: Run) -> None:
    """No process may have a priority of 1000."""
    (tmp_path / "main.c").write_text(
        '#include "posix/fsm_posix.h"\n'
        "static fsm_posix host;\n"
        "static void step(void *m, uint32_t now) { (void)m; (void)now; fsm_posix_stop(&host); }\n"
        "int main(void)\n{\n"
        "    if (fsm_posix_init(&host, 1000) != 0) return 2;\n"
        "    host.priority = 1000;\n"
        "    (void)fsm_posix_periodic(&host, step, NULL);\n"
        "    fsm_posix_print(&host, stdout);\n    fsm_posix_close(&host);\n    return 0;\n}\n",
        encoding="utf-8",
    )
    printed = run(build(tmp_path, "gcc", "-pthread", "main.c", HOST))
    assert f"real-time priority: denied: {os.strerror(22)}" in printed
    assert "cycles 1," in printed
