"""Methods of strings, for each string that is known when compiling."""

from __future__ import annotations

import json
import random
import shutil
import subprocess
from typing import Any

import pytest

from fsmkit.chart.ecmascript.string_values import Unknown, evaluate
from fsmkit.language.syntax import parse
from fsmkit.testing.conformance.expectations import ends_in
from fsmkit.testing.harness.harness import harness
from tests.chart.endings import endings

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M" datamodel="ecmascript">'
    '<datamodel><data id="s" expr="\'door.open\'"/><data id="n" expr="0"/></datamodel>'
    '<state id="a"><transition event="go" target="b"><assign location="s" expr="\' Up.Down\'"/>'
    "</transition></state>"
)
RUNTIMES = ("interpreter", "python", "c")
HOLD = [  # of the first string, of the second
    ("s.length == 9", "s.length == 8"),
    ("s.substr(5) == 'open'", "s.substr(-4, 2) == 'Do'"),
    ("s.slice(0, -5) == 'door'", "s.slice(1, 3) == 'Up'"),
    ("s.charAt(0) == 'd' &amp;&amp; s.charAt(99) == ''", "s.charAt(0) == ' '"),
    ("s.split('.')[1] == 'open'", "s.split('.')[1].toUpperCase() == 'DOWN'"),
    ("s.startsWith('door')", "!s.startsWith('door')"),
    ("s.indexOf('o') + n == 1", "s.indexOf('o') == 5"),
    ("s.substr(s.lastIndexOf('.') + 1) == 'open'", "s.trim().substring(2, 0) == 'Up'"),
    ("s.slice(5) + '!' == 'open!'", "s.replace('.', '-') == ' Up-Down'"),
]


def text(before: str, after: str) -> str:
    return (
        f'{HEAD}<state id="b"><transition cond="{before}" target="fail"/>'
        f'<transition cond="{after}" target="pass"/></state>'
        f'<final id="pass"/><final id="fail"/></scxml>'
    )


def ends(chart: Any) -> set[tuple[str, ...] | None]:
    script = ["start 0", "post go", "run 0"]
    return endings(chart, script, RUNTIMES)


@pytest.mark.external
@pytest.mark.parametrize(("before", "after"), HOLD)
def test_methods_hold(scxml: Any, before: str, after: str) -> None:
    result = scxml(text(f"!({after})", after))
    assert "content-not-evaluable" not in result.rules
    assert ends(result.chart) == {("pass",)}
    first = scxml(text("false", after).replace("expr=\"' Up.Down'\"", "expr=\"'door.open'\""))
    assert first.chart is not None
    kept = text("false", before).replace('<assign location="s" expr="\' Up.Down\'"/>', "")
    assert ends(scxml(kept).chart) == {("pass",)}


MADE = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M"
  datamodel="ecmascript"><datamodel><data id="s" expr="'a1'"/><data id="t" expr="''"/>
  <data id="n" expr="0"/></datamodel>
  <state id="a"><transition event="go" target="b"><assign location="s" expr="'b27'"/></transition>
  </state><state id="b"><onentry><assign location="t" expr="'x' + s.slice(0, 1)"/>
  <assign location="n" expr="parseInt(s.slice(1)) + Number(s.substr(1))"/>
  <raise event="on"/></onentry>
  <transition event="on" cond="t == 'xb' &amp;&amp; n == 54" target="pass"/>
  <transition target="fail" event="on"/></state><final id="pass"/><final id="fail"/></scxml>
"""


@pytest.mark.external
def test_what_is_made_is_known_too(scxml: Any) -> None:
    result = scxml(MADE)
    assert "content-not-evaluable" not in result.rules
    assert ends(result.chart) == {("pass",)}


AT_HAND = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M"
  datamodel="ecmascript"><datamodel><data id="n" expr="0"/><data id="s" expr="''"/></datamodel>
  <state id="a">{early}
  <transition event="key.up key.down" cond="_event.name.substr(4) == 'up'" target="b">
  <assign location="s" expr="_event.name.slice(_event.name.lastIndexOf('.') + 1)"/></transition>
  <transition event="key.up" target="fail"/></state>
  <state id="b"><onentry><assign location="n" expr="n + _event.name.length"/></onentry>
  <transition event="go" cond="s == 'up' &amp;&amp; n == 6" target="c"/></state>
  <state id="c"><transition event="*" cond="_event.name.startsWith('key')" target="pass"/>
  <transition event="*" target="fail"/></state>
  <final id="pass"/><final id="fail"/></scxml>
"""
WITHOUT = "<onentry><assign location='n' expr='_event.name.length'/></onentry>"


