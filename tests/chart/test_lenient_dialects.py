"""Charts that declare nothing: types are read off the uses, errors kept for run time."""

from __future__ import annotations

from typing import Any

from fsmkit.chart.statements import Destination, Fail, Log, Raise, Send
from fsmkit.document.document import Direction
from fsmkit.language import BOOL, FLOAT64, INT32, SYMBOL, ArrayType, Field, Invalid, Literal


def chart(content: str, data: str = "", transitions: str = "") -> str:
    return (
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M" '
        'datamodel="ecmascript">'
        f"<datamodel>{data}</datamodel>"
        f'<state id="a"><onentry>{content}</onentry>{transitions}</state></scxml>\n'
    )


def types(result: Any) -> dict[str, object]:
    return {d.name: d.type for d in result.chart.data}


def test_types_are_read_off_start_values(scxml: Any) -> None:
    data = """<data id="n" expr="1"/><data id="x" expr="0.5"/><data id="b" expr="true"/>
        <data id="s" expr="'on'"/><data id="l" expr="[1,2,3]"/><data id="m" expr="n + 1"/>"""
    assert types(scxml(chart("", data))) == {
        "n": INT32,
        "x": FLOAT64,
        "b": BOOL,
        "s": SYMBOL,
        "l": ArrayType(INT32, 3),
        "m": INT32,
    }


def test_a_start_value_that_wraps_around_is_told(scxml: Any) -> None:
    result = scxml(chart("", '<data id="n" type="uint8" expr="300"/>'))
    assert "value-out-of-range" in result.rules
    assert result.chart.data[0].init.value == 44


def test_types_are_read_off_assignments(scxml: Any) -> None:
    data = '<data id="n"/><data id="x" expr="1"/><data id="y"/>'
    content = """<assign location="y" expr="n"/><assign location="n" expr="3"/>
        <assign location="x" expr="0.5"/>"""
    result = scxml(chart(content, data))
    assert types(result) == {"n": INT32, "x": FLOAT64, "y": INT32}
    assert result.chart.data[1].init.value == 1.0
    assert isinstance(result.chart.data[1].init.value, float)


def test_untyped_data_is_told(scxml: Any) -> None:
    result = scxml(chart("", '<data id="n"/>'))
    assert "untyped-data" in result.rules
    assert types(result) == {"n": INT32}


def test_events_are_implied_with_their_fields(scxml: Any) -> None:
    content = """<raise event="one"/>
        <send event="two"><param name="x" expr="1"/><param name="s" expr="'a'"/></send>"""
    result = scxml(chart(content, "", '<transition event="two" cond="_event.data.x == 1"/>'))
    events = {e.name: e for e in result.chart.events}
    assert events["one"].directions == {Direction.INTERNAL}
    assert events["two"].fields == (Field("x", INT32), Field("s", SYMBOL))
    assert not isinstance(result.chart.transitions[1].guard, Invalid)


def test_prefixes_of_platform_events_are_no_events(scxml: Any) -> None:
    result = scxml(chart("", "", '<transition event="error"/><transition event="done.*"/>'))
    assert [e.name for e in result.chart.events if e.directions] == []


def test_content_that_cannot_be_evaluated_fails_at_run_time(scxml: Any) -> None:
    result = scxml(chart('<assign location="nowhere" expr="1"/><raise event="e"/>'))
    ((failing, rest),) = result.chart.states[1].on_entry
    assert isinstance(failing, Fail)
    assert isinstance(rest, Raise)
    assert "content-not-evaluable" in result.rules
    assert result.chart.lenient


def test_a_guard_that_cannot_be_evaluated_is_invalid(scxml: Any) -> None:
    result = scxml(chart("", "", '<transition cond="nowhere == 1" target="a"/>'))
    assert isinstance(result.chart.transitions[1].guard, Invalid)


def test_strict_makes_it_an_error(scxml: Any) -> None:
    text = chart('<assign location="nowhere" expr="1"/>')
    assert scxml(text, strict=True).maybe is None
    assert scxml(text).maybe is not None


def test_targets(scxml: Any) -> None:
    content = """<send event="e" target="#_internal"/><send event="e" target="!bad"/>
        <send event="e" target="#_scxml_nobody"/><send event="e" type="http://no"/>
        <send eventexpr="'e'" delayexpr="'1s'"/>"""
    result = scxml(chart(content))
    ((internal, bad, nobody, kind, late),) = result.chart.states[1].on_entry
    assert isinstance(internal, Send)
    assert internal.destination is Destination.INTERNAL
    assert isinstance(bad, Fail)
    assert isinstance(nobody, Raise)
    assert result.chart.events[nobody.event].name == "error.communication"
    assert isinstance(kind, Fail)
    assert isinstance(late, Send)
    assert isinstance(late.delay, Literal)
    assert late.delay.value == 1000


def test_done_data(scxml: Any) -> None:
    result = scxml(
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M">'
        '<state id="a"><transition event="done.state.a" cond="_event.data.x == 2" target="b"/>'
        '<final id="f"><donedata><param name="x" expr="2"/></donedata></final></state>'
        '<state id="b"/></scxml>\n'
    )
    chart_ = result.chart
    assert chart_.events[chart_.event_index["done.state.a"]].fields == (Field("x", INT32),)
    (value,) = chart_.states[chart_.state_index["f"]].done_data
    assert value.type == INT32


def test_late_binding_assigns_on_the_first_entry(scxml: Any) -> None:
    result = scxml(
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M" binding="late">'
        '<state id="a"><datamodel><data id="x" expr="3"/></datamodel></state></scxml>\n'
    )
    assert types(result)["x"] == INT32
    assert result.chart.data[0].init.value == 0
    assert len(result.chart.states[1].on_entry) == 2


def test_a_log_never_fails_for_lack_of_strings(scxml: Any) -> None:
    result = scxml(chart("""<log expr="'x is ' + x"/><log expr="[x, x + 1]"/>
                         <log expr="x + x + 's'"/><log expr="'x' + (this + x)"/>
                         <raise event="e"/>""",
                         '<data id="x" expr="1"/>'))  # fmt: skip
    ((*logged, last),) = result.chart.states[1].on_entry
    assert [len(log.values) for log in logged if isinstance(log, Log)] == [2, 2, 2, 2]
    assert isinstance(last, Raise)
    assert result.rules.count("value-not-logged") == 1


def test_the_script_of_a_chart_declares_variables(scxml: Any) -> None:
    result = scxml(
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M" '
        'datamodel="ecmascript"><script>var x = 0.5</script>'
        '<state id="a"><transition cond="x == 0.5" target="a"/></state></scxml>\n'
    )
    assert types(result) == {"x": FLOAT64}
    assert not isinstance(result.chart.transitions[1].guard, Invalid)


def test_loose_dialects_loop_further(scxml: Any) -> None:
    assert scxml(chart("")).chart.capacities.microsteps == 1000


def test_the_queues_hold_what_one_handler_sends(scxml: Any) -> None:
    def chart(raises: int, sends: int) -> str:
        content = '<raise event="e"/>' * raises + '<send event="e"/>' * sends
        return (
            '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">'
            f'<state id="a"><onentry>{content}</onentry><transition event="e"/></state></scxml>'
        )

    few, many = scxml(chart(2, 3)).chart.capacities, scxml(chart(11, 20)).chart.capacities
    assert (few.internal, few.queue) == (8, 8)
    assert (many.internal, many.queue) == (11, 20)
