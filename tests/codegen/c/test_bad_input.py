"""Findings for charts that do not fit, distinct names for collisions, reports of hosts' errors."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.naming import name_everything
from fsmkit.codegen.c.reserved import HEADERS, INSIDE, KEYWORDS
from fsmkit.codegen.python.names import file_name
from fsmkit.codegen.python.plugin import PLUGIN as PYTHON
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.plan import lower
from tests.codegen.c.conftest import CHARTS, SANITIZERS, machine_of

Write = Callable[[Path, Mapping[str, str]], Path]
Compile = Callable[..., subprocess.CompletedProcess[str]]
RequireTool = Callable[[str], str]

CHART = """
chart: NAME
data: {NAME: uint8 = 0, samples: "uint8[2] = 0"}
operations: ["show(NAME uint8, switch uint8)"]
events: {in: [tick, "NAME(NAME uint8)"]}
capacity: {queue: QUEUE}
initial: a
states:
  a:
    on:
      tick: {do: 'NAME += 1; show(NAME, 1); for s in samples { NAME = s }; send tick after DELAY'}
      NAME: {do: 'show(event.NAME, 2)'}
    after: {DELAY: a}
"""


def written(folder: Path, name: str = "Plain", queue: str = "4", delay: str = "5ms") -> Path:
    """Write a chart whose name is that of a variable, a parameter, an event and a field, too."""
    text = CHART.replace("chart: NAME", f"chart: {name}").replace("NAME", name.lower())
    path = folder / f"{name}_chart.yaml"
    path.write_text(text.replace("QUEUE", queue).replace("DELAY", delay), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("queue", "delay", "rule"),
    [
        ("0", "5ms", "bad-capacity"),
        ("65536", "5ms", "bad-capacity"),
        ("4", "2147484s", "invalid-duration"),
        ("4", "99999999999999s", "invalid-duration"),
    ],
)
def test_what_does_not_fit_is_found(queue: str, delay: str, rule: str, tmp_path: Path) -> None:
    with pytest.raises(FsmkitError) as caught:
        load(written(tmp_path, "Plain", queue, delay))
    assert {finding.rule.name for finding in caught.value.diagnostics} == {rule}


HARD = ("Counter", "Queue", "Place", "Timer", "Class", "While", "None", "Fsm", "Main", "Signal")


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang", "g++", "clang++"])
def test_names_of_charts_that_are_taken(
    compiler: str, tmp_path: Path, compile_with: Compile, write: Write
) -> None:
    sources = []
    for name in HARD:
        machine = generate_machine(load(written(tmp_path, name)))
        assert "fsm.h" in machine.files
        assert machine.names.prefix == f"{name.lower()}_machine"
        write(tmp_path, machine.files)
        sources += [file for file in machine.files if file.endswith(".c")]
    compile_with(tmp_path, compiler, "-c", *sorted(set(sources)))


@pytest.mark.parametrize("name", HARD)
def test_names_that_python_has(name: str, tmp_path: Path) -> None:
    chart = load(written(tmp_path, name))
    made = PYTHON.generate(chart, Findings(), {})
    assert made is not None
    ((file, text),) = made.files.items()
    compile(text, file, "exec")
    compile(f"import {Path(file).stem}", "import", "exec")
    assert file == file_name(chart)


@pytest.mark.slow
def test_no_function_calls_what_it_holds_as_a_machine_may_be_called() -> None:
    """A type that a local name hides is a warning: each local is one that no machine has."""
    local = re.compile(
        r"\b(?:u?int\d+_t|bool|size_t|fsm_fault|const char|\w+_event) \*?(\w+)(?=[,);=[ ])"
    )
    for name in CHARTS:
        machine = machine_of(name)
        given = {*machine.names.fields.values(), *machine.names.variables.values()}
        for file, text in machine.files.items():
            code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
            for found in set(local.findall(code)) - given if file.endswith(".c") else ():
                if found.startswith((name, "fsm_")) or found[0].isupper():
                    continue
                other = name_everything(lower(replace(machine.names.chart, name=found)), None)
                assert other.prefix != found, f"{found} of {file}"


@pytest.mark.external
def test_states_and_events_that_are_told_apart_by_a_sign(
    tmp_path: Path, compile_with: Compile, write: Write
) -> None:
    path = tmp_path / "signs.yaml"
    path.write_text(
        "chart: Signs\n"
        "data: {a_b: uint8 = 0}\n"
        "events: {in: [go.on, go_on, go-on], out: [a_b]}\n"
        "operations: [go_on(), post_go_on()]\n"
        "initial: a-b\n"
        "states:\n"
        "  a-b: {on: {go.on: a_b}, entry: go_on(); a_b += 1}\n"
        "  a_b: {on: {go_on: a.b}, exit: send a_b; post_go_on()}\n"
        "  a.b: {on: {go-on: a-b}}\n",
        encoding="utf-8",
    )
    machine = generate_machine(load(path))
    assert len(set(machine.names.states)) == 4
    assert len(set(machine.names.events)) == len(machine.names.events)
    write(tmp_path, machine.files)
    compile_with(tmp_path, "gcc", "-c", "signs.c")
    compile_with(tmp_path, "g++", "-c", "signs.c")
    made = PYTHON.generate(load(path), Findings(), {})
    assert made is not None
    compile(made.files["signs.py"], "signs.py", "exec")


def test_words_of_c_are_kept_for_c() -> None:
    assert {"int", "class", "while", "template"} <= KEYWORDS
    assert {"stdint", "fsm", "main"} <= HEADERS
    assert "counter" in INSIDE


BOUNDED = """
chart: Bounded
types: {Mode: [slow, fast], Point: {x: "-5..5", y: uint8}}
data: {n: 0..9 = 0}
operations: [shown(n 0..9)]
events:
  in: [one(n 0..9), "two(on bool, mode Mode)", "many(list int8[2], at Point, few Mode[3])",
       all(n uint8), none]
