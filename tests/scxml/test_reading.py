"""Every element of SCXML and of the extension comes out as the Document has it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fsmkit.document.document import Direction, Kind, Trigger
from fsmkit.language.statements import tree as stmt

ReadChart = Callable[..., Any]


def test_states_of_every_kind(read: ReadChart) -> None:
    document = read(
        """
        <state id="a" initial="b c">
          <parallel id="p"><state id="b"/><state id="c"/></parallel>
          <history id="h"><transition target="b"/></history>
          <history id="d" type="deep"><transition target="c"><log/></transition></history>
        </state>
        <state id="s"><initial><transition target="t"><log/></transition></initial>
          <state id="t"/></state>
        <state id="x" fk:kind="choice"><transition target="a"/></state>
        <final id="f"><onexit><log label="bye"/></onexit></final>
        <state/>
        """,
        more=' initial="s"',
    ).document
    a, s, x, f, nameless = document.root.children
    assert [t.value for t in document.root.initial.targets] == ["s"]
    assert [t.value for t in a.initial.targets] == ["b", "c"]
    assert [child.kind for child in a.children] == [
        Kind.PARALLEL,
        Kind.SHALLOW_HISTORY,
        Kind.DEEP_HISTORY,
    ]
    assert a.children[1].initial.content is None
    assert len(a.children[2].initial.content) == 1
    assert a.children[2].transitions == ()
    assert [t.value for t in s.initial.targets] == ["t"]
    assert len(s.initial.content) == 1
    assert x.kind is Kind.CHOICE
    assert f.kind is Kind.FINAL
    assert len(f.exit) == 1
    assert nameless.id is None


def test_transitions(read: ReadChart) -> None:
    (state,) = read(
        """
        <state id="a">
          <transition event="go error.*  done" cond="x &lt; 3" target="b c" type="internal"/>
          <transition fk:after="500ms" target="a" fk:watchdog="true" fk:id="late"/>
          <transition fk:every="T" fk:ordered="true"><script/></transition>
          <transition fk:sometimes="true" fk:first="1" fk:override="x"/>
          <transition><log/><log/></transition>
        </state>
        """
    ).document.root.children
    event, after, every, sometimes, always = state.transitions
    assert [e.value for e in event.events] == ["go", "error.*", "done"]
    assert event.guard.value == "x < 3"
    assert [t.value for t in event.targets] == ["b", "c"]
    assert (event.trigger, event.internal, event.content) == (Trigger.EVENT, True, None)
    assert (after.trigger, after.delay.value, after.watchdog) == (Trigger.AFTER, "500ms", True)
    assert after.id.value == "late"
    assert (every.trigger, every.content, every.ordered) == (Trigger.EVERY, (), True)
    assert (sometimes.trigger, sometimes.first) == (Trigger.SOMETIMES, True)
    assert sometimes.override.value == "x"
    assert always.trigger is Trigger.EVENTLESS
    assert len(always.content) == 2


def test_executable_content(read: ReadChart) -> None:
    (state,) = read(
        """
        <state id="a"><onentry>
          <assign location="x" expr="1"/>
          <raise event="e"/>
          <raise event="e"><fk:param name="n" expr="2"/></raise>
          <if cond="a"><log/><elseif cond="b"/><else/><log label="c" expr="d"/></if>
          <foreach array="xs" item="x" index="i"><cancel sendid="k"/></foreach>
          <script>y += 1; go(3)</script>
          <send event="e" target="#_internal" delay="2s" id="k" namelist="x  y" type="scxml">
            <param name="n" expr="1"/><param name="m" location="x"/></send>
          <send eventexpr="e" targetexpr="t" delayexpr="d" idlocation="l" typeexpr="p">
            <content>  hello &amp; goodbye </content></send>
          <send event="e"><content expr="x"/></send>
          <cancel sendidexpr="k"/>
          <fk:super/><fk:reply expr="1"/><fk:call expr="f(1)"/><fk:unreadable reason="why"/>
        </onentry><onentry><log/></onentry><onentry/></state>
        """
    ).document.root.children
    first, second = state.entry
    assert len(second) == 1
    kinds = [type(statement) for statement in first]
    assert kinds == [
        *(
            stmt.Assign,
            stmt.Raise,
            stmt.Raise,
            stmt.If,
            stmt.ForEach,
            stmt.Assign,
            stmt.CallOperation,
        ),
        *(
            stmt.DocSend,
            stmt.DocSend,
            stmt.DocSend,
            stmt.DocCancel,
            stmt.Super,
            stmt.Reply,
            stmt.CallOperation,
            stmt.Fail,
        ),
    ]
    assert first[2].arguments[0].value.value == "2"
    branches = first[3].branches
    assert [b.condition and b.condition.value for b in branches] == ["a", "b", None]
    assert [len(b.body) for b in branches] == [1, 0, 1]
    assert isinstance(branches[2].body[0], stmt.Log)
    assert first[4].index.value == "i"
    assert (first[5].location.value, first[5].operator) == ("y", "+")
    send = first[7]
    assert (send.target.value, send.delay.value, send.id.value) == ("#_internal", "2s", "k")
    assert [n.value for n in send.name_list] == ["x", "y"]
    assert [(p.name.value, p.value.value) for p in send.arguments] == [("n", "1"), ("m", "x")]
    computed = first[8]
    assert (computed.event_expr.value, computed.target_expr.value) == ("e", "t")
    assert (computed.delay_expr.value, computed.id_location.value) == ("d", "l")
    assert computed.content.value == "hello & goodbye"
    assert first[9].content_expr.value == "x"


def test_declarations_of_the_extension(read: ReadChart) -> None:
    document = read(
        """
        <fk:doc>
          What it is for.
        </fk:doc>
        <fk:type name="Fault" members="none lost"/>
        <fk:type name="Point"><fk:field name="x" type="0..3"/></fk:type>
        <fk:constant name="LIMIT" expr="2800"/>
        <fk:operation signature="goto(position 0..LIMIT, speed 0..100) -> bool"/>
        <fk:event direction="in" signature="fault(code Fault)"/>
        <fk:event direction="out" signature="done"/>
        <fk:capacity queue="4" tick="100us"/>
        <datamodel>
          <fk:input id="ready" type="bool"/><fk:output id="power" type="0..100" expr="5"/>
          <data id="n" fk:type="0..3 wrap" expr="1"/><data id="m" type="uint8"/>
        </datamodel>
        <script>n = 2</script>
        <state id="a" fk:rest="true" fk:abstract="true" fk:defer="x y" fk:invariant="n &lt; 3"
            fk:override="exit entry"><fk:doc>A.</fk:doc></state>
        <fk:refine state="b" initial="c" rest="true"><state id="c"/></fk:refine>
        """,
        more=' fk:extends="base.yaml" fk:abstract="true" binding="late"',
    ).document
    assert (document.extends.value, document.abstract) == ("base.yaml", True)
    assert (document.doc, document.late_binding) == ("What it is for.", True)
    fault, point = document.types
    assert [m.name.value for m in fault.members] == ["none", "lost"]
    assert point.fields[0].type.value == "0..3"
    assert document.constants[0].value.value == "2800"
    goto = document.operations[0]
    assert [p.type.value for p in goto.parameters] == ["0..LIMIT", "0..100"]
    assert goto.result.value == "bool"
    assert [e.direction for e in document.events] == [Direction.IN, Direction.OUT]
    assert [(c.name.value, c.value.value) for c in document.capacities] == [
        ("queue", "4"),
        ("tick", "100us"),
    ]
    assert document.inputs[0].type.value == "bool"
    assert document.outputs[0].init.value == "5"
    assert [(d.type.value, d.init and d.init.value) for d in document.data] == [
        ("0..3 wrap", "1"),
        ("uint8", None),
    ]
    assert len(document.script) == 1
    (a,) = document.root.children
    assert (a.rest, a.abstract, a.doc) == (True, True, "A.")
    assert a.overrides == {"entry", "exit"}
    assert [d.value for d in a.defer] == ["x", "y"]
    assert a.invariant.value == "n < 3"
    (b,) = document.refine
    assert (b.id.value, b.rest, b.kind) == ("b", True, Kind.COMPOUND)
    assert b.children[0].id.value == "c"


def test_final_data_and_invoked_charts(read: ReadChart) -> None:
    _, state, final = read(
        """
        <state id="x"/>
        <state id="a"><invoke id="i" src="other.scxml" autoforward="true" namelist="p">
          <param name="q" expr="1"/>
          <finalize><log/></finalize>
          <content><scxml version="1.0" name="inner" datamodel="ecmascript"><state id="z"/>
          </scxml></content></invoke></state>
        <final id="f"><donedata><content>so it is</content></donedata></final>
        """
    ).document.root.children
    (invoke,) = state.invokes
    assert (invoke.id.value, invoke.src.value, invoke.autoforward) == ("i", "other.scxml", True)
    assert invoke.content.name.value == "inner"
    assert invoke.content.datamodel == "ecmascript"
    assert invoke.content.root.children[0].id.value == "z"
    assert len(invoke.finalize) == 1
    assert final.done_content.value == '"so it is"'


def test_inline_data_is_json_or_a_string(read: ReadChart) -> None:
    result = read(
        """
        <datamodel><data id="a">[1, 2]</data><data id="b">
           two   words </data><data id="c"><x/></data><data id="d" type="string"/></datamodel>
        <state id="s"/>
        """,
        datamodel="ecmascript",
    )
    data = result.document.data
    assert [d.init and d.init.value for d in data] == ["[1, 2]", '"two words"', "<x/>", None]
    assert data[3].type.value == "symbol"


def test_parts_in_files_beside_the_chart(read: ReadChart, tmp_path: Path) -> None:
    (tmp_path / "rules.js").write_text("x = 1; y = 2")
    (tmp_path / "value.txt").write_text(" 42\n")
    (tmp_path.parent / "outside.js").write_text("x = 1")
    text = """
        <datamodel><data id="a" src="file:value.txt"/></datamodel>
        <script src="{}"/><state id="s"/>
        """
    at = str(tmp_path / "chart.scxml")
    document = read(text.format("rules.js"), name=at).document
    assert document.data[0].init.value == "42"
    assert len(document.script) == 2
    outside = read(text.format("../outside.js"), name=at)
    assert outside.errors == ["unloaded-source"]
    assert outside.marked == ["../outside.js"]
