"""StateSmith diagrams: each construct in each notation, and what it does as a chart."""

from __future__ import annotations

import pytest

from fsmkit.foreign.imports import report_lines
from fsmkit.yaml.writer import write_document
from tests.foreign.imports import calls, chart_of, imported, messages
from tests.foreign.statesmith.diagrams import compressed, drawio, graphml, svg

SHAPES = (
    ("i", "$initial_state", ()),
    ("off", "OFF\nenter / lamp(0);\nBLINK / {\n  blink();\n  count++;\n}", ()),
    (
        "on",
        "ON\nexit / lamp(0); // dark\n(DIM, BLINK) [is_warm && x < 3] / warm();\ndo / tick();",
        (
            ("j", "$initial_state", ()),
            ("low", "LOW\n2. DIM / second();\n1. DIM / first();\ndo / low();", ()),
            ("high", "HIGH\nDIM / { consume_event = false; high(); }", ()),
        ),
    ),
)
ARROWS = (
    ("i", "off", ""),
    ("off", "on", "PRESS / lamp(1);"),
    ("on", "off", "PRESS"),
    ("j", "low", "/ start();"),
    ("low", "high", "UP"),
    ("high", "on", "UP / up();"),
    ("on", "high", "JUMP"),
)
PLANTUML = r"""
@startuml Lamp
skinparam state {
  BackgroundColor<<dark>> 545454
}
[*] --> OFF
state "off, of course" as OFF <<dark>>
OFF : enter / lamp(0);
OFF : BLINK / {\n  blink();\n  count++;\n}
note right of OFF
  OFF : enter / not_read();
end note
/' a comment
   OFF --> ON : NOTHING '/
OFF -[#red]-> ON : PRESS / lamp(1);
state ON {
  ' of the state
  ON : exit / lamp(0);
  ON : (DIM, BLINK) [is_warm && x < 3] / warm();
  ON : do / tick();
  [*] -down-> LOW : / start();
  LOW : 2. DIM / second();
  LOW : 1. DIM / first();
  LOW : do / low();
  HIGH : DIM / { consume_event = false; high(); }
  LOW --> HIGH : UP
}
ON --> OFF : PRESS
HIGH -> ON : UP / up();
ON --> HIGH : JUMP
@enduml
"""
PLAIN = drawio("Lamp", SHAPES, ARROWS)
NOTATIONS = {
    "lamp.drawio": PLAIN,
    "deflated.drawio": compressed(PLAIN),
    "lamp.drawio.svg": svg(PLAIN),
    "lamp.graphml": graphml("Lamp", SHAPES, ARROWS),
    "lamp.puml": PLANTUML,
}


@pytest.mark.parametrize("name", NOTATIONS)
def test_one_machine_in_each_notation(name: str) -> None:
    chart, found = chart_of("statesmith", NOTATIONS[name], name)
    warm = ("is_warm", "x < 3")

    def run(events: str, true: tuple[str, ...] = ()) -> list[str]:
        return calls(chart, found, events.split(), true=true)

    assert run("") == ["lamp(0)", "OFF"]
    assert run("BLINK PRESS") == ["lamp(0)", "blink()", "count++", "lamp(1)", "start()", "LOW"]
    on = ["lamp(0)", "lamp(1)", "start()"]
    assert run("PRESS DIM", warm) == [*on, "first()", "second()", "LOW"], "1., 2., consumed"
    assert run("PRESS BLINK", warm) == [*on, "warm()", "LOW"]
    assert run("PRESS BLINK", ("is_warm",)) == [*on, "LOW"]
    assert run("PRESS do") == [*on, "low()", "tick()", "LOW"], "`do` is passed on"
    assert run("PRESS UP DIM", warm) == [*on, "high()", "warm()", "HIGH"], "passed on"
    assert run("PRESS UP UP") == [*on, "up()", "start()", "LOW"], "the outer state is not left"
    assert run("PRESS JUMP") == [*on, "HIGH"]
    assert run("PRESS PRESS") == [*on, "lamp(0)", "lamp(0)", "OFF"]


def test_the_notations_give_the_same_chart() -> None:
    texts = {
        write_document(chart_of("statesmith", NOTATIONS[name], name)[1].document)
        for name in ("lamp.drawio", "deflated.drawio", "lamp.drawio.svg", "lamp.graphml")
    }
    assert len(texts) == 1


def test_the_report() -> None:
    found, findings = imported("statesmith", NOTATIONS["lamp.drawio"], "lamp.drawio")
    assert found is not None
    lines = report_lines(found, findings)
    assert lines[0].startswith("machine    Lamp: 4 states, ")
    rules = {one.rule for one in found.rewritten}
    assert rules == {"R1", "R7", "R9", "R11"}
    assert {one.name: one.role.value for one in found.opaque}["is_warm"] == "guard"


def run(text: str, events: str, true: tuple[str, ...] = ()) -> list[str]:
    chart, found = chart_of("statesmith", f"@startuml M\n{text}\n@enduml", "m.puml")
    return calls(chart, found, events.split(), true=true)


def test_a_composite_state_without_an_initial_state_rests() -> None:
    text = """
[*] -> G
state G {
  A : enter / a();
  G : enter / g();
}
G --> A : E
A --> G : F
"""
    assert run(text, "") == ["g()", "G_self"]
    assert run(text, "E F") == ["g()", "a()", "G_self"], "a transition to G does not enter it again"


