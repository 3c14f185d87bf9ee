"""Invoked charts (SCXML 6.4, 6.5) in the reference interpreter: what is started, told, ended."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.chart.loading import load, load_with_findings
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.runtime.session import Session

HEAD = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" '


def session(tmp_path: Path, text: str) -> Session:
    path = tmp_path / "chart.scxml"
    path.write_text(HEAD + text, encoding="utf-8")
    return Session(load(path))


def child(text: str) -> str:
    return f"<content>{HEAD}{text}</content>"


COUNTER = child(
    """name="Counter" initial="counting">
      <datamodel><data id="n" expr="0"/><data id="own" expr="5"/></datamodel>
      <state id="counting">
        <onexit><send target="#_parent" event="left"/></onexit>
        <transition event="more"><assign location="n" expr="n + 1"/>
          <send target="#_parent" event="now"><param name="n" expr="n + own"/></send></transition>
        <transition event="enough" target="over"/>
      </state>
      <final id="over"><donedata><param name="total" expr="n"/></donedata></final>
    </scxml>"""
)


def counting(attributes: str = "", inside: str = "") -> str:
    return f"""name="Outer" initial="on">
      <datamodel><data id="last" expr="0"/><data id="total" expr="-1"/>
        <data id="start" expr="7"/></datamodel>
      <state id="on">
        <invoke id="c" {attributes}><param name="n" expr="start"/>{COUNTER}{inside}</invoke>
        <transition event="go"><send target="#_c" event="more"/></transition>
        <transition event="stop"><send target="#_c" event="enough"/></transition>
        <transition event="now"><assign location="last" expr="_event.data.n"/></transition>
        <transition event="left"/>
        <transition event="done.invoke.c" target="off">
          <assign location="total" expr="_event.data.total"/></transition>
        <transition event="away" target="off"/>
      </state>
      <state id="off"><transition event="back" target="on"/>
        <transition event="left" target="lost"/></state>
      <state id="lost"/>
    </scxml>"""


def test_data_given_events_both_ways_and_the_end(tmp_path: Path) -> None:
    machine = session(tmp_path, counting())
    machine.post("go")
    machine.post("go")
    machine.run()
    assert machine["last"] == 7 + 2 + 5
    machine.post("stop")
    machine.run()
    assert machine["total"] == 9
    assert machine.active == ("off",)


def test_leaving_the_state_cancels_and_nothing_comes_any_more(tmp_path: Path) -> None:
    machine = session(tmp_path, counting())
    machine.post("away")
    machine.run()
    assert machine.active == ("off",)
    text = machine.trace_text()
    assert "c: - counting\nc: out left to #_parent" in text


def test_it_starts_anew_with_each_entry(tmp_path: Path) -> None:
    machine = session(tmp_path, counting())
    for event in ("go", "away", "back", "go"):
        machine.post(event)
        machine.run()
    assert machine["last"] == 7 + 1 + 5


def test_an_event_for_what_does_not_run_is_an_error(tmp_path: Path) -> None:
    machine = session(
        tmp_path,
        f"""initial="on">
      <state id="on"><invoke id="c">{COUNTER}</invoke>
        <onentry><send target="#_c" event="more"/></onentry>
        <transition event="error.communication" target="told"/></state>
      <state id="told"/>
    </scxml>""",
    )
    assert machine.active == ("told",)


def test_finalize_runs_before_the_event_is_handled(tmp_path: Path) -> None:
    finalize = '<finalize><assign location="start" expr="_event.data.n"/></finalize>'
    text = counting(inside=finalize).replace('event="now"', 'event="now" cond="start == 13"')
    machine = session(tmp_path, text)
    machine.post("go")
    machine.run()
    assert machine["last"] == 13


def test_autoforward_gives_a_copy_of_every_external_event(tmp_path: Path) -> None:
    machine = session(tmp_path, counting('autoforward="true"'))
    machine.post("enough")
    machine.run()
    assert machine["total"] == 7


def test_a_timer_of_an_invoked_machine_is_a_deadline(tmp_path: Path) -> None:
    inner = child(
        """initial="a"><state id="a"><onentry><send event="t" delay="1s"/></onentry>
        <transition event="t" target="b"/></state><final id="b"/></scxml>"""
    )
    machine = session(
        tmp_path,
        f"""initial="on"><state id="on"><invoke id="c">{inner}</invoke>
        <transition event="done.invoke" target="off"/></state><state id="off"/></scxml>""",
    )
    assert machine.next_deadline == 1000
    machine.advance("999ms")
    assert machine.active == ("on",)
    machine.advance("1ms")
    assert machine.active == ("off",)


def test_charts_within_charts(tmp_path: Path) -> None:
    inner = child('initial="z"><final id="z"/></scxml>')
    middle = child(
        f"""initial="m"><state id="m"><invoke id="d">{inner}</invoke>
        <transition event="done.invoke.d" target="e"/></state><final id="e"/></scxml>"""
    )
    machine = session(
        tmp_path,
        f"""initial="on"><state id="on"><invoke id="c">{middle}</invoke>
        <transition event="done.invoke.c" target="off"/></state><state id="off"/></scxml>""",
    )
    machine.run()
    assert machine.active == ("off",)
    assert "c: d: + z" in machine.trace_text()


def test_a_fault_of_an_invoked_machine_is_one_of_the_invoker(tmp_path: Path) -> None:
    inner = child(
        """initial="a"><state id="a"><transition target="b"/></state>
        <state id="b"><transition target="a"/></state></scxml>"""
    )
    machine = session(
        tmp_path, f'initial="on"><state id="on"><invoke>{inner}</invoke></state></scxml>'
    )
    assert machine.fault == "invoked"


def test_a_chart_that_invokes_itself_is_refused(tmp_path: Path) -> None:
    for name, other in (("a", "b"), ("b", "a")):
        text = f'{HEAD}initial="s"><state id="s"><invoke src="{other}.scxml"/></state></scxml>'
        (tmp_path / f"{name}.scxml").write_text(text, encoding="utf-8")
    with pytest.raises(FsmkitError) as refused:
        load(tmp_path / "a.scxml")
    (found,) = refused.value.diagnostics
    assert found.rule.name == "invocation-cycle"
    assert "a.scxml -> b.scxml -> a.scxml" in found.message


def test_nesting_without_end_in_one_file_is_bounded(tmp_path: Path) -> None:
    text = 'initial="z"><state id="z"/></scxml>'
    for _ in range(12):
        text = f'initial="s"><state id="s"><invoke>{child(text)}</invoke></state></scxml>'
    machine = session(tmp_path, text)
    assert machine.is_running


def test_charts_that_declare_what_passes_between_them(tmp_path: Path) -> None:
    (tmp_path / "worker.yaml").write_text(WORKER, encoding="utf-8")
    (tmp_path / "boss.yaml").write_text(BOSS, encoding="utf-8")
    findings = Findings()
    machine = Session(load_with_findings(tmp_path / "boss.yaml", findings))
    assert not list(findings)
    machine.post("go")
    machine.run()
    machine.advance("100ms")
    assert machine["seen"] == 1
    machine.advance("100ms")
    assert machine.active == ("idle",)


def test_a_file_that_is_not_there_is_told_where_it_is_named(tmp_path: Path) -> None:
    (tmp_path / "boss.yaml").write_text(BOSS, encoding="utf-8")
    with pytest.raises(FsmkitError) as refused:
        load(tmp_path / "boss.yaml")
    (found,) = refused.value.diagnostics
    assert found.rule.name == "unreadable-file"
    assert found.primary is not None
    span = found.primary.span
    assert span.source.text[span.start : span.end] == "worker.yaml"


WORKER = """
chart: Worker
data: {left: 0..9 = 3}
events:
  in: [tick]
  out: ["progress(left 0..9)"]
initial: busy
states:
  busy:
    on:
      tick:
        - if: left > 1
          do: |
            left -= 1
            send progress(left = left) to "#_parent"
        - target: ready
  ready: {final: true}
"""
BOSS = """
chart: Boss
data: {seen: 0..9 = 9, size: 0..9 = 2}
outputs: {shown: 0..9 = 0}
events:
  in: [go, "progress(left 0..9)"]
  out: [tick]
initial: idle
states:
  idle:
    entry: shown = seen
    on: {go: working}
  working:
    invoke: {id: worker, src: worker.yaml, with: {left: size}}
    every:
      100ms: {do: 'send tick to "#_worker"'}
    on:
      progress: {do: seen = event.left}
      done.invoke.worker: idle
"""
