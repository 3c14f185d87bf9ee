"""An extension module as its user meets it: as the Python module, and where it is stricter."""

from __future__ import annotations

import gc
import sys
import weakref
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.python.loading import load_machine
from fsmkit.testing.harness.pyext import load_class
from tests.codegen.pyext.press import PRESS, Host, script, seen

pytestmark = pytest.mark.cc  # the class of the press is compiled


@pytest.fixture(scope="module")
def chart(tmp_path_factory: pytest.TempPathFactory) -> Chart:
    path = tmp_path_factory.mktemp("press") / "press.yaml"
    path.write_text(PRESS)
    return load(path)


@pytest.fixture(scope="module")
def press_class(chart: Chart, require_tool: Callable[[str], str]) -> type[Any]:
    require_tool("cc")
    return load_class(chart)


@pytest.fixture
def host() -> Host:
    return Host()


@pytest.fixture
def press(press_class: type[Any], host: Host) -> Any:
    machine = press_class(host)
    machine.start(0)
    return machine


def test_a_script_does_the_same_on_both(chart: Chart, press_class: type[Any]) -> None:
    hosts = Host(), Host()
    by_python, by_c = load_machine(chart)(hosts[0]), press_class(hosts[1])
    assert script(by_c, hosts[1]) == script(by_python, hosts[0])
    assert len(hosts[1].told) > 10


@pytest.mark.slow
def test_operations_are_methods_of_a_subclass_or_of_an_object(
    chart: Chart, press_class: type[Any]
) -> None:
    for base in (press_class, load_machine(chart)):

        class Derived(base, Host):  # type: ignore[misc, valid-type]
            def __init__(self) -> None:
                base.__init__(self)  # noqa: B023  (it is called at once)
                Host.__init__(self)

        machine = Derived()
        machine.start(0)
        assert machine.dispatch_boom()
        assert machine.told == [("measure", -3)]
        assert machine.weight == 7
        with pytest.raises(TypeError, match="object lacks what Press calls: goto, at_limit"):
            base(object())


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda m: m.post("x"), ValueError, "Press receives no event 'x', but arrived, reset"),
        (lambda m: m.dispatch([]), TypeError, "unhashable"),
        (lambda m: m.dispatch(), TypeError, "event"),
        (lambda m: m.post("ask"), TypeError, "ask carries 1 values, not 0"),
        (lambda m: m.is_in("x"), ValueError, "Press has no state 'x'"),
        (lambda m: m.dispatch_ask(), TypeError, "by"),
        (lambda m: m.dispatch_ask(1, 2), TypeError, "dispatch_ask"),
        (lambda m: m.dispatch_ask(to=1), TypeError, "to"),
        (lambda m: m.dispatch_ask(1, by=1), TypeError, "by"),
        (lambda m: m.dispatch("arrived", when=3), TypeError, "when"),
        (lambda m: m.run(), TypeError, "now"),
    ],
)
def test_both_refuse(
    chart: Chart, press_class: type[Any], call: Callable[[Any], object],
    error: type[Exception], message: str,
) -> None:  # fmt: skip
    for machine in (press_class(Host()), load_machine(chart)(Host())):
        machine.start(0)
        before = seen(machine)
        with pytest.raises(error, match=message):
            call(machine)
        assert seen(machine) == before


class Nasty:
    """Is an integer that does something else meanwhile."""

    def __init__(self, act: Callable[[], object]) -> None:
        self._act = act

    def __index__(self) -> int:
        self._act()
        return 3


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda m: m.dispatch_ask(11), ValueError, "ask: by must be in 0..10, not 11"),
        (lambda m: m.dispatch_ask(-1), ValueError, "not -1"),
        (lambda m: m.dispatch_ask(2**70), ValueError, "0..10"),
        (lambda m: m.post_ask(1.0), TypeError, "ask: by must be an integer, not float"),
        (lambda m: m.post_ask("1"), TypeError, "not str"),
        (lambda m: m.post_put(2**64, 0, 0.0, True), ValueError, "put: big"),
        (lambda m: m.post_put(-1, 0, 0.0, True), ValueError, "put: big"),
        (lambda m: m.post_put(0, 2**63, 0.0, True), ValueError, "put: small"),
        (lambda m: m.post_put(0, 0, "x", True), TypeError, "put: ratio must be a number, not str"),
        (lambda m: m.post_put(0, 0, 0.0, 2), ValueError, "put: is_it"),
        (lambda m: m.post_paint(3, "x"), ValueError, "paint: colour must be in 0..2"),
        (lambda m: m.post_paint(1, 5), TypeError, "paint: label must be a string"),
        (lambda m: m.post_place((1, 2, 3), (1, 2, 3)), ValueError, "2 parts, not 3"),
        (lambda m: m.post_place((1, 2), "123"), TypeError, "sequence"),
        (lambda m: m.post_place((1, 2), (1, 2, 40000)), ValueError, "place: last"),
        (lambda m: m.post_place((1, 2), 5), TypeError, "sequence"),
        (lambda m: m.run("x"), TypeError, "time"),
        (lambda m: m.start(0.5), TypeError, "time"),
        (lambda m: m.dispatch_ask(Nasty(lambda: 1 / 0)), ZeroDivisionError, "zero"),
        (lambda m: setattr(m, "level", 1001), ValueError, "level must be in 0..1000"),
        (lambda m: setattr(m, "last", (1, 2, None)), TypeError, "last"),
        (lambda m: setattr(m, "spot", ()), ValueError, "spot"),
        (lambda m: setattr(m, "misspelt", 1), AttributeError, "misspelt"),
        (lambda m: setattr(m, "running", True), AttributeError, "running"),
        (lambda m: delattr(m, "level"), AttributeError, "deleted"),
        (lambda m: delattr(m, "log"), AttributeError, "deleted"),
    ],
)
def test_wrong_types_and_ranges_are_told_and_change_nothing(
    press: Any, call: Callable[[Any], object], error: type[Exception], message: str
) -> None:
    press.spot, press.last = (1, 2), (3, 4, 5)
    before = seen(press)
    with pytest.raises(error, match=message):
        call(press)
    assert seen(press) == before
    assert press.run(1)