@pytest.mark.external
def test_methods_of_the_name_of_the_event_at_hand(scxml: Any) -> None:
    result = scxml(AT_HAND.format(early=""))
    assert "content-not-evaluable" not in result.rules
    script = ["start 0", "post key.down", "run 0", "post key.up", "post go", "post key.down"]
    script.append("run 0")
    traces = [harness(runtime).run(result.chart, script) for runtime in RUNTIMES]
    assert {ends_in(trace) for trace in traces} == {("pass",)}
    assert "content-not-evaluable" in scxml(AT_HAND.format(early=WITHOUT)).rules


@pytest.mark.parametrize(
    "condition",
    ["s.split('.')[7] == 'x'", "parseInt(s) == 1", "s.match('x') == 1", "s.at(-1) == 'n'"],
)
def test_what_is_no_value_is_told(scxml: Any, condition: str) -> None:
    assert "content-not-evaluable" in scxml(text("false", condition)).rules


@pytest.mark.slow
def test_a_hundred_joins_are_one_table_each(scxml: Any) -> None:
    """Each of 100 variables joins one of 8 prefixes with one of 8 others."""
    data = "".join(f'<data id="v{n}" expr="\'p0\'"/>' for n in range(100))
    data += '<data id="a" expr="\'k0\'"/><data id="b" expr="\'l0\'"/>'
    given = "".join(
        f'<transition event="e{n}"><assign location="a" expr="\'k{n}\'"/>'
        f'<assign location="b" expr="\'l{n}\'"/></transition>'
        for n in range(1, 8)
    )
    joins = "".join(f'<assign location="v{n}" expr="a + \'.\' + b"/>' for n in range(100))
    made = scxml(
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M" '
        f'datamodel="ecmascript"><datamodel>{data}</datamodel><state id="s">{given}'
        f'<transition event="go" cond="v99.length == 5">{joins}</transition></state></scxml>'
    )
    assert "content-not-evaluable" not in made.rules


METHODS = [
    "s.charAt({i})", "s.slice({i})", "s.slice({i}, {j})", "s.substr({i}, {j})", "s.substr({i})",
    "s.substring({i}, {j})", "s.indexOf(t)", "s.indexOf(t, {i})", "s.lastIndexOf(t)",
    "s.startsWith(t)", "s.endsWith(t)", "s.includes(t)", "s.toUpperCase()", "s.toLowerCase()",
    "s.trim()", "s.concat(t, {i})", "s.replace(t, s)", "s.split(t)[{i}]", "s.length", "s[{i}]",
    "parseInt(s)", "Number(s)", "parseFloat(s)", "String(s)", "s + {i} + t",
]  # fmt: skip
LETTERS = "ab.B1 -0+e\t\u00a0ß\u0130"


@pytest.mark.external
def test_methods_are_those_of_node() -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("there is no node")
    choose = random.Random(3)
    asked = []
    for _ in range(4000):
        one, two = ("".join(choose.choices(LETTERS, k=choose.randint(0, k))) for k in (7, 2))
        i, j = choose.randint(-5, 9), choose.randint(-5, 9)
        asked.append((choose.choice(METHODS).format(i=i, j=j), one, two))
    program = (
        "const told = JSON.parse(require('fs').readFileSync(0, 'utf8')).map(([e, s, t]) => "
        "new Function('s', 't', 'return ' + e)(s, t));"
        "console.log(JSON.stringify(told.map(v => v === undefined || v !== v ? null : v)))"
    )
    ran = subprocess.run(
        [node, "-e", program], input=json.dumps(asked), capture_output=True, text=True, check=True
    )
    known = 0
    for (expression, one, two), expected in zip(asked, json.loads(ran.stdout), strict=True):
        try:
            value = evaluate(parse(expression), {"s": one, "t": two})
        except Unknown:
            continue
        known += 1
        assert value == expected, expression
        assert isinstance(value, bool) == isinstance(expected, bool), expression
    assert known > 3000
