"""Names of events that are joined of a number are known when compiling, if the number's few are."""

from __future__ import annotations

from typing import Any

import pytest

from fsmkit.chart.ecmascript.known_numbers import MOST_NUMBERS
from tests.chart.endings import endings

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0"'
    ' name="M" datamodel="ecmascript"><datamodel>{}</datamodel>'
)
FINALS = '<final id="ok"/><final id="bad"/></scxml>'
RUNTIMES = ("interpreter", "c", "python")
SCRIPT = ["start 0", "run 0", "run 0", "run 0", "run 0"]
TOLD = "content-not-evaluable"


def chart(data: str, entry: str, event: str, cond: str = "true") -> str:
    """Return a chart that ends in `ok` by this event, and in `bad` by an error."""
    return (
        f'{HEAD.format(data)}<state id="s"><onentry>{entry}</onentry>'
        f'<transition event="{event}" cond="{cond}" target="ok"/>'
        f'<transition event="error" target="bad"/></state>{FINALS}'
    )


LOOP = (
    '<foreach array="list" item="each" index="at">'
    '<send eventexpr="\'input.\' + at"><content expr="each"/></send></foreach>'
)
LIST = '<data id="list" expr="[7, 8, 9]"/>'


@pytest.mark.external
@pytest.mark.cc
@pytest.mark.parametrize(("number", "value"), [(0, 7), (1, 8), (2, 9)])
def test_the_index_of_a_loop(scxml: Any, number: int, value: int) -> None:
    result = scxml(chart(LIST, LOOP, f"input.{number}", f"_event.data == {value}"))
    assert TOLD not in result.rules
    assert endings(result.chart, SCRIPT, RUNTIMES if number == 2 else RUNTIMES[:1]) == {("ok",)}


JOINED = [
    ("'e' + n", "e2"),
    ("'e.' + n + '.x'", "e.2.x"),
    ("'e' + 1 + n", "e12"),
    ("'e' + (n ? 1 : n)", "e1"),
    ("m + 'e'", "-1e"),
    ("'e' + m", "e-1"),
]


@pytest.mark.parametrize(("expression", "event"), JOINED)
def test_a_declared_range(scxml: Any, expression: str, event: str) -> None:
    data = '<data id="n" fk:type="0..3" expr="2"/><data id="m" fk:type="-2..2" expr="-1"/>'
    result = scxml(chart(data, f'<send eventexpr="{expression}"/>', event))
    assert TOLD not in result.rules
    assert endings(result.chart, SCRIPT) == {("ok",)}


@pytest.mark.parametrize("most", [MOST_NUMBERS, MOST_NUMBERS + 1])
def test_as_many_numbers_as_are_told_apart(scxml: Any, most: int) -> None:
    data = f'<data id="n" fk:type="1..{most}" expr="5"/>'
    result = scxml(chart(data, "<send eventexpr=\"'e' + n\"/>", "e5"))
    assert (TOLD in result.rules) == (most > MOST_NUMBERS)


NOT_KNOWN = [
    ("a sum", LIST, LOOP.replace("'input.' + at", "at + each + 'x'")),
    ("any number", '<data id="n" expr="2"/>', "<send eventexpr=\"'e' + n\"/>"),
    ("an element", LIST, LOOP.replace("+ at", "+ each")),
    ("also assigned", LIST, LOOP + '<assign location="at" expr="each"/>'),
]


@pytest.mark.parametrize(("data", "entry"), [row[1:] for row in NOT_KNOWN])
def test_other_numbers_are_told(scxml: Any, data: str, entry: str) -> None:
    entry += '<assign location="n" expr="n + 1"/>' if '"n"' in data else ""
    assert TOLD in scxml(chart(data, entry, "e2")).rules


def test_what_the_host_writes_is_not_known(scxml: Any) -> None:
    text = chart("", "<send eventexpr=\"'e' + n\"/>", "e2")
    for declared, is_told in (("int32", True), ("0..3", False)):
        given = f'<datamodel><fk:input id="n" type="{declared}"/>'
        assert (TOLD in scxml(text.replace("<datamodel>", given)).rules) == is_told