def test_a_self_transition_leaves_and_enters() -> None:
    text = "[*] -> A\nA : enter / in();\nA : exit / out();\nA --> A : E / act();"
    assert run(text, "E") == ["in()", "out()", "act()", "in()", "A"]


def test_choices_and_entry_and_exit_points() -> None:
    text = """
[*] -> A
state c <<choice>>
A --> c : E / first();
c --> A : else
c --> B : [b] / second();
state B {
  state e1 <<entryPoint>>
  state x1 <<exitPoint>>
  e1 --> D : / e();
  [*] --> C
  C --> x1 : E
  D --> x1 : E / d();
  B : exit / left();
}
x1 --> A : / x();
A --> e1 : F
"""
    assert run(text, "E") == ["first()", "A"]
    assert run(text, "E", ("b",)) == ["first()", "second()", "C"]
    assert run(text, "F E") == ["e()", "d()", "left()", "x()", "A"]


def test_histories() -> None:
    text = """
[*] -> G
state G {
  [*] --> G[%s]
  G[%s] --> A
  A --> B : N
  state B {
    [*] --> B1
    B1 --> B2 : N
  }
}
G --> Z : OUT
Z --> G : BACK
"""
    assert run(text % ("H", "H"), "N N OUT BACK") == ["B1"]
    assert run(text % ("H*", "H*"), "N N OUT BACK") == ["B2"]
    assert run(text % ("H", "H"), "OUT BACK") == ["A"]


def test_a_history_is_continued_by_hc() -> None:
    inner = (
        "b",
        "B",
        (("bi", "$initial_state", ()), ("b1", "B1", ()), ("b2", "B2", ()), ("hc", "$HC", ())),
    )
    shapes = (
        ("i", "$initial_state", ()),
        ("g", "G", (("gi", "$initial_state", ()), ("h", "$H", ()), ("a", "A", ()), inner)),
        ("z", "Z", ()),
    )
    arrows = (
        ("i", "g", ""), ("gi", "h", ""), ("h", "a", ""), ("a", "b", "N"), ("bi", "b1", ""),
        ("b1", "b2", "N"), ("g", "z", "OUT"), ("z", "g", "BACK"),
    )  # fmt: skip
    chart, found = chart_of("statesmith", drawio("M", shapes, arrows), "m.drawio")
    assert calls(chart, found, ["N", "N", "OUT", "BACK"]) == ["B2"]


def test_the_root_has_behaviours() -> None:
    shapes = (
        ("i", "$initial_state", ()),
        ("a", "A", ()),
        ("p", "$PARENT_ALIAS\nENTER / up();\nEV / root();", ()),
    )
    chart, found = chart_of("statesmith", drawio("M", shapes, (("i", "a", ""),)), "m.drawio")
    assert calls(chart, found, ["EV"]) == ["up()", "root()", "A"]


def test_triggers_are_mapped() -> None:
    config = (
        "c",
        "$CONFIG : TriggerMap\n// names\nANY => *\nDIMx => DIM*\nen => enter\nR => /UP\\d+/",
        (),
    )
    shapes = (
        ("i", "$initial_state", ()), config,
        ("a", "A\nen / a();\nDIMx / dim();\nDIM1 / one();\nUP2 / two();\nR / r();", ()),
        ("p", "$PARENT_ALIAS\nANY / any();", ()),
    )  # fmt: skip
    chart, found = chart_of("statesmith", drawio("M", shapes, (("i", "a", ""),)), "m.drawio")
    assert calls(chart, found, ["DIM1"]) == ["a()", "dim()", "one()", "A"]
    assert calls(chart, found, ["UP2"]) == ["a()", "two()", "r()", "A"]


def test_declared_variables_become_data_unless_opaque_content_uses_them() -> None:
    config = ("c", "$CONFIG : VariableDeclarations\nuint8_t count = 3;\nint shared;", ())
    shapes = (
        ("i", "$initial_state", ()), config,
        ("a", "A\nE [count < 5] / count += 2; show(shared);", ()),
    )  # fmt: skip
    chart, found = chart_of("statesmith", drawio("M", shapes, (("i", "a", ""),)), "m.drawio")
    assert [(data.name, str(data.type)) for data in chart.data] == [("count", "uint8")]
    assert calls(chart, found, ["E", "E"]) == ["show(shared)", "A"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[*] --> A\nstate A {\nstate B\n--\nstate C\n}", "a state has regions"),
        ("[*] --> A\nA --> [*] : E", "StateSmith has no final states"),
        ("[*] --> A\nstate f <<fork>>\nA --> f", "StateSmith has no state `<<fork>>`"),
        ("[*] --> A\nA : what is this", "`what is this` is not a behaviour"),
        ("[*] --> A\nA : E [x", "`E [x` is not a behaviour"),
        ("[*] --> A\nfoo bar", "`foo bar` is not read"),
        ("[*] --> A\nstate A {", "`A` is not closed"),
        ("[*] --> A\n}", "a `}` closes nothing"),
        (
            "[*] --> A\nstate c <<choice>>\nA --> c : E\nc --> A : [x]",
            "a leg of `M_choice_c` without a guard is missing",
        ),
        ("[*] --> A\nA --> B : enter / x();", "an arrow has the trigger `enter` or `exit`"),
        ("", "the machine `M` has no states"),
    ],
)  # fmt: skip
def test_what_is_rejected_has_a_location(text: str, message: str) -> None:
    _, findings = imported("statesmith", f"@startuml M\n{text}\n@enduml", "m.puml")
    assert any(each.startswith(message) for each in messages(findings))
    assert all(one.primary is not None for one in findings)
