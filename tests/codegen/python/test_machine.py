"""A generated module as its user meets it."""

from __future__ import annotations

import ast
import gc
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.python.generate import module_text
from fsmkit.codegen.python.loading import load_machine
from fsmkit.codegen.python.plugin import PLUGIN
from fsmkit.diagnostics import Findings
from fsmkit.runtime.script import run_script
from fsmkit.testing.harness import python as harness

PRESS = """\
chart: Press
doc: Presses things.
types:
  Fault: [none, jam]
data:
  count: uint16 = 0
  level: 0..9 = 0
  samples: uint8[3] = 0
  running: bool = false
inputs:
  loaded: bool
outputs:
  lamp: Fault = Fault.none
operations:
  - goto(position 0..4000, speed 0..100)
  - at_limit() -> bool
events:
  in:
    - arrived
    - fault(code Fault)
    - query() -> 0..9
    - tick(amount 0..5)
  out:
    - pushed(count uint16)
initial: idle
states:
  idle:
    entry: level = 0
    on:
      arrived: {if: loaded, target: pushing}
      query: {do: reply level}
      tick:
        do: level += event.amount; samples[1] += event.amount; count += 1
      fault: {target: broken, do: lamp = event.code}
  pushing:
    entry: goto(2800, 100)
    exit: send pushed(count = count)
    after:
      100ms: idle
    every:
      30ms: {if: at_limit(), do: count += 1}
  broken:
    final: true
"""


@pytest.fixture
def chart(tmp_path: Path) -> Chart:
    path = tmp_path / "press.yaml"
    path.write_text(PRESS)
    return load(path)


class Host:
    """A host that records its calls."""

    def __init__(self) -> None:
        self.told: list[tuple[Any, ...]] = []
        self.is_at_limit = False
        self.machine: Any = None

    def goto(self, position: int, speed: int) -> None:
        self.told.append(("goto", position, speed))

    def at_limit(self) -> bool:
        return self.is_at_limit

    def send_pushed(self, count: int) -> None:
        self.told.append(("pushed", count))


@pytest.fixture
def host() -> Host:
    return Host()


@pytest.fixture
def press(chart: Chart, host: Host) -> Any:
    machine = load_machine(chart)(host)
    machine.start(1000)
    return machine


def test_it_steps(press: Any, host: Host) -> None:
    assert press.active() == ("idle",)
    assert press.post_arrived()
    assert press.run(1010)
    assert press.is_in("idle")  # not loaded
    press.loaded = True
    press.post("arrived")
    press.run(1020)
    assert press.is_in("pushing")
    assert not press.is_in("idle")
    assert host.told == [("goto", 2800, 100)]
    assert press.next_deadline() == 1050
    host.is_at_limit = True
    press.run(1119)
    assert press.count == 3
    press.run(1120)
    assert press.active() == ("idle",)
    assert press.next_deadline() is None
    assert host.told[-1] == ("pushed", 3)


def test_dispatch_answers(press: Any) -> None:
    press.post_tick(4)
    press.run(1001)
    assert press.dispatch_query()
    assert press.reply == 4
    assert press.dispatch("query", now=1500)
    press.loaded = True
    assert press.dispatch_arrived()
    assert press.next_deadline() == 1530
    press.loaded = False
    press.run(1600)
    assert not press.dispatch("arrived")
    assert press.reply is None


def test_names_of_the_chart_that_the_machine_has_already_get_an_underscore(press: Any) -> None:
    assert press.running is True
    assert press.running_ is False


def test_an_operation_does_not_hide_a_method_of_the_machine(tmp_path: Path) -> None:
    path = tmp_path / "odd.yaml"
    path.write_text(
        "chart: Odd\noperations: ['run(self 0..9, class bool)', pass()]\n"
        "states:\n  if: {entry: 'run(3, true); pass()'}\n"
    )
    told: list[object] = []

    class Own(load_machine(load(path))):  # type: ignore[misc]
        def run_(self, *values: object) -> None:
            told.append(values)

        def pass_(self) -> None:
            told.append("pass")

    machine = Own()
    machine.start(0)
    assert machine.run(1)
    assert machine.is_in("if")
    assert told == [(3, True), "pass"]


