# ruff: noqa: E501  (a table of texts, a line each)
"""Fixes: each removes the finding that carries it, and brings no error."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Diagnostic, Findings, FsmkitError, Severity
from fsmkit.diagnostics.fixes import apply_edits
from fsmkit.system.any_file import read_with_boards

Y = "chart: A\ninitial: a\n"
AB = "states:\n  a: {on: {go: b}}\n  b: {}\n"
GO = "events: {in: [go]}\n"
X = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0" '
    'name="A" datamodel="fsmkit" initial="a">\n  <fk:event direction="in" signature="go"/>\n'
)
XAB = '  <state id="a"><transition event="go" target="b"/></state>\n  <state id="b"/>\n</scxml>\n'
BASE = (
    "chart: Base\nevents: {in: [go]}\ndata: {n: 0..9 = 0}\ninitial: a\n"
    "states:\n  a:\n    entry: n = 1\n    invariant: n < 9\n    on: {go: [{id: t, target: b}]}\n"
    "  b:\n    initial: c\n    states: {c: {}, d: {}}\n"
)
ABSTRACT = BASE + "  e: {abstract: true}\n"
OTHER = (
    "chart: G\nevents: {in: [go, stop], out: [done_]}\ninputs: {lit: bool}\ninitial: a\n"
    "states:\n  a: {on: {go: {target: b, do: send done_}}}\n  b: {on: {stop: {if: lit, target: a}}}\n"
)
WORLD = (
    "chart: W\nevents: {in: [done_], out: [go]}\noutputs: {lit: bool = false}\ninitial: a\n"
    "states: {a: {sometimes: {do: send go}, on: {done_: {do: lit = not lit}}}}\n"
)
S = "system: S\nmachines:\n  g: other.yaml\n  w: world.yaml\n"
WIRES = "connect:\n  - w.go -> g.go\n  - g.done_ -> w.done_\n  - w.lit -> g.lit\n"
MAY = "environment:\n  may: [g.stop]\n  will: [w]\n"

# name: (file, text, rule)
CASES = {
    "a state": ("a.yaml", Y + GO + AB.replace("go: b", "go: bb").replace("  b:", "  bbb:"), "unknown-name"),
    "a state, SCXML": ("a.scxml", X + XAB.replace('target="b"', 'target="bb"').replace('id="b"', 'id="bbb"'), "unknown-name"),
    "a type of C": ("a.yaml", Y + GO + "data: {n: int = 0}\n" + AB.replace("go: b", "go: {target: b, if: n < 1}"), "unknown-name"),
    "a key": ("a.yaml", Y + GO + AB.replace("{on:", "{onn:"), "unknown-key"),
    "an attribute": ("a.scxml", X + XAB.replace("target=", "targt="), "unknown-attribute"),
    "an attribute that means nothing": ("a.scxml", X + XAB.replace('id="b"', 'id="b" colour="red"'), "unknown-attribute"),
    "an element": ("a.scxml", X + XAB.replace('<state id="b"/>', '<state id="b"><colour/></state>'), "unknown-element"),
    "a flag": ("a.yaml", Y + GO + AB.replace("b: {}", "b: {rest: yes}"), "unexpected-value"),
    "a flag, SCXML": ("a.scxml", X + XAB.replace('id="b"', 'id="b" fk:rest="yes"'), "unexpected-attribute-value"),
    "a choice, SCXML": ("a.scxml", X + XAB.replace('target="b"', 'target="b" type="inner"'), "unexpected-attribute-value"),
    "tabs": ("a.yaml", Y + GO + "states:\n  a:\n\t\ton: {go: b}\n  b: {}\n", "broken-yaml"),
    "a blank too many": ("a.yaml", Y + GO + "states:\n  a:\n    on: {go: b}\n     after: {5s: a}\n  b: {}\n", "broken-yaml"),
    "a text with a comma": ("a.yaml", Y + "operations: [f(a 0..9, b 0..9)]\nstates: {a: {entry: f(1, 2)}}\n", "lost-text"),
    "no name": ("a.yaml", (Y + GO + AB).partition("\n")[2], "missing-key"),
    "no version": ("a.scxml", (X + XAB).replace(' version="1.0"', ""), "missing-version"),
    "no namespace": ("a.scxml", (X + XAB).replace(' xmlns="http://www.w3.org/2005/07/scxml"', ""), "missing-namespace"),
    "a key twice": ("a.yaml", Y + GO + AB.replace("b: {}", "b: {}\n  b: {}"), "duplicate-key"),
    "a key twice, in flow style": ("a.yaml", Y + GO + AB.replace("b: {}", "b: {doc: x, doc: x}"), "duplicate-key"),
    "entry unmarked": ("a.yaml", "chart: A\nextends: base.yaml\nrefine:\n  a:\n    entry: n = 2\n", "unmarked-override"),
    "initial unmarked": ("a.yaml", "chart: A\nextends: base.yaml\nrefine:\n  b: {initial: d}\n", "unmarked-override"),
    "an invariant unmarked": ("a.yaml", "chart: A\nextends: base.yaml\nrefine: {a: {invariant: n < 8}}\n", "unmarked-override"),
    "entry unmarked, SCXML": ("a.scxml", X.split("  <fk:event", maxsplit=1)[0].replace(' initial="a"', ' fk:extends="base.yaml"') + '<fk:refine state="a"><onentry><assign location="n" expr="2"/></onentry></fk:refine></scxml>', "unmarked-override"),
    "override without a base": ("a.yaml", Y + GO + AB.replace("go: b", "go: {target: b, override: true}"), "override-of-nothing"),
    "an id of no transition": ("a.yaml", "chart: A\nextends: base.yaml\nrefine: {a: {on: {go: {override: tt, do: n = 2}}}}\n", "override-of-nothing"),
    "a number without a unit": ("a.yaml", Y + "states: {a: {after: {5: b}}, b: {}}\n", "invalid-duration"),
    "data without a use": ("a.yaml", Y + GO + "data:\n  n: 0..9 = 0\n  m: bool = false\n" + AB.replace("go: b", "go: {target: b, if: m}"), "unread-data"),
    "data without a use, SCXML": ("a.scxml", X + '  <datamodel>\n    <data id="n" fk:type="bool" expr="false"/>\n  </datamodel>\n' + XAB, "unread-data"),
    "an event without a use": ("a.yaml", Y + "events:\n  in:\n    - go\n    - stop\n" + AB, "unused-event"),
    "an event without a use, in a list": ("a.yaml", Y + "events: {in: [stop, go]}\n" + AB, "unused-event"),
    "an event without a use, SCXML": ("a.scxml", X + '  <fk:event direction="in" signature="stop"/>\n' + XAB, "unused-event"),
    "an unknown data model": ("a.scxml", (X + XAB).replace('datamodel="fsmkit"', 'datamodel="python"').replace('  <fk:event direction="in" signature="go"/>\n', ""), "unknown-datamodel"),
    "a guard at the end of a choice": ("a.yaml", Y + "inputs: {x: bool}\nstates:\n  a:\n    choice:\n      - {if: x, target: b}\n      - if: not x\n        target: c\n  b: {}\n  c: {}\n", "choice-without-default"),
    "initial of a leaf": ("a.yaml", Y + GO + AB.replace("b: {}", "b: {initial: a, doc: x}"), "initial-not-allowed"),
    "a history without a default": ("a.yaml", Y + GO + "states:\n  a: {on: {go: h}}\n  b:\n    states:\n      h: {history: deep}\n      c: {}\n", "history-without-default"),
    "raise of an output event": ("a.yaml", Y + "events: {in: [go], out: [x]}\n" + AB.replace("go: b", "go: {target: b, do: raise x}"), "wrong-direction"),
    "raise of an output event, SCXML": ("a.scxml", X + '  <fk:event direction="out" signature="x"/>\n' + XAB.replace('target="b"/>', 'target="b"><raise event="x"/></transition>'), "wrong-direction"),
    "an argument twice": ("a.yaml", Y + "events: {in: [go], out: [x(n 0..9)]}\n" + AB.replace("go: b", "go: {target: b, do: 'send x(n = 1, n = 2)'}"), "duplicate-argument"),
    "attributes that exclude each other": ("a.scxml", X + XAB.replace('target="b"/>', 'target="b"><log expr="1"/><send event="go" eventexpr="go"/></transition>').replace('direction="in"', 'direction="internal"'), "conflicting-attributes"),
    "text that nothing reads": ("a.scxml", X + XAB.replace('<state id="b"/>', '<state id="b">what for</state>'), "stray-text"),
    "division as in Python": ("a.yaml", Y + GO + "data: {n: 0..9 = 4}\n" + AB.replace("go: b", "go: {target: b, if: n // 2 > 1}"), "outside-language"),
    "division that is a comment": ("a.yaml", Y + GO + "data: {n: 0..9 = 4}\n" + AB.replace("go: b", "go: {target: b, if: n > 1, do: n = n // 2}"), "comment-or-division"),
    "one equals sign": ("a.yaml", Y + GO + "data: {n: 0..9 = 4}\n" + AB.replace("go: b", "go: {target: b, if: n = 2}"), "expression-syntax"),
    "a comparison of a comparison": ("a.yaml", Y + GO + "data: {n: 0..9 = 4}\n" + AB.replace("go: b", "go: {target: b, if: 1 < n < 3}"), "chained-comparison"),
    "guards that overlap": ("a.yaml", Y + GO + "inputs: {x: 0..9}\nstates:\n  a:\n    on:\n      go:\n        - {if: x > 2, target: b}\n        - {if: x < 5, target: a}\n  b: {}\n", "nondeterministic-choice"),
    "guards that overlap, SCXML": ("a.scxml", X + '  <fk:input id="x" type="0..9"/>\n' + XAB.replace('<transition event="go" target="b"/>', '<transition event="go" cond="x > 2" target="b"/><transition event="go" cond="x &lt; 5" target="a"/>'), "nondeterministic-choice"),
    "hidden by an inherited transition": ("a.yaml", "chart: A\nextends: base.yaml\ninputs: {x: bool}\nrefine: {a: {on: {go: {if: x, target: a}}}}\n", "dead-transition"),
    "an abstract state left": ("a.yaml", "chart: A\nextends: abstract.yaml\n", "abstract-state-left"),
    "a capacity that is no number": ("a.yaml", Y + GO + "capacity: {queue: many}\n" + AB, "bad-capacity"),
    "a tick that is too long": ("a.yaml", Y + GO + "capacity: {tick: 0ms}\n" + AB, "bad-capacity"),
    "every nought seconds": ("a.yaml", Y + "states: {a: {every: {0s: a}}}\n", "bad-delay"),
    "an interval that ends first": ("a.yaml", Y + "states: {a: {after: {5s..2s: a}}}\n", "bad-delay"),
    "an event that is inherited": ("a.yaml", "chart: A\nextends: base.yaml\noperations: [f()]\nevents: {in: [go, stop]}\nrefine: {b: {on: {stop: {do: f()}}}}\n", "redefines-inherited"),
    "targets that exclude each other": ("a.yaml", Y + GO + AB.replace("go: b", "go: [a, b]").replace("go: [a, b]", "go: {target: [b, a]}"), "targets-exclude-each-other"),
    "an empty range": ("a.yaml", Y + GO + "data: {n: 9..0 = 0}\n" + AB.replace("go: b", "go: {target: b, if: n < 1}"), "invalid-type"),
    "a wire twice": ("s.yaml", S + WIRES + "  - w.go -> g.go\n" + MAY, "duplicate-connection"),
    "a wire in braces": ("s.yaml", S + WIRES.replace("- w.go -> g.go", "- {w.go -> g.go}") + MAY, "broken-connection"),
    "an input that nothing drives": ("s.yaml", S + WIRES.replace("  - w.lit -> g.lit\n", "") + MAY, "unconnected-input"),
    "an event that never comes": ("s.yaml", S + WIRES + "environment:\n  will: [w]\n", "unconnected-event"),
    "an event that never comes, no environment": ("s.yaml", S + WIRES, "unconnected-event"),
    "a machine that may": ("s.yaml", S + WIRES + "environment:\n  may: [g.stop, w]\n", "machine-that-may"),
    "an input that will": ("s.yaml", S + WIRES.replace("  - w.lit -> g.lit\n", "") + "environment:\n  may: [g.stop]\n  will: [w, g.lit]\n", "input-that-will"),
    "a machine without a turn": ("s.yaml", S + WIRES + "environment:\n  may: [g.stop, w.done_]\nschedule: {cyclic: [g], period: 10ms}\n", "unscheduled-machine"),
    "a machine in the order twice": ("s.yaml", S + WIRES + MAY + "schedule: {cyclic: [g, g], period: 10ms}\n", "duplicate-name"),
    "another arrow": ("s.yaml", S + WIRES.replace("w.go -> g.go", "w.go => g.go") + MAY, "broken-connection"),
    "a range with a dash": ("a.yaml", Y + GO + "data: {n: 0-9 = 0}\n" + AB.replace("go: b", "go: {target: b, if: n < 1}"), "unknown-name"),
    "no blank after a colon": ("a.yaml", Y.replace("initial: a", "initial:a") + GO + AB, "broken-yaml"),
    "no comma": ("a.yaml", Y + GO + "data: {n: 0..9 = 4}\n" + AB.replace("go: b", "go: {if: n > 2 target: b}"), "broken-yaml"),
    "shared by none": ("s.yaml", S + "shared:\n  x: bool = false\n" + WIRES + MAY, "unshared-data"),
}  # fmt: skip


def read(path: Path) -> list[Diagnostic]:
    """Return what is found in a file."""
    findings = Findings()
    try:
        read_with_boards(path, findings)
    except FsmkitError as error:
        return list(error.diagnostics)
    return list(findings)


def write(folder: Path, name: str, text: str) -> Path:
    for other, content in (
        ("base.yaml", BASE), ("abstract.yaml", ABSTRACT), ("other.yaml", OTHER),
        ("world.yaml", WORLD), (name, text),
    ):  # fmt: skip
        (folder / other).write_text(content, encoding="utf-8")
    return folder / name


def carried(findings: list[Diagnostic], rule: str) -> Iterator[Diagnostic]:
    return (finding for finding in findings if finding.rule.name == rule)


@pytest.mark.parametrize("name", CASES)
def test_each_fix_removes_its_finding_and_brings_no_error(name: str, tmp_path: Path) -> None:
    file, text, rule = CASES[name]
    path = write(tmp_path, file, text)
    before = read(path)
    found = next(carried(before, rule))
    assert found.fixes, "no fix"
    errors = sum(f.severity is Severity.ERROR for f in before)
    for fix in found.fixes:
        path.write_text(apply_edits(text, fix.edits), encoding="utf-8")
        after = read(path)
        left = [f for f in carried(after, rule) if f.message == found.message]
        known = [f for f in carried(before, rule) if f.message == found.message]
        assert len(left) < len(known), (fix.title, path.read_text())
        wrong = [f for f in after if f.severity is Severity.ERROR]
        allowed = errors - (found.severity is Severity.ERROR)
        assert len(wrong) <= allowed, (fix.title, path.read_text(), wrong)


def test_thirty_rules_carry_fixes() -> None:
    assert len({rule for _, _, rule in CASES.values()}) >= 30


def test_check_fix_applies_what_is_sure(tmp_path: Path) -> None:
    path = write(tmp_path, "a.scxml", (X + XAB).replace(' version="1.0"', ""))
    with_python = ["check", "--fix", "--engine", "python", "--time", "discrete"]
    assert execute([*with_python, str(path)]) == 1  # it stops in `b`, where nothing goes on
    assert 'version="1.0"' in path.read_text(encoding="utf-8")
    guess = Y + GO + AB.replace("go: b", "go: bb")
    path = write(tmp_path, "b.yaml", guess)
    assert execute([*with_python, str(path)]) == 1
    assert path.read_text(encoding="utf-8") == guess


def test_sarif_carries_fixes(tmp_path: Path) -> None:
    path = write(tmp_path, "a.yaml", CASES["a key"][1])
    log = tmp_path / "log.sarif"
    assert execute(["show", "--sarif", str(log), str(path)]) == 1
    result = json.loads(log.read_text(encoding="utf-8"))["runs"][0]["results"][0]
    (change,) = result["fixes"][0]["artifactChanges"]
    assert change["replacements"][0]["insertedContent"] == {"text": "on"}
    assert change["replacements"][0]["deletedRegion"]["startLine"] == 5


@pytest.mark.parametrize(
    ("name", "wire"),
    [
        ("an input that nothing drives", "w.lit -> g.lit"),
        ("an event that never comes", "w.go -> g.stop"),
    ],
)
def test_a_port_is_connected(name: str, wire: str, tmp_path: Path) -> None:
    file, text, rule = CASES[name]
    text = text.replace("  - w.go -> g.go\n", "")
    found = carried(read(write(tmp_path, file, text)), rule)
    assert f"Connect `{wire}`" in [fix.title for each in found for fix in each.fixes]
