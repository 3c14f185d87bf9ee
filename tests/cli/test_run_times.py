"""Times that ``fsmkit run`` prints: delayed events come when they are due, and time goes on."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from fsmkit.cli import execute

SCXML = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="a">{}</scxml>'
CHARTS = {
    "delayed": (
        SCXML.format(
            '<state id="a"><onentry><send event="e" delay="1s"/></onentry>'
            '<transition event="e" target="b"/></state><state id="b"/>'
        ),
        [(0, "start"), (1000, "e")],
    ),
    "sent_at_the_start": (
        SCXML.format(
            '<state id="a"><onentry><send event="bar" delay="2s"/><send event="foo"/></onentry>'
            '<transition event="foo" target="b"/></state>'
            '<state id="b"><transition event="bar" target="c"/></state><state id="c"/>'
        ),
        [(0, "start"), (0, "foo"), (2000, "bar")],
    ),
    "cancelled": (
        SCXML.format(
            '<state id="a"><onentry><send id="x" event="e" delay="3s"/><send event="f" delay="1s"/>'
            '</onentry><transition event="f" target="b"><cancel sendid="x"/></transition></state>'
            '<state id="b"><transition event="e" target="a"/></state>'
        ),
        [(0, "start"), (1000, "f")],
    ),
    "again_and_again": (
        SCXML.format(
            '<state id="a"><onentry><send event="e" delay="2s"/></onentry>'
            '<transition event="e" target="a"/></state>'
        ),
        [(0, "start"), (2000, "e"), (4000, "e")],
    ),
}
TARGETS = ("interpreter", "python", "c")
OUTPUTS = ("text", "trace", "json", "script")


@pytest.mark.external
@pytest.mark.parametrize("output", OUTPUTS)
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", CHARTS)
def test_events_come_when_they_are_due(
    name: str, target: str, output: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, expected = CHARTS[name]
    chart, script = tmp_path / f"{name}.scxml", tmp_path / "script"
    chart.write_text(text, encoding="utf-8")
    script.write_text("start 0\nrun 0\nrun 5000\n", encoding="utf-8")
    happens = ["--script", str(script)] if output == "script" else ["--events", "wait 5s"]
    more = {"trace": ["--trace"], "json": ["--json"]}.get(output, [])
    assert execute(["run", str(chart), *happens, "--target", target, *more]) == 0
    told = capsys.readouterr().out
    assert _steps(told, is_json=output == "json") == expected


def _steps(told: str, *, is_json: bool) -> list[tuple[int, str]]:
    """Return time in ms and cause of each step, from any output."""
    if is_json and "steps" in (document := json.loads(told)):
        return [(step["at"], step["cause"]) for step in document["steps"]]
    lines = document["trace"] if is_json else told.splitlines()
    trace = [re.fullmatch(r"@(\d+) > (?:event )?(\w+)", line) for line in lines]
    if any(trace):
        return [(int(match[1]), match[2]) for match in trace if match]
    shown = [re.fullmatch(r" +(\d+)(ms|s)  (\w+)", line) for line in lines]
    return [(int(m[1]) * {"ms": 1, "s": 1000}[m[2]], m[3]) for m in shown if m]


LEAVING = """\
chart: Sender
events: {out: [ping]}
initial: a
states:
  a:
    entry: send ping after 1s
    after: {3s: a}