def test_it_ends_and_begins_anew(press: Any) -> None:
    press.post_fault(1)
    assert not press.run(1001)
    assert press.finished
    assert press.lamp == 1
    assert not press.post_arrived()
    press.start(5)
    assert press.active() == ("idle",)
    assert press.lamp == 0


def test_a_full_queue_refuses(press: Any) -> None:
    assert [press.post_arrived() for _ in range(9)] == [True] * 8 + [False]


def test_operations_can_be_methods_of_a_subclass(chart: Chart) -> None:
    class Own(load_machine(chart), Host):  # type: ignore[misc]
        def __init__(self) -> None:
            Host.__init__(self)
            super().__init__()

    machine = Own()
    machine.loaded = True
    machine.start(0)
    machine.post_arrived()
    machine.run(0)
    assert machine.told == [("goto", 2800, 100)]


def test_a_host_that_lacks_an_operation_is_told_which(chart: Chart) -> None:
    with pytest.raises(TypeError, match="lacks what Press calls: goto, at_limit, send_pushed"):
        load_machine(chart)(object())


def test_wrong_events_are_told(press: Any) -> None:
    with pytest.raises(ValueError, match="receives no event 'arived', but arrived, fault"):
        press.post("arived")
    with pytest.raises(ValueError, match="Press has no state 'idel'"):
        press.is_in("idel")
    with pytest.raises(TypeError, match="fault carries 1 values, not 0"):
        press.post("fault")


def test_a_step_within_a_step_is_an_error(press: Any, host: Host) -> None:
    def reenter(*_: int) -> None:
        with pytest.raises(RuntimeError, match="from within one of its own steps"):
            press.run(2000)
        host.told.append(("tried",))

    host.goto = reenter  # type: ignore[assignment]
    press.loaded = True
    press.post_arrived()
    press.run(1001)
    assert host.told == [("tried",)]


def test_it_has_slots_and_no_dictionary(press: Any) -> None:
    assert not hasattr(press, "__dict__")
    with pytest.raises(AttributeError):
        press.leevl = 3


def test_two_machines_are_independent(chart: Chart) -> None:
    machine = load_machine(chart)
    one, other = machine(Host()), machine(Host())
    one.start(0)
    other.start(0)
    one.post_tick(3)
    one.run(0)
    assert (one.level, other.level) == (3, 0)
    assert (one.samples, other.samples) == ([0, 3, 0], [0, 0, 0])


