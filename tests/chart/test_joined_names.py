"""Names of events that are joined from the name of the event at hand are known when compiling."""

from __future__ import annotations

from pathlib import Path
from time import process_time
from typing import Any

import pytest

from devtools.runtimes import harness
from fsmkit.chart.loading import load_with_findings
from fsmkit.diagnostics import Findings
from fsmkit.testing.conformance.charts import replacement_causes
from tests.chart.endings import endings

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M" datamodel="ecmascript"'
    "{}>"
)
FINALS = '<final id="ok"/><final id="bad"/></scxml>'
RUNTIMES = ("interpreter", "c", "c-size", "pyext", "python")


def chart_of(scxml: Any, inside: str, head: str = "", *, warned: bool = False) -> Any:
    """Return a chart of these states, in which no place becomes an error."""
    result = scxml(HEAD.format(head) + inside + FINALS)
    assert ("content-not-evaluable" in result.rules) == warned, [d.message for d in result.found]
    return result.chart


def invoking(folder: Path, inside: str) -> Any:
    """Return a chart of these states with the charts that it invokes."""
    path = folder / "m.scxml"
    path.write_text(HEAD.format("") + inside + FINALS, encoding="utf-8")
    findings = Findings()
    chart = load_with_findings(path, findings)
    assert not replacement_causes(findings)
    return chart


def names(chart: Any) -> set[str]:
    """Return the names of the events that are not the platform's."""
    own = {event.name for event in chart.events}
    return {name for name in own if not name.startswith(("error.", "done."))}


def ends(chart: Any, *posted: str, runtimes: tuple[str, ...] = RUNTIMES) -> set[Any]:
    """Return where a chart ends when these events are posted, on every runtime."""
    script = ["start 0", "run 0", *(line for name in posted for line in (f"post {name}", "run 0"))]
    return endings(chart, script, runtimes)


SENDEV = (
    '<state id="a"><transition event="go.*" target="b"/></state><state id="b"><onentry>'
    "<send eventexpr=\"'sub.' + _event.name\"/></onentry>"
    '<transition event="sub.go.x" target="ok"/><transition event="sub" target="bad"/>'
    '<transition event="error" target="bad"/></state>'
)


@pytest.mark.external
def test_an_event_is_sent_by_its_joined_name(scxml: Any) -> None:
    chart = chart_of(scxml, SENDEV)
    assert names(chart) == {"go", "go.x", "sub", "sub.go", "sub.go.x"}
    assert ends(chart, "go.x") == {("ok",)}
    assert ends(chart, "go") == {("bad",)}


@pytest.mark.external
def test_what_no_descriptor_matches_is_not_sent(scxml: Any) -> None:
    text = SENDEV.replace('<transition event="sub" target="bad"/>', "").replace(
        'event="sub.go.x"', 'event="other"'
    )
    chart = chart_of(scxml, text)
    assert names(chart) == {"go", "other"}
    assert ends(chart, "go", "other") == {("ok",)}


@pytest.mark.external
def test_a_prefix_matches_what_is_joined(scxml: Any) -> None:
    text = (
        '<state id="a"><transition event="go" target="b"/><transition event="stop" target="b"/>'
        "</state><state id=\"b\"><onentry><send eventexpr=\"'sub.' + _event.name + '.done'\"/>"
        '</onentry><transition event="sub.*" cond="_event.name == \'sub.go.done\'" target="ok"/>'
        '<transition event="sub" target="bad"/></state>'
    )
    chart = chart_of(scxml, text)
    assert {"sub.go.done", "sub.stop.done"} <= names(chart)
    assert ends(chart, "go") == {("ok",)}
    assert ends(chart, "stop") == {("bad",)}


@pytest.mark.external
def test_what_is_joined_is_joined_again(scxml: Any) -> None:
    text = (
        '<state id="a"><transition event="x" target="b"/></state><state id="b"><onentry>'
        "<send eventexpr=\"_event.name + '.y'\"/></onentry>"
        '<transition event="x.y.y.y" target="ok"/>'
        '<transition event="x.y x.y.y"><send eventexpr="_event.name + \'.y\'"/></transition>'
        "</state>"
    )
    # Every name below `x.y.y.y` is heard: each is joined to a longer one until the chart ends.
    endless = scxml(HEAD.format("") + text + FINALS)
    (found,) = {d.message for d in endless.found if d.rule.name == "content-not-evaluable"}
    assert found.endswith("`_event.name + '.y'` joins more than 256 names of events")
    bounded = text.replace('event="x.y x.y.y"', 'event="q.1 q.q.1"').replace(
        "\"_event.name + '.y'\"/></transition>", "\"'q.' + _event.name\"/></transition>"
    )
    bounded = bounded.replace("\"_event.name + '.y'\"/></onentry>", "\"'q.1'\"/></onentry>")
    bounded = bounded.replace('event="x.y.y.y"', 'event="q.q.q.1"')
    chart = chart_of(scxml, bounded)
    assert names(chart) == {"x", "q.1", "q.q.1", "q.q.q.1"}
    assert ends(chart, "x") == {("ok",)}


