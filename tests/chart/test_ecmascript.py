"""What only ECMAScript says: it is decided when compiling, so that every runtime agrees."""

from __future__ import annotations

from typing import Any

import pytest

from fsmkit.chart.statements import Send
from fsmkit.language import INT32, SYMBOL
from tests.chart.endings import endings

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="M" datamodel="ecmascript">'
)
FINALS = '<final id="pass"/><final id="fail"/></scxml>\n'
SCRIPT = ["start 0", "run 0", "run 0", "run 5000"]
RUNTIMES = ("interpreter", "python", "c")


def types(result: Any) -> dict[str, object]:
    return {d.name: d.type for d in result.chart.data}


def asking(condition: str, data: str = "", entry: str = "") -> str:
    """Return a chart that passes where a condition holds for the event `go`, raised or sent."""
    return (
        f"{HEAD}<datamodel>{data}</datamodel>"
        f'<state id="s"><onentry>{entry or "<raise event=" + chr(34) + "go" + chr(34) + "/>"}'
        f'</onentry><transition event="go" cond="{condition}" target="pass"/>'
        f'<transition event="*" target="fail"/></state>{FINALS}'
    )


N = '<data id="n" expr="3"/><data id="x" expr="0.5"/><data id="s" expr="\'on\'"/><data id="u"/>'
SENT = '<send event="go"><content>{}</content></send>'

HOLD = [
    ("n &amp;&amp; x &amp;&amp; s", N, ""),
    ("!(n - 3)", N, ""),
    ("!''", "", ""),
    ("typeof n === 'number' &amp;&amp; typeof s == 'string'", N, ""),
    ("typeof u === 'undefined' &amp;&amp; u == null &amp;&amp; n != undefined", N, ""),
    ("typeof nowhere === 'undefined'", "", ""),
    ("u !== undefined", N, '<assign location="u" expr="1"/><raise event="go"/>'),
    ("l instanceof Array", '<data id="l" expr="[1, 2]"/>', ""),
    ("'origin' in _event", "", ""),
    ("typeof _event === 'object' &amp;&amp; typeof _ioprocessors === 'object'", "", ""),
    ("_name == 'M' &amp;&amp; _sessionid", "", ""),
    ("_event.type == 'internal' &amp;&amp; typeof _event.origin === 'undefined'", "", ""),
    ("_event.type == 'external' &amp;&amp; _event.origin == '#_scxml_M'", "", '<send event="go"/>'),
    ("Math.pow(n, 3) === 27", N, ""),
    ("_event.data === 21", "", SENT.format(21)),
    ("_event.data == 'two words'", "", SENT.format(" two\n  words ")),
    ("_event.data['size'] == 27", "", SENT.format('{"name": "bar", "size": 27}')),
    ("typeof _event.data === 'undefined'", "", '<send event="go"/>'),
]


@pytest.mark.parametrize(("condition", "data", "entry"), HOLD)
def test_conditions_that_hold(scxml: Any, condition: str, data: str, entry: str) -> None:
    chart = scxml(asking(condition, data, entry)).chart
    assert endings(chart, SCRIPT, RUNTIMES[:2]) == {("pass",)}


@pytest.mark.parametrize(("condition", "data", "entry"), HOLD)
def test_their_negations_fail(scxml: Any, condition: str, data: str, entry: str) -> None:
    chart = scxml(asking(f"!({condition})", data, entry)).chart
    assert endings(chart, SCRIPT) == {("fail",)}


LATER = '<send event="late" id="one" delay="1s"/><send event="go" delay="2s"/>'
CHOSEN = """<onentry><assign location="v" expr="{}"/>{}</onentry>"""


@pytest.mark.external
@pytest.mark.parametrize(
    ("value", "content"),
    [
        ("'go'", '<send eventexpr="v"/>'),
        ("'#_internal'", '<send event="go" targetexpr="v"/>'),
        ("'2s'", '<send event="late" delay="3s"/><send event="go" delayexpr="v"/>'),
        (
            "'one'",
            LATER + '<cancel sendidexpr="v"/>',
        ),
    ],
)
def test_attributes_from_variables(scxml: Any, value: str, content: str) -> None:
    chart = scxml(
        f"""{HEAD}<datamodel><data id="v" expr="'late'"/></datamodel>"""
        f'<state id="s">{CHOSEN.format(value, content)}'
        '<transition event="go" target="pass"/><transition event="*" target="fail"/></state>'
        f"{FINALS}"
    ).chart
    assert endings(chart, SCRIPT, RUNTIMES) == {("pass",)}


