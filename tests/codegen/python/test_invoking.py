"""Generated machines that invoke others do what the interpreter does (SCXML 6.4, 6.5)."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.scripts import random_script
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.python.generate import module_text
from fsmkit.codegen.python.loading import load_machine
from fsmkit.codegen.python.plugin import PLUGIN
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.runtime.script import run_script
from fsmkit.testing.harness.python import run
from tests.codegen.python.families import random_family

SHOP = Path(__file__).parents[2] / "golden/shop.yaml"


@pytest.fixture(scope="module")
def shop() -> Chart:
    return load(SHOP)


def traced(chart: Chart, *script: str) -> list[str]:
    """Return the traces of both runtimes."""
    expected = run_script(chart, script)
    assert run(chart, script) == expected
    return expected


def written(tmp_path: Path, text: str) -> Chart:
    path = tmp_path / "chart.yaml"
    path.write_text(text)
    return load(path)


def test_it_is_started_with_what_it_is_given(shop: Chart) -> None:
    told = traced(shop, "start 0", "post go", "run 1", "dump")
    assert told[told.index("+ work") :][:6] == [
        "+ work",
        "press: @1 > start",
        "press: + up",
        "press: out ready 8 to #_parent",
        "press: op stamp 8",
        "press: feeder: @1 > start",
    ]
    assert "press: feeder: d count 8" in told


def test_finalize_comes_before_the_transition_and_only_for_its_own_events(shop: Chart) -> None:
    told = traced(shop, "start 0", "post go", "run 1", "dump", "post hint 3", "run 2", "dump")
    assert [line for line in told if line.startswith("d ")] == [
        "d heard 1", "d price 7", "d last 8",
        "d heard 1", "d price 7", "d last 8",
    ]  # fmt: skip


def test_external_events_are_forwarded(shop: Chart) -> None:
    told = traced(shop, "start 0", "post go", "run 1", "post hint 3", "run 2", "dump")
    assert "press: @2 > event hint 3" in told
    assert "press: out pressed 3" in told
    assert "press: d seen 3" in told


def test_timers_due_at_one_instant_fire_from_the_outside_in(shop: Chart) -> None:
    told = traced(shop, "start 0", "post go", "run 1", "run 60")
    fired = [line for line in told if "timeout" in line]
    assert [line.rpartition(": ")[0] for line in fired] == ["", "press", "press: feeder"]
    assert all("@51 > " in line for line in fired)


def test_leaving_the_state_cancels_from_the_inside_out_and_sends_nothing(shop: Chart) -> None:
    told = traced(shop, "start 0", "post go", "run 1", "post stop", "run 2", "run 90", "dump")
    assert told[told.index("- work") :][:6] == [
        "- work",
        "out sold 8",
        "press: - up",
        "press: op measure = 4",
        "press: out left 4 to #_parent",
        "press: feeder: - full",
    ]
    assert "d heard 11" in told, "neither `left` nor what it would do to `heard` has come"
    assert not [line for line in told if line.startswith("press: d ")]


def test_its_end_is_told_with_the_data_of_the_final_state(shop: Chart) -> None:
    told = traced(shop, "start 0", "post go", "run 1", "post order 1", "run 2", "dump")
    assert "press: feeder: out done.session to #_parent" in told
    assert "press: out done.session 1 to #_parent" in told
    assert "@2 > event done.invoke.press 1" in told
    assert told[-4:] == ["= end", "d heard 113", "d price 1", "d last 1"]


def test_a_delayed_event_reaches_the_machine_or_is_an_error(shop: Chart) -> None:
    told = traced(shop, "start 0", "post go", "run 1", "run 101")
    assert "out order 2 to #_press" in told
    assert "press: @101 > event order 2" in told
    told = traced(shop, "start 0", "post go", "run 1", "post stop", "run 2", "run 101", "dump")
    assert "@101 > event error.communication" in told
    assert "d heard 1011" in told


def test_an_event_for_a_machine_that_does_not_run_is_an_error(shop: Chart) -> None:
    told = traced(shop, "start 0", "post order 1", "run 1", "dump")
    assert "error error.communication" in told
    assert "d heard 1000" in told


def test_a_full_queue_is_told_by_the_sender(tmp_path: Path) -> None:
    chart = written(
        tmp_path,
        """
chart: Outer
events: {in: [go, x]}
capacity: {queue: 2}
initial: a
states:
  a:
    entry: 'send x to "#_inner" after 5ms'
    invoke:
      id: inner
      content:
        chart: Inner
        capacity: {queue: 1}
        events: {in: [x], out: [o]}
        initial: i
        states:
          i: {on: {x: {do: 'send o to "#_parent"; send o to "#_parent"; send o to "#_parent"'}}}
    on:
      o: {}
      go: {do: 'send x to "#_inner"; send x to "#_inner"'}
