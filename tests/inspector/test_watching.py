"""A chart that is saved again is loaded anew, and the same is done with it again."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import fsmkit
from fsmkit.inspector import charts
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.sources.live_file import read_live
from fsmkit.inspector.watching import Watcher
from tests.inspector.conftest import GATE, Client


@pytest.fixture(autouse=True)
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw no chart: that is not what is tested here."""
    monkeypatch.setattr(charts, "MOST_DRAWN", 0)


@pytest.fixture
def client(gate: Path) -> Client:
    """Look at a gate, of which something was done."""
    client = Client(Hub(fsmkit.read_chart(gate), file=gate))
    client.result("post", m="Gate", event="open")
    client.result("step", how="timer")
    client.result("set", m="Gate", input="blocked", value=True)
    client.result("post", m="Gate", event="close")
    return client


class Saved:
    """A watcher that a test tells when to look."""

    def __init__(self, client: Client, file: Path) -> None:
        self.file = file
        self.watcher = Watcher(client.hub, file, lambda: fsmkit.read_chart(file))
        self._time = 0

    def save(self, text: str) -> bool:
        """Save the file, and look until it rests; return whether it was loaded."""
        self.file.write_text(text, encoding="utf-8")
        self._time += 1_000_000_000
        os.utime(self.file, ns=(self._time, self._time))
        assert not self.watcher.has_changed()  # it does not rest yet
        if not self.watcher.has_changed():
            return False
        self.watcher.load()
        return True


def test_the_same_is_done_again(client: Client, gate: Path) -> None:
    saved = Saved(client, gate)
    assert not saved.watcher.has_changed()
    before = client.hub.moment
    branch = [*client.hub.view.history.branch.texts]
    assert saved.save(GATE + "# a comment\n")
    assert client.last("mode")["why"] == ["reloaded"]
    assert client.hub.moment == before
    assert [*client.hub.view.history.branch.texts] == branch
    assert client.last("hello")["k"] == "hello"
    assert client.last("state")["on"] == ["closed"]


def test_the_first_entry_that_differs_is_told(client: Client, gate: Path) -> None:
    opened = next(m["n"] for m in client.told if m["k"] == "step" and m["cause"][0] == "timeout")
    assert Saved(client, gate).save(GATE.replace("count = count + 1, ", "count = count + 2, "))
    assert client.last("mode")["why"] == ["reloaded", opened]
    assert client.last("state")["data"]["count"] == 2
    assert client.last("mode")["n"] == client.last("mode")["head"]


def test_what_cannot_be_done_again_is_told(client: Client, gate: Path) -> None:
    gone = GATE.replace("in: [open, close, ", "in: [open, ").replace(
        "{close: closed}", "{open: closed}"
    )
    assert Saved(client, gate).save(gone)
    kind, n, problem = client.last("mode")["why"]
    assert kind == "reloaded"
    assert "close" in problem
    assert n >= 4
    assert client.last("state")["on"] == ["wide"]
    assert client.result("post", m="Gate", event="open") == "queued"


def test_a_broken_file_keeps_the_session(client: Client, gate: Path) -> None:
    saved = Saved(client, gate)
    before = client.hub.moment
    assert saved.save(GATE.replace("broken:", "brokn:"))
    broken = client.last("broken")["findings"]
    assert broken
    assert broken[0]["at"]["file"] == str(gate)
    assert "`broken`" in broken[0]["message"]
    assert client.hub.moment == before
    assert client.result("post", m="Gate", event="open") == "queued"
    assert Client(client.hub).told[-1]["k"] == "broken"
    assert saved.save("")
    assert client.last("broken")["findings"]
    assert saved.save(GATE)
    assert "broken" not in [m["k"] for m in Client(client.hub).told]


def test_breakpoints_stay_where_their_names_do(client: Client, gate: Path) -> None:
    kept = client.result("break", m="Gate", on="entered", what="wide")
    gone = client.result("break", m="Gate", on="entered", what="broken")
    text = GATE.replace("broken", "jammed")
    assert Saved(client, gate).save(text)
    assert client.say("unbreak", number=gone)["k"] == "refused"
    client.result("set", m="Gate", input="blocked", value=False)
    client.result("post", m="Gate", event="open")
    client.result("run", speed=0)
    client.hub.advance(1)
    assert client.last("mode")["why"] == ["breakpoint", kept]


def test_it_runs_on_and_is_recorded_anew(client: Client, gate: Path, tmp_path: Path) -> None:
    recorder = client.hub.record(tmp_path / "a.live")
    client.result("run", speed=1)
    client.hub.advance(500_000)
    assert Saved(client, gate).save(GATE.replace("T_OPEN: 4s", "T_OPEN: 3s"))
    assert client.last("mode")["mode"] == "running"
    assert client.last("mode")["at"] == client.hub.at > 4000
    client.result("pause")
    recorder.close()
    recorded, _ = read_live(tmp_path / "a.live", fsmkit.Findings())
    assert len(recorded.entries) == client.hub.view.history.head
