"""The state after an exception of the host, on each runtime of Python."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from fsmkit import Session
from fsmkit.chart.loading import load
from fsmkit.codegen.python.generate import module_text

CHART = """\
chart: Press
data: {count: uint8 = 0}
operations: [goto(position uint8)]
events: {in: [push, pull]}
initial: idle
states:
  idle: {on: {push: {target: pushing, do: count += 1}}}
  pushing:
    entry: [count += 10, goto(5), count += 100]
    after: {10ms: idle}
    on: {pull: {target: idle, do: goto(0)}}
"""


class Host:
    """Raises the given exception."""

    def __init__(self) -> None:
        self.error: BaseException | None = None

    def goto(self, _position: int) -> None:
        if self.error is not None:
            raise self.error


@pytest.fixture
def path(tmp_path: Path) -> Path:
    found = tmp_path / "press.yaml"
    found.write_text(CHART, encoding="utf-8")
    return found


@pytest.fixture(params=[False, True], ids=["plain", "traced"])
def machine(request: pytest.FixtureRequest, path: Path) -> Any:
    module = ModuleType("press")
    sys.modules["press"] = module
    exec(module_text(load(path), traced=request.param, saved=True), module.__dict__)
    made = module.Press(Host())
    made.start(0)
    return made


def test_a_session_takes_the_step_back(path: Path) -> None:
    host = Host()
    session = Session(load(path), host)
    host.error = OSError("stuck")
    before = session.snapshot
    with pytest.raises(OSError, match="stuck"):
        session.dispatch("push")
    assert session.snapshot == before
    host.error = None
    assert session.dispatch("push").handled


@pytest.mark.parametrize("error", [OSError("stuck"), KeyboardInterrupt("stuck")])
@pytest.mark.parametrize("how", ["dispatch", "run", "leave"])
def test_a_generated_machine_stops(machine: Any, how: str, error: BaseException) -> None:
    saved = machine.save(0)
    step = {"dispatch": machine.dispatch_push, "run": lambda: machine.run(1)}.get(how)
    if step is None:  # what a transition does, after a step that went well
        machine.dispatch_push()
        step = machine.dispatch_pull
    machine.post_push()
    machine._host.error = error
    with pytest.raises(type(error), match="stuck"):
        step()
    assert (machine.fault, machine.running, machine.finished) == ("exception", False, False)
    assert machine.run(1) is False
    assert machine.dispatch_pull() is False
    with pytest.raises(ValueError, match="broken off in the midst of a step"):
        machine.save(1)
    machine._host.error = None
    machine.restore(saved, 5)
    assert (machine.fault, machine.count, machine.active()) == (None, 0, ("idle",))
    assert machine.dispatch_push()
    assert (machine.count, machine.next_deadline()) == (111, 15)
    machine.start(3)
    assert (machine.fault, machine.count) == (None, 0)


def test_an_exception_that_the_operation_catches_is_its_own_affair(machine: Any) -> None:
    def goto(_position: int) -> None:
        with pytest.raises(RuntimeError, match="from within one of its own steps"):
            machine.run(1)

    machine._host.goto = goto
    assert machine.dispatch_push()
    assert (machine.fault, machine.count) == (None, 111)


def test_who_calls_nobody_has_nothing_to_break_off(path: Path) -> None:
    path.write_text(CHART.replace("goto(5), ", "").replace(", do: goto(0)}", "}"), encoding="utf-8")
    assert "_break_off" not in module_text(load(path))
