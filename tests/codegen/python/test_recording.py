"""Generated Python records what the interpreter, and so C, records: byte for byte."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.python.generate import module_text
from fsmkit.codegen.python.loading import load_machine
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.script import run_script, script_texts
from fsmkit.runtime.tracing.following import CompleteState, Divergence, Missing, ReplayedStep
from fsmkit.testing.harness.python import HarnessMachine
from tests.codegen.c.recorded import by_interpreter, followed, lines, recorded
from tests.codegen.c.test_recording import LAMP, SCRIPT, SHOP, expressible, has_symbols, macrosteps

ROOT = Path(__file__).parents[3]
SHOP_SCRIPT = ["start 0", "post go", "run 1", "post order 3", "run 5", "run 400", "post stop",
               "run 401"]  # fmt: skip


class Recorded(HarnessMachine):
    """A machine that goes on where it is restored, as one in C does: its records are one trace."""

    _only: Any = None

    def _new_machine(self) -> Any:
        self._only = self._only or super()._new_machine()
        return self._only

    @property
    def records(self) -> bytes:
        """The bytes that it recorded."""
        return bytes(self._only.records)


def by_python(chart: Chart, script: Sequence[str], *, traced: bool = False) -> bytes:
    """Return the records of the generated machine for a script."""
    driven = Recorded(chart, load_machine(chart, recorded=True), traced=traced)
    for line in script_texts(script):
        driven.obey(line)
    if traced:
        assert driven.told == run_script(chart, script)
    return driven.records


@pytest.fixture
def lamp(tmp_path: Path) -> Chart:
    path = tmp_path / "lamp.yaml"
    path.write_text(LAMP)
    return load(path)


@pytest.mark.cc
def test_python_and_c_record_the_same_bytes(lamp: Chart, tmp_path: Path) -> None:
    shop = load(SHOP)
    saved = ["start 0", "input dark 1", "dispatch press 9", "run 5", "save", "post press 1",
             "restore 4294967290", "run 4294967295", "post press 2", "run 3000"]  # fmt: skip
    jobs = [(lamp, SCRIPT), (lamp, saved), (shop, SHOP_SCRIPT)]
    for (chart, script), data in zip(jobs, recorded(tmp_path, jobs), strict=True):
        assert by_python(chart, script) == data


@pytest.mark.slow
def test_python_records_random_charts_as_the_interpreter_does() -> None:
    """As C does, by a test of that; strings of a host have other numbers in C."""
    for chart, script in expressible(25):
        data = by_python(chart, script, traced=True)
        if not has_symbols(chart):
            assert data == by_interpreter(chart, script)
        found = followed(chart, data)
        assert [each for each in found if isinstance(each, Missing | Divergence)] == []
        assert macrosteps(lines(chart, found)) == macrosteps(run_script(chart, script))


def test_without_save_there_are_no_saved_machines(lamp: Chart) -> None:
    space: dict[str, Any] = {"__name__": "lamp"}
    exec(module_text(lamp, recorded=True), space)
    machine = space["Lamp"](Host())
    machine.start(0)
    machine.run(5_000)
    assert machine.records[-15:-13] == b"\x73\x8c"
    assert not hasattr(machine, "save")


class Host:
    """Returns a value that is one, or raises."""

    value: Any = 7

    def sense(self) -> Any:
        if isinstance(self.value, Exception):
            raise self.value
        return self.value

    def click(self) -> None:
        """Do nothing."""


@pytest.mark.parametrize("value", [OSError("no light"), 4711, "bright"])
def test_a_step_that_the_host_breaks_off_is_told(lamp: Chart, value: object) -> None:
    """The follower then knows that the machine stopped, but not its other effects."""
    host = Host()
    host.value = value
    machine = load_machine(lamp, recorded=True)(host)
    machine.start(0)
    machine.dark = True
    machine.post_press(9)
    with pytest.raises(Exception, match=r"light|format|argument|required"):
        machine.run(5)
    found = followed(lamp, bytes(machine.records))
    assert isinstance(found[-1], CompleteState)
    assert not found[-1].snapshot.running
    machine.start(9)
    found = followed(lamp, bytes(machine.records))
    assert isinstance(found[-1], ReplayedStep)
    assert active_leaves(lamp, found[-1].macrostep.after) == ["off"]


def test_untraced_code_is_as_before(lamp: Chart) -> None:
    for chart in (lamp, load(SHOP)):
        text = module_text(chart, traced=True, saved=True)
        assert not [word for word in ("records", "_record_") if word in text]


def test_the_program_of_the_how_to_is_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (ROOT / "docs/how-to/trace.md").read_text()
    chart_text, program = (
        re.search(rf"```{language}\n({first}.*?)```", page, re.DOTALL)[1]  # type: ignore[index]
        for language, first in (("yaml", "chart: Lamp"), ("python", "from lamp"))
    )
    (tmp_path / "lamp.yaml").write_text(chart_text)
    chart = load(tmp_path / "lamp.yaml")
    (tmp_path / "lamp.py").write_text(module_text(chart, saved=True, recorded=True))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    exec(program, {"__name__": "host"})
    found = followed(chart, (tmp_path / "lamp.trace").read_bytes())
    assert [each for each in found if isinstance(each, Missing | Divergence)] == []
    assert sum(isinstance(each, ReplayedStep) for each in found) == 4