"""


def test_a_delayed_event_that_leaves_is_told_with_its_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chart = tmp_path / "sender.yaml"
    chart.write_text(LEAVING, encoding="utf-8")
    assert execute(["run", str(chart), "--events", "wait 5s"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "      1s  ping after its delay" in lines
    assert lines[lines.index("      1s  ping after its delay") + 1].strip() == "out ping"
    assert [line for line in lines if line.startswith("      4s")] == [
        "      4s  ping after its delay"
    ]


def test_the_same_in_a_system(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "sender.yaml").write_text(LEAVING, encoding="utf-8")
    (tmp_path / "delayed.scxml").write_text(CHARTS["delayed"][0], encoding="utf-8")
    system = tmp_path / "system.yaml"
    system.write_text(
        "system: S\nmachines: {one: sender.yaml, two: delayed.scxml}\nconnect: []\n",
        encoding="utf-8",
    )
    assert execute(["run", str(system), "--events", "wait 2s"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert all(line.strip() not in ("one", "two") for line in lines)
    assert "one       1s  ping after its delay" in lines
    assert "two       1s  e" in lines


INVOKED = SCXML.format(
    '<state id="a"><invoke id="child" type="scxml"><content>'
    '<scxml version="1.0" initial="k"><state id="k"><onentry>'
    '<send event="tick" delay="1s"/></onentry><transition event="tick" target="l"/></state>'
    '<state id="l"><onentry><send event="done" target="#_parent" delay="1s"/></onentry></state>'
    '</scxml></content></invoke><transition event="done" target="b"/></state><state id="b"/>'
)


def test_times_of_an_invoked_chart(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chart = tmp_path / "invoker.scxml"
    chart.write_text(INVOKED, encoding="utf-8")
    assert execute(["run", str(chart), "--events", "wait 5s"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert all(line.strip() != "child:" for line in lines)
    assert "          child:       1s  tick" in lines
    assert "      2s  done" in lines


def test_time_goes_on_in_a_chart_with_timers(
    capsys: pytest.CaptureFixture[str],
) -> None:
    feeder = Path(__file__).parents[2] / "machines/production_cell/feeder.yaml"
    assert execute(["run", str(feeder), "--events", "arrived; wait 500ms; pause; wait 60s"]) in (
        0,
        1,
    )
    times = [at for at, _ in _steps(capsys.readouterr().out, is_json=False)]
    assert times == sorted(times)


LONG = """
chart: Long
data: {n: 0..1000000 wrap = 0}
initial: a
states: {a: {every: {200h: {do: n += 1}}, after: {559h: b}}, b: {after: {1h: c}}, c: {}}
"""
HALF_TURN = 2**31


@pytest.mark.external
@pytest.mark.parametrize("target", ["interpreter", "c", "python", "javascript"])
def test_a_wait_may_be_longer_than_the_clock_of_a_machine(
    target: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A machine has a 32-bit clock, so a long wait is several readings of it."""
    chart = tmp_path / "long.yaml"
    chart.write_text(LONG, encoding="utf-8")
    assert (
        execute(["run", str(chart), "--target", target, "--events", "wait 600h; wait 5000h"]) == 0
    )
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert [line for line in lines if line.startswith("=")][-1] == "= c"


@pytest.mark.parametrize(
    "ticks", [HALF_TURN - 1, HALF_TURN, 2 * HALF_TURN, 2 * HALF_TURN + 1, 2**36]
)
def test_every_long_wait_fires_the_timers(
    ticks: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chart = tmp_path / "long.yaml"
    chart.write_text(
        "chart: L\ninitial: a\nstates: {a: {after: {1h: b}}, b: {}}\n", encoding="utf-8"
    )
    system = tmp_path / "system.yaml"
    system.write_text("system: S\nmachines: {m: long.yaml}\n", encoding="utf-8")
    for file in (chart, system):
        assert execute(["run", str(file), "--events", f"wait {ticks}ms"]) == 0
        assert capsys.readouterr().out.rstrip().endswith("= b")


@pytest.mark.parametrize("wait", [f"{2**48 + 1}ms", "99999999999999999h", f"{'9' * 6000}h"])
def test_a_wait_without_end_is_rejected(
    wait: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chart = tmp_path / "long.yaml"
    chart.write_text(LONG, encoding="utf-8")
    assert execute(["run", str(chart), "--events", f"wait {wait}"]) == 1
    assert "wrong-script-line" in capsys.readouterr().err


def test_only_events_that_can_be_posted_are_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chart = tmp_path / "events.yaml"
    chart.write_text(
        "chart: E\nevents: {in: [go], out: [told], internal: [inner]}\ninitial: a\n"
        "states: {a: {on: {go: {do: 'raise inner; send told'}, inner: a}}}\n",
        encoding="utf-8",
    )
    assert execute(["run", str(chart), "--events", "why x"]) == 1
    assert "there are: go, inner\n" in capsys.readouterr().err
