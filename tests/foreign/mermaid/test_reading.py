"""State diagrams of Mermaid: each construct, damaged and hostile files."""

from __future__ import annotations

import random

import pytest

from fsmkit.diagnostics import Severity
from fsmkit.document.document import Kind, Trigger
from tests.foreign.imports import calls, chart_of, imported, messages
from tests.foreign.statesmith.test_hostile import damaged

KETTLE = """---
title: "Kettle"
---
%%{init: {"theme": "dark"}}%%
stateDiagram-v2
  direction LR
  accDescr {
    Off --> Nowhere : not read
  }
  [*] --> Off
  state "switched off" as Off
  Off : no power
  note right of Off
    entry / lamp_off()
  end note
  Off --> is_full : PRESS [plugged_in] / click() %% a comment
  state is_full <<choice>>
  is_full --> Heating : if full
  is_full --> Off : else
  state Heating {
    [*] --> Low
    Low --> High : after 2s
    High --> Low: cool &amp; calm
    --
    [*] --> Quiet
    Quiet --> Loud:::big : boiling
    Loud --> Loud : TICK / whistle()
  }
  Heating --> Off : PRESS / click(); lamp_off()
  Heating --> [*] : burn through
  classDef big font-size:20px
"""


def test_a_kettle() -> None:
    chart, found = chart_of("mermaid", KETTLE, "kettle.mmd")
    assert chart.name == "Kettle"
    names = [event.name for event in chart.events if event.name[0] != "#"]
    assert {"PRESS", "cool_calm", "boiling", "TICK", "burn_through"} <= set(map(simple, names))

    def run(events: str, *true: str) -> list[str]:
        return calls(chart, found, events.split(), true=true)

    assert run("PRESS") == ["lamp_off()", "Off"]
    full = ("plugged_in", "if full")
    heating = ["lamp_off()", "click()"]
    assert run("PRESS", *full) == [*heating, "Low", "Quiet"]
    assert run("PRESS", "plugged_in") == [*heating, "lamp_off()", "Off"]
    assert run("PRESS boiling TICK", *full) == [*heating, "whistle()", "Low", "Loud"]
    assert run("PRESS PRESS", *full) == [*heating, "click()", "lamp_off()", "lamp_off()", "Off"]
    timers = [t for t in chart.transitions if t.trigger is Trigger.AFTER]
    assert [str(t.delay_text or t.delay) for t in timers] != []
    assert [state.kind for state in chart.states].count(Kind.FINAL) == 1


def simple(name: str) -> str:
    return "_".join(part for part in name.split("_") if part)


def test_forks_and_joins_of_regions() -> None:
    text = """stateDiagram
  [*] --> A
  state f [[fork]]
  state j <<join>>
  A --> f : GO
  f --> One2
  f --> Two2
  state Both {
    state One2
    [*] --> One1
    One2 --> One3 : X
    One3 --> j
    --
    state Two2
    [*] --> Two1
    Two2 --> Two3 : Y
    Two3 --> j
  }
  j --> A : / done()
"""
    chart, found = chart_of("mermaid", text, "m.mmd")
    assert calls(chart, found, ["GO"]) == ["One2", "Two2"]
    assert calls(chart, found, ["GO", "X"]) == ["One3", "Two2"]
    assert calls(chart, found, ["GO", "X", "Y"]) == ["done()", "A"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("flowchart LR\nA --> B", "the file is not a state diagram of Mermaid"),
        ("stateDiagram\n", "the diagram has no states"),
        ("stateDiagram\nA --> B\n}", "a `}` closes nothing"),
        ("stateDiagram\nstate A {\nB", "`A` is not closed"),
        ("stateDiagram\nA -> B", "`A -> B` is not read"),
        ("stateDiagram\nstate A {\nstate A {\n}\n}", "`A` is inside itself, or too deep"),
        ("stateDiagram\n[*] --> A\n[*] --> B", "a second arrow leads from `[*]`"),
        ("stateDiagram\n[*] --> A : [x]", "an initial arrow has a guard"),
        ("stateDiagram\nA --> B\n--\nC --> D", "the whole diagram has regions"),
        ("stateDiagram\nstate f <<fork>>\nA --> f\nf --> B\nf --> C", "the ends of the fork `f`"),
        ("stateDiagram\nstate j <<join>>\nA --> j\nB --> j\nj --> C", "the arrows to the join `j`"),
        ("stateDiagram\nstate c <<choice>>\nA --> c", "no arrow leaves the choice `c`"),
        ("stateDiagram\nstate c <<choice>>\nA --> c\nc --> A\nc --> B", "the choice `c` has two"),
    ],
)
def test_what_is_rejected_has_a_location(text: str, message: str) -> None:
    _, findings = imported("mermaid", text, "m.mmd")
    assert any(each.startswith(message) for each in messages(findings))
    assert all(one.primary is not None for one in findings)


def test_a_choice_without_else_and_a_diagram_without_start_differ() -> None:
    text = "stateDiagram\nA --> c : E\nstate c <<choice>>\nc --> A : if n < 0\nc --> B : if n >= 0"
    found, findings = imported("mermaid", text, "m.mmd")
    assert found is not None
    assert len(found.differs) == 2
    assert {one.severity for one in findings} == {Severity.WARNING}


@pytest.mark.parametrize(
    "text",
    [
        "stateDiagram\n" + "state A {\n" * 500,
        "stateDiagram\nA --> B : " + "[" * 4_000,
        "stateDiagram\nA : " + "#38;" * 1_000,
        "stateDiagram\n" + "A --> B : E\n" * 3_000,
        "stateDiagram\n" + "-" * 100_000,
        "stateDiagram\nif --> send : raise raise\nsend --> if : #0; #99999999;",
        'stateDiagram\nA --> B : */ int x; /* ["] / `',
        '---\ntitle: "\\x00\\x0a*/"\n---\nstateDiagram\nA --> B',
        "---\n" * 1_000,
        "stateDiagram\nnote right of A",
    ],
)
def test_hostile_files(text: str) -> None:
    _, findings = imported("mermaid", text, "m.mmd")
    assert all(one.primary is not None for one in findings)


def test_damaged_files() -> None:
    chosen = random.Random(40)
    for _ in range(60):
        imported("mermaid", damaged(KETTLE.encode(), chosen), "kettle.mmd")
