"""What is wrong gets a finding with its place, never a traceback; real files are read leniently."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from fsmkit.diagnostics import Findings, Source
from fsmkit.language.statements.tree import Fail, Raise
from fsmkit.scxml.nodes import DEEPEST
from fsmkit.scxml.reader import read_document

ReadChart = Callable[..., Any]


def rules_of(text: str) -> list[str]:
    findings = Findings()
    assert read_document(Source("chart.scxml", text), findings) is None
    return [d.rule.name for d in findings]


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("", "broken-xml"),
        ("   \n", "broken-xml"),
        ("chart: Feeder", "broken-xml"),
        ("<scxml>", "broken-xml"),
        ("<scxml><state></scxml>", "broken-xml"),
        ('<scxml a="1" a="2"/>', "broken-xml"),
        ("<scxml/><scxml/>", "broken-xml"),
        ("<x:scxml/>", "broken-xml"),
        ("<scxml>\0</scxml>", "broken-xml"),
        ("<scxml>\ud800</scxml>", "broken-xml"),
        ('<scxml name="&nbsp;"/>', "broken-xml"),
        ("<project/>", "not-scxml"),
        ('<fk:scxml xmlns:fk="urn:fsmkit:scxml"/>', "not-scxml"),
        ("<scxml>" * 10_000 + "</scxml>" * 10_000, "nested-too-deep"),
        ('<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><scxml>&b;</scxml>',
         "xml-beyond-charts"),
        ('<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><scxml>&a;</scxml>',
         "xml-beyond-charts"),
        ('<!DOCTYPE x [<!ENTITY % a SYSTEM "http://x/y"> %a;]><scxml/>', "xml-beyond-charts"),
        ('<!DOCTYPE scxml SYSTEM "http://x/y"><scxml/>', "xml-beyond-charts"),
        ('<!DOCTYPE scxml PUBLIC "-//W3C//DTD" "http://x/y"><scxml/>', "xml-beyond-charts"),
        ('<!DOCTYPE x SYSTEM "http://x/y"><scxml>&unknown;</scxml>', "xml-beyond-charts"),
        ('<scxml xmlns:x="http://www.w3.org/2001/XInclude"><x:include href="a"/></scxml>',
         "xml-beyond-charts"),
    ],
)  # fmt: skip
def test_what_cannot_be_read(text: str, rule: str) -> None:
    assert rules_of(text)[-1] == rule


def test_the_deepest_chart(read: ReadChart) -> None:
    depth = DEEPEST - 1
    assert read('<state id="s">' * depth + "</state>" * depth).maybe is not None
    assert read("<state>" * (depth + 1) + "</state>" * (depth + 1)).errors == ["nested-too-deep"]
    content = '<if cond="x">' * (depth - 2) + "</if>" * (depth - 2)
    assert read(f"<state><onentry>{content}</onentry></state>").maybe is not None


def test_a_bare_file() -> None:
    findings = Findings()
    text = '<scxml initial="a"><state id="a"><transition event="e" target="a"/></state></scxml>'
    document = read_document(Source("dir/lamp.v2.scxml", text), findings)
    assert document is not None
    assert document.name.value == "lamp.v2"
    assert document.datamodel == "ecmascript"
    assert [d.rule.name for d in findings] == ["missing-namespace", "missing-version"]
    assert document.root.children[0].transitions[0].events[0].value == "e"


@pytest.mark.parametrize(
    ("text", "rule", "marked"),
    [
        ('<state id="a" colour="red"/>', "unknown-attribute", "colour"),
        ('<state id="a"><onenter/></state>', "unknown-element", "<onenter/>"),
        ('<state id="a"/><onentry/>', "unknown-element", "<onentry/>"),
        ('<datamodel><data expr="1"/></datamodel>', "incomplete-element", '<data expr="1"/>'),
        ('<state id="a"><initial/></state>', "incomplete-element", "<initial/>"),
        ('<state id="a"><onentry>x = 1</onentry></state>', "stray-text", "x = 1"),
        ('<state><history type="DEEP"/></state>', "unexpected-attribute-value", "DEEP"),
        ('<state><transition type="intern"/></state>', "unexpected-attribute-value", "intern"),
        ('<state><onentry><send event="a" eventexpr="b"/></onentry></state>',
         "conflicting-attributes", "b"),
        ('<state initial="b"><initial><transition target="c"/></initial></state>',
         "conflicting-attributes", "<initial>"),
        ('<datamodel><data id="x" type="geometry/Pose"/></datamodel>', "unusable-type",
         "geometry/Pose"),
        ('<datamodel><data id="x" src="nowhere.txt"/></datamodel>', "unloaded-source",
         "nowhere.txt"),
    ],
)  # fmt: skip
def test_a_warning_in_a_real_file_and_an_error_in_ours(
    read: ReadChart, text: str, rule: str, marked: str
) -> None:
    lenient = read(text, datamodel="ecmascript")
    assert lenient.rules == [rule]
    assert lenient.marked == [marked]
    assert lenient.errors == []
    assert all(d.help for d in lenient.found)
    if rule != "unusable-type":  # fsmkit looks the type up itself
        assert rule in read(text, datamodel="fsmkit").errors


def test_misspelt_words_get_a_suggestion(read: ReadChart) -> None:
    result = read('<state><onetry/><transition evnt="x" fk:aftr="2s"/></state>')
    assert [d.help for d in result.found] == [
        "did you mean `onentry`?",
        "did you mean `event`?",
        "did you mean `fk:after`?",
    ]


def test_foreign_namespaces(read: ReadChart) -> None:
    result = read(
        """
        <q:info xmlns:q="urn:q"><q:more/></q:info>
        <state id="a" q:x="1" xmlns:q="urn:q"><q:layout/>
          <onentry><q:beep/><raise event="e"/></onentry></state>
        """
    )
    assert result.rules == ["foreign-content"]
    ((statement,),) = result.document.root.children[0].entry
    assert isinstance(statement, Raise)


@pytest.mark.parametrize(
    "content",
    [
        "<assign expr='1'/>",
        "<assign location='x'/>",
        "<raise/>",
        "<if><log/></if>",
        "<if cond='a'><else/><else/></if>",
        "<if cond='a'><elseif/></if>",
        "<foreach item='x'/>",
        "<cancel/>",
        "<send/>",
        "<send event='e'><param expr='1'/></send>",
        "<state/>",
        "<script>while (true) { x = function () { } }</script>",
        "<script>x = 1 }</script>",
    ],
)
def test_content_that_is_an_error_when_executed(read: ReadChart, content: str) -> None:
    result = read(
        f"<state><onentry><log/>{content}<log/></onentry></state>", datamodel="ecmascript"
    )
    assert result.errors == []
    _, statement, _ = result.document.root.children[0].entry[0]
    assert isinstance(statement, Fail)
    assert statement.reason


def test_a_transition_has_one_trigger(read: ReadChart) -> None:
    result = read('<state><transition event="e" fk:after="2s"/></state>', datamodel="null")
    assert result.errors == ["conflicting-triggers"]
    assert result.marked == ["2s"]


def test_a_type_has_members_or_fields(read: ReadChart) -> None:
    result = read(
        '<fk:type name="T" members="a"><fk:field name="x" type="bool"/></fk:type><state/>',
        datamodel="ecmascript",
    )
    assert result.rules == ["conflicting-attributes"]
    (type_,) = result.document.types
    assert type_.members == ()
    assert len(type_.fields) == 1


def test_what_no_mark_replaces(read: ReadChart) -> None:
    result = read('<state id="a" fk:override="entry on"/>')
    assert result.rules == ["unexpected-attribute-value"]
    assert result.marked == ["on"]


def test_an_unknown_data_model(read: ReadChart) -> None:
    result = read("<state/>", datamodel="lua")
    assert result.rules == ["unknown-datamodel"]
    assert result.document.datamodel == "ecmascript"


def test_a_type_of_nothing() -> None:
    text = (
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0">'
        '<fk:type name="R" members=" "/><state id="a"/></scxml>'
    )
    assert rules_of(text) == ["incomplete-element"]


@pytest.mark.parametrize(
    ("script", "advice"),
    [
        ("onEnterOff", "call it: `onEnterOff()`"),
        ("x == 3", "assign with `=`: `==` compares"),
        ("}", "remove it"),
    ],
)
def test_a_script_that_cannot_be_evaluated_has_the_advice_of_a_strict_one(
    script: str, advice: str
) -> None:
    findings = Findings()
    text = (
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="s"><state id="a">'
        f"<onentry><script>{script}</script></onentry></state></scxml>"
    )
    document = read_document(Source("chart.scxml", text), findings)
    assert document is not None
    ((failed,),) = document.root.children[0].entry or ()
    assert isinstance(failed, Fail)
    assert failed.advice == advice
