"""The log of a machine in C is gone through like a session."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.sources import Recorded
from fsmkit.inspector.sources.log import read_log
from fsmkit.inspector.sources.opening import open_source
from fsmkit.runtime.interpreter.trace import trace_lines
from fsmkit.runtime.recording import replay
from tests.codegen.c.test_tracing import LAMP, logged
from tests.inspector.conftest import Client, elaborated

SCRIPT = [
    "seed 7", "start 4294967290", "input dark 1", "post press 3", "run 4294967290", "post press 9",
    "run 4294967295", "run 18", "run 19", "dispatch ask", "dispatch press 8",
]  # fmt: skip


@pytest.fixture(scope="module")
def lamp(tmp_path_factory: pytest.TempPathFactory) -> tuple[Chart, bytes]:
    """Run a lamp in C, and keep its log."""
    chart = elaborated(LAMP)
    ((log, _),) = logged(tmp_path_factory.mktemp("lamp"), [(chart, SCRIPT)])
    return chart, log


@pytest.mark.cc
def test_a_log_is_gone_through(lamp: tuple[Chart, bytes]) -> None:
    chart, log = lamp
    recorded = read_log(chart, log)
    steps = [entry.stepped.macrostep for entry in recorded.entries if entry.stepped is not None]
    lines = [line for step in steps for line in trace_lines(chart, (step,))]
    assert lines == list(replay(chart, log))
    assert all(entry.moment is not None for entry in recorded.entries)
    client = Client(Hub(recorded))
    assert (client.last("mode")["n"], client.last("mode")["head"]) == (0, len(recorded.entries))
    number = client.result("break", on="entered", what="on")
    client.result("run", speed=0)
    client.hub.advance(1)
    assert client.last("mode")["why"] == ["breakpoint", number]
    light = client.result("watch", expression="light")["value"]
    assert light > 0
    assert client.last("step")["do"][1][0] == "t"
    client.result("unbreak", number=number)
    client.result("run", speed=0)
    client.hub.advance(1)
    assert client.last("mode")["why"] == ["end"]
    posts = [m["event"] for m in client.told if m["k"] == "post"]
    assert posts == [["press", 3], ["press", 9], ["ask"], ["press", 8]]
    client.result("step", how="timer")  # on from the end, in the interpreter
    assert client.last("mode")["branch"] == 1
    assert client.result("watch", expression="In(off)")["value"] is True


@pytest.mark.cc
def test_a_log_needs_its_chart(lamp: tuple[Chart, bytes], tmp_path: Path) -> None:
    chart, log = lamp
    (tmp_path / "lamp.yaml").write_text(LAMP, encoding="utf-8")
    (tmp_path / "lamp.log").write_bytes(log)
    opened = open_source(tmp_path / "lamp.yaml", Findings(), replay=tmp_path / "lamp.log")
    assert isinstance(opened.source, Recorded)
    assert opened.name == "Lamp"
    with pytest.raises(FsmkitError) as raised:
        read_log(elaborated(LAMP.replace("0..100", "0..99")), log)
    assert raised.value.diagnostics[0].rule.name == "foreign-log"
    for broken in (b"\xff" + log, b"FST\x01" + log):
        with pytest.raises(FsmkitError) as raised:
            read_log(chart, broken)
        assert raised.value.diagnostics[0].rule.name == "unreadable-log"


@pytest.mark.cc
def test_a_log_is_saved_as_a_script_where_its_results_do_not_count(tmp_path: Path) -> None:
    text = LAMP.replace("do: light = sense()", "do: light = 7")
    chart = elaborated(text)
    ((log, _),) = logged(tmp_path, [(chart, SCRIPT)])
    file = tmp_path / "lamp.yaml"
    file.write_text(text, encoding="utf-8")
    client = Client(Hub(read_log(chart, log), file=file))
    saved = client.result("save", **{"as": "pytest"})
    found: dict[str, object] = {}
    exec(compile(saved, "test_saved.py", "exec"), found)
    found["test_it_does_so_again"]()  # type: ignore[operator]
