"""A check that is interrupted, or has no memory or room: a diagnostic, the exit code, no child."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.verify.engines.c import engine
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Verdict
from tests.needs import where
from tests.verify.conftest import Load
from tests.verify.systems import SYSTEMS

pytestmark = pytest.mark.usefixtures("own_cache", "quickly_compiled")
needs_c = pytest.mark.cc

ENDLESS = """
chart: Counter
events: {in: [more, other]}
data: {n: 0..1000000, m: 0..1000000}
initial: a
states:
  a:
    on:
      more: {if: n < 1000000, do: n = n + 1}
      other: {if: m < 1000000, do: m = m + 1}
"""
INVOKES = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="I" initial="a">
<state id="a"><onentry><send event="late" delay="10ms"/></onentry>
<invoke id="inner"><content><scxml version="1.0" initial="x"><state id="x"/></scxml></content>
</invoke><transition event="late" target="b"/></state><final id="b"/></scxml>
"""


@pytest.mark.cc
@needs_c
def test_progress_never_falls_into_a_result(load: Load, monkeypatch: pytest.MonkeyPatch) -> None:
    """The finding: what seeks the way to a livelock tells how far it is, amid the result."""
    flags = (*engine.FLAGS, "-DFSM_PROGRESS_EVERY=0.0")
    monkeypatch.setattr(engine, "FLAGS", flags)
    told: list[tuple[int, int, int]] = []
    report = check(
        load(**SYSTEMS["livelock"]),
        Findings(),
        options=ExplorationOptions("c", time="discrete"),
        progress=lambda *figures: told.append(figures),
    )
    assert report.exploration.livelock is not None
    assert len(told) > 1  # of the search, and of the second one that seeks the way