def test_a_number_that_is_only_a_placeholder(scxml: Any) -> None:
    entry = '<assign location="v" expr="\'scxml\'"/><send event="go" typeexpr="v"/>'
    result = scxml(asking("true", '<data id="v" expr="27"/>', entry))
    assert types(result) == {"v": SYMBOL}
    assert endings(result.chart, SCRIPT) == {("pass",)}
    read = scxml(asking("v != 27", '<data id="v" expr="27"/>', entry))
    assert types(read) == {"v": INT32}


def test_a_variable_given_anything_else_is_told(scxml: Any) -> None:
    data = '<data id="v" expr="\'go\'"/>'
    entry = '<assign location="v" expr="_event.name"/><send eventexpr="v"/>'
    result = scxml(asking("true", data, entry))
    assert "computed at run time" in result.one("content-not-evaluable").message


@pytest.mark.parametrize("name", ["_name", "_sessionid", "_ioprocessors", "_event"])
def test_system_variables_cannot_be_assigned(scxml: Any, name: str) -> None:
    entry = f'<assign location="{name}" expr="1"/>'
    text = asking("true", "", entry).replace('event="go"', 'event="error.execution"')
    chart = scxml(text).chart
    assert endings(chart, SCRIPT) == {("pass",)}


@pytest.mark.external
def test_an_event_is_kept_as_its_name(scxml: Any) -> None:
    result = scxml(
        f'{HEAD}<datamodel><data id="v"/><data id="w"/></datamodel><state id="s"><onentry>'
        '<raise event="go"/><raise event="other"/><assign location="w" expr="_ioprocessors"/>'
        '</onentry><transition event="go" target="t"><assign location="v" expr="_event"/>'
        '<assign location="_event" expr="27"/></transition></state><state id="t">'
        '<transition event="other" cond="v != _event &amp;&amp; w == _ioprocessors" target="pass"/>'
        '<transition cond="v != _event" target="fail"/>'
        f'<transition event="other" target="fail"/></state>{FINALS}'
    )
    assert result.rules.count("event-as-name") == 3
    assert types(result) == {"v": SYMBOL, "w": SYMBOL}
    assert endings(result.chart, SCRIPT, RUNTIMES) == {("pass",)}


SKIPPED = '<assign location="skipped" expr="false"/>'
BAD = '<send event="x" target="nowhere" {}/>' + SKIPPED
ONE = BAD.format('id="one"')
IDS = [
    (ONE, "_event.sendid == 'one'"),
    (BAD.format('idlocation="v"'), "_event.sendid == v &amp;&amp; v != ''"),
    (BAD.format('id="one" targetexpr="nothing"'), "_event.sendid == 'one'"),
    (BAD.format(""), "typeof _event.sendid === 'undefined'"),
    ('<send event="x" id="one" type="http://nowhere"/>' + SKIPPED, "_event.sendid == 'one'"),
    ('<send event="x" id="one" target="#_nobody"/>', "_event.sendid == 'one'"),
    ('<assign location="n" expr="1 / 0 | 0"/>' + SKIPPED, "_event.sendid == undefined"),
    (f'<foreach item="i" array="l">{ONE}</foreach>{SKIPPED}', "_event.sendid == 'one'"),
    (f'<if cond="n == 1">{ONE}</if>{SKIPPED}', "_event.sendid == 'one'"),
    ('<raise event="error.execution"/>', "!_event.sendid"),
]


@pytest.mark.external
@pytest.mark.parametrize(("content", "condition"), IDS)
def test_the_id_of_what_could_not_be_sent(scxml: Any, content: str, condition: str) -> None:
    error = "communication" if "nobody" in content else "execution"
    chart = scxml(
        f'{HEAD}<datamodel><data id="v"/><data id="n" expr="1"/><data id="l" expr="[1, 2]"/>'
        f'<data id="skipped" expr="true"/></datamodel><state id="s"><onentry>{content}</onentry>'
        f'<transition event="error.{error}" cond="{condition} &amp;&amp; skipped" target="t"/>'
        '<transition event="*" target="fail"/></state>'
        '<state id="t"><onentry><send event="two" id="two"/></onentry>'
        '<transition event="two" cond="_event.sendid == \'two\'" target="pass"/>'
        f'<transition event="*" target="fail"/></state>{FINALS}'
    ).chart
    assert endings(chart, SCRIPT, RUNTIMES) == {("pass",)}


