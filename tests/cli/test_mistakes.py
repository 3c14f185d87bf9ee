"""Mistakes that people make, in both notations: each message names the cause and a way out."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.runtime.cycles import round_of

HEAD = """\
chart: A
types: {Fault: [none, jam]}
data: {n: 0..9 = 0, fault: Fault = none}
events: {in: [go]}
initial: a
"""
STATES = "states:\n  a: {on: {go: b}}\n  b: {}\n"
SCXML = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0" '
    'datamodel="fsmkit" initial="a">'
)
GOOD = "chart: G\nevents: {in: [go], out: [ready]}\ninitial: a\nstates: {a: {on: {go: a}}}\n"

# name: (file, text, all that must be told, place)
MISTAKES = {
    "a blank too many before a key": (
        "a.yaml",
        HEAD + "states:\n    a:\n        on: {go: b}\n     b: {}\n",
        ("this line is indented by 5, the entries before it by 4", "fix: indent it by 4"),
        ("a.yaml:9:6", "a.yaml:7:5"),
    ),
    "a blank too many within a state": (
        "a.yaml",
        HEAD + "states:\n  a:\n    on: {go: b}\n     after: {5s: b}\n  b: {}\n",
        ("this line is indented by 5, the entries before it by 4",),
        ("a.yaml:9:6", "a.yaml:8:5"),
    ),
    "a blank too few": (
        "a.yaml",
        HEAD + "states:\n   a:\n     on: {go: b}\n  b: {}\n",
        ("this line is indented by 2, the entries before it by 3",),
        ("a.yaml:9:3", "a.yaml:7:4"),
    ),
    "a blank before a key at the margin": (
        "a.yaml",
        "chart: A\n initial: a\nstates: {a: {}}\n",
        ("this line is indented by 1, the entries before it by 0",),
        ("a.yaml:2:2", "a.yaml:1:1"),
    ),
    "a blank too few in a list of a system": (
        "s.yaml",
        "system: S\nmachines:\n  g: good.yaml\nproperties:\n  p:\n    never: g.In(a)\n   q: x\n",
        ("this line is indented by 3, the entries before it by",),
        ("s.yaml:7:4",),
    ),
    "a tab": (
        "a.yaml",
        HEAD + "states:\n  a:\n\ton: {go: b}\n  b: {}\n",
        ("YAML is indented with blanks; here is a tab", "fix: write two blanks for each tab"),
        ("a.yaml:8:1",),
    ),
    "blanks and a tab": (
        "a.yaml",
        HEAD + "states:\n  a:\n  \ton: {go: b}\n  b: {}\n",
        ("YAML is indented with blanks; here is a tab",),
        ("a.yaml:8:3",),
    ),
    "a text with a colon is still to be quoted": (
        "a.yaml",
        "chart: A\ndoc: this: that\nstates: {a: {}}\n",
        ("must be quoted",),
        ("a.yaml:2:10",),
    ),
    "a unit that is none": (
        "a.yaml",
        HEAD + "states:\n  a: {after: {5sec: b}}\n  b: {}\n",
        ("`sec` is no unit; units are us, ms, s, m, h, d", "write `5s`"),
        ("a.yaml:7:16",),
    ),
    "a unit that nobody knows": (
        "a.yaml",
        HEAD + "states:\n  a: {after: {5fortnights: b}}\n  b: {}\n",
        ("`fortnights` is no unit; units are us, ms, s, m, h, d", "write `5ms` or `5s`"),
        ("a.yaml:7:16",),
    ),
    "a unit that is none in xml": (
        "a.scxml",
        SCXML + '<state id="a"><transition fk:after="5sec" target="a"/></state></scxml>',
        ("`sec` is no unit; units are us, ms, s, m, h, d", "write `5s`"),
        ("a.scxml:1:",),
    ),
    "a unit that is none in a send": (
        "a.scxml",
        SCXML.replace('fsmkit"', 'ecmascript"')
        + '<state id="a"><onentry><send event="e" delay="5sec"/></onentry>'
        '<transition event="e" target="a"/></state></scxml>',
        ("`sec` is no unit; units are us, ms, s, m, h, d",),
        ("a.scxml:1:",),
    ),
    "a key of a system in a chart": (
        "a.yaml",
        HEAD + "shared: {p: x}\n" + STATES,
        ("a chart has no key `shared`", "`shared` belongs to a system"),
        ("a.yaml:6:1",),
    ),
    "a key of a chart in a system": (
        "s.yaml",
        "system: S\nmachines: {g: good.yaml}\nevents: {in: [x]}\n",
        ("a system has no key `events`", "`events` belongs to a chart (at the left margin)"),
        ("s.yaml:3:1",),
    ),
    "a key of a transition in a state": (
        "a.yaml",
        HEAD + "states:\n  a: {on: {go: b}, target: b}\n  b: {}\n",
        ("state `a` has no key `target`", "`target` belongs to a transition"),
        ("a.yaml:7:20",),
    ),
    "a key of a deployment in a chart": (
        "a.yaml",
        HEAD + STATES + "links: {}\n",
        ("`links` belongs to a deployment",),
        ("a.yaml:9:1",),
    ),
    "a key that is misspelt": (
        "a.yaml",
        HEAD + "opperations: []\n" + STATES,
        ("did you mean `operations`?",),
        ("a.yaml:6:1",),
    ),
    "an attribute of another element": (
        "a.scxml",
        SCXML + '<state id="a" cond="true"/></scxml>',
        ("`<state>` has no attribute `cond`", "`cond` belongs to `<transition>`"),
        ("a.scxml:1:",),
    ),
    "a number and a member": (
        "a.yaml",
        HEAD + "states:\n  a: {on: {go: b}}\n  b: {entry: n = 100 + fault}\n",
        ("a number and a `Fault` cannot be added", "compare with `==`"),
        ("a.yaml:8:18",),
    ),
    "a number and a member in xml": (
        "a.scxml",
        SCXML + '<fk:type name="Fault" members="none jam"/>'
        '<datamodel><data id="f" fk:type="Fault" expr="Fault.none"/>'
        '<data id="n" fk:type="0..9" expr="0"/></datamodel>'
        '<state id="a"><onentry><assign location="n" expr="1 + f"/></onentry></state></scxml>',
        ("a number and a `Fault` cannot be added", "compare with `==`"),
        ("a.scxml:1:",),
    ),
    "a connection in braces": (
        "s.yaml",
        "system: S\nmachines: {a: good.yaml, b: good.yaml}\nconnect:\n  - {a.ready -> b.go}\n",
        ("a connection is a text: write it without braces", "write `- a.ready -> b.go`"),
        ("s.yaml:4:5",),
    ),
    "a chart in json": (
        "a.json",
        '{"chart": "X"}',
        (
            "charts are YAML or SCXML; a `.json` configures the library `transitions`",
            "has the key `states`",
        ),
        ("a.json:1:2",),
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_told(
    name: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    file, text, messages, places = MISTAKES[name]
    monkeypatch.chdir(tmp_path)
    Path("good.yaml").write_text(GOOD, encoding="utf-8")
    Path(file).write_text(text, encoding="utf-8")
    assert execute(["show", file, "--strict"]) == 1
    told = capsys.readouterr().err
    for part in (*messages, *places):
        assert part in told


SET = """\
chart: A
events: {in: [set(v 0..9), post, wait(t 0..3), go]}
inputs: {lamp: bool}
initial: a
states: {a: {on: {set: b}}, b: {on: {post: a, wait: a, go: a}}}
"""


@pytest.mark.parametrize("target", ["interpreter", "python"])
def test_an_event_of_any_name_can_be_posted(
    target: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chart = tmp_path / "set.yaml"
    chart.write_text(SET, encoding="utf-8")
    events = "post set v=3; post post; post wait 2; go; set lamp true; post set 4"
    assert execute(["run", str(chart), "--events", events, "--trace", "-t", target]) == 0
    steps = [line for line in capsys.readouterr().out.splitlines() if "> event" in line]
    assert steps == [
        "@0 > event set 3",
        "@0 > event post",
        "@0 > event wait 2",
        "@0 > event go",
        "@0 > event set 4",
    ]


@pytest.mark.parametrize("line", ["set v=3", "post", "wait"])
def test_the_way_to_post_is_told(
    line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chart = tmp_path / "set.yaml"
    chart.write_text(SET, encoding="utf-8")
    assert execute(["run", str(chart), "--events", line]) == 1
    assert f"to post the event: `post {line}`" in capsys.readouterr().err


def test_post_in_a_system(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "set.yaml").write_text(SET, encoding="utf-8")
    system = tmp_path / "s.yaml"
    system.write_text("system: S\nmachines: {m: set.yaml}\n", encoding="utf-8")
    assert execute(["run", str(system), "--events", "post m.set v=3; m.post; m.set 4"]) == 0
    told = capsys.readouterr().out
    assert [line for line in told.splitlines() if "0ms" in line] == [
        "m      0ms  start",
        "m      0ms  set v=3",
        "m      0ms  post",
        "m      0ms  set v=4",
    ]


def test_time_to_wait_has_a_unit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chart = tmp_path / "set.yaml"
    chart.write_text(SET, encoding="utf-8")
    assert execute(["run", str(chart), "--events", "wait 5sec"]) == 1
    assert "`sec` is no unit; units are us, ms, s, m, h, d" in capsys.readouterr().err
    assert execute(["run", str(chart), "--events", "wait 1d"]) == 0


@pytest.mark.cc
def test_each_transition_that_is_never_taken_is_told_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "gate.yaml").write_text(
        "chart: G\nevents: {in: [go, no]}\ninitial: a\nstates:\n  a:\n    on:\n      go: b\n"
        "      no: a\n  b:\n    after: {1s: a}\n    on:\n      no: a\n",
        encoding="utf-8",
    )
    system = tmp_path / "s.yaml"
    system.write_text(
        "system: S\nmachines: {m: gate.yaml}\nenvironment: {may: [m.go]}\n", encoding="utf-8"
    )
    execute(["check", str(system)])
    told = capsys.readouterr().err
    gate = tmp_path / "gate.yaml"
    assert f"never takes 2 of its transitions: of `a` at {gate}:8, of `b` at {gate}:12" in told


LOOPS = {
    "two": (
        "  b: {always: c}\n  c: {always: b}\n",
        ["b -> c (loop.yaml:6)", "c -> b (loop.yaml:7)"],
    ),
    "itself": ("  b: {always: {target: b, do: n = 1}}\n", ["b -> b (loop.yaml:6)"]),
    "three, after a way to them": (
        "  b: {always: c}\n  c: {always: d}\n  d: {always: e}\n  e: {always: c}\n",
        ["c -> d (loop.yaml:7)", "d -> e (loop.yaml:8)", "e -> c (loop.yaml:9)"],
    ),
}


@pytest.mark.cc
@pytest.mark.parametrize("name", LOOPS)
def test_a_fault_of_microsteps_names_the_cycle(
    name: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    states, cycle = LOOPS[name]
    monkeypatch.chdir(tmp_path)
    head = "chart: Loop\nevents: {in: [go]}\ndata: {n: 0..99 = 0}\nstates:\n  a: {on: {go: b}}\n"
    Path("loop.yaml").write_text(head + states, encoding="utf-8")
    for arguments in (["run", "loop.yaml", "--events", "go"], ["check", "loop.yaml"]):
        assert execute(arguments) == 1
        told = capsys.readouterr()
        assert f"round and round: {', '.join(cycle)}" in told.out


@pytest.mark.parametrize(
    ("taken", "found"),
    [((), ()), ((1,), ()), ((1, 2, 3), ()), ((4, 1, 1), (1,)), ((1, 2, 1, 2), (1, 2))],
)
def test_what_ends_twice_is_a_round(taken: tuple[int, ...], found: tuple[int, ...]) -> None:
    assert round_of(taken) == found
