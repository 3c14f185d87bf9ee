"""Objects: members in variables of their own, where they are known; payloads as a whole."""

from __future__ import annotations

from typing import Any

import pytest

from tests.chart.endings import endings

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M" '
    'datamodel="ecmascript"><datamodel>{}</datamodel><state id="s"><onentry>{}</onentry>'
)
TAIL = '<final id="pass"/><final id="fail"/></scxml>\n'
RUNTIMES = ("interpreter", "python", "c")
SEND = '<send event="e"><param name="x" expr="7"/><param name="y" expr="\'up\'"/></send>'
TAKE = '<assign location="o" expr="_event.data"/>'


def asking(data: str, entry: str, condition: str) -> str:
    return (
        f'{HEAD.format(data, entry)}<transition cond="{condition}" target="pass"/>'
        f'<transition target="fail"/></state>{TAIL}'
    )


def taking(data: str, entry: str, condition: str) -> str:
    """Return a chart that keeps a payload, and asks when it has it."""
    return (
        f'{HEAD.format(data, entry)}<transition event="e" target="t">{TAKE}</transition></state>'
        f'<state id="t"><transition cond="{condition}" target="pass"/><transition target="fail"/>'
        f"</state>{TAIL}"
    )


def ends(chart: Any) -> set[tuple[str, ...] | None]:
    script = ["start 0", "run 0", "run 0"]
    return endings(chart, script, RUNTIMES)


EMPTY = '<data id="o" expr="{}"/>'
NEW = '<data id="o" expr="new Object()"/>'
HOLD = [
    asking(EMPTY, "<script>o.a = 3; o['b'] = 'x'</script>", "o.a == 3 &amp;&amp; o.b == 'x'"),
    asking(NEW, '<assign location="o.n" expr="2"/>', "o.n == 2"),
    asking(NEW, "<script>o = {a: 1, b: 2}</script>", "o.a + o.b == 3"),
    taking(EMPTY, SEND, "o.x == 7 &amp;&amp; o.y == 'up'"),
    taking('<data id="o" expr="{x: 1, y: \'\'}"/>', SEND, "o.x == 7 &amp;&amp; o.y == 'up'"),
    asking('<data id="o" expr="null"/>', "", "o == null"),
    asking('<data id="o" expr="null"/>', "<script>o = 4</script>", "o != null &amp;&amp; o == 4"),
    asking('<data id="o" expr="4"/>', "<script>o = null</script>", "o === null"),
]


@pytest.mark.external
@pytest.mark.parametrize("text", HOLD)
def test_members_hold(scxml: Any, text: str) -> None:
    result = scxml(text)
    assert "content-not-evaluable" not in result.rules
    assert ends(result.chart) == {("pass",)}


@pytest.mark.external
def test_an_object_is_sent_as_content(scxml: Any) -> None:
    text = HEAD.format(
        '<data id="o" expr="{x: 5, y: 6}"/>',
        '<send event="e"><content expr="o"/></send>',
    )
    text += '<transition event="e" cond="_event.data.x + _event.data.y == 11" target="pass"/>'
    result = scxml(f"{text}</state>{TAIL}")
    assert "content-not-evaluable" not in result.rules
    assert ends(result.chart) == {("pass",)}


@pytest.mark.external
@pytest.mark.parametrize(
    ("sent", "holds"),
    [(SEND, "_event.data &amp;&amp; _event.data.x == 7"), ('<send event="e"/>', "!_event.data")],
)
def test_a_payload_counts_as_true(scxml: Any, sent: str, holds: str) -> None:
    text = f'{HEAD.format("", sent)}<transition event="e" cond="{holds}" target="pass"/></state>'
    result = scxml(f"{text}{TAIL}")
    assert "content-not-evaluable" not in result.rules
    assert ends(result.chart) == {("pass",)}


PASSED = [  # what is sent on, with data of the chart; what is given; what is asked
    ("", SEND, "_event.data", "_event.data.p.x == 7 &amp;&amp; _event.data.p.y == 'up'"),
    ('<data id="o" expr="{a: 3, b: \'u\'}"/>', '<send event="e"/>', "o", "_event.data.p.a == 3"),
]


@pytest.mark.external
@pytest.mark.parametrize(("data", "sent", "value", "holds"), PASSED)
def test_an_object_is_passed_on(scxml: Any, data: str, sent: str, value: str, holds: str) -> None:
    text = (
        f'{HEAD.format(data, sent)}<transition event="e"><send event="f">'
        f'<param name="p" expr="{value}"/></send></transition>'
        f'<transition event="f" cond="{holds}" target="pass"/></state>{TAIL}'
    )
    result = scxml(text)
    assert "content-not-evaluable" not in result.rules
    assert ends(result.chart) == {("pass",)}
    whole = text.replace('expr="o"', 'expr="_event.data"').replace(holds, "_event.data.p == 3")
    assert "content-not-evaluable" in scxml(whole).rules


def test_a_payload_as_a_whole_is_told_with_a_way_out(scxml: Any) -> None:
    text = f'{HEAD.format("", SEND)}<transition event="e" cond="_event.data == 3" target="pass"/>'
    found = scxml(f"{text}</state>{TAIL}").found
    (told,) = (d for d in found if d.rule.name == "content-not-evaluable")
    assert told.help == (
        "read `_event.name`, or a field as in `_event.data.field`; "
        "at run time it is `error.execution`; `--strict` makes it an error now"
    )


LEFT = [
    asking(EMPTY, "<script>o = {a: 1}; o = {b: 2}</script>", "o.a == 1"),
    asking(EMPTY, "<script>o.a = 1</script>", "o.never == 1"),
    asking(EMPTY, "<script>o.a = 1; o = {}</script>", "o.a == 1"),
    asking(EMPTY + '<data id="p" expr="0"/>', "<script>o.a = 1; p = o</script>", "o.a == 1"),
]


@pytest.mark.parametrize("text", LEFT)
def test_what_would_lose_a_value_is_left_as_it_is(scxml: Any, text: str) -> None:
    assert "content-not-evaluable" in scxml(text).rules


def test_an_object_may_be_given_to_what_is_not_there(scxml: Any) -> None:
    """`mmir` is unknown, so that the call fails before it looks at the object."""
    result = scxml(asking(EMPTY, "<script>mmir.dialog.show(o)</script>", "true"))
    assert [d.message for d in result.found if d.rule.name == "content-not-evaluable"] == [
        "this cannot be evaluated: `mmir.dialog.show` cannot be called"
    ]