@pytest.mark.external
def test_an_id_that_is_made_can_be_cancelled(scxml: Any) -> None:
    chart = scxml(
        f'{HEAD}<datamodel><data id="v"/></datamodel><state id="s"><onentry>'
        '<send event="late" idlocation="v" delay="1s"/><send event="go" delay="2s"/>'
        '<cancel sendidexpr="v"/></onentry><transition event="go" target="pass"/>'
        f'<transition event="*" target="fail"/></state>{FINALS}'
    ).chart
    assert endings(chart, SCRIPT, RUNTIMES) == {("pass",)}


def test_ids_that_are_made_are_running_numbers(scxml: Any) -> None:
    """They depend on neither the layout nor the notation, and are nobody else's."""
    made = '<send event="go" idlocation="v" delay="{}s"/>'
    texts = [
        f'{HEAD}<datamodel><data id="v"/></datamodel><state id="s"><onentry>{made.format(1)}{gap}'
        f'<send event="go" id="send.2"/>{made.format(3)}</onentry>'
        f'<transition event="go" cond="v == \'send.3\'" target="pass"/></state>{FINALS}'
        for gap in ("", "<!-- a comment -->\n\n")
    ]
    first, second = (scxml(text).chart for text in texts)
    assert first == second
    assert [send.id for send in first.states[1].on_entry[0] if isinstance(send, Send)] == [
        "send.1", "send.2", "send.3"
    ]  # fmt: skip
    assert endings(first, SCRIPT) == {("pass",)}


JOINED = '<data id="v" expr="\'#_scxml_\'"/><data id="w" expr="{}"/>'


@pytest.mark.external
@pytest.mark.parametrize(
    ("joining", "target", "rest"),
    [
        ("v + w", "v", "_sessionid"),
        ("v + ('' + w)", "v", "'M'"),
        ("'#_' + 'internal'", "v", "1"),
        ("v", "'#_scxml_' + w", "_sessionid"),
        ("v", "'#_scxml_' + _sessionid", "1"),
    ],
)
def test_strings_are_joined_when_compiling(
    scxml: Any, joining: str, target: str, rest: str
) -> None:
    entry = f'<assign location="v" expr="{joining}"/><send event="go" targetexpr="{target}"/>'
    chart = scxml(asking("true", JOINED.format(rest), entry)).chart
    assert endings(chart, SCRIPT, RUNTIMES) == {("pass",)}


@pytest.mark.external
def test_a_join_of_several_values_is_a_choice(scxml: Any) -> None:
    data = '<data id="a" expr="\'x\'"/><data id="b" expr="\'y\'"/><data id="v" expr="\'\'"/>'
    chart = scxml(
        f'{HEAD}<datamodel>{data}</datamodel><state id="s"><onentry>'
        '<if cond="a == \'x\'"><assign location="b" expr="\'z\'"/></if>'
        '<assign location="v" expr="a + b + a"/></onentry>'
        '<transition cond="v == \'xzx\'" target="pass"/>'
        f'<transition target="fail"/></state>{FINALS}'
    ).chart
    assert endings(chart, SCRIPT, RUNTIMES) == {("pass",)}


LOOP = '<transition event="go" target="s"/>'


def test_a_string_that_grows_is_known_only_where_it_grows_once(scxml: Any) -> None:
    entry = '<assign location="v" expr="v + w"/>'
    text = asking("true", JOINED.format("_sessionid"), entry)
    assert "content-not-evaluable" not in scxml(text).rules
    looping = scxml(text.replace("</onentry>", f"</onentry>{LOOP}"))
    assert "strings cannot be joined" in looping.one("content-not-evaluable").message


@pytest.mark.parametrize("value", ["1 + 'a' == '1a'", "'a' + 'b' != 'ba'", "'a' + (1 + 2) == 'a3'"])
def test_constants_are_joined(scxml: Any, value: str) -> None:
    result = scxml(asking(value))
    assert "content-not-evaluable" not in result.rules
    assert endings(result.chart, SCRIPT) == {("pass",)}


