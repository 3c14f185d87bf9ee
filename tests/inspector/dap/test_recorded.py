"""Logs of machines in C in an editor, and the inside of macrosteps made again."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fsmkit.chart.chart import Chart
from fsmkit.inspector.questions.microsteps import snapshots_within
from fsmkit.inspector.simulation import Simulation
from fsmkit.runtime.interpreter.snapshot import Occurrence
from fsmkit.system.of_one_chart import system_of
from tests.codegen.c.test_tracing import LAMP, logged
from tests.inspector.conftest import elaborated
from tests.inspector.dap.editor import Editor
from tests.inspector.dap.test_session import PARALLEL

SCRIPT = ["seed 7", "start 0", "input dark 1", "post press 3", "run 0", "run 30"]


@pytest.mark.cc
def test_a_log_is_stepped_from_its_start(tmp_path: Path) -> None:
    file, log = tmp_path / "lamp.yaml", tmp_path / "lamp.log"
    file.write_text(LAMP, encoding="utf-8")
    ((data, _),) = logged(tmp_path, [(elaborated(LAMP), SCRIPT)])
    log.write_bytes(data)
    editor = Editor()
    assert editor.launch(file, replay=str(log), speed=0)["description"] == "not started"
    editor.get("setFunctionBreakpoints", breakpoints=[{"name": "press"}])
    assert editor.run()["reason"] == "function breakpoint"
    assert editor.values("Event")["cause"] == "event press"
    editor.stop("reverseContinue")
    assert editor.stack() == ["Lamp (not started):2"]
    assert editor.refused("launch", program=str(file), replay="none.log")["rule"]


CHART: Chart = elaborated(PARALLEL)


@settings(max_examples=30)
@given(st.lists(st.sampled_from(["go", "stop"]), max_size=5), st.integers(0, 9))
def test_the_inside_of_a_macrostep_leads_to_its_end(events: list[str], value: int) -> None:
    simulation = Simulation(system_of(CHART))
    moment, done = simulation.step(simulation.begin(), 0)
    for event in ["", *events]:
        if event:
            payload = (value,) if event == "go" else ()
            after = simulation.post(moment, 0, Occurrence(CHART.event_index[event], payload))
            if after is None:
                return
            moment, done = simulation.step(after, 0)
        assert done is not None
        seen = snapshots_within(CHART, done.macrostep)
        assert len(seen) == len(done.macrostep.microsteps)
        configuration = set(done.macrostep.before.configuration)
        for snapshot, small in zip(seen, done.macrostep.microsteps, strict=True):
            if snapshot.running:
                configuration = configuration - set(small.exited) | set(small.entered) | {0}
                assert snapshot.configuration == configuration
        if seen:
            assert seen[-1].data == done.macrostep.after.data
