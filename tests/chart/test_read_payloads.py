"""Fields of events that only the host can post: known by being read, typed by their use."""

from __future__ import annotations

from typing import Any

import pytest

from fsmkit.chart.statements import Assign
from fsmkit.language import BOOL, FLOAT64, INT32, SYMBOL, Field, Type
from fsmkit.testing.conformance.expectations import configurations, ends_in
from fsmkit.testing.harness.harness import harness

DATA = """<data id="n" expr="0"/><data id="x" expr="0.5"/><data id="b" expr="false"/>
    <data id="s" expr="'on'"/>"""


def chart(transitions: str, data: str = DATA) -> str:
    return (
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M" '
        f'datamodel="ecmascript"><datamodel>{data}</datamodel>'
        f'<state id="a">{transitions}</state></scxml>\n'
    )


def fields(result: Any, event: str = "e") -> tuple[Field, ...]:
    return next(e.fields for e in result.chart.events if e.name == event)


def assigned(location: str, value: str) -> str:
    return f'<transition event="e"><assign location="{location}" expr="{value}"/></transition>'


@pytest.mark.parametrize(
    ("transition", "type_"),
    [
        (assigned("n", "_event.data.f"), INT32),
        (assigned("x", "_event.data.f"), FLOAT64),
        (assigned("b", "_event.data.f"), BOOL),
        (assigned("s", "_event.data.f"), SYMBOL),
        (assigned("b", "_event.data.f &lt; 30"), INT32),
        (assigned("b", "0.5 &lt; _event.data.f"), FLOAT64),
        (assigned("n", "n + _event.data.f"), INT32),
        (assigned("n", "-_event.data.f"), INT32),
        (assigned("n", "_event.data.f ? 1 : 2"), BOOL),
        (assigned("x", "b ? x : _event.data.f"), FLOAT64),
        ('<transition event="e" cond="_event.data.f"/>', BOOL),
        ('<transition event="e" cond="b &amp;&amp; !_event.data.f"/>', BOOL),
        ('<transition event="e" cond="_event.data.f == \'off\'"/>', SYMBOL),
        (
            '<transition event="e"><if cond="_event.data.f"><raise event="g"/></if></transition>',
            BOOL,
        ),
    ],
)
def test_the_use_tells_the_type(scxml: Any, transition: str, type_: Type) -> None:
    result = scxml(chart(transition))
    assert fields(result) == (Field("f", type_),)
    assert "content-not-evaluable" not in result.rules
    assert result.rules.count("assumed-field") == 1


def test_a_variable_may_be_typed_by_the_field_and_the_field_by_another_use(scxml: Any) -> None:
    data = '<data id="y"/>'
    read = assigned("y", "_event.data.f")
    assert scxml(chart(read, data)).chart.data[0].type == INT32
    result = scxml(chart(f'{read}<transition event="e" cond="_event.data.f == 0.5"/>', data))
    assert result.chart.data[0].type == FLOAT64
    assert fields(result) == (Field("f", FLOAT64),)
    (taken,) = result.chart.transitions[1].content
    assert isinstance(taken, Assign)


def test_what_nothing_types_is_a_number_and_all_that_are_matched_have_it(scxml: Any) -> None:
    sent = '<transition event="e g"><send event="h"><param name="p" expr="_event.data.f"/></send>'
    result = scxml(chart(f"{sent}</transition>"))
    assert fields(result) == fields(result, "g") == (Field("f", INT32),)
    assert fields(result, "h") == (Field("p", INT32),)
    assert result.rules.count("assumed-field") == 2


@pytest.mark.parametrize(
    "transition",
    [
        '<transition event="error.execution" cond="_event.data.f == 1"/>',
        '<transition event="*" cond="_event.data.f == 1"/>',
        '<transition event="e" cond="_event.data.f.g == 1"/>',
        '<transition event="e" cond="_event.data.f[0] == 1"/>',
        '<transition event="e" cond="_event.data.f() == 1"/>',
        '<transition event="e" cond="_event.data.f == 1"><raise event="e"/></transition>',
        '<transition event="e" cond="_event.data.f == "/>',
    ],
)
def test_what_the_chart_sends_itself_or_is_no_plain_field_stays_unknown(
    scxml: Any, transition: str
) -> None:
    result = scxml(chart(transition))
    assert "content-not-evaluable" in result.rules
    assert "assumed-field" not in result.rules


def test_an_id_with_a_space_is_told(scxml: Any) -> None:
    text = chart('<transition event="e" target="b c"/>').replace(
        "</state>", '</state><state id="b c"/>'
    )
    result = scxml(text)
    assert result.maybe is None
    messages = [d.message for d in result.found]
    assert messages[0].endswith("the id `b c` holds a space, and targets are separated by spaces")


# --- through the variables that take a field ------------------------------------------------------

TAKING = assigned("v", "_event.data.f")


def asked(condition: str) -> str:
    return f'<transition cond="{condition}" target="a"/>'