def test_arguments_may_use_the_machine_while_they_are_read(press: Any) -> None:
    assert press.dispatch_ask(Nasty(lambda: press.dispatch_ask(5)))
    assert press.reply == 6
    assert press.dispatch_ask(Nasty(lambda: press.start(9)))


@pytest.mark.parametrize(
    ("answer", "error", "message"),
    [
        (OSError("no sensor"), OSError, "no sensor"),
        (KeyboardInterrupt("stop"), KeyboardInterrupt, "stop"),
        (501, ValueError, "the result of measure must be in 0..500, not 501"),
        (None, TypeError, "the result of measure must be an integer, not NoneType"),
    ],
)
def test_a_step_in_which_an_operation_raises_has_not_happened(
    press: Any, host: Host, answer: object, error: type[BaseException], message: str
) -> None:
    host.answer = answer
    before = seen(press)
    with pytest.raises(error, match=message):
        press.dispatch_boom()
    assert seen(press) == before
    press.post_ask(4)
    press.post_boom()
    press.post_wait()
    for _ in range(2):  # it stays first in the queue
        with pytest.raises(error):
            press.run(20)
    assert press.active() == ("idle",)
    host.answer = 9
    assert press.run(21)
    assert press.active() == ("measuring",)
    assert press.weight == 9
    assert press.count == 1


def test_a_timeout_whose_step_was_broken_off_is_taken_again(press: Any, host: Host) -> None:
    press.dispatch_wait()
    host.answer = ConnectionError()
    with pytest.raises(ConnectionError):
        press.run(50)
    assert (press.active(), press.next_deadline()) == (("waiting",), 10)
    host.answer = 1
    press.run(51)
    assert press.active() == ("measuring",)


def test_what_raises_in_the_first_step_leaves_the_machine_as_it_was(press_class: type[Any]) -> None:
    machine = press_class(Host())
    machine.log = lambda *_: 1 / 0
    machine.start(0)
    with pytest.raises(ZeroDivisionError):
        machine.dispatch_boom()
    assert machine.active() == ("idle",)
    machine.log = 5
    with pytest.raises(TypeError):
        machine.dispatch_boom()
    machine.log = None
    assert machine.dispatch_boom()


@pytest.mark.parametrize("how", ["dispatch_boom", "run", "start", "__init__", "dispatch"])
def test_a_step_within_a_step_is_an_error(press: Any, host: Host, how: str) -> None:
    passed = {"run": (5,), "dispatch": ("boom",)}.get(how, ())

    def reenter() -> int:
        with pytest.raises(RuntimeError, match="from within one of its own steps"):
            getattr(press, how)(*passed)
        assert press.post_reset()  # which is fine
        press.level = 3
        return 11

    host.answer = reenter
    assert press.dispatch_boom()
    assert (press.weight, press.level, press.active()) == (11, 3, ("measuring",))
    assert press.run(1)
    assert press.active() == ("idle",)


@pytest.mark.slow
def test_cycles_are_collected(press_class: type[Any]) -> None:
    class Weak(press_class):  # type: ignore[misc]
        __slots__ = ("__weakref__", "again")

    host: Any = Host()
    machine = Weak(host)
    machine.again, host.machine = machine, machine
    machine.log = partial(print, machine)
    machine.reply = [machine]
    gone = weakref.ref(machine)
    del host, machine
    gc.collect()
    assert gone() is None


