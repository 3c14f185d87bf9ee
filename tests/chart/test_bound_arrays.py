"""Arrays that grow: a capacity, a length, and no more elements than there are."""

from __future__ import annotations

from typing import Any

import pytest

from fsmkit.language import FLOAT64, INT32, ArrayType
from tests.chart.endings import endings

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0" '
    'name="M" datamodel="ecmascript">'
)
SCRIPT = ["start 0", "run 0", "run 0"]
RUNTIMES = ("interpreter", "python", "c")
LIST = '<data id="l" expr="[1, 2, 3]"/><data id="n" expr="0"/>'
SMALL = 'fk:type="int32[4]"'
GROWN = '<assign location="l" expr="[].concat(l, [4])"/>'


def asking(condition: str, entry: str, data: str = LIST) -> str:
    """Return a chart that passes where a condition holds after some content."""
    return (
        f'{HEAD}<datamodel>{data}</datamodel><state id="s"><onentry>{entry}</onentry>'
        f'<transition cond="{condition}" target="pass"/><transition target="fail"/></state>'
        '<final id="pass"/><final id="fail"/></scxml>\n'
    )


def ends(chart: Any) -> set[tuple[str, ...] | None]:
    return endings(chart, SCRIPT, RUNTIMES)


SUM = '<assign location="n" expr="n + at"/>'
HOLD = [
    ("l.length == 4 &amp;&amp; l[3] == 4", GROWN),
    ("l.length == 5", '<assign location="l" expr="l.concat([4], [5])"/>'),
    ("l.length == 6 &amp;&amp; l[5] == 9", "<script>l.push(7, 8, n + 9)</script>"),
    ("l[l.length - 1] == 3 &amp;&amp; l.length == 4", "<script>l[l.length] = l.length</script>"),
    ("l.length == 1 &amp;&amp; l[0] == 5", "<script>l.push(4); l = [5]</script>"),
    ("l[2] == 3 &amp;&amp; l instanceof Array", GROWN + "<script>l[0] += 1</script>"),
    (
        "n == 3 &amp;&amp; l.length == 6 &amp;&amp; i == 3",
        f'<foreach item="i" array="l">{GROWN}<assign location="n" expr="n + 1"/></foreach>',
    ),
    (
        "n == 6 &amp;&amp; at == 3",
        f'{GROWN}<foreach item="i" index="at" array="l">{SUM}</foreach>',
    ),
]


@pytest.mark.external
@pytest.mark.parametrize(("condition", "entry"), HOLD)
def test_growth(scxml: Any, condition: str, entry: str) -> None:
    result = scxml(asking(condition, entry))
    assert "content-not-evaluable" not in result.rules
    assert ends(result.chart) == {("pass",)}
    assert ends(scxml(asking(f"!({condition})", entry)).chart) == {("fail",)}


def test_the_capacity_is_told_or_declared(scxml: Any) -> None:
    result = scxml(asking("true", GROWN))
    assert "16 elements" in result.one("growing-array").message
    assert result.chart.data[0].type == ArrayType(INT32, 16)
    typed = LIST.replace("<data", f"<data {SMALL}", 1)
    declared = scxml(asking("true", GROWN, typed))
    assert "growing-array" not in declared.rules
    assert declared.chart.data[0].type == ArrayType(INT32, 4)


ERRORS = [
    ("l.push(4)", "l.push(5)", 4),
    ("l = l.concat([])", "l.push(4, 5)", 3),
    ("l.push(4)", "l[l.length] = 5", 4),
    ("l = l.concat([])", "n = l[3]", 3),
    ("l = l.concat([])", "l[3] = 1", 3),
]


@pytest.mark.external
@pytest.mark.parametrize(("before", "content", "length"), ERRORS)
def test_beyond_the_bounds_is_an_error_that_changes_nothing(
    scxml: Any, before: str, content: str, length: int
) -> None:
    chart = scxml(
        f"{HEAD}<datamodel>{LIST.replace('<data', '<data ' + SMALL, 1)}</datamodel>"
        f'<state id="s"><onentry><script>{before}; {content}; n = 1</script></onentry>'
        f'<transition event="error.execution" cond="n == 0 &amp;&amp; l.length == {length}" '
        'target="pass"/><transition event="*" target="fail"/></state>'
        '<final id="pass"/><final id="fail"/></scxml>\n'
    ).chart
    assert ends(chart) == {("pass",)}


