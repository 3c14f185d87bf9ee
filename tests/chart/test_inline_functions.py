"""Functions of scripts: put in where they are called."""

from __future__ import annotations

from typing import Any

import pytest

from tests.chart.endings import endings

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M" '
    'datamodel="ecmascript"><datamodel><data id="n" expr="3"/><data id="f" expr="1.5"/>'
    '<data id="s" expr="\'up\'"/><data id="x" expr="100"/></datamodel><script><![CDATA[{}]]>'
    "</script>"
)
TAIL = (
    '<state id="s_"><onentry><script>{}</script></onentry><transition cond="{}" target="pass"/>'
    '<transition target="fail"/></state><final id="pass"/><final id="fail"/></scxml>\n'
)
RUNTIMES = ("interpreter", "python", "c")
FUNCTIONS = """
// comments and braces in strings stay: function no() { }
function twice(x) { return x * 2; }
function clip(v, most) {
  var r = v;
  if (v > most) { r = most; }
  return r;
}
function same(a) { return a; }
function grade(v) { if (v > 10) { return 'high'; } else if (v > 2) { return 'some'; } return '{'; }
function add(k) { var old = n; n = old + k; x += 1; }
function both(k) { add(k); add(twice(k)); }
function forever(k) { return forever(k - 1); }
function odd() { return this.x; }
"""
HOLD = [
    ("", "twice(n) == 6 &amp;&amp; twice(f) == 3"),
    ("", "clip(n, 2) == 2 &amp;&amp; clip(n, 7) == 3 &amp;&amp; x == 100"),
    ("", "same(s) == 'up' &amp;&amp; same(n) == 3"),
    (
        "",
        "grade(n) == 'some' &amp;&amp; grade(twice(twice(n))) == 'high' &amp;&amp; grade(1) == '{'",
    ),
    ("add(4);", "n == 7 &amp;&amp; x == 101"),
    ("both(n);", "n == 12 &amp;&amp; x == 102"),
    ("twice(n);", "n == 3"),
    ("if (twice(n) == 6) { add(1) }", "n == 4"),
]


@pytest.mark.external
@pytest.mark.parametrize(("entry", "condition"), HOLD)
def test_functions_hold(scxml: Any, entry: str, condition: str) -> None:
    result = scxml(HEAD.format(FUNCTIONS) + TAIL.format(entry, condition))
    assert "content-not-evaluable" not in result.rules
    ended = endings(result.chart, ["start 0", "run 0"], RUNTIMES)
    assert ended == {("pass",)}


@pytest.mark.parametrize(
    "condition", ["forever(n) == 1", "odd() == 1", "twice() == 0", "no() == 1"]
)
def test_what_cannot_be_put_in_is_told(scxml: Any, condition: str) -> None:
    result = scxml(HEAD.format(FUNCTIONS) + TAIL.format("", condition))
    assert "unknown operation" in result.one("content-not-evaluable").message


def test_a_function_that_cannot_be_read_is_told(scxml: Any) -> None:
    broken = "function bad(x) { if (x !=== 2) { x = 1; } return x; }"
    result = scxml(HEAD.format(broken) + TAIL.format("", "n == 3"))
    assert "content-not-evaluable" in result.rules