COUNTING = """{head}<datamodel><data id="n" {type} expr="0"/><data id="m" expr="0"/></datamodel>
<state id="a"><onentry>{entry}</onentry><onexit>{exit}</onexit>
<transition cond="{first}" target="pass"/>
<transition cond="{guard}" target="a"><assign location="m" expr="n"/></transition>
<transition target="t"/></state>
<state id="t"><transition cond="n == 4 &amp;&amp; m == 3" target="pass"/>
<transition target="fail"/></state>{finals}"""


def counting(**parts: str) -> str:
    known = {"type": "", "entry": "", "exit": "", "first": "n &gt; 4", "guard": "++n &lt; 4"}
    return COUNTING.format(head=HEAD, finals=FINALS, **(known | parts))


@pytest.mark.external
@pytest.mark.parametrize(
    "guard",
    ["++n &lt; 4", "(++ n) != 4 &amp;&amp; m &lt; 9", "!(4 == ++n)", "4 &gt; ++n ? true : false"],
)
def test_a_guard_that_counts(scxml: Any, guard: str) -> None:
    result = scxml(counting(guard=guard))
    assert "content-not-evaluable" not in result.rules
    assert endings(result.chart, SCRIPT, RUNTIMES) == {("pass",)}


@pytest.mark.parametrize(
    "parts",
    [
        {"guard": "m &lt; 4 &amp;&amp; ++n &lt; 4"},
        {"guard": "++n &lt; 4 || ++m &lt; 4"},
        {"guard": "++n &lt; n"},
        {"exit": '<log expr="n"/>'},
        {"type": 'xmlns:fk="urn:fsmkit:scxml" fk:type="0..3"'},
    ],
)
def test_a_guard_that_counts_otherwise_is_told(scxml: Any, parts: dict[str, str]) -> None:
    result = scxml(counting(**parts))
    assert "outside the language" in result.one("content-not-evaluable").message


def test_a_guard_that_counts_in_a_region_is_told(scxml: Any) -> None:
    text = counting().replace('<state id="a">', '<parallel id="p"><state id="a">', 1)
    result = scxml(text.replace('<final id="pass"/>', "</parallel>" + '<final id="pass"/>'))
    assert "`++` is outside" in result.one("content-not-evaluable").message


@pytest.mark.external
@pytest.mark.parametrize(
    ("content", "condition"),
    [
        ('<assign location="u" expr="10 * ++n"/>', "u == 40 &amp;&amp; n == 4"),
        ('<if cond="--n == 2"><assign location="u" expr="n"/></if>', "u == 2"),
        ('<if cond="n"><log expr="++n"/></if>', "n == 4"),
        ("<script>l.push(++n)</script>", "l[1] == 4 &amp;&amp; n == 4"),
    ],
)
def test_content_that_counts(scxml: Any, content: str, condition: str) -> None:
    data = N + '<data id="l" expr="[1]"/>'
    chart = scxml(asking(condition, data, f'{content}<raise event="go"/>')).chart
    assert endings(chart, SCRIPT, RUNTIMES) == {("pass",)}


def test_an_increment_in_the_guard_of_an_event_is_told(scxml: Any) -> None:
    result = scxml(asking("++n == 4", N))
    assert "`++` is outside" in result.one("content-not-evaluable").message


def test_done_data_of_no_value_is_an_error_before_the_event(scxml: Any) -> None:
    chart = scxml(
        f'{HEAD}<state id="s" initial="f"><transition event="error.execution" target="t"/>'
        '<transition event="done.state.s" target="fail"/>'
        '<final id="f"><donedata><param name="p" expr="a.b.c"/></donedata></final></state>'
        '<state id="t"><transition event="done.state.s" '
        'cond="typeof _event.data === \'undefined\'" target="pass"/></state>'
        f"{FINALS}"
    ).chart
    assert endings(chart, SCRIPT, RUNTIMES[:2]) == {("pass",)}


@pytest.mark.external
def test_the_name_of_the_event_in_entry_content(scxml: Any) -> None:
    chart = scxml(
        f'{HEAD}<datamodel><data id="v"/></datamodel><state id="s"><onentry><raise event="go"/>'
        '</onentry><transition event="go" target="t"/></state><state id="t"><onentry>'
        '<raise event="other"/><assign location="v" expr="_event.name"/></onentry>'
        '<transition cond="v == \'go\'" target="pass"/>'
        f'<transition event="*" target="fail"/></state>{FINALS}'
    ).chart
    assert endings(chart, SCRIPT, RUNTIMES) == {("pass",)}