@pytest.mark.cc
def test_it_runs_where_fsmkit_is_not(chart: Chart, tmp_path: Path) -> None:
    generated = PLUGIN.generate(chart, Findings(), {"trace": "on"})
    assert generated is not None
    for name, text in generated.files.items():
        (tmp_path / name).write_text(text)
    code = (
        "import sys, press; m = press.Press(type('H', (), dict(goto=print, at_limit=bool,"
        " send_pushed=print))); m.start(0); m.trace = print; m.post_tick(2); m.run(5);"
        " assert not [n for n in sys.modules if n.startswith('fsmkit')]"
    )
    done = subprocess.run(
        [
            sys.executable,
            "-I",
            "-S",
            "-c",
            f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {code}",
        ],
        capture_output=True,
        text=True,
        check=False,
        cwd="/",
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["@5 > event tick 2", "t 3", "= idle"]


def test_it_imports_the_standard_library_only(chart: Chart) -> None:
    tree = ast.parse(module_text(chart))
    imported = {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    imported |= {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    assert {name.split(".")[0] for name in imported} <= sys.stdlib_module_names


@pytest.mark.cc
def test_the_text_is_the_same_every_time(chart: Chart) -> None:
    assert module_text(chart) == module_text(chart)
    code = (
        "from devtools.differential import random_case;"
        "from fsmkit.codegen.python.generate import module_text;"
        "from hashlib import sha256;"
        "print(sha256(module_text(random_case(5, 3).chart).encode()).hexdigest())"
    )
    hashes = {
        subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={"PYTHONHASHSEED": seed, "PYTHONPATH": str(Path(__file__).parents[3])},
        ).stdout
        for seed in ("1", "2")
    }
    assert len(hashes) == 1


def test_it_tells_where_each_piece_comes_from(chart: Chart) -> None:
    text = module_text(chart)
    line = PRESS[: PRESS.index("arrived: {")].count("\n") + 1
    assert f"press.yaml:{line} idle -> pushing on arrived" in text
    assert "Presses things." in text


@pytest.mark.slow
def test_steps_leave_no_net_allocation(press: Any, host: Host) -> None:
    def steps(count: int) -> None:
        for now in range(count):
            press.post_arrived()
            press.post_tick(3)
            press.run(now)

    host.goto = host.send_pushed = lambda *_: None  # type: ignore[assignment]
    press.loaded = True
    press.start(0)
    steps(2000)
    press.start(0)
    gc.collect()
    gc.disable()
    try:
        before = sys.getallocatedblocks()
        tracked = gc.get_count()[0]
        steps(100_000)
        grown = sys.getallocatedblocks() - before
        made = gc.get_count()[0] - tracked
    finally:
        gc.enable()
    assert press.running
    assert press.next_deadline() is not None
    assert grown < 50, "a step keeps memory"
    assert made < 50, "a step makes objects that the collector tracks"


@pytest.mark.slow
def test_generated_modules_pass_strict_typing(chart: Chart, tmp_path: Path) -> None:
    api = pytest.importorskip("mypy.api")
    charts = [chart, *(random_case(11, number).chart for number in range(6))]
    for number, each in enumerate(charts):
        text = module_text(each, traced=number % 2 == 0)
        (tmp_path / f"machine_{number}.py").write_text(text)
    out, _, status = api.run(
        ["--strict", "--config-file=", f"--cache-dir={tmp_path}", str(tmp_path)]
    )
    assert status == 0, out


def test_a_prefix_names_module_and_class(chart: Chart) -> None:
    made = PLUGIN.generate(chart, Findings(), {"prefix": "left_press"})
    assert made is not None
    ((name, text),) = made.files.items()
    assert name == "left_press.py"
    assert "class Left_press:" in text
    assert "class Left_pressHost(Protocol):" in text
    assert 'NAME: ClassVar[str] = "Press"' in text


def test_there_is_no_trace_unless_asked_for(chart: Chart, press: Any) -> None:
    assert "trace" not in module_text(chart)
    with pytest.raises(AttributeError):
        press.trace = print
    machine = load_machine(chart, traced=True)(Host())
    told: list[str] = []
    machine.trace = told.append
    machine.start(0)
    assert told == ["@0 > start", "+ idle", "= idle"]


def test_what_is_not_needed_is_not_there(tmp_path: Path) -> None:
    path = tmp_path / "plain.yaml"
    path.write_text("chart: Plain\nevents: {in: [go]}\nstates: {a: {on: {go: b}}, b: {}}\n")
    text = module_text(load(path))
    assert "self._active = C_B" in text
    for name in ("_microstep", "_offer", "_test", "_GUARDS", "_PORTS", "_chosen", "shown"):
        assert name not in text


def test_a_machine_that_does_something_else_without_a_trace_is_told(
    chart: Chart, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "other.yaml"
    path.write_text(PRESS.replace("count += 1\n", "count += 2\n"))
    other = load(path)

    def text(given: Chart, *, traced: bool, saved: bool, recorded: bool, covered: bool) -> str:
        assert not recorded
        assert not covered
        return module_text(given if traced else other, traced=traced, saved=saved)

    script = ["start 0", "dispatch tick 2"]
    assert not any("without a trace" in line for line in harness.run(chart, script))
    monkeypatch.setattr("fsmkit.codegen.python.loading.module_text", text)
    assert "without a trace after `dispatch tick 2`" in harness.run(chart, script)[-1]


def test_a_state_named_as_its_chart_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "same.yaml"
    path.write_text(
        "chart: same\nevents: {in: [go]}\nstates: {other: {on: {go: same}}, same: {}}\n"
    )
    machine = load_machine(load(path))()
    machine.start(0)
    assert not machine.is_in("same")
    assert machine.dispatch("go")
    assert machine.is_in("same")


def test_many_states_are_found_in_a_table(tmp_path: Path) -> None:
    """Each state handles the event; if its guard is false, its parent does."""
    states = "\n".join(
        f"      s{n}: {{on: {{go: {{if: n % 2 == {n % 2}, target: s{(n + 1) % 20}, do: n += 1}}}}}}"
        for n in range(20)
    )
    path = tmp_path / "many.yaml"
    path.write_text(
        "chart: Many\ndata: {n: int32 = 0, passed_on: int32 = 0}\nevents: {in: [go, skip]}\n"
        f"states:\n  all:\n    on: {{go: {{do: passed_on += 1}}, skip: {{do: n += 1}}}}\n"
        f"    states:\n{states}\n"
    )
    chart = load(path)
    assert "_FROM_go: ClassVar" in module_text(chart)
    machine = load_machine(chart)()
    machine.start(0)
    for _ in range(25):
        assert machine.dispatch_go()
    assert machine.active() == ("s5",)
    machine.dispatch_skip()
    assert machine.dispatch_go()
    assert (machine.n, machine.passed_on) == (26, 1)
    script = ["start 0", *["dispatch go", "dispatch skip", "dispatch go"] * 9, "dump"]
    assert harness.run(chart, script) == list(run_script(chart, script))


def test_constants_members_and_timers_stand_by_their_names(tmp_path: Path) -> None:
    """Also where two of them would have one name, or one that the module has already."""
    path = tmp_path / "named.yaml"
    path.write_text(
        "chart: Named\nconstants: {__wait: 20ms, any: 3, ANY: 4, far: 2.5, kind_a: 7}\n"
        "types: {Kind: [a, b], Any: [c]}\n"
        "data: {k: Kind = Kind.b, n: int32 = any, x: float64 = far, e: Any = Any.c}\n"
        "events: {in: [go]}\n"
        "states:\n  on:\n    on: {go: {do: n = ANY; n += kind_a; x = far + far; k = Kind.a}}\n"
        "    after: {__wait: off}\n  off: {}\n"
    )
    chart = load(path)
    text = module_text(chart)
    for line in (
        "self._arm(TIMER_ON___WAIT, V__WAIT)", "self.n = ANY_2", "self.n + KIND_A_2",
        "self.k = KIND_A", "self.x = 5.0",
    ):  # fmt: skip
        assert line in text, line
    machine = load_machine(chart)()
    machine.start(0)
    assert (machine.k, machine.n, machine.x, machine.e) == (1, 3, 2.5, 0)
    assert machine.dispatch_go()
    assert (machine.k, machine.n, machine.x) == (0, 11, 5.0)
    assert machine.next_deadline() == 20


def test_an_enumeration_named_as_a_constant_gets_an_underscore(tmp_path: Path) -> None:
    path = tmp_path / "clash.yaml"
    path.write_text(
        "chart: Clash\ntypes: {C_ON: [x, y], S_ON: [z]}\ndata: {a: C_ON = C_ON.y}\n"
        "events: {in: [go]}\nstates: {on: {on: {go: off}}, off: {}}\n"
    )
    machine = load_machine(load(path))()
    machine.start(0)
    assert machine.is_in("on")
    assert machine.dispatch_go()
    assert machine.active() == ("off",)
    assert machine.a == 1


def test_no_branch_is_left_that_cannot_be_taken(tmp_path: Path) -> None:
    """The machine has one timeout, no delayed send, no deferral, no payload and no guard."""
    path = tmp_path / "timed.yaml"
    path.write_text(
        "chart: Timed\nevents: {in: [go]}\nstates:\n  a: {on: {go: b}}\n  b: {after: {20ms: a}}\n"
    )
    text = module_text(load(path))
    assert "self._arm(TIMER_B_AFTER, 20)" in text
    for name in ("pass", "_deliver", "_recall", "_deferred", "_sends", "_test", "_take_several"):
        assert name not in text.replace("passed", ""), name
    assert not [line for line in text.splitlines() if line.strip() in ("if 0:", "if True:")]
    machine = load_machine(load(path))()
    machine.start(0)
    assert machine.dispatch_go()
    machine.run(20)
    assert machine.active() == ("a",)