@pytest.mark.parametrize("other", ["n = l", "m = l", "l = l.concat(m)", "n = l.indexOf(1)"])
def test_an_array_of_which_more_is_asked_is_left_as_it_is(scxml: Any, other: str) -> None:
    data = LIST + '<data id="m" expr="[7]"/>'
    result = scxml(asking("true", f"{GROWN}<script>{other}</script>", data))
    assert "growing-array" not in result.rules
    assert "content-not-evaluable" in result.rules
    assert result.chart.data[0].type == ArrayType(INT32, 3)


@pytest.mark.external
def test_an_empty_array_has_the_type_of_what_is_put_in(scxml: Any) -> None:
    data = '<data id="l" expr="[]"/>'
    grown = "<script>l.push(0.25, 0.5)</script>"
    chart = scxml(asking("l.length == 2 &amp;&amp; l[1] == 0.5", grown, data)).chart
    assert chart.data[0].type == ArrayType(FLOAT64, 16)
    assert ends(chart) == {("pass",)}


OPEN = (
    '<data id="l" type="int32[]" expr="[1, 2]"/><data id="m" type="int32[]"/>'
    '<data id="n" expr="0"/>'
)
OPEN_HOLD = [
    ("l.length == 3 &amp;&amp; l[2] == 7", "<script>l[2] = 7</script>"),
    ("l.length == 2 &amp;&amp; l[1] == 9", "<script>l[n + 1] = 9</script>"),
    ("l.length == 1 &amp;&amp; l[0] == 4", "<script>l.length = 0; l[0] = 4</script>"),
    (
        "m.length == 3 &amp;&amp; m[2] == 5 &amp;&amp; l.length == 2",
        "<script>m = l; m[m.length] = 5</script>",
    ),
    (
        "m.length == 4 &amp;&amp; m[3] == 3",
        "<script>m[0] = 1; m[1] = 1; m[2] = m[1] + m[0]; m[3] = m[2] + m[1]</script>",
    ),
    ("l.length == 2 &amp;&amp; n == 0", "<script>l[7] = 1; n = 1</script>"),
]


@pytest.mark.external
@pytest.mark.parametrize(("condition", "entry"), OPEN_HOLD)
def test_an_array_whose_type_has_no_length(scxml: Any, condition: str, entry: str) -> None:
    result = scxml(asking(condition, entry, OPEN))
    assert "content-not-evaluable" not in result.rules
    assert "growing-array" in result.rules
    assert ends(result.chart) == {("pass",)}
    assert ends(scxml(asking(f"!({condition})", entry, OPEN)).chart) == {("fail",)}


SENT = f"""{HEAD}<datamodel><data id="l" type="int32[]" expr="[5]"/>
  <data id="got" type="int32[]" expr="[]"/></datamodel>
  <state id="s"><onentry><script>l.push(6)</script><raise event="at"/>
    <send event="list"><param name="all" expr="l"/></send></onentry>
    <transition event="list" target="t"><assign location="got" expr="_event.data.all"/></transition>
  </state>
  <state id="t"><transition cond="got.length == 2 &amp;&amp; got[1] == 6" target="pass"/></state>
  <state id="wait"><transition event="given" target="pass" cond="_event.data.k == 1">
    <assign location="got" expr="_event.data.all"/></transition></state>
  <final id="pass"/></scxml>
"""


@pytest.mark.external
def test_an_array_is_sent_with_its_length(scxml: Any) -> None:
    chart = scxml(SENT).chart
    assert ends(chart) == {("pass",)}
    sent = chart.events[chart.event_index["list"]]
    assert [field.name for field in sent.fields] == ["all", "all_length"]
    given = chart.events[chart.event_index["given"]]
    assert [str(field.type) for field in given.fields] == ["int32", "int32[16]", "int32"]


def test_an_open_array_of_which_more_is_asked_is_left_as_it_is(scxml: Any) -> None:
    result = scxml(asking("true", "<script>l.sort()</script>", OPEN))
    assert "content-not-evaluable" in result.rules