@pytest.mark.external
def test_what_is_joined_without_end_is_said_at_its_place_and_nothing_else_is_lost(
    scxml: Any,
) -> None:
    text = SENDEV.replace(
        '<transition event="error"',
        '<transition event="sub"><send eventexpr="\'sub.\' + _event.name"/></transition>'
        '<transition event="error"',
    ).replace('<transition event="sub" target="bad"/>', "")
    result = scxml(HEAD.format("") + text + FINALS)
    (found,) = [d for d in result.found if d.rule.name == "content-not-evaluable"]
    assert "joins more than 256 names of events" in found.message
    assert "not-known-when-compiling" not in result.errors
    assert ends(result.chart, "go.x") == {("ok",)}
    strictly = scxml(HEAD.format("") + text + FINALS, strict=True)
    assert strictly.errors == ["unreadable-content"]


@pytest.mark.external
def test_without_an_event_there_is_no_name(scxml: Any) -> None:
    text = (
        '<state id="a"><onentry><send eventexpr="\'sub.\' + _event.name"/></onentry>'
        '<transition event="error.execution" target="ok"/><transition event="sub" target="bad"/>'
        "</state>"
    )
    assert ends(chart_of(scxml, text, warned=True)) == {("ok",)}


@pytest.mark.external
@pytest.mark.parametrize(
    ("expression", "event"),
    [
        ("'a' + 'b'", "ab"),
        ("n == 1 ? 'a' : 'b'", "a"),
        ("n ? 'x.' + _event.name : 'b'", "x.go"),
        ("n &gt; 1 ? 'a' : n &gt; 0 ? 'b' : 'c'", "b"),
        ("'x.' + (n != 1 ? 'a' : 'b')", "x.b"),
        ("prefix + _event.name", "x.go"),
        ("_name + '.' + _event.name", "M.go"),
        ("_event.name + _event.name", "gogo"),
    ],
)
def test_expressions_of_strings_that_are_known(scxml: Any, expression: str, event: str) -> None:
    text = (
        '<datamodel><data id="n" expr="1"/><data id="prefix" expr="\'x.\'"/></datamodel>'
        '<state id="a"><transition event="go" target="b"/></state>'
        f'<state id="b"><onentry><send eventexpr="{expression}"/></onentry>'
        f'<transition event="{event}" target="ok"/><transition event="*" target="bad"/></state>'
    )
    chart = chart_of(scxml, text)
    assert ends(chart, "go", runtimes=("interpreter", "python", "c")) == {("ok",)}


@pytest.mark.external
def test_what_goes_to_the_invoker_is_sent_under_every_name(tmp_path: Path) -> None:
    text = (
        '<state id="s"><invoke id="c"><content><scxml version="1.0" name="C"'
        ' datamodel="ecmascript"><state id="i"><transition event="ping.*">'
        '<send eventexpr="\'re.\' + _event.name" target="#_parent"/></transition></state></scxml>'
        '</content></invoke><transition event="go"><send event="ping.one" target="#_c"/>'
        '</transition><transition event="stay"><send event="ping.two" target="#_c"/></transition>'
        '<transition event="re.ping.one" target="ok"/><transition event="re" target="bad"/></state>'
    )
    chart = invoking(tmp_path, text)
    assert {"re.ping.one", "re.ping.two"} <= names(chart)
    assert ends(chart, "go") == {("ok",)}
    assert ends(chart, "stay") == {("bad",)}


@pytest.mark.external
def test_an_event_that_a_child_sends_is_joined_to_another(tmp_path: Path) -> None:
    text = (
        '<state id="s"><invoke id="c"><content><scxml version="1.0" name="C"'
        ' datamodel="ecmascript"><state id="i"><onentry><send event="told.y" target="#_parent"/>'
        "</onentry></state></scxml></content></invoke>"
        '<transition event="told"><send eventexpr="\'got.\' + _event.name"/></transition>'
        '<transition event="got.told.y" target="ok"/><transition event="got" target="bad"/></state>'
    )
    assert ends(invoking(tmp_path, text)) == {("ok",)}


def test_a_declared_event_goes_out(scxml: Any) -> None:
    declared = (
        '<fk:event direction="out" signature="said.go"/><fk:event direction="in" signature="go"/>'
    )
    text = (
        f'{declared}<state id="a"><transition event="go">'
        "<send eventexpr=\"'said.' + _event.name\"/></transition></state>"
    )
    chart = chart_of(scxml, text, ' xmlns:fk="urn:fsmkit:scxml"')
    trace = harness("interpreter").run(chart, ["start 0", "post go", "run 0"])
    assert "said.go" in repr(trace)


def test_a_hundred_joins_take_less_than_a_second(scxml: Any) -> None:
    states = "".join(
        f'<state id="s{k}"><onentry><send eventexpr="\'e{k}.\' + _event.name"/></onentry>'
        f'<transition event="e{k}.go.*" target="s{k + 1}"/><transition event="go.{k}"'
        f' target="s0"/></state>'
        for k in range(100)
    )
    began = process_time()
    chart = chart_of(scxml, states + '<state id="s100"/>', warned=True)
    assert process_time() - began < 2.0
    assert len(chart.events) > 200
