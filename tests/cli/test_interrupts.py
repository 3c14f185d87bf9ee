"""Ctrl-C and SIGTERM end every verb: its exit code, no traceback, no half of a result.

``FSMKIT_INTERRUPTS`` is a list of seconds after which each job is interrupted, such as ``1,3,9``.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics.interrupts import hold_interrupts
from fsmkit.verify.resources import children

MOMENTS = [float(x) for x in os.environ.get("FSMKIT_INTERRUPTS", "0.5").split(",")]
SIGNALS = (signal.SIGINT, signal.SIGTERM)
MOST = 20
"""Seconds until a test gives up; a command takes less than two on a free machine."""
ENDLESS = """
chart: Counter
events: {in: [more, other]}
data: {n: 0..1000000, m: 0..1000000}
environment: {may: [more, other]}
properties: {p: {never: n == 999999 and m == 999999}, q: {recoverable: In(a)}}
initial: a
states: {a: {rest: true, on: {more: {do: n += 1}, other: {do: m += 3; n += 7}}}}
"""
DEEP = """
chart: Deep
data: {k: 0..5000000 = 0}
events: {in: [e]}
properties: {p: {never: k == 4999999}}
environment: {may: [e]}
initial: a
states: {a: {rest: true, on: {e: {if: k < 5000000, do: k += 1}}}}
"""
TIMED = """
chart: Timed
events: {in: [more, other]}
data: {n: 0..1000000 = 0}
environment: {may: [more, other]}
properties: {p: {never: n == 999999}}
initial: a
states:
  a:
    regions:
      l:
        initial: l0
        states: {l0: {after: {17ms: l1}}, l1: {after: {23ms: {target: l0, do: n += 1}}}}
      r:
        initial: r0
        states: {r0: {after: {19ms: r1}, on: {other: r0}}, r1: {after: {29ms: r0}}}
"""
BEAT = """
chart: Beat
data: {n: 0..10 wrap = 0}
initial: a
states: {a: {every: {1ms: {do: n += 1}}}}
"""
TESTS = "tests: Beat\nchart: beat.yaml\ncases:\n" + "".join(
    f"  c{number}:\n    - wait 9s\n    - expect: {{in: a}}\n" for number in range(2000)
)
CAMPAIGN = """
campaign: night
runs:
  - {check: endless.yaml, time: untimed, engine: python}
  - {mutants: endless.yaml, count: 500}
