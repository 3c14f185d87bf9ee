"""The usual layout: what changes, what never does, and that it changes only once."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from pathlib import Path

import pytest

from devtools.formatting import problem
from fsmkit.diagnostics import FsmkitError
from fsmkit.editor.formatting import format_source
from fsmkit.editor.formatting.spacing import normalize_spaces

MACHINES = Path(__file__).parents[3] / "machines"
SPOILT = """\
# The licence
# of the file

chart: Gate   # its name
# about the beginning
initial: closed
inputs:  # the host writes them
  # the first
  a: bool  # behind a
  # at the end of the inputs


  # at the very end of the inputs
# about the events
events: {in: [a,  # behind the first
   b],
   out: [c]}  # behind the bracket
states:
  closed:
      # about the entry
      entry: |  # behind the sign
        x=1
        # within
        y  =  2   # behind a statement

      on:
        a:
        - if: x>1&&y   # behind the guard
          target: open
        -   # the second
          target: closed
          do: x=2;y=3
        # at the end of the list
      # at the end of the state
  # about the other state
  open:   {}
   # in another column
data: {x: "0..9=0", y: 0..9 = 0}
# at the end
"""
USUAL = """\
# The licence
# of the file

chart: Gate   # its name
data: {x: "0..9 = 0", y: 0..9 = 0}

inputs:  # the host writes them
  # the first
  a: bool  # behind a
  # at the end of the inputs

  # at the very end of the inputs

# about the events
events:  # behind the bracket
  in:
    - a  # behind the first
    - b
  out: [c]

# about the beginning
initial: closed

states:
  closed:
    # about the entry
    entry: |  # behind the sign
      x = 1
      # within
      y = 2   # behind a statement

    on:
      a:
        - if: x > 1 && y   # behind the guard
          target: open
        # the second
        - {target: closed, do: x = 2; y = 3}
        # at the end of the list
    # at the end of the state
  # about the other state
  open: {}
  # in another column