@pytest.mark.cc
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_leaves_what_is_known_and_its_code(
    tmp_path: Path, number: signal.Signals
) -> None:
    path = tmp_path / "counter.yaml"
    path.write_text(ENDLESS)
    code = (
        "import os, sys; import fsmkit.verify.engines.python.oracle as oracle\n"
        "from fsmkit.cli import main\n"
        f"sys.argv[1:] = ['check', {str(path)!r}, '--engine', 'python', '--json']\n"
        "search = oracle.Oracle._search\n"
        "def hit(self, until):\n"
        "    for n, more in enumerate(search(self, until)):\n"
        f"        n == 3 and os.kill(os.getpid(), {int(number)})\n"
        "        yield more\n"
        "oracle.Oracle._search = hit\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 128 + number
    told = json.loads(done.stdout)
    assert told["verdict"] == "undecided"
    assert told["states"] > 100
    assert "Traceback" not in done.stderr


@pytest.mark.cc
def test_no_time_is_measured_in_what_is_too_large(
    load: Load, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After an interrupt, or without memory, another exploration would only take long."""
    monkeypatch.setattr(engine.CEngine, "watch", lambda *_: pytest.fail("it explores again"))
    system = "machines: {c: chart.yaml}\nenvironment: {may: [c.more, c.other]}\n"
    property_ = "properties: {soon: {within: [c.n > 3, 5ms, c.n > 4]}}\n"
    timed = ENDLESS + "    after: {1s: a}\n"
    found = load(system=f"system: S\n{system}{property_}", chart=timed)
    report = check(found, Findings(), options=ExplorationOptions("c", time="zones", timeout=1.0))
    verdicts = {result.name: result.verdict.value for result in report.results}
    assert verdicts["soon"] == "undecided"


@pytest.mark.cc
def test_an_interrupt_while_it_reads(tmp_path: Path) -> None:
    path = tmp_path / "counter.yaml"
    path.write_text(ENDLESS)
    code = (
        "import os, signal, sys; import fsmkit.verify.explore as explore\n"
        "from fsmkit.cli import main\n"
        f"sys.argv[1:] = ['check', {str(path)!r}]\n"
        "explore.load_any = lambda *_, **__: os.kill(os.getpid(), signal.SIGTERM)\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr.strip()) == (143, "", "interrupted")


@pytest.mark.cc
@needs_c
def test_an_explorer_without_memory_leaves_it_undecided(
    load: Load, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = load(**SYSTEMS["drive"])
    check(system, Findings(), options=ExplorationOptions("c", time="discrete"))
    wanted = engine.CEngine.result

    def starved(self: engine.CEngine, command: list[str], progress: None) -> object:
        return wanted(self, ["sh", "-c", 'ulimit -v 20000; exec "$@"', "sh", *command], progress)

    monkeypatch.setattr(engine.CEngine, "result", starved)
    report = check(system, Findings(), options=ExplorationOptions("c", time="discrete"))
    assert {r.verdict.value for r in report.results} == {"undecided"}
    assert "memory limit" in report.results[0].reason


@pytest.mark.cc
@needs_c
@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("kill -9 $$", "ended by SIGKILL"),
        ("exit 0", "wrote no program"),
        ("echo 'x.c: error: No space left on device' >&2; exit 1", "No space left"),
    ],
)
def test_a_compiler_that_fails_is_told(
    load: Load,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    script: str,
    said: str,
) -> None:
    load(**SYSTEMS["drive"])
    fails = tmp_path / "fails"
    fails.write_text(f"#!/bin/sh\n{script}\n")
    fails.chmod(0o755)
    monkeypatch.setenv("CC", str(fails))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert execute(["check", str(tmp_path / "drive.yaml")]) == 1
    told = capsys.readouterr().err
    assert said in told
    assert "has a bug" not in told


@pytest.mark.cc
@where(Path("/dev/full").exists(), "there is no `/dev/full` here")
def test_a_full_standard_output_is_told(tmp_path: Path) -> None:
    path = tmp_path / "counter.yaml"
    path.write_text(ENDLESS)
    command = [sys.executable, "-m", "fsmkit", "show", str(path)]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert "exhausted" in done.stderr
    assert "Traceback" not in done.stderr
    assert "has a bug" not in done.stderr


def test_what_the_machine_has_no_more_of_is_no_bug(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "counter.yaml"
    path.write_text(ENDLESS)
    errors = MemoryError(), OSError(12, os.strerror(12)), RuntimeError("can't start new thread")
    for error in errors:

        def fails(*_: object, error: Exception = error, **__: object) -> None:
            raise error

        monkeypatch.setattr("fsmkit.verify.explore.load_any", fails)
        assert execute(["check", str(path)]) == 1
        assert "exhausted" in capsys.readouterr().err


LAMP = """chart: Lamp
events: {in: [press]}
initial: dark
states:
  dark: {rest: true, on: {press: lit}}
  lit: {after: {50ms: dark}}
"""
CYCLIC = """system: Cyclic
machines: {lamp: lamp.yaml}
schedule: {cyclic: [lamp], period: 20ms}
environment: {may: [lamp.press]}
properties:
  again: {recoverable: lamp.In(dark)}
  ends: {leads_to: [lamp.In(lit), lamp.In(dark)]}
"""


@pytest.mark.cc
@needs_c
@pytest.mark.parametrize(
    ("name", "text", "line", "unit"),
    [("i.scxml", INVOKES, 3, "10ms"), ("c.yaml", CYCLIC, 3, "10ms")],
)
def test_what_zones_cannot_explore_is_explored_in_discrete_time(
    name: str, text: str, line: int, unit: str, tmp_path: Path
) -> None:
    (tmp_path / "lamp.yaml").write_text(LAMP)
    path = tmp_path / name
    path.write_text(text)
    findings = Findings()
    report = fsmkit.check(path, findings=findings)
    assert not report.closed.zones
    assert report.closed.unit > 0
    (found,) = (d for d in findings if d.rule.name == "discrete-time")
    assert found.primary is not None
    assert f"{name}:{line}:" in str(found.primary.span)
    assert found.help is not None
    assert f"two multiples of {unit}" in found.help
    assert all(each.verdict is not Verdict.UNDECIDED for each in report.results)