@pytest.mark.parametrize(
    ("more", "type_"),
    [
        (asked("v == 'OK'"), SYMBOL),
        (asked("'OK' != v"), SYMBOL),
        (asked("v &lt; 0.5"), FLOAT64),
        (asked("v &lt; 5"), INT32),
        (asked("!v"), BOOL),
        (asked("v") + asked("v &gt; 2"), INT32),
        (asked("v &gt; 2") + asked("v"), INT32),
        (asked("v") + asked("v == 'OK'"), SYMBOL),
        (assigned("w", "v") + asked("w == 'OK'"), SYMBOL),
        (assigned("w", "v") + assigned("u", "w") + asked("u == 'OK'"), SYMBOL),
        (assigned("w", "_event.data.f") + asked("w == 'OK'"), SYMBOL),
        (assigned("v", "'no'") + asked("v"), SYMBOL),
        (assigned("v", "0.5") + asked("v"), FLOAT64),
        ("", INT32),
    ],
)
@pytest.mark.parametrize("is_first", [True, False])
def test_the_uses_of_a_variable_type_the_field(
    scxml: Any, more: str, type_: Type, is_first: bool
) -> None:
    data = '<data id="v"/><data id="w"/><data id="u"/>'
    result = scxml(chart(more + TAKING if is_first else TAKING + more, data))
    assert fields(result) == (Field("f", type_),)
    assert result.chart.data[0].type == type_
    assert "content-not-evaluable" not in result.rules


def test_strings_with_numbers_are_strings_and_both_places_are_told(scxml: Any) -> None:
    more = '<transition event="e" cond="_event.data.f &lt; 5"/>'
    result = scxml(chart(more + '<transition event="e" cond="_event.data.f == \'x\'"/>'))
    assert fields(result) == (Field("f", SYMBOL),)
    told = result.one("assumed-field")
    assert [label.text for label in told.secondary] == ["used as `int32` here"]
    assert result.rules.count("content-not-evaluable") == 1


OTHER = TAKING.replace("<assign", "<raise event='i'/><assign") + (
    "<transition event='i' cond=\"v == 'OK'\" target='b'/>"
    "<transition event='i' cond=\"v != 'NO'\" target='c'/>"
)


@pytest.mark.external
@pytest.mark.parametrize(("posted", "state"), [("OK", "b"), ("NO", "a"), ("OTHER", "c")])
def test_a_string_that_nothing_names_is_unequal_to_all(scxml: Any, posted: str, state: str) -> None:
    text = chart(OTHER, '<data id="v"/>').replace(
        "</scxml>", '<state id="b"/><state id="c"/></scxml>'
    )
    machine = scxml(text).chart
    for runtime in ("interpreter", "python", "c", "pyext"):
        trace = harness(runtime).run(machine, ["start 0", f'post e "{posted}"', "run 0"])
        assert configurations(trace)[-1][1] == (state,), runtime


WHOLE = [
    ('<transition event="e" cond="_event.data == 3"/>', INT32),
    ('<transition event="e" cond="!(_event.data === 1.5)"/>', FLOAT64),
    ('<transition event="e" cond="_event.data"/>', BOOL),
    ('<transition event="e" cond="(_event.data) == \'on\'"/>', SYMBOL),
    (assigned("s", "_event.data"), SYMBOL),
    (assigned("n", "n + _event.data"), INT32),
    ('<transition event="e" cond="_event.data != null &amp;&amp; _event.data > 2"/>', INT32),
]


@pytest.mark.parametrize(("transition", "type_"), WHOLE)
def test_a_payload_of_the_host_may_be_one_value(scxml: Any, transition: str, type_: Type) -> None:
    result = scxml(chart(transition))
    assert fields(result) == (Field("data", type_),)
    assert "content-not-evaluable" not in result.rules
    assert "the payload of `e`" in result.one("assumed-field").message


@pytest.mark.parametrize(
    "transition",
    [
        '<transition event="e" cond="_event.data == other"/>',
        '<transition event="e" cond="_event.data == 1"><raise event="e"/></transition>',
        '<transition event="error.execution" cond="_event.data == 1"/>',
        '<transition event="e" cond="_event.data[0] == 1"/>',
    ],
)
def test_a_payload_of_fields_or_of_no_known_type_is_not_one_value(
    scxml: Any, transition: str
) -> None:
    result = scxml(chart(transition))
    assert "content-not-evaluable" in result.rules
    assert not any("payload" in d.message for d in result.found)


@pytest.mark.external
@pytest.mark.cc
def test_a_posted_value_is_compared(scxml: Any) -> None:
    accepting = chart('<transition event="e" cond="_event.data == 3" target="t"/>')
    made = scxml(accepting.replace("</scxml>", '<final id="t"/></scxml>')).chart
    for runtime in ("interpreter", "python", "c"):
        for value, is_done in ((2, False), (3, True)):
            trace = harness(runtime).run(made, ["start 0", "run 0", f"post e {value}", "run 0"])
            assert (ends_in(trace) == ("t",)) == is_done, (runtime, value)
