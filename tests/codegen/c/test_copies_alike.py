"""Code for size has handlers of copies of a used chart once, with the copy as an argument."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from devtools.runtimes import harness
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.chart.statements import Raise
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import Options
from fsmkit.codegen.c.small.differences import Leaf, NotMergeable, unified
from fsmkit.language import Expr
from fsmkit.plan.instances import instances_of
from fsmkit.runtime.script import run_script

AXIS = """
chart: Axis
constants: {FAR: 2800, T_MOVE: 2s}
data: {tries: 0..3 = 0, past: "uint8[3]", at: 0..9 = 0}
inputs: {at_far: bool}
operations: ["goto(position 0..4000)"]
events: {in: [go, halt], out: [arrived(n 0..9)], internal: [hop]}
entries: {resumed: halted}
initial: idle
states:
  idle: {rest: true, on: {go: moving}}
  moving:
    entry: let now = tries; goto(FAR + now); past[at] = now; at += 1
    exit: log "left", at
    defer: [halt]
    always: [{if: "at_far and past[at - 1] < 9", target: there, do: send arrived(n = at)}]
    after: {T_MOVE: [{if: tries < 3, target: moving, do: tries += 1}, {target: jammed}]}
  halted: {rest: true, on: {go: {if: not In(moving), target: moving, do: raise hop}}}
  there: {final: true}
  jammed: {final: true, done: {with: {count: tries}}}
"""
EIGHT = """
chart: Eight
initial: all
states:
  all:
    regions:
      "axis[i in 0..7]": {use: axis.yaml}
    on: {done.state.all: end}
  end: {rest: true}
"""
NAMED = """
chart: Named
operations: ["drive(axis 0..9, position 0..4000)"]
events: {in: [both]}
initial: left
states:
  left: {use: axis.yaml, bind: {goto: "drive(1, position)"}, exits: {there: right, jammed: pair}}
  right: {use: axis.yaml, bind: {goto: "drive(4, position)"}, exits: {there: left.resumed, jammed: pair}}
  pair:
    regions:
      a: {use: axis.yaml, bind: {goto: "drive(7, position)", go: both}}
      b: {use: axis.yaml, with: {FAR: 30}, bind: {goto: "drive(8, position)", go: both}}
    on: {done.state.pair: left}
"""  # noqa: E501

Write = Callable[[Path, Mapping[str, str]], Path]
Compile = Callable[..., subprocess.CompletedProcess[str]]


def using(folder: Path, text: str, axis: str = AXIS) -> Chart:
    (folder / "axis.yaml").write_text(axis)
    (folder / "test.yaml").write_text(text)
    return load(folder / "test.yaml")


def script(chart: Chart) -> list[str]:
    """Move every copy, some until it jams, and look at everything."""
    lines = ["start 0"]
    now = 0
    inputs = [data.name for data in chart.inputs]
    events = [e.name for e in chart.events if {d.value for d in e.directions} == {"in"}]
    for turn in range(5):
        for number, event in enumerate(events):
            lines.append(f"post {event}")
            if number % 3 == turn % 3:
                lines.append(f"input {inputs[number % len(inputs)]} {(turn + number) % 2}")
            lines.append(f"run {now}")
        now += 1500 + 1000 * (turn % 2)
        lines += [f"run {now}", "dump"]
    return lines


def source(chart: Chart) -> str:
    machine = generate_machine(chart, "x", Options(is_small=True))
    return machine.files["x.c"]


@pytest.mark.cc
@pytest.mark.external
@pytest.mark.parametrize("text", [EIGHT, NAMED])
def test_it_does_what_the_interpreter_does(tmp_path: Path, text: str) -> None:
    chart = using(tmp_path, text)
    assert len(instances_of(chart).groups[0].bases) > 1
    assert "copy" in source(chart)
    assert harness("c-size").run(chart, script(chart)) == run_script(chart, script(chart))


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "g++"])
@pytest.mark.parametrize("text", [EIGHT, NAMED])
def test_it_compiles_without_a_warning(
    tmp_path: Path, text: str, compiler: str, compile_with: Compile, write: Write
) -> None:
    machine = generate_machine(using(tmp_path, text), "x", Options(is_small=True))
    write(tmp_path, machine.files)
    compile_with(tmp_path, compiler, "-O2", "-c", "x.c")


def test_each_handler_is_there_once(tmp_path: Path) -> None:
    text = source(using(tmp_path, EIGHT))
    assert text.count("m->data.axis[copy].tries < 3") == 1
    assert "m->data.axis[3].tries" not in text
    assert text.count("static void x_block_") == 1  # the entry of `moving`, which can fail
    assert text.count("switch (copy) {") == 3  # names of the host, and a label


def test_a_number_of_each_copy_is_computed(tmp_path: Path) -> None:
    """A bound call passes 1 in one copy and 4 in the other."""
    text = source(using(tmp_path, NAMED))
    assert text.count("(1u + 3u * copy)") == 1
    assert "x_call_drive(m, 4u" not in text


def test_one_thing_cannot_be_two_in_another_copy(tmp_path: Path) -> None:
    chart = using(tmp_path, NAMED)
    place = chart.root.span
    assert place is not None
    hops = [e.index for e in chart.events if e.name.endswith(".hop")]
    raised: list[Raise[int, Expr]] = [Raise(event, (), place) for event in hops]
    one, other, third, *_ = raised
    _, found = unified(chart, [(one, one), (other, other)])
    assert found.varying == {(Leaf.EVENT, hops[0]): (hops[0], hops[1])}
    for pair in ((other, third), (other,), (one, other)):
        with pytest.raises(NotMergeable):
            unified(chart, [(one, one), pair])


def test_copies_whose_constants_differ_have_their_own(tmp_path: Path) -> None:
    differing = EIGHT.replace(
        "{use: axis.yaml}", '{use: axis.yaml, with: {T_MOVE: "(i + 1) * 1s"}}'
    )
    text = source(using(tmp_path, differing))
    for copy in range(8):
        assert f"X_AXIS_{copy}_T_MOVE);" in text


def test_few_small_copies_are_not_worth_a_table(tmp_path: Path) -> None:
    lamp = """
    chart: Lamp
    outputs: {lit: bool = false}
    events: {in: [push]}
    states:
      dark: {entry: lit = false, on: {push: bright}}
      bright: {entry: lit = true, on: {push: dark}}
    """
    host = """
    chart: Host
    states:
      all: {regions: {a: {use: axis.yaml}, b: {use: axis.yaml}}}
    """
    assert "copy" not in source(using(tmp_path, host, lamp))