def print_nothing(*_: object) -> None:
    pass


@pytest.mark.slow
def test_nothing_is_kept(host: Host, press_class: Callable[..., Any]) -> None:
    def once() -> None:
        machine = press_class(host)
        machine.log = print_nothing
        machine.start(0)
        machine.dispatch("paint", 1, "always the same")
        machine.dispatch_place((1, 2), (3, 4, 5))
        machine.spot, machine.last = machine.last[:2], (*machine.spot, 1)
        machine.dispatch_boom()
        machine.dispatch_reset()
        machine.dispatch_ask(5)
        for call in (
            partial(machine.post_ask, 99), partial(machine.post, "x"), partial(machine.is_in, "x"),
            partial(press_class, object()), partial(machine.dispatch_place, (1, 2), (1, 2, "3")),
        ):  # fmt: skip
            with pytest.raises((ValueError, TypeError)):
                call()
        host.answer = ConnectionError()
        with pytest.raises(ConnectionError):
            machine.dispatch_boom()
        host.answer = 7
        host.told.clear()
        machine.active()

    references = sys.getrefcount(press_class)
    gc.freeze()  # what other tests keep is not searched ten times
    grown = []
    for _ in range(5):  # what is kept grows in each round
        gc.collect()
        before = sys.getallocatedblocks()
        for _ in range(100):
            once()
        gc.collect()
        grown.append(sys.getallocatedblocks() - before)
    assert min(grown) < 60, grown  # one block in each run would be 100
    assert sys.getrefcount(press_class) - references < 3


def test_it_can_be_made_in_odd_ways(press_class: type[Any]) -> None:
    new: Any = press_class.__new__
    machine = new(press_class, 1, x=2)
    assert (machine.active(), machine.running) == ((), False)  # was never given a host
    assert machine.post_arrived() is False
    machine.start(0)
    with pytest.raises(AttributeError, match="measure"):
        machine.dispatch_boom()
    with pytest.raises(TypeError):
        press_class(1, 2)
    with pytest.raises(TypeError):
        type(machine).start(object())
    for copying in (machine.__reduce__, partial(machine.__reduce_ex__, 4)):
        with pytest.raises(TypeError, match="pickle"):
            copying()


def test_it_is_saved_as_the_python_module_saves_it(chart: Chart, press_class: type[Any]) -> None:
    classes = press_class, load_machine(chart)
    made = []
    for each in classes:
        machine = each(Host())
        machine.start(100)
        machine.loaded = True
        machine.spot, machine.last = [1, -2], [3, 4, 5]
        machine.dispatch_arrived()
        machine.post_ask(3)
        made.append(machine.save(130))
    assert made[0] == made[1]
    for each, saved in zip(classes, reversed(made), strict=True):
        machine = each(Host())
        machine.restore(saved, now=1000)
        assert machine.active() == ("pushing",)
        assert machine.next_deadline() == 1000
        assert (tuple(machine.spot), tuple(machine.last)) == ((1, -2), (3, 4, 5))
        for wrong in (saved[:-1], b"", saved[:8] + b"x" + saved[9:]):
            with pytest.raises(ValueError, match="Press"):
                machine.restore(wrong)
        with pytest.raises(TypeError):
            machine.restore("text")
        machine.start(0)
        machine.label = "not in the chart"
        with pytest.raises(ValueError, match=r"a text that|not in tuple"):
            machine.save()


def test_it_has_a_trace_if_asked_for(chart: Chart, press: Any, tmp_path: Path) -> None:
    del tmp_path
    assert not hasattr(press, "trace")
    traced = load_class(chart, traced=True, prefix="traced")
    python = load_machine(chart, traced=True)
    lines: list[list[str]] = [[], []]
    for kept, made in zip(lines, (traced, python), strict=True):
        host = Host()
        machine = made(host)
        machine.trace = kept.append
        script(machine, host)
    assert lines[0] == lines[1]
    assert len(lines[0]) > 50
    machine = traced(Host())
    machine.trace = lambda line: machine.run(1) if line.startswith("=") else None
    with pytest.raises(RuntimeError, match="own steps"):
        machine.start(0)
    assert not machine.running


def test_strings_have_an_end(press_class: type[Any]) -> None:
    # the last: they are those of the module, and then there is no room for others
    machine = press_class(Host())
    machine.start(0)
    number = 0

    def on_and_on() -> None:
        nonlocal number
        while number < 65_600:
            machine.label = f"string {number}"
            number += 1

    with pytest.raises(ValueError, match="over 65535 different strings"):
        on_and_on()
    assert 65_000 < number < 65_536
    assert machine.label == f"string {number - 1}"
    machine.label = "string 3"
    assert machine.label == "string 3"