initial: a
states: {a: {on: {one: {do: n = event.n; shown(n)}, two: a, many: a, all: a, none: a}}}
"""
BOUNDED_HOST = """
#include "bounded.h"
#include <stdio.h>
#include <string.h>
static fsm_result within;
static bool stepped;
void bounded_shown(bounded *m, uint8_t n)
{
    const bounded_event e = {.event = BOUNDED_EVENT_NONE};
    within = bounded_dispatch(m, &e, 0u);
    bounded_run(m, 0u);
    stepped = bounded_step_event(m);
    (void)n;
}
static bounded m;
static void give(const bounded_event *e)
{
    printf("%d %d\\n", (int)bounded_post(&m, e), (int)bounded_dispatch(&m, e, 0u));
    bounded_run(&m, 0u);
}
int main(void)
{
    bounded_event e = BOUNDED_NO_EVENT;
    bounded_init(&m);
    bounded_start(&m, 0u);
    give(&e); /* none at all */
    e.event = 200;
    give(&e);
    e.event = BOUNDED_EVENT_ONE;
    e.of.one.n = 9;
    give(&e);
    printf("within %d %d\\n", (int)within, (int)stepped);
    e.of.one.n = 10;
    give(&e);
    e = (bounded_event)BOUNDED_NO_EVENT;
    e.event = BOUNDED_EVENT_TWO;
    e.of.two.mode = BOUNDED_MODE_FAST;
    memset(&e.of.two.on, 1, 1);
    give(&e);
    memset(&e.of.two.on, 2, 1);
    give(&e);
    memset(&e.of.two.on, 0, 1);
    e.of.two.mode = 2;
    give(&e);
    e = (bounded_event)BOUNDED_NO_EVENT;
    e.event = BOUNDED_EVENT_MANY;
    e.of.many.at.x = -5;
    give(&e);
    e.of.many.at.x = -6;
    give(&e);
    e.of.many.at.x = 0;
    e.of.many.few[2] = 2;
    give(&e);
    printf("n %d, rejected %d\\n", m.data.n, m.fsm.rejected);
    return 0;
}
"""
HANDLED, BUSY, REJECTED = 1, 2, 4


@pytest.mark.external
def test_a_checked_build_refuses_what_no_declaration_allows(
    tmp_path: Path, compile_with: Compile, write: Write
) -> None:
    (tmp_path / "bounded.yaml").write_text(BOUNDED, encoding="utf-8")
    files = generate_machine(load(tmp_path / "bounded.yaml")).files
    write(tmp_path, {**files, "host.c": BOUNDED_HOST})
    compile_with(tmp_path, "g++", "-DFSM_CHECKED", "-c", "bounded.c")
    for compiler in ("gcc", "clang"):
        arguments = [*SANITIZERS, "-DFSM_CHECKED", "host.c", "bounded.c", "fsm.c", "-o", "host"]
        compile_with(tmp_path, compiler, *arguments)
        done = subprocess.run([tmp_path / "host"], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")
        good, bad = f"1 {HANDLED}", f"0 {REJECTED}"
        assert done.stdout.splitlines() == [
            *(bad, bad, good, f"within {BUSY} 0", bad, good, bad, bad, good, bad, bad),
            "n 9, rejected 7",
        ]


@pytest.mark.cc
def test_a_missing_operation_is_named_by_the_linker(
    tmp_path: Path, write: Write, require_tool: RequireTool
) -> None:
    (tmp_path / "bounded.yaml").write_text(BOUNDED, encoding="utf-8")
    files = generate_machine(load(tmp_path / "bounded.yaml")).files
    host = '#include "bounded.h"\nint main(void) { bounded m; bounded_init(&m); return 0; }\n'
    write(tmp_path, {**files, "host.c": host})
    command = [require_tool("gcc"), "-std=c99", "host.c", "bounded.c", "fsm.c", "-o", "host"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "undefined reference to `bounded_shown'" in done.stderr
    header = files["bounded.h"]
    assert (
        "/* Operations: the host defines them. */\nvoid bounded_shown(bounded *m, uint8_t n);"
        in header
    )
