"""Generated Python saves what the interpreter reads, and the reverse."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.python.generate import module_text
from fsmkit.runtime.session import Session
from tests.codegen.oven import OVEN


def chart_of(folder: Path, text: str = OVEN) -> Chart:
    path = folder / "oven.yaml"
    path.write_text(text)
    return load(path)


class Host:
    """Saves from within a step."""

    machine: Any

    def alarm(self) -> None:
        with pytest.raises(RuntimeError):
            self.machine.save()


def machine_of(chart: Chart) -> Any:
    space: dict[str, Any] = {"__name__": "oven"}
    exec(module_text(chart, saved=True), space)
    host = Host()
    host.machine = space["Oven"](host)
    return host.machine


def test_the_interpreter_goes_on_and_back(tmp_path: Path) -> None:
    chart = chart_of(tmp_path)
    machine = machine_of(chart)
    machine.start(2**32 - 6)
    machine.post("go", 1, -300)
    machine.run(2**32 - 6)
    machine.post("hint")
    machine.run(2**32 - 5)
    machine.post("stop")
    session = Session(chart, {"alarm": lambda: None}, start=False)
    session.restore(machine.save(994))
    assert session.active == ("warm",)
    assert session.data == {"heat": "high", "grams": -300, "factor": 0.1, "rows": [7, 9, 7]}
    assert session.next_deadline == 4000
    again = machine_of(chart)
    again.restore(session.save_bytes(), 50)
    assert again.save() == session.save_bytes() == machine.save(994)
    assert (again.heat, again.grams, again.rows, again.next_deadline()) == (
        1,
        -300,
        [7, 9, 7],
        4050,
    )
    again.run(51)
    assert again.active() == ("off",)


def test_a_restored_machine_goes_on(tmp_path: Path) -> None:
    chart = chart_of(tmp_path)
    session = Session(chart, {"alarm": lambda: None})
    session.post("go", "low", 1)
    session.run()
    machine = machine_of(chart)
    machine.restore(session.save_bytes())
    machine.run(4999)
    assert machine.active() == ("warm",)
    machine.run(5000)
    assert machine.active() == ("hot",)


def test_what_is_damaged_or_of_another_chart_is_refused(tmp_path: Path) -> None:
    machine = machine_of(chart_of(tmp_path))
    machine.start()
    saved = machine.save()
    for wrong in (b"", saved[:-1], saved + b"\0", saved[:20] + b"\7" + saved[21:]):
        with pytest.raises(ValueError, match="damaged"):
            machine.restore(wrong)
    other = machine_of(chart_of(tmp_path, OVEN.replace("5s: hot", "6s: hot")))
    with pytest.raises(ValueError, match="another chart"):
        other.restore(saved)
    assert machine.running


def test_nothing_is_there_unless_it_is_asked_for(tmp_path: Path) -> None:
    chart = chart_of(tmp_path)
    assert "def save" not in module_text(chart)
    assert "zlib" not in module_text(chart)