# at the end
"""


def test_comments_stay_with_what_they_stand_at() -> None:
    assert format_source(SPOILT, "gate.yaml") == USUAL
    assert format_source(USUAL, "gate.yaml") == USUAL


# expression: as it is usually spaced
SPACED = {
    "a+b*-c": "a + b * -c",
    "x=-1;y  =2": "x = -1; y = 2",
    "not  -x and(a or b)": "not -x and (a or b)",
    "raise go-on(x=1)": "raise go-on(x = 1)",
    "send plant.go-on after 5s": "send plant.go-on after 5s",
    "0 .. 9=1": "0..9 = 1",
    "0..-9 wrap=3": "0..-9 wrap = 3",
    "LIMIT ..-5 wrap=3": "LIMIT..-5 wrap = 3",
    "a?b:c": "a ? b : c",
    "f (x,y)[ 3 ].z": "f(x, y)[3].z",
    "if x{send a to(p)}else{}": "if x { send a to(p) } else {}",
    "x++; --y": "x++; --y",
    "1e-3+2": "1e-3 + 2",
    "a=1   # a=1": "a = 1   # a=1",
    'log "a=b",-x': 'log "a=b", -x',
    "x in[1,2]": "x in [1, 2]",
    "motor(speed  -1..1,on bool)": "motor(speed -1..1, on bool)",
    "n = a -1": "n = a - 1",
    "for i,x in xs { y+=x }": "for i, x in xs { y += x }",
    "  a=1\n\n    b=2": "  a = 1\n\n    b = 2",
    "/* a=1\n b=2 */ c=3": "/* a=1\n b=2 */ c=3",
    "`a`=1": "`a`=1",
}


@pytest.mark.parametrize("text", SPACED)
def test_operators_have_blanks_around_them(text: str) -> None:
    assert normalize_spaces(text) == SPACED[text]
    assert normalize_spaces(SPACED[text]) == SPACED[text]


LONG = "f(); " * 12 + "g()"
# what is shown: (spoilt, usual) below `states:`
LAYOUTS = {
    "the order of transitions is their priority": (
        "  a:\n    always: b\n    on: {go: b}\n    entry: f()\n",
        "  a:\n    entry: f()\n    always: b\n    on: {go: b}\n",
    ),
    "a transition that fits is in flow style": (
        "  a:\n    on:\n      go:\n        target: b\n        if: x\n",
        "  a:\n    on:\n      go: {if: x, target: b}\n",
    ),
    "one with statements on several lines is not": (
        "  a:\n    always:\n      target: b\n      do: |\n        f()\n        g()\n",
        "  a:\n    always:\n      target: b\n      do: |\n        f()\n        g()\n",
    ),
    "what is too long for flow style is a block": (
        f"  a: {{always: [{{if: x, target: b}}, {{do: {LONG}}}]}}\n",
        f"  a:\n    always:\n      - {{if: x, target: b}}\n      - {{do: {LONG}}}\n",
    ),
    "a comma within braces needs a block": (
        "  a:\n    on:\n      go:\n        do: f(1,2)\n",
        "  a:\n    on:\n      go:\n        do: f(1, 2)\n",
    ),
    "a list begins two blanks further right": (
        "  a:\n    on:\n      go:\n      - b\n",
        "  a:\n    on:\n      go:\n        - b\n",
    ),
    "a text that keeps its last lines": (
        "  a:\n    doc: |+\n      x\n\n  b: {}\n",
        '  a:\n    doc: "x\\n\\n"\n\n  b: {}\n',
    ),
    "blanks at the ends of lines of a text": (
        "  a:\n    doc: |\n       one  \n       two \n\n  b: {}\n",
        "  a:\n    doc: |\n      one  \n      two \n\n  b: {}\n",
    ),
    "an empty text": (
        "  a:\n    always:\n      target: b\n      do: |\n",
        '  a:\n    always: {target: b, do: ""}\n',
    ),
    "a quoted key without a value": ('  a: {"x": , y: }\n', '  a: {"x", y}\n'),
    "a text whose first line is indented": (
        "  a:\n    doc: |2\n         x\n        y\n",
        "  a:\n    doc: |2\n         x\n        y\n",
    ),
    "a text on several lines": (
        "  a:\n    doc: one\n       two\n\n       three\n",
        "  a:\n    doc: one\n      two\n\n      three\n",
    ),
    "a comment behind a text on several lines": (
        "  a:\n    doc: one\n       two # behind\n    entry: f()\n",
        "  a:\n    doc: one\n      two  # behind\n    entry: f()\n",
    ),
    "what would be other tokens stays as it is": (
        "  a:\n    always: {do: send! b, target: b}\n",
        "  a:\n    always: {target: b, do: send! b}\n",
    ),
    "an unknown key stays where it is": ("  a:\n    colour: red\n    entry: f()\n",) * 2,
    "quotes stay": ("  a:\n    on: {'go': \"b\", x: []}\n",) * 2,
    "an empty value stays": ("  a:\n  b: {on: {go: }}\n", "  a:\n  b: {on: {go}}\n"),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_layouts(name: str) -> None:
    spoilt, usual = (f"chart: A\n\nstates:\n{text}" for text in LAYOUTS[name])
    assert format_source(spoilt, "a.yaml") == usual
    assert format_source(usual, "a.yaml") == usual


def test_systems_and_deployments_have_their_own_order() -> None:
    system = "machines: {a: a.yaml}\nsystem: S\nproperties:\n  P: {never: a.x>1}\n"
    usual = "system: S\nmachines: {a: a.yaml}\n\nproperties:\n  P: {never: a.x > 1}\n"
    assert format_source(system, "s.yaml") == usual
    deployment = "nodes: {n: [a]}\nsystem: s.yaml\n"
    assert format_source(deployment, "d.yaml") == "system: s.yaml\nnodes: {n: [a]}\n"


def test_other_files_line_ends_and_marks_are_left_alone() -> None:
    assert format_source("services: {a:   1}\n", "compose.yaml") == "services: {a:   1}\n"
    assert format_source("- a\n-   b\n", "list.yaml") == "- a\n-   b\n"
    assert format_source("chart:   A\r\nstates: {a: {}}\r\n", "a.yaml").count("\r\n") == 2
    assert format_source("---\nchart:   A\n", "a.yaml") == "---\nchart: A\n"


XML = """\
<?xml version="1.0"?>
<!-- the licence -->
<scxml initial="a" name="A" datamodel="fsmkit" version="1.0" xmlns="http://www.w3.org/2005/07/scxml"
  xmlns:fk="urn:fsmkit:scxml">
