"""Where time stands still `run` ends with an error: SCXML bounds no sequence of macrosteps."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fsmkit import Session
from fsmkit.chart.loading import load
from fsmkit.cli import execute
from fsmkit.diagnostics import FsmkitError

pytestmark = pytest.mark.slow

CIRCLE = """chart: Circle
events: {in: [go]}
data: {n: uint32}
initial: idle
states:
  idle: {rest: true, on: {go: a}}
  a: {entry: n += 1, after: {0ms: b}}
  b: {after: {0ms: a}}
"""
LONG = CIRCLE.replace("a: {entry", "a: {always: {if: n > 3000, target: idle}, entry")
FAST = "chart: Fast\ndata: {n: uint32}\ninitial: a\nstates: {a: {every: {1ms: {do: n += 1}}}}\n"
PING = """chart: Ping
events: {in: [called, go], out: [call]}
initial: s
states: {s: {rest: true, on: {called: {do: send call}, go: {do: send call}}}}
"""
PAIR = """system: Pair
machines: {a: ping.yaml, b: ping.yaml}
connect: [a.call -> b.called, b.call -> a.called]
"""


def run(folder: Path, text: str, events: str) -> int:
    (folder / "ping.yaml").write_text(PING)
    (folder / "x.yaml").write_text(text)
    return execute(["run", str(folder / "x.yaml"), "--events", events])


@pytest.mark.parametrize(
    ("text", "events", "words"),
    [
        (CIRCLE, "wait 7ms; go; wait 1s", r"at 7ms: `Circle` .* in (`a`, `b`|`b`, `a`)"),
        (PAIR, "a.go; wait 1s", r"at 0ms: `Ping` .* in `s`"),
    ],
    ids=["timers without delay", "events of two machines"],
)
def test_it_is_an_error_with_a_place(
    text: str, events: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(tmp_path, text, events) == 1
    told = capsys.readouterr().err
    assert re.search(rf"FK0503.*: time stands still {words}", told), told
    assert ".yaml:" in told


@pytest.mark.parametrize(("text", "events"), [(LONG, "go; wait 1s"), (FAST, "wait 15s")])
def test_what_ends_or_takes_time_is_none(text: str, events: str, tmp_path: Path) -> None:
    assert run(tmp_path, text, events) == 0


def test_a_session_stays_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "circle.yaml").write_text(CIRCLE)
    session = Session(load(tmp_path / "circle.yaml"))
    session.post("go")
    for _ in range(2):
        with pytest.raises(FsmkitError, match="time stands still"):
            session.run()
        assert session.is_in("idle")
        assert session["n"] == 0


@pytest.mark.cc
@pytest.mark.parametrize("target", ["python", "c"])
def test_a_generated_machine_is_not_run_where_the_interpreter_ends(
    target: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "x.yaml").write_text(CIRCLE)
    events = ["--events", "go; wait 1s", "--target", target]
    assert execute(["run", str(tmp_path / "x.yaml"), *events]) == 1
    assert "FK0503" in capsys.readouterr().err
