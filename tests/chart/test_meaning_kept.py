"""Charts of others keep their meaning: no place of them becomes an error that none was meant."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from devtools.runtimes import harness
from fsmkit.chart.loading import load_with_findings
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.language.binding.mathematics import evaluate
from fsmkit.language.binding.typing import parse_with_names
from fsmkit.runtime.session import Session
from fsmkit.testing.conformance.charts import replacement_causes
from fsmkit.testing.conformance.expectations import configurations, ends_in
from tests.chart.endings import endings

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M" datamodel="ecmascript">'
)
FINALS = '<final id="pass"/><final id="fail"/></scxml>\n'
SCRIPT = ["start 0", "run 0", "run 0", "run 5000"]
RUNTIMES = ("interpreter", "python", "c", "pyext")


def always(condition: str, data: str = "", entry: str = "") -> str:
    """Return a chart that passes at once where a condition holds."""
    return (
        f"{HEAD}<datamodel>{data}</datamodel><state id='s'><onentry>{entry}</onentry>"
        f"<transition cond=\"{condition}\" target='pass'/><transition target='fail'/></state>"
        f"{FINALS}"
    )


# --- In of a state that there is not -------------------------------------------------------------


@pytest.mark.external
@pytest.mark.parametrize("datamodel", ["ecmascript", "null"])
def test_no_state_of_that_name_is_active(scxml: Any, datamodel: str) -> None:
    text = always("!In('nosuch')" if datamodel == "ecmascript" else "In('s')")
    text = text.replace("<datamodel></datamodel>", "").replace('"ecmascript"', f'"{datamodel}"')
    result = scxml(text.replace("target='fail'", "cond=\"In('nosuch')\" target='fail'"))
    assert "content-not-evaluable" not in result.rules
    assert [d.severity.value for d in result.found if d.rule.name == "unknown-name"][:1] == [
        "warning"
    ]
    assert endings(result.chart, SCRIPT, RUNTIMES) == {("pass",)}


@pytest.mark.external
def test_a_history_is_never_active(scxml: Any) -> None:
    inner = (
        "<state id='c' initial='d'><history id='h'><transition target='d'/></history><state id='d'>"
        "<transition cond=\"In('h')\" target='fail'/>"
        "<transition cond=\"In('d') &amp;&amp; !In('h')\" target='pass'/></state></state>"
    )
    result = scxml(f"{HEAD}{inner}{FINALS}")
    assert result.rules.count("unknown-name") == 2
    assert endings(result.chart, SCRIPT, RUNTIMES) == {("pass",)}


# --- words of our language -----------------------------------------------------------------------


@pytest.mark.external
@pytest.mark.parametrize("word", ["not", "and", "or", "True", "False"])
def test_a_word_of_ours_is_a_name(scxml: Any, word: str) -> None:
    entry = '<assign location="{0}" expr="{0} + 1"/>'
    data = f'<data id="{word}" expr="1"/><data id="s_" expr="\'{word} and\'"/>'
    condition = f"{word} &gt; 1 &amp;&amp; ({word} == 2) &amp;&amp; s_ == '{word} and'"
    result = scxml(always(condition, data, entry.format(word)))
    assert "content-not-evaluable" not in result.rules
    assert endings(result.chart, SCRIPT, RUNTIMES) == {("pass",)}


def test_words_stay_operators_where_nothing_has_the_name(scxml: Any) -> None:
    data = '<data id="x" expr="true"/><data id="y" expr="false"/>'
    chart = scxml(always("x and not y", data)).chart
    assert endings(chart, SCRIPT) == {("pass",)}
    assert parse_with_names("a.not + 'not'", frozenset({"not"})) == parse_with_names(
        "a.not + 'not'", frozenset()
    )


# --- Math ----------------------------------------------------------------------------------------

FUNCTIONS = {
    "Math.floor(5.5)": 5,
    "Math.floor(-5.5)": -6,
    "Math.ceil(5.2)": 6,
    "Math.round(2.5)": 3,
    "Math.round(-2.5)": -2,
    "Math.trunc(-5.5)": -5,
    "Math.sign(-0.1)": -1,
    "Math.abs(-3)": 3,
    "Math.min(3, 1, 2)": 1,
    "Math.max(3, 1.5, 2)": 3,
    "Math.pow(2, 10)": 1024,
    "Math.pow(4, 0.5)": 2,
    "Math.pow(2, -1) * 4": 2,
    "Math.floor(n)": -7,
    "Math.sign(n)": -1,
    "Math.sign(n + 7)": 0,
    "Math.floor(n / 2)": -4,
    "Math.ceil(n / 2)": -3,
    "Math.ceil((n + 14) / 2)": 4,
    "Math.trunc(n / 2)": -3,
    "Math.abs(n)": 7,
}


@pytest.mark.parametrize(("text", "value"), FUNCTIONS.items())
def test_math_that_is_exact(scxml: Any, text: str, value: int) -> None:
    chart = scxml(always(f"{text} == {value}", '<data id="n" expr="-7"/>')).chart
    assert endings(chart, SCRIPT, RUNTIMES[:2]) == {("pass",)}


@pytest.mark.external
def test_math_in_all_runtimes(scxml: Any) -> None:
    text = " &amp;&amp; ".join(f"{text} == {value}" for text, value in FUNCTIONS.items())
    chart = scxml(always(text, '<data id="n" expr="-7"/>')).chart
    assert endings(chart, SCRIPT, RUNTIMES) == {("pass",)}


@pytest.mark.parametrize(
    "text", ["Math.pow(0, -1)", "Math.pow(-8, 0.3)", "Math.floor(1, 2)", "Math.sqrt(4)",
             "Math.pow(10.0, 400)", "Math.sign(x)"],
)  # fmt: skip
def test_what_is_no_number_or_not_exact_stays_an_error(scxml: Any, text: str) -> None:
    result = scxml(always(f"{text} == 1", '<data id="x" expr="0.5"/>'))
    assert "content-not-evaluable" in result.rules


def test_rounding_is_that_of_ecmascript() -> None:
    """The neighbours of one half, at which adding 0.5 and cutting goes wrong (ECMA-262)."""
    assert evaluate("round", [0.49999999999999994]) == 0
    assert evaluate("round", [4503599627370495.5]) == 4503599627370496
    assert evaluate("round", [-0.5]) == 0
    assert evaluate("pow", [3, 40]) == 3.0**40


# --- parameters of one name ----------------------------------------------------------------------

TWICE = '<param name="x" expr="2"/><param name="x_1" expr="9"/><param name="x" expr="3"/>'


@pytest.mark.external
def test_two_params_of_one_name_are_two_fields(scxml: Any) -> None:
    text = (
        f"{HEAD}<datamodel><data id='y' expr='5'/></datamodel>"
        f"<state id='s'><onentry><send event='e'>{TWICE}</send>"
        f"<send event='f' namelist='y'><param name='y' expr='6'/></send></onentry>"
        "<transition event='e' cond='_event.data.x == 3' target='t'/>"
        "<transition event='*' target='fail'/></state>"
        "<state id='t'><transition event='f' cond='_event.data.y == 6' target='u'/>"
        "<transition event='*' target='fail'/></state>"
        f"<state id='u'><state id='v'><transition target='w'/></state><final id='w'>"
        f"<donedata>{TWICE}</donedata></final>"
        "<transition event='done.state.u' cond='_event.data.x == 3' target='pass'/>"
        f"<transition event='*' target='fail'/></state>{FINALS}"
    )
    result = scxml(text)
    assert replacement_causes(result.found) == ()
    event = result.chart.events[result.chart.event_index["e"]]
    assert [field.name for field in event.fields] == ["x_2", "x_1", "x"]
    for runtime in RUNTIMES:
        trace = harness(runtime).run(result.chart, SCRIPT)
        assert ends_in(trace) == ("pass",), runtime
        assert {"send e 2 9 3", "send f 5 6"} <= set(trace)


# --- the type of an event ------------------------------------------------------------------------

TYPED = f"""{HEAD}<datamodel><data id="t"/><data id="u" expr="'none'"/></datamodel>
  <state id="a">
    <onentry>
      <assign location="u" expr="_event.type"/><raise event="foo"/><send event="foo"/>
    </onentry>
    <transition event="foo" cond="u != ''" target="fail"/>
    <transition event="foo" cond="_event.type == 'external'" target="fail"/>
    <transition event="foo" cond="_event.type == 'internal'" target="b">
      <assign location="t" expr="_event.type"/>
    </transition>
  </state>
  <state id="b">
    <transition event="*" cond="t == 'internal' &amp;&amp; _event.type == 'external'" target="c">
      <assign location="t" expr="_event.type"/><script>nowhere()</script>
    </transition>
  </state>
  <state id="c">
    <onentry><assign location="u" expr="_event.type"/></onentry>
    <transition event="foo error" cond="_event.type == 'platform' &amp;&amp; u == t" target="d">
      <send event="bar" delay="1s"/><raise event="bar"/>
      <send event="foo" target="#_internal"/><send event="foo"/>
    </transition>
  </state>
  <state id="d">
    <transition event="bar" cond="_event.type == 'internal'" target="e"/>
  </state>
  <state id="e">
    <transition event="foo bar" cond="_event.type === 'internal'" target="f"/>
  </state>
  <state id="f">
    <transition event="foo" cond="_event.type === 'internal'" target="fail"/>
    <transition event="foo" target="g"/>
  </state>
  <state id="g">
    <transition event="bar" cond="_event.type == 'external'" target="pass"/>
    <transition event="bar" target="fail"/>
  </state>{FINALS}"""


@pytest.mark.external
@pytest.mark.parametrize("runtime", [*RUNTIMES, "c-size"])
def test_the_type_goes_with_each_event(scxml: Any, runtime: str) -> None:
    result = scxml(TYPED)
    assert [cause for cause in replacement_causes(result.found) if "not there" not in cause] == []
    script = ["start 0", "save", "restore 0", "run 0", "save", "restore 0", "run 0", "run 2000"]
    trace = harness(runtime).run(result.chart, script)
    assert ends_in(trace) == ("pass",), runtime
    reference = harness("interpreter").run(result.chart, script)
    assert trace == reference


def test_an_event_is_two_only_where_its_type_is_asked_and_senders_disagree(scxml: Any) -> None:
    def events(text: str) -> list[str]:
        return [e.name for e in scxml(text).chart.events if e.name in ("foo", "bar")]

    assert sorted(events(TYPED)) == ["bar", "bar", "foo", "foo"]
    assert sorted(events(TYPED.replace("_event.type", "_event.name"))) == ["bar", "foo"]
    only_sent = TYPED.replace('<raise event="bar"/>', "").replace('<raise event="foo"/>', "")
    assert sorted(events(only_sent.replace(' target="#_internal"', ""))) == ["bar", "foo"]


@pytest.mark.external
def test_what_the_host_posts_is_external(scxml: Any) -> None:
    text = (
        f"{HEAD}<state id='a'><onentry><raise event='i'/></onentry>"
        "<transition event='i'><raise event='foo'/><send event='bar' delay='9s'/></transition>"
        "<transition event='foo' cond='_event.type == &quot;internal&quot;' target='b'/></state>"
        "<state id='b'><transition event='never'><send event='foo'/></transition>"
        "<transition event='foo' cond='_event.type == &quot;external&quot;' target='pass'/>"
        f"</state>{FINALS}"
    )
    chart = scxml(text).chart
    for runtime in (*RUNTIMES, "c-size"):
        trace = harness(runtime).run(chart, ["start 0", "post foo", "run 0"])
        assert ends_in(trace) == ("pass",), runtime


# --- what an invoked chart sends to its invoker --------------------------------------------------


@pytest.mark.external
def test_an_event_for_the_invoker_is_used(tmp_path: Path) -> None:
    inner = (
        HEAD.replace('"M"', '"Inner"')
        + "<state id='t'><onentry><send target='#_parent' event='turned'/></onentry></state>"
        + "</scxml>"
    )
    path = tmp_path / "m.scxml"
    path.write_text(
        f"{HEAD}<state id='w'><invoke id='m'><content>{inner}</content></invoke>"
        f"<transition event='turned' target='pass'/></state>{FINALS}",
        encoding="utf-8",
    )
    findings = Findings()
    chart = load_with_findings(path, findings)
    assert "unused-event" not in [d.rule.name for d in findings]
    assert endings(chart, SCRIPT, RUNTIMES[:3]) == {("pass",)}


# --- files ---------------------------------------------------------------------------------------

INVOKING = f'{HEAD}<state id="s"><invoke src="{{}}"/></state></scxml>'
INVOKED = f'{HEAD}<state id="t"/></scxml>'


@pytest.fixture
def folders(tmp_path: Path) -> Path:
    (tmp_path / "charts/below").mkdir(parents=True)
    for name in ("outside.scxml", "charts/beside.scxml", "charts/below/deep.scxml"):
        (tmp_path / name).write_text(INVOKED, encoding="utf-8")
    (tmp_path / "charts/link.scxml").symlink_to("../outside.scxml")
    (tmp_path / "charts/loop.scxml").symlink_to("loop.scxml")
    return tmp_path


def load_invoking(folders: Path, src: str, datamodel: str = "ecmascript") -> tuple[int, list[str]]:
    path = folders / "charts/main.scxml"
    text = INVOKING.format(src).replace("ecmascript", datamodel)
    path.write_text(text, encoding="utf-8")
    findings = Findings()
    chart = load_with_findings(path, findings)
    return len(chart.invocations), [d.message for d in findings]


@pytest.mark.parametrize("src", ["beside.scxml", "file:beside.scxml", "./below/deep.scxml"])
def test_a_chart_in_the_folder_is_invoked(folders: Path, src: str) -> None:
    assert load_invoking(folders, src)[0] == 1


@pytest.mark.parametrize(
    "src",
    ["../outside.scxml", "file:../outside.scxml", "link.scxml", "loop.scxml", "{}/outside.scxml",
     "file://{}/outside.scxml", "/etc/passwd", "below/../../outside.scxml"],
)  # fmt: skip
def test_a_chart_outside_of_the_folder_is_not_read(folders: Path, src: str) -> None:
    named = src.format(folders)
    invoked, messages = load_invoking(folders, named)
    assert invoked == 0
    assert any(f"`{named}` leaves the folder" in message for message in messages) or src[0] == "l"
    (folders / "charts/beside.scxml").write_text(
        INVOKED.replace("ecmascript", "fsmkit"), encoding="utf-8"
    )
    with pytest.raises(FsmkitError):
        load_invoking(folders, named, "fsmkit")


def test_a_chart_behind_a_link_is_in_its_own_folder(folders: Path) -> None:
    load_invoking(folders, "beside.scxml")
    (folders / "linked.scxml").symlink_to("charts/main.scxml")
    chart = load_with_findings(folders / "linked.scxml", Findings())
    assert len(chart.invocations) == 1
    assert configurations(harness("interpreter").run(chart, ["start 0"]))


# --- strictly -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "inside",
    ['<invoke src="absent.scxml"/>', '<onentry><send event="e" target="#_b"/></onentry>',
     '<onentry><send event="e" type="DOM"/></onentry>', '<transition cond="nosuch"/>',
     '<onentry><assign location="x" expr="nosuch"/></onentry>', "<onentry><foo/></onentry>",
     '<datamodel><data id="w" expr="new Date()"/></datamodel>',
     '<onentry><script>f(</script></onentry>'],
)  # fmt: skip
def test_what_is_replaced_is_an_error_when_read_strictly(tmp_path: Path, inside: str) -> None:
    path = tmp_path / "m.scxml"
    path.write_text(f"{HEAD}<state id='s'>{inside}</state></scxml>", encoding="utf-8")
    findings = Findings()
    load_with_findings(path, findings)
    assert len(replacement_causes(findings)) >= 1
    with pytest.raises(FsmkitError):
        load_with_findings(path, Findings(), strict=True)


# --- events below a prefix ------------------------------------------------------------------------

PREFIX = (
    '{}<state id="a"><transition event="digit" cond="_event.name == {}" target="pass"/></state>'
    + FINALS
)


@pytest.mark.external
def test_what_lies_below_a_prefix_can_be_declared_and_posted(scxml: Any) -> None:
    undeclared = scxml(PREFIX.format(HEAD, "'digit.1.x'")).chart
    with pytest.raises(FsmkitError) as refused:
        harness("interpreter").run(undeclared, ["start 0", "post digit.1.x", "run 0"])
    (told,) = refused.value.diagnostics
    assert told.help is not None
    assert "post `digit`, or declare" in told.help
    session = Session(undeclared)
    session.start()
    with pytest.raises(FsmkitError) as unknown:
        session.post("digit.1.x")
    assert unknown.value.diagnostics[0].help == told.help
    element = told.help.split("`")[3]
    assert element.startswith("<fk:event")
    head = HEAD.replace("<scxml", '<scxml xmlns:fk="urn:fsmkit:scxml"') + element
    declared = scxml(PREFIX.format(head, "'digit.1.x'")).chart
    for runtime in RUNTIMES[:3]:
        trace = harness(runtime).run(declared, ["start 0", "post digit.1.x", "run 0"])
        assert ends_in(trace) == ("pass",), runtime
