"""Names that end strings, comments and lines of what is generated: each is only a name."""

from __future__ import annotations

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.codegen.python.generate import module_text
from fsmkit.diagnostics import Findings, Source
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plugins import plugin
from fsmkit.testing.harness.harness import harness

CHART = """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="T" datamodel="ecmascript">
  <datamodel><data id="n" expr="1"/></datamodel>
  <state id="NAME">
    <onentry>
      <log label="NAME" expr="n"/>
      <raise event="x.NAME"/>
      <send event="y.NAME" id="NAME" delay="1s"><param name="n" expr="n"/></send>
    </onentry>
    <transition event="x" target="s"/>
  </state>
  <state id="s"><transition event="y" cond="n == 1" target="z.NAME"/></state>
  <final id="z.NAME"/>
</scxml>
"""
"""A chart in which states, events, an id and a label are called so."""
ONE_LINE = ['a"b', "a'b", "a{b}", "a}", "a\\", "a\\n", '"""', "*/", "//", "%d", "??/"]
LINE_ENDS = ["&#10;", "&#13;", "&#133;", "&#8232;"]
SCRIPT = ["start 0", "run 2000"]


def elaborated(text: str) -> Chart:
    findings = Findings()
    document = plugin(FrontEnd, "scxml").read(Source("t.scxml", text), findings)
    assert document is not None, [found.message for found in findings]
    chart = elaborate((document,), findings)
    assert chart is not None, [found.message for found in findings]
    return chart


@pytest.mark.external
@pytest.mark.parametrize("name", ONE_LINE)
def test_every_runtime_says_the_name_as_it_is(name: str) -> None:
    chart = elaborated(CHART.replace("NAME", name.replace('"', "&quot;")))
    expected = list(harness("interpreter").run(chart, SCRIPT))
    assert f"+ {name}" in expected
    assert f"+ z.{name}" in expected
    for runtime in ("python", "c"):
        assert list(harness(runtime).run(chart, SCRIPT)) == expected, runtime


@pytest.mark.parametrize("end", LINE_ENDS)
@pytest.mark.parametrize("traced", [False, True])
def test_a_name_of_two_lines_stays_in_its_string(end: str, *, traced: bool) -> None:
    """Found by fuzzing."""
    head = CHART[: CHART.index(">") + 1]
    chart = elaborated(
        f'{head}<state id="a{end}b"><transition event="e" target="s"/></state>'
        '<state id="s"/></scxml>'
    )
    assert len(chart.states[1].id) == 3
    compile(module_text(chart, traced=traced), "t.py", "exec")


@pytest.mark.parametrize("name", ["true", "none", "false", "True", "intEnum", "callable"])
def test_a_capital_makes_no_keyword_of_a_class(name: str) -> None:
    """Found by fuzzing: a chart `true` was a class `True`."""
    chart = elaborated(CHART.replace('name="T"', f'name="{name}"').replace("NAME", "a"))
    compile(module_text(chart), "t.py", "exec")
