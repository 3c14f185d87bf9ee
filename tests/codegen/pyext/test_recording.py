"""An extension module records what the same machine in C does, each object into its own bytes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.pyext.members import module_of
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.script import script_texts
from fsmkit.runtime.tracing.following import CompleteState, Divergence, Missing, ReplayedStep
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.records import Lost
from fsmkit.runtime.tracing.stream import Stream
from fsmkit.testing.harness.pyext import HarnessExtension, _load, load_class
from tests.codegen.c.recorded import by_interpreter, followed
from tests.codegen.c.test_recording import LAMP, SCRIPT, SHOP, expressible, has_symbols
from tests.codegen.python.test_recording import SHOP_SCRIPT

SAVED = ["start 0", "input dark 1", "dispatch press 9", "run 5", "save", "post press 1",
         "restore 4294967290", "run 4294967295", "post press 2", "run 3000"]  # fmt: skip
PACED = """
chart: Paced
events: {in: [go]}
operations: [sense() -> 0..100]
data: {n: 0..100 = 0}
initial: a
states:
  a: {after: {10ms: b}, on: {go: {do: n = sense()}}}
  b: {after: {10ms: c}}
  c: {entry: n = sense()}
"""


class Recorded(HarnessExtension):
    """A machine that goes on where it is restored, as one in C does: its records are one trace."""

    _only: Any = None

    def _new_machine(self) -> Any:
        self._only = self._only or super()._new_machine()
        return self._only

    def play(self, script: Sequence[str]) -> bytes:
        """Obey a script; return the bytes that were recorded."""
        for line in script_texts(script):
            self.obey(line)
        return bytes(self._only.records)


class Host:
    """Senses what it is given, or does it."""

    value: Any = 7

    def sense(self) -> Any:
        return self.value() if callable(self.value) else self.value

    def click(self) -> None:
        """Do nothing."""


@pytest.fixture(scope="module")
def lamp(tmp_path_factory: pytest.TempPathFactory) -> Chart:
    path = tmp_path_factory.mktemp("lamp") / "lamp.yaml"
    path.write_text(LAMP)
    return load(path)


@pytest.fixture(scope="module")
def paced(tmp_path_factory: pytest.TempPathFactory) -> Chart:
    path = tmp_path_factory.mktemp("paced") / "paced.yaml"
    path.write_text(PACED)
    return load(path)


@pytest.fixture(scope="module")
def classes(
    lamp: Chart, paced: Chart, require_tool: Callable[[str], str]
) -> tuple[type[Any], type[Any]]:
    require_tool("cc")
    return load_class(lamp, recorded=True), load_class(paced, recorded=True, saved=False)


@pytest.mark.external
@pytest.mark.slow
def test_random_charts_record_the_bytes_of_the_interpreter(lamp: Chart) -> None:
    """So those of C, by a test of that. With a trace beside, and without one."""
    jobs = [job for job in expressible(8) if not has_symbols(job[0])]
    jobs += [(lamp, SCRIPT), (lamp, SAVED), (load(SHOP), SHOP_SCRIPT)]
    modules = [
        module_of(chart, f"rec{n}", saved=True, recorded=True, traced=n % 2 > 0)
        for n, (chart, _) in enumerate(jobs)
    ]
    for n, ((chart, script), made) in enumerate(zip(jobs, _load(modules, "all"), strict=True)):
        driven = Recorded(chart, made, traced=n % 2 > 0)
        assert driven.play(script) == by_interpreter(chart, script)


@pytest.mark.cc
def test_each_machine_has_its_own_records(classes: tuple[type[Any], type[Any]]) -> None:
    """Also one that runs within an operation of another one of the same class."""
    hosts = Host(), Host()
    alone, outer, inner = (classes[0](host) for host in (hosts[1], *hosts))

    def run(machine: Any) -> None:
        machine.start(0)
        machine.dark = True
        machine.post_press(9)
        machine.run(5)

    def within() -> int:
        run(inner)
        return 7

    hosts[0].value = within
    run(alone)
    run(outer)
    assert outer.records == inner.records == alone.records
    outer.records.clear()
    assert len(inner.records) > 20
    with pytest.raises(AttributeError):
        outer.records = bytearray()


@pytest.mark.cc
def test_a_call_that_the_host_breaks_off_has_not_happened(
    classes: tuple[type[Any], type[Any]],
) -> None:
    hosts = Host(), Host()
    broken, plain = (classes[0](host) for host in hosts)
    for machine in (broken, plain):
        machine.start(0)
        machine.post_press(9)
        machine.dark = True
    hosts[0].value = lambda: 1 // 0
    with pytest.raises(ZeroDivisionError):
        broken.run(5)
    assert broken.records == plain.records
    hosts[0].value = 7
    for machine in (broken, plain):
        machine.run(6)
    assert broken.records == plain.records


@pytest.mark.cc
def test_of_a_run_that_is_broken_off_the_whole_state_is_told(
    classes: tuple[type[Any], type[Any]], paced: Chart
) -> None:
    """Its first step stays; no call of which a follower knows does that alone."""
    host = Host()
    machine = classes[1](host)
    machine.start(0)
    host.value = lambda: 1 // 0
    with pytest.raises(ZeroDivisionError):
        machine.run(25)
    assert machine.active() == ("b",)
    found = followed(paced, bytes(machine.records))
    assert isinstance(found[-1], CompleteState)
    assert active_leaves(paced, found[-1].snapshot) == ["b"]
    host.value = 3
    machine.run(26)
    found = followed(paced, bytes(machine.records))
    assert not [each for each in found if isinstance(each, Divergence | Missing)]
    assert isinstance(found[-1], ReplayedStep)
    assert active_leaves(paced, found[-1].macrostep.after) == ["c"]


@pytest.mark.cc
def test_records_may_be_taken_within_a_step(
    classes: tuple[type[Any], type[Any]], paced: Chart
) -> None:
    host, taken = Host(), bytearray()
    machine = classes[1](host)

    def take() -> int:
        taken.extend(machine.records)
        machine.records.clear()
        raise ConnectionError

    host.value = take
    machine.start(0)
    with pytest.raises(ConnectionError):
        machine.dispatch_go()
    host.value = 4
    machine.dispatch_go()
    found = followed(paced, bytes(taken + machine.records))
    assert not [each for each in found if isinstance(each, Divergence | Missing)]
    assert isinstance(found[-1], ReplayedStep)
    assert active_leaves(paced, found[-1].macrostep.after) == ["a"]


@pytest.mark.cc
def test_what_finds_no_room_is_counted(classes: tuple[type[Any], type[Any]], lamp: Chart) -> None:
    """Bytes that someone looks into cannot grow."""
    machine = classes[0](Host())
    machine.start(0)
    with memoryview(machine.records):
        machine.post_press(1)
        machine.run(2)
        machine.post_press(2)
    machine.post_press(3)
    told = [each.told for each in Stream([Numbering(lamp)]).feed(bytes(machine.records))]
    assert Lost(3) in told  # two events, the end of the call


@pytest.mark.cc
def test_a_text_of_the_host_is_not_saved_where_it_is_recorded(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    path = tmp_path / "named.yaml"
    path.write_text(
        'chart: Named\nevents: {in: ["name(text symbol)"]}\ndata: {held: symbol = ""}\n'
        "initial: a\nstates: {a: {on: {name: {do: held = event.text}}}}\n"
    )
    machine = load_class(load(path), recorded=True)()
    machine.start(0)
    machine.save()
    machine.dispatch_name("from outside")
    with pytest.raises(ValueError, match="holds a text that its chart nowhere mentions"):
        machine.save()
