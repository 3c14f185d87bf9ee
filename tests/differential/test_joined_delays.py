"""``delayexpr="t + 'ms'"`` is a duration: the same on every runtime, and what the string says."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import pytest

from devtools.runtimes import harnesses
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load_with_findings
from fsmkit.diagnostics import Findings
from fsmkit.language import LONGEST_DURATION
from fsmkit.language.units import MICROSECONDS
from fsmkit.testing.harness.harness import INTERPRETER, Harness

VALUES = (
    "0",
    "1",
    "7",
    "250",
    "1500",
    "-1",
    "-250",
    "40000",
    "3000000",
    "2147483647",
    str(LONGEST_DURATION),
    str(LONGEST_DURATION + 1),
    "-2147483648",
)
FRACTIONS = ("0.5", "1.25", "0.29", "0.001", "2.5", "-0.5", "1000000.75")
FORMS = (
    "{} + '{}'",
    "'' + {} + '{}'",
    "String({}) + ' {}'",
    "{}.toString() + '{}'",
    "({} + 0) + '{}'",
)


def delays(unit: str) -> Iterator[tuple[str, str, int | None]]:
    """Yield a type, a value and its delay in ticks of a millisecond; None for none."""
    for value in (*VALUES, *FRACTIONS):
        ticks = Fraction(value) * MICROSECONDS[unit] / 1000
        is_float = "." in value
        if is_float:
            ticks = Fraction(int(ticks + Fraction(1, 2))) if ticks >= 0 else ticks
        is_one = 0 <= ticks <= LONGEST_DURATION and ticks.denominator == 1
        yield "float64" if is_float else "int32", value, int(ticks) if is_one else None


def text(unit: str, form: str, value: str, type_: str) -> str:
    """Return a chart that sends an event after a number that a transition has stored."""
    expression = form.format("t", unit)
    return f"""<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml"
 version="1.0" name="Delays" datamodel="ecmascript" initial="a">
 <fk:capacity tick="1ms"/>
 <datamodel><data id="t" fk:type="{type_}" expr="3"/></datamodel>
 <state id="a"><transition event="go" target="b"><assign location="t" expr="{value}"/></transition>
 </state>
 <state id="b"><onentry><send event="e" delayexpr="{expression}"/></onentry>
  <transition event="e" target="a"/><transition event="error.execution" target="bad"/></state>
 <state id="bad"/></scxml>"""


def chart_of(folder: Path, written: str) -> Chart:
    path = folder / "chart.scxml"
    path.write_text(written)
    return load_with_findings(path, Findings())


@pytest.mark.parametrize("unit", sorted(MICROSECONDS))
def test_a_number_and_a_unit_are_a_duration(unit: str, tmp_path: Path) -> None:
    for place, (type_, value, ticks) in enumerate(delays(unit)):
        chart = chart_of(tmp_path, text(unit, FORMS[place % len(FORMS)], value, type_))
        trace = INTERPRETER.run(chart, ("start 0", "post go", "run 1"))
        found = [line for line in trace if line.startswith("delay")]
        if ticks is None:
            assert trace[-1] == "= bad", (value, unit, trace)
        else:
            assert found == [f"delay e in {ticks}"], (value, unit, trace)


@pytest.mark.external
@pytest.mark.parametrize("runtime", harnesses(), ids=lambda runtime: runtime.name)
def test_every_runtime_waits_as_long(runtime: Harness, tmp_path: Path) -> None:
    script = ("start 0", "post go", "run 1", "run 100", "run 600", "run 70000")
    cases = [(unit, *each) for unit in ("ms", "s", "us") for each in delays(unit)]
    for place, (unit, type_, value, _) in enumerate(cases[::13]):
        chart = chart_of(tmp_path, text(unit, FORMS[place % len(FORMS)], value, type_))
        assert runtime.run(chart, script) == INTERPRETER.run(chart, script), (unit, value)


@pytest.mark.parametrize(
    ("expression", "delay"),
    [
        ("t + 'ms'", 3),
        ("2 * t + 1 + 's'", 7000),
        ("t > 2 ? '1s' : '2s'", 1000),
        ("t > 2 ? t + 's' : '2ms'", 3000),
        ("t > 5 ? t + 's' : (t == 3 ? t * 10 + 'ms' : '1s')", 30),
        ("1500 + 'ms'", 1500),
        ("1.5 + 's'", 1500),
        ("t / 2 + 's'", 1500),
        ("_event.data.n + 'ms'", 12),
    ],
)
def test_the_number_may_be_any_expression(expression: str, delay: int, tmp_path: Path) -> None:
    chart = chart_of(
        tmp_path,
        f"""<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="Delays"
 datamodel="ecmascript"><datamodel><data id="t" expr="3"/></datamodel>
 <state id="a"><onentry><raise event="go"/><send event="in"><param name="n" expr="12"/></send>
 </onentry><transition event="in"><send event="e" delayexpr="{expression.replace(">", "&gt;")}"/>
 </transition></state></scxml>""",
    )
    trace = INTERPRETER.run(chart, ("start 0", "run 1"))
    assert f"delay e in {delay}" in trace, trace


@pytest.mark.parametrize("expression", ["t + 'parsecs'", "'a' + 'ms'", "t + t", "u + 'ms'"])
def test_what_is_no_delay_stays_an_error(expression: str, tmp_path: Path) -> None:
    findings = Findings()
    path = tmp_path / "chart.scxml"
    path.write_text(
        text("ms", "{}", "1", "int32").replace('delayexpr="t"', f'delayexpr="{expression}"')
    )
    chart = load_with_findings(path, findings)
    assert {"content-not-evaluable"} <= {d.rule.name for d in findings}
    assert INTERPRETER.run(chart, ("start 0", "post go", "run 1"))[-1] == "= bad"