""",
    )
    told = traced(chart, "start 0", "post go", "run 1", "post go", "post go", "run 5")
    full = [line for line in told if line.endswith("full queue")]
    assert "full queue" in full, "what is sent inward"
    assert "inner: full queue" in full, "what is sent outward"


def test_its_fault_is_one_of_the_invoker(tmp_path: Path) -> None:
    chart = written(
        tmp_path,
        """
chart: Outer
events: {in: [x]}
initial: a
states:
  a:
    invoke:
      id: inner
      content:
        chart: Inner
        initial: i
        states: {i: {after: {5ms: {do: raise x; raise x}}}}
        events: {in: [x]}
        capacity: {internal: 1}
""",
    )
    told = traced(chart, "start 0", "run 10", "dump")
    assert told[-4:] == [
        "inner: full internal",
        "inner: fault internal",
        "inner: = i",
        "fault invoked",
    ]
    assert "= a" in told


def test_it_begins_anew(shop: Chart) -> None:
    told = traced(
        shop, "start 0", "post go", "run 1", "start 5", "dump", "post go", "run 6", "dump"
    )
    again = told[told.index("@5 > start") :]
    assert again[:3] == ["@5 > start", "+ idle", "= idle"]
    assert not [line for line in again[: again.index("@6 > event go")] if line.startswith("press")]


@pytest.mark.slow
@pytest.mark.parametrize("number", range(12))
def test_random_families(number: int) -> None:
    choices = SeededChoices(f"kin {number}")
    chart = random_family(choices, 1 + number % 2)
    traced(chart, *random_script(choices, chart))


TWINS = """
chart: Outer
events: {{out: ["pressed(n 0..9)"]}}
initial: a
states:
  a:
    entry: send pressed(n = 1)
    invoke:
      - id: left
        content:
          chart: Press
          events: {{out: [pressed]}}
          operations: ["take(n 0..9) -> bool"]
          initial: i
          states: {{i: {{entry: 'send pressed; if take(1) {{}}'}}}}
      - id: right
        content:
          chart: Press
          events: {{out: ["pressed(n 0..9)"]}}
          operations: ["take(n {other}) -> bool"]
          initial: i
          states: {{i: {{entry: 'if take(2) {{}}; send pressed(n = 2)'}}}}
"""


def test_events_of_other_payloads_have_methods_of_their_own(tmp_path: Path) -> None:
    chart = written(tmp_path, TWINS.format(other="0..9"))
    told = traced(chart, "start 0")
    assert [line for line in told if "out pressed" in line] == [
        "out pressed 1",
        "left: out pressed",
        "right: out pressed 2",
    ]
    text = module_text(chart)
    assert "def send_pressed(self, n: int) -> None:" in text
    assert "def send_left_pressed(self) -> None:" in text


CLASHES = """
chart: Outer
events: {out: ["left_done(n 0..9)"]}
operations: ["send_done(n 0..9)"]
initial: a
states:
  a:
    entry: send left_done(n = 1); send_done(2)
    invoke:
      id: left
      content:
        chart: Press
        events: {out: ["done(n 0..9)"]}
        initial: i
        states: {i: {entry: 'send done(n = 3)'}}