<fk:doc>Text   of
 two lines</fk:doc>


<datamodel><data id='n' fk:type="0..9" expr="1+2"/></datamodel> <!-- behind -->
<state id="a"><transition target="b" cond="n&lt;=3" event="go"></transition>
      <!-- of
           two lines -->
<onentry><script>n = n+1;   f()</script></onentry>

</state><state id="b"/>
</scxml>
"""
XML_USUAL = """\
<?xml version="1.0"?>
<!-- the licence -->
<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0" name="A"
       initial="a" datamodel="fsmkit">
  <fk:doc>Text   of
 two lines</fk:doc>

  <datamodel>
    <data id='n' fk:type="0..9" expr="1 + 2"/>
  </datamodel> <!-- behind -->
  <state id="a">
    <transition event="go" cond="n&lt;=3" target="b"/>
    <!-- of
         two lines -->
    <onentry>
      <script>n = n+1;   f()</script>
    </onentry>
  </state>
  <state id="b"/>
</scxml>
"""


def test_xml_has_two_blanks_for_a_level_and_keeps_texts() -> None:
    assert format_source(XML, "a.scxml") == XML_USUAL
    assert format_source(XML_USUAL, "a.scxml") == XML_USUAL


def test_foreign_expressions_are_left_alone() -> None:
    text = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">\n'
    text += '  <state id="a">\n    <transition cond="/a+b/.test(x)"/>\n  </state>\n</scxml>\n'
    assert format_source(text, "a.scxml") == text


@pytest.mark.parametrize(
    "text", ["chart: [", "", "%YAML 1.2\n---\nchart: A\n", "chart: A\u2028B\n"]
)
def test_unreadable_yaml_is_an_error(text: str) -> None:
    with pytest.raises(FsmkitError):
        format_source(text, "a.yaml")


@pytest.mark.parametrize("text", ["<scxml>", "", "<scxml/><scxml/>"])
def test_unreadable_xml_is_an_error(text: str) -> None:
    with pytest.raises(FsmkitError):
        format_source(text, "a.scxml")


@pytest.mark.parametrize("name", ["feeder.yaml", "module.scxml", "cell.yaml", "deployment.yaml"])
def test_files_of_the_cell_change_once(name: str) -> None:
    before = (MACHINES / "production_cell" / name).read_text(encoding="utf-8")
    after = format_source(before, name)
    assert format_source(after, name) == after
    marks = [Counter(text.split())["#"] for text in (before, after)]
    assert marks[0] == marks[1]


@pytest.mark.parametrize("seed", range(3))
def test_random_charts_keep_their_plans_and_comments(seed: int) -> None:
    assert problem(seed) is None


def test_comments_of_any_columns_keep_their_order() -> None:
    for columns in itertools.product((0, 1, 2, 4, 6, 8), repeat=3):
        gap = "".join(f"{' ' * column}# {n}\n" for n, column in enumerate(columns))
        text = f"chart: X\ndata:\n  v:\n    type: 0..9\n{gap}inputs: {{}}\nstates: {{a: {{}}}}\n"
        result = format_source(text, "x.yaml")
        assert re.findall("# [0-9]", result) == ["# 0", "# 1", "# 2"]
