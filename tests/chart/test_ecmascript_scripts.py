"""Scripts of ECMAScript: variables that they declare, and calls that only write."""

from __future__ import annotations

from typing import Any

import pytest

from fsmkit.chart.statements import Log
from fsmkit.language import INT32, Literal
from tests.chart.endings import endings

HEAD = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">'
FINALS = '<final id="pass"/><final id="fail"/></scxml>\n'
SCRIPT = ["start 0", "run 0", "run 0", "run 0"]


def passing(script: str, condition: str = "true", data: str = "") -> str:
    """Return a chart that executes a script, and passes if a condition holds behind it."""
    return (
        f"{HEAD}<datamodel>{data}</datamodel><state id='s'><onentry><script>{script}</script>"
        '</onentry><transition event="error.*" target="fail"/>'
        f'<transition cond="{condition}" event="go" target="pass"/>'
        '<transition event="*" target="fail"/><onentry><raise event="go"/></onentry></state>'
        f"{FINALS}"
    )


@pytest.mark.external
@pytest.mark.cc
def test_a_variable_of_a_script_is_declared(scxml: Any) -> None:
    script = "var d = x - 3; let twice = 2 * d; var later; later = twice; x -= later"
    result = scxml(passing(script, "x == -4 &amp;&amp; d == 7", '<data id="x" expr="10"/>'))
    assert "content-not-evaluable" not in result.rules
    assert [(d.name, d.type) for d in result.chart.data] == [
        (name, INT32) for name in ("x", "d", "twice", "later")
    ]
    assert endings(result.chart, SCRIPT, ("interpreter", "python", "c")) == {("pass",)}


def test_a_declared_name_is_the_same_variable(scxml: Any) -> None:
    result = scxml(passing("var x = 4", "x == 4", '<data id="x" expr="1"/>'))
    assert [d.name for d in result.chart.data] == ["x"]
    assert endings(result.chart, SCRIPT) == {("pass",)}


def test_only_a_script_declares(scxml: Any) -> None:
    text = passing("").replace("<script>", '<assign location="y" expr="1"/><script>')
    result = scxml(text)
    assert "unknown name `y`" in result.one("content-not-evaluable").message


def logs(result: Any) -> list[Any]:
    blocks = [block for state in result.chart.states for block in state.on_entry]
    return [each for block in blocks for each in block if isinstance(each, Log)]


LOGGED = [
    ("console.log('here')", "here", 0),
    ("console.warn('n is', n, n + 1)", "n is", 2),
    ("console.info('n is ' + n + ', and ' + (n + 1))", "n is ", 3),
    ("console.error(n + 1 + ' here')", "", 2),
    ("console.log(n + 1)", "", 1),
    ("console.debug()", "", 0),
    ("_trace(n)", "", 1),
    (r"console.log('\'&lt;b&gt; %s */ ${n}')", "'<b> %s */ ${n}", 0),
]


@pytest.mark.parametrize(("call", "label", "values"), LOGGED)
def test_a_call_that_writes_is_a_log(scxml: Any, call: str, label: str, values: int) -> None:
    result = scxml(passing(call, "true", '<data id="n" expr="1"/>'))
    assert not {"content-not-evaluable", "value-not-logged"} & set(result.rules)
    (log,) = logs(result)
    assert (log.label, len(log.values)) == (label, values)
    assert endings(result.chart, SCRIPT) == {("pass",)}


def test_the_rest_of_a_joined_string_is_a_value(scxml: Any) -> None:
    (log,) = logs(scxml(passing("console.log('a' + 1)")))
    assert [v.value for v in log.values if isinstance(v, Literal)] == [1]


@pytest.mark.parametrize("call", ["console.clear()", "window.log('x')", "alert('x')"])
def test_other_calls_are_told(scxml: Any, call: str) -> None:
    result = scxml(passing(call))
    assert "content-not-evaluable" in result.rules
    assert endings(result.chart, SCRIPT) == {("fail",)}


def test_a_declared_operation_is_called(scxml: Any) -> None:
    head = '<fk:operation xmlns:fk="urn:fsmkit:scxml" signature="_trace(n int32)"/>'
    result = scxml(passing("_trace(1)").replace("<datamodel>", f"{head}<datamodel>"))
    assert "content-not-evaluable" not in result.rules
    assert logs(result) == []
