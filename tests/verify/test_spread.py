"""What fills a space that is too large: the queue, the input or the variable is named."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fsmkit.diagnostics import Diagnostic, Findings
from fsmkit.system.any_file import load_any
from fsmkit.verify.engines.c.engine import compiler
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.statespace.symbolic_search import Search

needs_compiler = pytest.mark.skipif(compiler() is None, reason="there is no C compiler")
pytestmark = [pytest.mark.usefixtures("own_cache", "quickly_compiled"), pytest.mark.cc]
ENGINES = ["python", pytest.param("c", marks=needs_compiler)]

LIFT = """chart: Lift
events: {in: ["call(at 0..5)", opened]}
capacity: {queue: 8}
outputs: {last: 0..5}
initial: idle
states:
  idle: {rest: true, on: {call: {if: event.at * 2 <= 10, target: busy, do: last = event.at}}}
  busy: {defer: call, on: {opened: idle}}
"""
COMPARED = " or ".join(f"temp == {celsius}" for celsius in range(-390, 1000, 29))
"""So the input is divided into as many values."""
BATTERY = f"""chart: Batt
inputs: {{volts: 0..5000, temp: -400..1000}}
events: {{in: [plug, tick]}}
data: {{n: 0..63}}
initial: off
states:
  off:
    rest: true
    invariant: temp <= 1000 or {COMPARED}
    on:
      tick: {{if: n < 63, do: n += 1}}
      plug: {{if: volts > 100, target: cc}}
  cc: {{on: {{plug: off}}}}
"""
COUNTER = """chart: C
events: {in: [up, down]}
data: {n: 0..4000000, m: 0..1}
initial: a
states:
  a:
    rest: true
    on:
      up: {if: n < 4000000, do: n += 1}
      down: {if: n > 0, do: [n -= 1, m = 1 - m]}
"""
SCXML = """<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml"
  version="1.0" name="S" initial="idle" datamodel="fsmkit">
  <fk:event direction="in" signature="call(at 0..5)"/>
  <fk:event direction="in" signature="opened"/>
  <datamodel><fk:output id="last" type="0..5" expr="0"/></datamodel>
  <state id="idle" fk:rest="true">
    <transition event="call" target="busy" cond="event.at * 2 &lt;= 10">
      <assign location="last" expr="event.at"/>
    </transition>
  </state>
  <state id="busy" fk:defer="call"><transition event="opened" target="idle"/></state>
</scxml>
"""


def large_space(path: Path, engine: str, megabytes: int = 40) -> Diagnostic | None:
    """Return the note on a space too large for the memory, or for half a second of Python."""
    findings = Findings()
    timeout = 0.5 if engine == "python" else 0
    report = check(
        load_any(path, Findings()),
        findings,
        options=ExplorationOptions(
            engine,
            time="discrete",
            memory=megabytes << 20,
            timeout=timeout,
            search=Search.EXPLICIT,  # a diagram has room for more
        ),
    )
    assert report.verdict is Verdict.UNDECIDED
    notes = [d for d in findings if d.rule.name == "large-space"]
    assert len(notes) <= 1
    return notes[0] if notes else None


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("name", "text"), [("lift.yaml", LIFT), ("lift.scxml", SCXML)], ids=["yaml", "scxml"]
)
def test_a_queue_is_named_with_what_waits_in_it(
    name: str, text: str, tmp_path: Path, engine: str
) -> None:
    (tmp_path / name).write_text(text)
    note = large_space(tmp_path / name, engine)
    assert note is not None
    assert note.message.startswith("the queue of 8 holds up to 6^8 orders of `call(at 0..5)`: of")
    assert "`capacity: {queue: 3}`" in str(note.help)
    assert '`<fk:capacity queue="3"/>`' in str(note.help)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_variable_is_named_and_others_that_multiply_the_space(
    tmp_path: Path, engine: str
) -> None:
    (tmp_path / "counter.yaml").write_text(COUNTER)
    note = large_space(tmp_path / "counter.yaml", engine)
    assert note is not None
    assert re.match(
        r"the variable `n` has [\d,]+ values: of the first [\d,]+ local states of `C`, 3 differ "
        r"in anything else; the space is multiplied by the variable `m` by 2, too$",
        note.message,
    )
    assert note.primary is not None
    assert note.primary.span.source.text[note.primary.span.start :].startswith("n: 0..4")


@pytest.mark.parametrize("engine", ENGINES)
def test_an_input_is_named_with_the_property_that_reads_it(tmp_path: Path, engine: str) -> None:
    (tmp_path / "battery.yaml").write_text(BATTERY)
    note = large_space(tmp_path / "battery.yaml", engine, 12)
    assert note is not None
    assert "the input `temp`" in note.message
    assert note.help is not None
    assert "`off.invariant`" in note.help


SCALE = """chart: Scale
inputs: {load: 0..4000000}
data: {seen: 0..4000000, m: 0..1}
events: {in: [weigh, turn]}
initial: a
states:
  a:
    rest: true
    on:
      weigh: {if: load != seen, do: seen = (load + seen) / 2}
      turn: {do: m = 1 - m}
"""


@pytest.mark.parametrize("engine", ENGINES)
def test_an_input_that_is_no_state_is_named_with_what_takes_its_values(
    tmp_path: Path, engine: str
) -> None:
    (tmp_path / "scale.yaml").write_text(SCALE)
    note = large_space(tmp_path / "scale.yaml", engine, 12)
    assert note is not None
    assert "the variable `seen`, which takes values of the input `load`, has" in note.message


@needs_compiler
@pytest.mark.parametrize("megabytes", [12, 20])
def test_neither_the_search_nor_its_diagram_has_room(tmp_path: Path, megabytes: int) -> None:
    """The search gives its memory to the diagram, and still says what it saw."""
    (tmp_path / "counter.yaml").write_text(COUNTER)
    options = ExplorationOptions("c", time="discrete", memory=megabytes << 20)
    report = check(load_any(tmp_path / "counter.yaml", Findings()), Findings(), options=options)
    assert report.verdict is Verdict.UNDECIDED
    assert report.exploration.states > 10_000
