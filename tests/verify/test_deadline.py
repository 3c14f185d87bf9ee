"""One deadline for all that a check does; limits are generous, as the machine may be busy."""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.verify.engines.c import engine
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.explore import ExplorationOptions, check, check_file
from fsmkit.verify.properties.refinement import refines
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.resources.deadline import Deadline, Stage, TimeUp
from fsmkit.verify.statespace.exploration import End
from tests.verify.conftest import Load
from tests.verify.systems import SYSTEMS

SLACK = 60.0
"""Seconds that a busy machine may take beside what is asked for; an endless thing takes longer."""
# a deadline that comes while a file is opened leaves it to the garbage collector
pytestmark = [
    pytest.mark.usefixtures("own_cache", "quickly_compiled"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]
needs_c = pytest.mark.cc


def endless() -> None:
    for _ in count():
        pass


def flat(states: int) -> str:
    lines = ["chart: Flat", "events: {in: [e]}", "initial: s0", "states:"]
    lines += [f"  s{n}: {{on: {{e: s{(n + 1) % states}}}}}" for n in range(states)]
    return "\n".join(lines) + "\n"


COUNTER = """
chart: Counter
events:
  in: [more, other]
data: {n: 0..1000000, m: 0..1000000}
initial: a
states:
  a:
    on:
      more: {if: n < 1000000, do: n = n + 1}
      other: {if: m < 1000000, do: m = m + 1}
"""


# --- the mechanism --------------------------------------------------------------------------------


def test_work_that_never_ends_is_cut_off() -> None:
    deadline = Deadline(0.2)
    with pytest.raises(TimeUp):
        deadline.cut_off(Stage.READING, endless)
    assert deadline.left == 0
    assert deadline.spent[Stage.READING] >= 0.2
    assert deadline.why().startswith("the time limit of 0.2 s was reached (reading ")


def test_it_is_cut_off_in_any_thread() -> None:
    found: list[str] = []

    def work() -> None:
        try:
            Deadline(0.2).cut_off(Stage.READING, endless)
        except TimeUp:
            found.append("cut off")

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(SLACK)
    assert found == ["cut off"]


def test_nothing_comes_up_after_the_work() -> None:
    """Also where the time ends just when the work does."""
    for n in range(200):
        deadline = Deadline(0.001 + n % 7 / 1000)
        with suppress(TimeUp):
            deadline.cut_off(Stage.READING, lambda: sum(range(20_000)))
        for _ in range(1000):
            pass


def test_what_swallows_exceptions_does_not_swallow_it() -> None:
    def stubborn() -> None:
        for _ in count():
            with suppress(Exception):
                endless()

    with pytest.raises(TimeUp):
        Deadline(0.1).cut_off(Stage.READING, stubborn)


def test_a_finalizer_that_swallows_it_once_does_not_keep_it_away_and_reports_nothing() -> None:
    class Swallows:
        def __del__(self) -> None:
            end = time.monotonic() + 0.3
            while time.monotonic() < end:
                pass

    def work() -> None:
        made = Swallows()
        del made
        endless()

    reported: list[object] = []
    hook, sys.unraisablehook = sys.unraisablehook, reported.append
    try:
        with pytest.raises(TimeUp):
            Deadline(0.1).cut_off(Stage.READING, work)
        ours = sys.unraisablehook
    finally:
        sys.unraisablehook = hook
    assert reported == []
    assert ours == reported.append


def test_without_an_end_nothing_is_watched() -> None:
    before = threading.active_count()
    assert Deadline(0).cut_off(Stage.READING, threading.active_count) == before


def test_stages_are_counted_once() -> None:
    deadline = Deadline(0)
    with deadline.stage(Stage.COMPILING), deadline.stage(Stage.GENERATING):
        time.sleep(0.05)
    spent = deadline.spent
    assert spent[Stage.GENERATING] >= 0.05 > spent[Stage.COMPILING]


# --- each stage -----------------------------------------------------------------------------------


def stage_of(report: fsmkit.Report) -> str:
    """Return the stage in which most of the time went."""
    return max(report.spent, key=lambda stage: report.spent[stage])


def test_reading_is_cut_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "flat.yaml"
    path.write_text(flat(3))
    monkeypatch.setattr("fsmkit.verify.explore.load_any", lambda *_, **__: endless())
    findings = Findings()
    system, report = check_file(
        path, findings, options=ExplorationOptions(time="discrete", timeout=0.3)
    )
    assert system.machines == ()
    assert report.verdict is Verdict.UNDECIDED
    assert stage_of(report) == "reading"
    assert [d.rule.name for d in findings] == ["undecided"]
    assert report.results[0].reason == "the time limit of 0.3 s was reached"


def test_generating_is_cut_off(load: Load, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "model_files", lambda *_: endless())
    system = load(**SYSTEMS["drive"])
    report = check(
        system, Findings(), options=ExplorationOptions("c", time="discrete", timeout=0.5)
    )
    assert {r.verdict for r in report.results} == {Verdict.UNDECIDED}
    assert {r.name for r in report.results} == {p.name for p in system.properties}
    assert stage_of(report) == "generating"


@pytest.mark.cc
@needs_c
def test_a_compiler_that_hangs_is_ended_with_what_it_started(
    load: Load, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hangs = tmp_path / "hangs"
    hangs.write_text(f"#!/bin/sh\nsleep 1000 &\necho $! > {tmp_path}/child\nwait\n")
    hangs.chmod(0o755)
    monkeypatch.setenv("CC", str(hangs))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    options = ExplorationOptions("c", time="discrete", timeout=2)
    began = time.monotonic()
    report = check(load(**SYSTEMS["drive"]), Findings(), options=options)
    assert time.monotonic() - began < SLACK
    assert report.verdict is Verdict.UNDECIDED
    assert stage_of(report) == "compiling"
    child = int((tmp_path / "child").read_text())
    assert not _runs(child)
    assert not list((tmp_path / "cache/fsmkit/explorer").iterdir())


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    return state not in "ZX"


@pytest.mark.slow
@pytest.mark.cc
@needs_c
@pytest.mark.parametrize("options", [
    ExplorationOptions("c", time="discrete", timeout=4),
    ExplorationOptions("c", timeout=4),
    ExplorationOptions("c", time="untimed", timeout=4),
    ExplorationOptions("python", time="discrete", timeout=2),
], ids=["discrete", "zones", "untimed", "python"])  # fmt: skip
def test_exploring_ends_in_time(load: Load, options: ExplorationOptions) -> None:
    system = load(counter=COUNTER)
    for zones in (False, True):
        CEngine(options.closed(system, zones=zones), Findings()).close()  # so that it is compiled
    began = time.monotonic()
    report = check(system, Findings(), options=options)
    assert time.monotonic() - began < options.timeout + SLACK
    assert report.exploration.end is End.TIME
    assert report.exploration.states > 0
    assert stage_of(report) in ("exploring", "compiling")
    assert "exploring" in report.spent


@pytest.mark.cc
@needs_c
def test_an_explorer_that_overruns_is_ended(
    load: Load, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = load(**SYSTEMS["drive"])
    check(
        system, Findings(), options=ExplorationOptions("c", time="discrete")
    )  # so that it is compiled
    deaf = tmp_path / "deaf"
    far = '{"progress": {"states": 7, "transitions": 9, "depth": 1, "bytes": 0}}'
    deaf.write_text(f"#!/bin/sh\ntrap '' TERM\necho '{far}' >&2\nwhile :; do sleep 1; done\n")
    deaf.chmod(0o755)
    built = engine.CEngine.__init__

    def replaced(self: engine.CEngine, *arguments: Any, **options: Any) -> None:
        built(self, *arguments, **options)
        self.program = deaf

    monkeypatch.setattr(engine.CEngine, "__init__", replaced)
    report = check(system, Findings(), options=ExplorationOptions("c", time="discrete", timeout=5))
    assert report.exploration.end is End.TIME
    assert (report.exploration.states, report.exploration.transitions) == (7, 9)
    assert report.verdict is Verdict.UNDECIDED


@pytest.mark.slow
def test_what_was_found_is_told_where_no_time_is_left_to_show_it(
    load: Load, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fsmkit.verify.explore.write", lambda *_: endless())
    report = check(
        load(**SYSTEMS["drive"]),
        Findings(),
        options=ExplorationOptions("python", time="discrete", timeout=10),
    )
    (result,) = [r for r in report.results if r.name == "never_twice"]
    assert result.verdict is Verdict.VIOLATED
    assert result.trace is None
    assert "time for its path ran out" in result.reason
    assert stage_of(report) == "replaying"


@pytest.mark.slow
def test_a_comparison_ends_in_time(tmp_path: Path) -> None:
    path = tmp_path / "counter.yaml"
    path.write_text(COUNTER)
    (machine,) = load_any(path, Findings()).machines
    found = refines(machine.chart, machine.chart, deadline=Deadline(2))
    assert not found.violated
    assert "time limit of 2 s" in found.doubt
    assert found.pairs > 0


# --- as it is used --------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("options", [["--json"], ["--json", "--engine", "python"]])
def test_the_command_line_says_where_the_time_went(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str]
) -> None:
    path = tmp_path / "flat.yaml"
    path.write_text(flat(20_000))
    began = time.monotonic()
    assert execute(["check", str(path), "--timeout", "1s", *options]) == 1
    assert time.monotonic() - began < SLACK
    told = json.loads(capsys.readouterr().out)
    assert told["verdict"] == "undecided"
    assert told["states"] == 0
    assert "the time limit of 1 s was reached" in told["properties"][0]["reason"]
    assert sum(told["spent"].values()) >= 1


@pytest.mark.slow
def test_a_comparison_in_json_is_undecided(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "flat.yaml"
    path.write_text(flat(20_000))
    command = ["refine", str(path), str(path), "--timeout", "1s", "--json"]
    assert execute(command) == 1
    assert json.loads(capsys.readouterr().out)["verdict"] == "undecided"


@pytest.mark.slow
def test_python_has_it_too_and_in_a_thread(tmp_path: Path) -> None:
    path = tmp_path / "flat.yaml"
    path.write_text(flat(20_000))
    found: list[fsmkit.Report] = []
    thread = threading.Thread(target=lambda: found.append(fsmkit.check(path, timeout=1)))
    thread.start()
    thread.join(SLACK)
    assert found[0].verdict is Verdict.UNDECIDED


def children() -> set[str]:
    """Return the processes that this one started and that are still there, or not waited for."""
    found: set[str] = set()
    for task in Path(f"/proc/{os.getpid()}/task").iterdir():
        # A thread may end between its listing and its reading.
        with suppress(FileNotFoundError, ProcessLookupError):
            found.update((task / "children").read_text().split())
    return found


@pytest.fixture(autouse=True)
def no_child_is_left() -> Iterator[None]:
    before = children()
    yield
    assert children() <= before