"""


def test_what_machines_ask_of_the_host_is_never_one_method_for_two_things(tmp_path: Path) -> None:
    class CallRecorder:
        def __init__(self) -> None:
            self.calls: list[tuple[str, int]] = []

        def __getattr__(self, name: str) -> Callable[[int], None]:
            return lambda n: self.calls.append((name, n))

    chart = written(tmp_path, CLASHES)
    traced(chart, "start 0")
    host = CallRecorder()
    machine = load_machine(chart)(host)
    machine.start(0)
    machine.run(0)
    assert host.calls == [("send_left_done", 1), ("send_done", 2), ("send_left_left_done", 3)]


def test_operations_of_one_name_have_the_same_types(tmp_path: Path) -> None:
    with pytest.raises(FsmkitError) as raised:
        written(tmp_path, TWINS.format(other="0..8"))
    (finding,) = raised.value.diagnostics
    assert finding.rule.name == "invocation-mismatch"
    assert "`take` of `Press` has other types" in finding.message
    assert [label.text for label in finding.secondary] == ["the other", "invoked here"]


# --- as a host meets it ---------------------------------------------------------------------------


class Host:
    def __init__(self) -> None:
        self.told: list[tuple[str, int]] = []

    def stamp(self, n: int) -> None:
        self.told.append(("stamp", n))

    def measure(self) -> int:
        return 4

    def send_sold(self, n: int) -> None:
        self.told.append(("sold", n))

    def send_pressed(self, n: int) -> None:
        self.told.append(("pressed", n))


def test_the_host_serves_all_machines_of_the_module(shop: Chart) -> None:
    host = Host()
    machine = load_machine(shop)(host)
    machine.start(0)
    machine.post_go()
    machine.run(1)
    machine.post_hint(3)
    machine.run(2)
    machine.post_stop()
    machine.run(3)
    assert host.told == [("stamp", 8), ("pressed", 3), ("sold", 8)]
    with pytest.raises(TypeError, match="lacks what Press calls: stamp, measure, send_pressed"):
        load_machine(shop)(object())


def test_the_host_can_be_a_subclass(shop: Chart) -> None:
    class Own(load_machine(shop), Host):  # type: ignore[misc]
        def __init__(self) -> None:
            Host.__init__(self)
            super().__init__()

    machine = Own()
    machine.start(0)
    machine.post_go()
    machine.run(1)
    assert machine.told == [("stamp", 8)]
    assert machine.next_deadline() == 51


def test_log_and_trace_can_be_set_at_any_time(shop: Chart) -> None:
    machine = load_machine(shop)(Host())
    machine.start(0)
    machine.post_go()
    machine.run(1)
    told: list[str] = []
    machine.trace = told.append
    machine.run(51)
    assert "press: @51 > timeout" in " ".join(told)
    machine.trace = None
    count = len(told)
    machine.run(60)
    assert len(told) == count


@pytest.mark.slow
def test_invoked_machines_are_made_once_and_steps_leave_nothing(shop: Chart) -> None:
    host = Host()
    host.stamp = host.send_sold = host.send_pressed = lambda *_: None  # type: ignore[method-assign]
    machine = load_machine(shop)(host)
    machine.start(0)

    def steps(start: int, count: int) -> None:
        for now in range(start, start + count):
            if now % 150 == 0:
                machine.start(now)
            machine.post_go()
            machine.post_hint(3)
            machine.run(now)
            if now % 150 == 40:
                machine.post_stop()
            elif now % 150 == 140:
                assert machine.is_in("end")

    steps(0, 2000)
    gc.collect()
    gc.disable()
    try:
        before = sys.getallocatedblocks()
        tracked = gc.get_count()[0]
        steps(2000, 20_000)
        grown = sys.getallocatedblocks() - before
        made = gc.get_count()[0] - tracked
    finally:
        gc.enable()
    assert machine.running
    assert grown < 50, "a step keeps memory"
    assert made < 50, "a step makes objects that the collector tracks"


@pytest.mark.slow
def test_the_text_is_typed_and_names_its_slots(shop: Chart, tmp_path: Path) -> None:
    api = pytest.importorskip("mypy.api")
    charts = [shop, *(random_family(SeededChoices(f"typed {n}"), 2) for n in range(4))]
    for number, each in enumerate(charts):
        (tmp_path / f"machine_{number}.py").write_text(module_text(each))
    out, _, status = api.run(
        ["--strict", "--config-file=", f"--cache-dir={tmp_path}", str(tmp_path)]
    )
    assert status == 0, out
    text = module_text(shop)
    classes = [line for line in text.splitlines() if line.startswith("class Shop")]
    assert classes == [
        "class ShopHost(Protocol):",
        "class Shop_press_feeder(_Invoking):",
        "class Shop_press(_Invoking):",
        "class Shop(_Invoking):",
    ]


def test_a_chart_without_invocations_holds_nothing_of_them(tmp_path: Path) -> None:
    text = module_text(written(tmp_path, "chart: Plain\nstates: {a: {}}\n"))
    assert "invok" not in text.lower()
    assert "_Machine" not in text


def test_what_cannot_be_written_is_told_of_invoked_charts_too(tmp_path: Path) -> None:
    chart = written(
        tmp_path,
        """
chart: Outer
initial: a
states:
  a:
    invoke:
      id: inner
      content: {chart: Inner, initial: i, states: {i: {sometimes: {target: j}}, j: {}}}
""",
    )
    findings = Findings()
    assert PLUGIN.generate(chart, findings, {}) is None
    assert [one.rule.name for one in findings] == ["python-sometimes"]


def test_classes_have_names_of_their_own(tmp_path: Path) -> None:
    chart = written(
        tmp_path,
        """
chart: _Invoking
types: {Kind: [one, two]}
data: {x: Kind = one}
states:
  a:
    invoke:
      - {id: m, content: {chart: Kind, types: {Kind: [three]}, data: {y: Kind = three},
                          states: {a: {}}}}
      - {id: _m, content: {chart: _Machine, states: {m_a: {}}}}
""",
    )
    told = traced(chart, "start 0", "dump")
    assert "m: d y 0" in told
    assert "_m: + m_a" in told
