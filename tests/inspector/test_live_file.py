"""Sessions that were recorded are done again, message by message, or shown as they were told."""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.inspector import charts
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.recorder import FLUSHED_EVERY
from fsmkit.inspector.sources.live_file import read_live
from fsmkit.inspector.sources.opening import open_source
from tests.inspector.conftest import Client
from tests.inspector.following import Elsewhere

CELL = Path(__file__).parents[2] / "machines/production_cell/cell.yaml"


@pytest.fixture(autouse=True)
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw no chart: that is not what is tested here."""
    monkeypatch.setattr(charts, "MOST_DRAWN", 0)


def used(client: Client) -> None:
    """Do this and that in a session of a gate."""
    client.result("post", m="Gate", event="open")
    client.result("run", speed=1)
    client.hub.advance(1_500_000)
    client.result("post", m="Gate", event="fault", **{"with": {"code": "jam"}})
    client.result("pause")
    client.result("back", count=1)
    client.result("set", m="Gate", input="blocked", value=True)
    client.result("step", how="timer")


def seen(hub: Hub) -> list[dict[str, Any]]:
    """Return each entry of the branch in view, with all of the machine there."""
    client = Client(hub)
    found = []
    for n in range(hub.view.history.head + 1):
        client.result("seek", n=n)
        state = client.last("state")
        found.append({key: value for key, value in state.items() if key != "at"})
    return found


@pytest.mark.parametrize("name", ["gate.live", "gate.live.gz"])
def test_a_recording_of_a_simulation_is_done_again(gate: Path, tmp_path: Path, name: str) -> None:
    hub = Hub(fsmkit.read_chart(gate), file=gate)
    path = tmp_path / "kept" / name
    recorder = hub.record(path)
    used(Client(hub))
    recorder.close()
    recorded, file = read_live(path, Findings())
    assert file.resolve() == gate.resolve()
    again = Hub(recorded, file=file)
    assert seen(again) == seen(hub)
    assert all(entry.moment is not None for entry in recorded.entries)
    client = Client(again)
    client.result("seek", n=again.view.history.head)
    client.result("step")
    assert client.last("mode")["branch"] == 1


def test_what_is_saved_is_shown_again(gate: Path) -> None:
    client = Client(Hub(fsmkit.read_chart(gate), file=gate, seed=5))
    used(client)
    path = gate.with_name("saved.live")
    path.write_text(client.result("save", **{"as": "live"}), encoding="utf-8")
    opened = open_source(path, Findings())
    assert seen(Hub(opened.source)) == seen(client.hub)
    client.result("fork", branch=0)
    other = seen(client.hub)
    path.write_text(client.result("save", **{"as": "live"}), encoding="utf-8")
    assert seen(Hub(read_live(path, Findings())[0])) == other


def test_another_branch_that_is_gone_to_is_what_counts(gate: Path, tmp_path: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate), file=gate)
    recorder = hub.record(tmp_path / "a.live")
    client = Client(hub)
    used(client)
    client.result("fork", branch=0)
    client.result("post", m="Gate", event="close")
    recorder.close()
    assert seen(Hub(read_live(tmp_path / "a.live", Findings())[0])) == seen(hub)


@pytest.mark.slow
def test_a_system_with_delays_by_chance_is_done_again(tmp_path: Path) -> None:
    hub = Hub(fsmkit.read_system(CELL), file=CELL, seed=9)
    recorder = hub.record(tmp_path / "cell.live.gz")
    client = Client(hub)
    client.result("run", speed=0)
    hub.advance(1)
    client.result("post", m="plant", event="press_start")
    client.result("run", speed=0)
    hub.advance(1)
    client.result("pause")
    recorder.close()
    recorded, _ = read_live(tmp_path / "cell.live.gz", Findings())
    assert len(recorded.entries) == hub.view.history.head > 300
    last = recorded.entries[-1].moment
    assert hub.moment is not None
    assert last is not None
    assert last.snapshots == hub.moment.snapshots


def test_a_file_that_was_cut_off_is_read_up_to_there(gate: Path, tmp_path: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate), file=gate)
    recorder = hub.record(tmp_path / "a.live.gz")
    used(Client(hub))
    hub.advance(FLUSHED_EVERY)  # and the process is killed
    whole = read_live(tmp_path / "a.live.gz", Findings())[0]
    assert len(whole.entries) == hub.view.history.head
    recorder.close()
    lines = gzip.decompress((tmp_path / "a.live.gz").read_bytes())
    (tmp_path / "a.live").write_bytes(lines[:-40])
    assert len(read_live(tmp_path / "a.live", Findings())[0].entries) == len(whole.entries) - 1


def test_what_was_followed_is_only_looked_at(gate: Path, tmp_path: Path) -> None:
    far = Elsewhere(fsmkit.read_chart(gate))
    far.begin, far.is_known = None, False
    hub = Hub(far, file=gate)
    recorder = hub.record(tmp_path / "a.live")
    far.happen()
    far.happen("open", until=4000)
    hub.advance(16_000)
    recorder.close()
    recorded, _ = read_live(tmp_path / "a.live", Findings())
    client = Client(Hub(recorded))
    client.result("seek", n=client.last("mode")["head"])
    assert client.last("state")["on"] == ["wide"]
    assert client.last("state")["known"] is False
    assert client.say("post", m="Gate", event="close")["k"] == "refused"
    client.result("seek", n=0)
    number = client.result("break", on="entered", what="opening")
    client.result("run", speed=0)
    client.hub.advance(1)
    assert client.last("mode")["why"] == ["breakpoint", number]


def text_of(gate: Path) -> list[str]:
    client = Client(Hub(fsmkit.read_chart(gate), file=gate))
    used(client)
    saved: str = client.result("save", **{"as": "live"})
    return saved.splitlines()


@pytest.mark.parametrize(
    ("change", "rule"),
    [
        (lambda lines: lines[:0], "unreadable-log"),
        (lambda lines: lines[1:], "unreadable-log"),
        (lambda lines: [lines[0], "{", *lines[1:]], "unreadable-log"),
        (lambda lines: [lines[0], "3", *lines[1:]], "unreadable-log"),
        (lambda lines: [lines[0], '{"k":["step"]}', lines[2].replace('"n":0', '"n":-1'),
                        lines[3].replace('"n":1', '"n":7').replace('"Gate"', '"Door"')],
         "unreadable-log"),
        (lambda lines: [lines[0], "[" * 50_000, *lines[1:]], "unreadable-log"),
        (lambda lines: [x.replace('"gate.yaml"', '"../no.yaml"') for x in lines], "foreign-log"),
        (lambda lines: [x.replace('"opening"', '"wide"') for x in lines], "replay-parts"),
        (lambda lines: [x.replace('["open"]', '["opne"]') for x in lines], "unreadable-log"),
        (lambda lines: [x.replace('{"blocked":true}', '{"blocked":9}') for x in lines],
         "unreadable-log"),
        (lambda lines: [x.replace('"simulated"', '"live"').replace('["+","opening"]', '["+"]')
                        for x in lines], "unreadable-log"),
    ],
)  # fmt: skip
def test_what_is_no_such_file_is_a_finding(gate: Path, change: Any, rule: str) -> None:
    path = gate.with_name("broken.live")
    path.write_text("".join(f"{line}\n" for line in change(text_of(gate))), encoding="utf-8")
    with pytest.raises(FsmkitError) as raised:
        read_live(path, Findings())
    assert raised.value.diagnostics[0].rule.name == rule


def test_a_changed_chart_is_a_finding(gate: Path) -> None:
    path = gate.with_name("a.live")
    path.write_text("\n".join(text_of(gate)), encoding="utf-8")
    other = gate.with_name("other.yaml")
    other.write_text(gate.read_text().replace("4s", "5s"), encoding="utf-8")
    with pytest.raises(FsmkitError) as raised:
        open_source(other, Findings(), replay=path)
    assert raised.value.diagnostics[0].rule.name == "foreign-log"
    gate.rename(gate.with_name("moved.yaml"))
    assert open_source(gate.with_name("moved.yaml"), Findings(), replay=path).name == "Gate"


def test_kinds_that_are_not_known_are_passed_over(gate: Path) -> None:
    lines = text_of(gate)
    path = gate.with_name("a.live")
    new = json.dumps([{"k": "weather", "n": 3}])
    path.write_text("\n".join([lines[0], new, *lines[1:], ""]), encoding="utf-8")
    assert read_live(path, Findings())[0].entries


def test_a_file_that_cannot_be_written_is_a_finding(gate: Path, tmp_path: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate), file=gate)
    with pytest.raises(FsmkitError) as raised:
        hub.record(tmp_path)
    assert raised.value.diagnostics[0].rule.name == "unwritable-output"
    full = Path("/dev/full")
    if full.exists():
        recorder = hub.record(full)
        used(Client(hub))
        hub.advance(FLUSHED_EVERY)
        assert recorder.error is not None
        recorder.close()


def test_what_cannot_be_recorded_or_watched_is_said(
    gate: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["serve", str(gate), "--record", str(gate.with_name("a.txt"))]) == 2
    assert ".live" in capsys.readouterr().err
    path = gate.with_name("a.live")
    path.write_text("\n".join(text_of(gate)), encoding="utf-8")
    assert execute(["serve", str(path), "--watch"]) == 2
    assert "simulated" in capsys.readouterr().err
    assert execute(["serve", str(gate.with_name("no.live"))]) == 1
    assert "unreadable-file" in capsys.readouterr().err