"""
LARGE = "chart: Large\nevents: {in: [e]}\ninitial: s0\nstates:\n" + "".join(
    f"  s{number}: {{on: {{e: s{(7 * number + 1) % 20_000}}}}}\n" for number in range(20_000)
)
FILES = {
    "endless.yaml": ENDLESS,
    "deep.yaml": DEEP,
    "timed.yaml": TIMED,
    "beat.yaml": BEAT,
    "beat.test.yaml": TESTS,
    "night.yaml": CAMPAIGN,
    "large.yaml": LARGE,
}
JOBS = {
    "check explicit": "check deep.yaml --search explicit",
    "check symbolic": "check endless.yaml --search symbolic",
    "check zones": "check timed.yaml",
    "check in Python": "check endless.yaml --engine python",
    "check several": "check endless.yaml deep.yaml",
    "cover": "cover endless.yaml --out result --engine python",
    "certify": "certify endless.yaml --out result",
    "refine": "refine endless.yaml endless.yaml",
    "mutants": "mutants endless.yaml --engine python --resume kept",
    "run": "run beat.yaml --events 'wait 90000s'",
    "run C": "run beat.yaml --events 'wait 90000s' --target c",
    "shell": "run endless.yaml",
    "serve": "serve endless.yaml",
    "edit": "edit endless.yaml",
    "dap": "dap",
    "lsp": "lsp",
    "export": "export endless.yaml --to aut --max-states 100000000 --out result.aut",
    "campaign": "campaign night.yaml --workers 1 --resume kept",
    "compile": "compile large.yaml --target c --out result",
    "convert": "convert large.yaml --to scxml --out result.scxml",
    "draw": "draw large.yaml --out result.svg",
    "show": "show large.yaml",
    "simulate": "simulate large.yaml --out result.html",
    "fmt": "fmt large.yaml",
    "test": "test beat.test.yaml",
}
CASES = [
    (job, moment, SIGNALS[(place + turn) % 2])
    for place, job in enumerate(JOBS)
    for turn, moment in enumerate(MOMENTS)
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("interrupts")
    for name, text in FILES.items():
        (made / name).write_text(text, encoding="utf-8")
    return made


def interrupted(
    folder: Path, command: str, moment: float, number: signal.Signals
) -> tuple[int, str]:
    """Run a command line, send it a signal, and return its exit code and its errors."""
    line = f"exec {sys.executable} -m fsmkit {command}"
    with subprocess.Popen(
        ["sh", "-c", line],
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            process.wait(moment)
        except subprocess.TimeoutExpired:
            process.send_signal(number)
        else:
            pytest.fail(f"`{command}` ended before {moment} s")
        try:
            _, errors = process.communicate(timeout=MOST)
        except subprocess.TimeoutExpired:
            process.kill()
            pytest.fail(f"`{command}` did not end at {number.name} after {moment} s")
    return process.returncode, errors


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize(("job", "moment", "number"), CASES)
def test_an_interrupt_ends_every_verb(
    job: str, moment: float, number: signal.Signals, folder: Path
) -> None:
    code, errors = interrupted(folder, JOBS[job], moment, number)
    assert code in (128 + number, -number), errors  # the latter: before Python ran fsmkit
    assert "Traceback" not in errors
    assert "bug" not in errors
    left = {path.name for path in folder.iterdir()} - {"kept"}
    assert left == set(FILES)
    assert {name: (folder / name).read_text() for name in FILES} == FILES


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("moment", [0.03, 0.05, 0.07, 0.1, 0.15, 0.2])
@pytest.mark.parametrize("number", SIGNALS)
def test_an_interrupt_while_modules_are_imported(
    moment: float, number: signal.Signals, folder: Path
) -> None:
    """Python itself prints a traceback if it is interrupted before it runs fsmkit."""
    code, errors = interrupted(folder, "show large.yaml", moment, number)
    if "Traceback" in errors:
        assert "fsmkit/cli" not in errors
    else:
        assert code in (128 + number, -number)


IGNORING = """
import signal, sys, threading
signal.signal(signal.SIGINT, signal.SIG_IGN)
print("partial", flush=True)
print("ready", file=sys.stderr, flush=True)
threading.Event().wait()
"""


@pytest.mark.cc
def test_a_child_that_ignores_an_interrupt_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(children, "GRACE", 0.1)
    done = children.run(
        [sys.executable, "-c", IGNORING],
        line=lambda _: signal.raise_signal(signal.SIGINT),
        stops=True,
    )
    assert (done.code, done.out, done.interrupted) == (-signal.SIGKILL, "partial\n", True)


@pytest.mark.parametrize("number", SIGNALS)
def test_held_interrupts_come_at_the_end_of_the_block(number: signal.Signals) -> None:
    received: list[int] = []
    before = signal.signal(number, lambda got, _: received.append(got))
    try:
        with hold_interrupts():
            signal.raise_signal(number)
            signal.raise_signal(number)
            assert received == []
        assert received == [number]
    finally:
        signal.signal(number, before)


def interrupting(at: int, module: str) -> Callable[[FrameType, str, object], Any]:
    """Return a trace function that interrupts line ``at`` of those that a module executes."""
    passed = 0

    def trace(frame: FrameType, event: str, _: object) -> Any:
        nonlocal passed
        if frame.f_globals.get("__name__") != module:
            return None
        passed += event == "line"
        if event == "line" and passed == at:
            signal.raise_signal(signal.SIGINT)
        return trace

    return trace


def interrupt_at_every_line(tmp_path: Path) -> None:
    """Write files, interrupted at each line in turn: all are written, or nothing has changed."""
    for at in range(1, 1000):
        folder = tmp_path / str(at)
        folder.mkdir()
        (folder / "old.c").write_text("old")
        before = {"old.c": "old"}
        after = {"old.c": "new", "inner/one.c": "1", "inner/two.c": "2"}
        tracer = sys.gettrace()
        sys.settrace(interrupting(at, write_files.__module__))
        try:
            write_files({folder / name: text for name, text in after.items()})
            is_ended = False
        except KeyboardInterrupt:
            is_ended = True
        finally:
            sys.settrace(tracer)
        found = {
            str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*") if p.is_file()
        }
        assert found in ((before, after) if is_ended else (after,)), at
        if not is_ended:
            assert at > 50
            return
    raise AssertionError("the writing did not end")


@pytest.mark.cc
def test_an_interrupt_at_any_line_leaves_all_files_or_none(tmp_path: Path) -> None:
    """Also those that were there, and no temporary file.

    In a process of its own: CPython 3.11 can loop for ever where a traced line receives a signal in
    a process with threads.
    """
    program = "from tests.cli.test_interrupts import *; interrupt_at_every_line(Path(sys.argv[1]))"
    command = [sys.executable, "-c", program, str(tmp_path)]
    subprocess.run(command, check=True, cwd=Path(__file__).parents[2], timeout=120)
