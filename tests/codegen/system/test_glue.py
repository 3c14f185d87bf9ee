"""The C of a system does what its machines do in the interpreter, wired: the same traces."""

from __future__ import annotations

import os
import random
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.scripts import value
from fsmkit.chart.analysis.host_events import posted_events, sent_events
from fsmkit.cli import execute
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.header import parameters
from fsmkit.codegen.c.storage import storage
from fsmkit.codegen.system.glue import compose
from fsmkit.codegen.system.parts import Part, named_charts, parts_of
from fsmkit.diagnostics import Findings
from fsmkit.emit import snake
from fsmkit.emit.c import quoted
from fsmkit.language import Field, Type, default_value
from fsmkit.language.values import to_python
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.system_session import Happening, SystemSession
from fsmkit.system.system import System
from fsmkit.system.system_file import load_system
from tests.codegen.c.conftest import SANITIZERS, WARNINGS

LARGE = bool(os.environ.get("FSMKIT_SIZES"))
MACHINES = Path(__file__).parents[3] / "machines"
TALK = """\
system: Talk
machines: {west: player.yaml, right: player.yaml, judge: judge.yaml}
connect:
  - west.hit -> right.ball
  - right.hit -> west.ball
  - west.hit -> judge.hit
  - west.note -> west.noted
  - judge.called -> right.noted
  - judge.level -> west.limit
  - west.call -> judge.called_for
environment: {may: [west.serve, right.serve, judge.whistle], will: [judge]}
"""
PLAYER = """\
chart: Player
data: {hits: 0..9 wrap = 0, first: bool = true}
inputs: {limit: -2..9}
operations: ["call(who 0..3, why 0..200)", look() -> 0..9]
events:
  in: [ball(speed 0..99), noted(why 0..200), serve(speed 0..9)]
  out: [hit(speed 0..99), note(why 0..200)]
initial: waiting
states:
  waiting:
    entry: send note(why = 7)
    always: [{if: limit > 6, target: resting}]
    on:
      ball:
        target: hitting
        do: |
          hits += 1
          if event.speed > 50 { send note(why = event.speed) }
      serve: {if: event.speed > 2, target: hitting, do: "call(2, event.speed)"}
      noted: {if: event.why > 90, target: resting}
  hitting:
    after: {70ms: {target: waiting, do: send hit(speed = 3 * hits + 40)}}
  resting:
    always: [{if: limit < 3, target: waiting}]
    after: {250ms: waiting}
"""
JUDGE = """\
chart: Judge
data: {n: 0..99 wrap = 0}
outputs: {level: -2..9 = 2}
events:
  in: [hit(speed 0..99), "called_for(who 0..3, why 0..200)", whistle]
  out: [called(why 0..200)]
initial: calm
states:
  calm:
    entry: send called(why = 99)
    on:
      hit: {do: n += event.speed; level = n % 11 - 2}
      called_for: {if: event.why > 5, target: calm}
      whistle: {target: strict, do: level = 8}
  strict: {after: {130ms: {target: calm, do: level = -1}}, on: {whistle: over}}
  over: {on: {whistle: calm}, every: {90ms: {do: send called(why = n)}}}
"""
HOOKS = """\
#include <stdio.h>
#define FSM_HOOK_BEGIN(m, cause, index) \\
    ((cause) == FSM_TIMEOUT ? (void)printf("NAME timeout %d\\n", (int)(index)) : (void)0)
#define FSM_HOOK_EXIT(m, state) ((void)(m), (void)printf("NAME - %d\\n", (int)(state)))
#define FSM_HOOK_TAKE(m, transition) ((void)(m), (void)printf("NAME t %d\\n", (int)(transition)))
#define FSM_HOOK_ENTER(m, state) ((void)(m), (void)printf("NAME + %d\\n", (int)(state)))
#define FSM_HOOK_EVENT(m, what, e) \\
    ((void)(m), (void)printf("NAME event %d %d\\n", (int)(what), (int)(e)->event))
"""
RAISED, SENT_OUT, UNHANDLED, TAKEN = 0, 3, 4, 11
"""Kinds of `fsm_note`."""

Script = list[tuple[str, str, tuple[str, ...], int]]
"""Machine, event, values (nothing where only time passes), and how far time goes on then."""


@pytest.fixture
def talk(tmp_path: Path) -> Path:
    """Return a system of one chart twice, with a self-connection and features `cell.yaml` lacks."""
    for name, text in (("talk", TALK), ("player", PLAYER), ("judge", JUDGE)):
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    return tmp_path / "talk.yaml"


def random_script(system: System, seed: int, length: int) -> Script:
    choices = SeededChoices(str(seed))
    chance = random.Random(seed)
    posted = [(m.name, m.chart, i) for m in system.machines for i in posted_events(m.chart)]
    likely = [(system.machines[p.machine], p) for p in system.possible if not p.spontaneous]
    found: Script = [("", "", (), 8000)]
    for _ in range(length):
        kind = chance.randrange(10)
        passes = chance.choice((0, 0, 1, 90, 500, 1000, 3000))
        if kind < 5 and likely:
            machine, possible = chance.choice(likely)
            event = machine.chart.events[possible.event]
            values = tuple(str(int(v)) for v in possible.payload if isinstance(v, int))
            found.append((machine.name, event.name, values, passes))
        elif kind < 7:
            name, chart, index = chance.choice(posted)
            event = chart.events[index]
            values = tuple(value(choices, field.type) for field in event.fields)
            found.append((name, event.name, values, passes))
        else:
            found.append(("", "", (), passes))
    return found


def expected_trace(system: System, parts: tuple[Part, ...], script: Script) -> list[str]:
    session = SystemSession(system)
    prefix = {system.machines[part.index].name: part.prefix for part in parts}
    charts = {machine.name: machine.chart for machine in system.machines}
    lines = [line for done in session.start() for line in happened(done, prefix)]
    now = 0
    for machine, event, values, passes in script:
        if machine:
            declared = charts[machine].events[charts[machine].event_index[event]]
            payload = {
                field.name: to_python(int(text), field.type)
                for field, text in zip(declared.fields, values, strict=True)
            }
            session.post(machine, event, **payload)
            lines += [line for done in session.run(now) for line in happened(done, prefix)]
        now += passes
        lines += [line for done in session.run(now) for line in happened(done, prefix)]
        lines.append(f"now {now}")
    return lines


def happened(done: Happening, prefix: dict[str, str]) -> Iterator[str]:
    name = prefix[done.machine]
    match done.macrostep.event:
        case snap.Timeout(transition):
            yield f"{name} timeout {transition}"
        case snap.Occurrence(event):
            yield f"{name} event {TAKEN} {event + 1}"
    for effect in done.macrostep.effects:
        match effect:
            case snap.Exited(state):
                yield f"{name} - {state}"
            case snap.Entered(state):
                yield f"{name} + {state}"
            case snap.Taken(transition):
                yield f"{name} t {transition}"
            case snap.Raised(occurrence):
                yield f"{name} event {RAISED} {occurrence.event + 1}"
            case snap.Emitted(occurrence):
                yield f"{name} event {SENT_OUT} {occurrence.event + 1}"
            case snap.Unhandled(event):
                yield f"{name} event {UNHANDLED} {event + 1}"


def host(system: System, parts: tuple[Part, ...], script: Script) -> str:
    """Return a host that plays the script, with empty functions for unconnected ports."""
    s = snake(system.name)
    by_name = {system.machines[part.index].name: part for part in parts}
    lines = [
        "#include <stdio.h>",
        f'#include "{s}.h"',
        f"static {s} s;",
        *unconnected(system, parts),
    ]
    lines += ["int main(void) {", f"{s}_init(&s);", f"(void){s}_start(&s, 0u);"]
    now = 0
    for machine, event, values, passes in script:
        if machine:
            part = by_name[machine]
            name = part.names.event_names[part.chart.event_index[event]]
            given = "".join(f", {text}" for text in values)
            lines.append(f"(void){part.prefix}_post_{name}(&s.{part.member}{given});")
            lines.append(f"while (!{s}_run(&s, {now}u)) {{ }}")
        now += passes
        lines.append(f"while (!{s}_run(&s, {now}u)) {{ }}")
        lines.append(f'printf("now {now}\\n");')
    return "\n".join([*lines, "return 0;", "}", ""])


def unconnected(system: System, parts: tuple[Part, ...]) -> Iterator[str]:
    done = set()
    for part in parts:
        connected = {link.port for link in system.event_links if link.source == part.index}
        events = part.chart.events
        functions: list[tuple[int, str, tuple[Field, ...], Type | None]] = [
            (index, f"send_{part.names.event_names[index]}", events[index].fields, None)
            for index in sent_events(part.chart)
        ]
        functions += [
            (len(events) + n, part.names.operations[o.name], o.parameters, o.result)
            for n, o in enumerate(part.chart.operations)
        ]
        for port, name, fields, result in functions:
            if port in connected or (part.prefix, port) in done:
                continue
            done.add((part.prefix, port))
            ctype = "void" if result is None else storage(result, {}).text
            given = parameters(fields, part.names)
            unused = "".join(f" (void){part.names.field(field.name)};" for field in fields)
            least = None if result is None else default_value(result)
            answer = f" return {int(least)};" if isinstance(least, int) else ""
            yield f"{ctype} {part.prefix}_{name}({part.prefix} *m{given})"
            yield f"{{ (void)m;{unused}{answer} }}"


def built(
    path: Path, folder: Path, compiler: str, seed: int, length: int, *options: str
) -> tuple[list[str], list[str]]:
    """Build a system with a host; return its trace and that of the interpreter.

    ``options``: more arguments of the compiler.
    """
    findings = Findings()
    system = load_system(path, findings)
    charts = named_charts(system)
    files = {name: text for chart in charts for name, text in generate_machine(chart).files.items()}
    queued = {chart.name for chart in charts}
    joined = compose(system, charts, queued, findings)
    assert joined, [finding.message for finding in findings]
    parts = parts_of(system, charts, queued)
    script = random_script(system, seed, length)
    files |= joined | {"main.c": host(system, parts, script)}
    prefixes = dict.fromkeys(part.prefix for part in parts)
    files |= {f"trace_{name}.h": HOOKS.replace("NAME", name) for name in prefixes}
    folder.mkdir(exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    objects = ["main.c", f"{snake(system.name)}.c", "fsm.c"]
    for name in prefixes:
        hooks = f"-DFSM_HOOKS={quoted(f'trace_{name}.h')}"
        call(folder, compiler, "-std=c99", "-O1", *SANITIZERS, hooks, "-c", f"{name}.c")
        objects.append(f"{name}.o")
    flags = ["-std=c99", "-O1", *WARNINGS, *SANITIZERS, *options]
    call(folder, compiler, *flags, *objects, "-o", "host")
    return call(folder, "./host").splitlines(), expected_trace(system, parts, script)


def call(folder: Path, *command: str) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:3000]
    return done.stdout


@pytest.mark.slow
@pytest.mark.cc
def test_the_cell_is_the_same_joined_in_c(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    cc = require_tool("gcc")
    got, expected = built(MACHINES / "production_cell/cell.yaml", tmp_path, cc, 1, 400)
    assert got == expected
    assert len(got) > 3000


@pytest.mark.cc
@pytest.mark.parametrize("seed", range(3))
def test_charts_that_run_twice_and_talk_to_themselves(
    seed: int, talk: Path, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    got, expected = built(talk, tmp_path / "made", require_tool("gcc"), seed, 300)
    assert got == expected
    assert {line.split()[0] for line in got} == {"west", "right", "judge", "now"}


@pytest.mark.cc
@pytest.mark.parametrize("steps", [1, 7])
def test_calls_that_end_early_continue_where_they_stopped(
    steps: int, talk: Path, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    """The host calls `run` until it returns true, so its bound has no effect on the trace."""
    gcc = require_tool("gcc")
    got, expected = built(talk, tmp_path / "made", gcc, 1, 100, f"-DTALK_STEPS={steps}u")
    assert got == expected


@pytest.mark.external
def test_is_clean_everywhere(
    talk: Path, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    folder = tmp_path / "made"
    assert execute(["compile", str(talk), "--out", str(folder)]) == 0
    for compiler, *standard in (
        ("gcc", "-std=c99"),
        ("clang", "-std=c99"),
        ("g++", "-x", "c++", "-std=c++17"),
    ):
        call(folder, require_tool(compiler), *standard, *WARNINGS, "-c", "talk.c")


@pytest.mark.cc
def test_what_does_not_fit_is_counted(
    talk: Path, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    folder = tmp_path / "made"
    assert execute(["compile", str(talk), "--with", "world", "--out", str(folder)]) == 0
    system = load_system(talk, Findings())
    charts = named_charts(system)
    empty = "\n".join(unconnected(system, parts_of(system, charts, ())))
    (folder / "main.c").write_text(
        f"""
        #include <stdio.h>
        #include "talk.h"
        {empty}
        static talk s;
        int main(void)
        {{
            talk_init(&s);
            for (int i = 0; i < 3; i++)
                west_call(&s.west, 1, 1);
            printf("%u %u\\n", (unsigned)s.lost, (unsigned)s.judge.fsm.rejected);
            if (!talk_start(&s, 0))
                return 1;
            for (int i = 0; i < 11; i++)
                west_call(&s.west, 1, 1);
            printf("%u %u\\n", (unsigned)s.lost, (unsigned)s.judge.fsm.rejected);
            return 0;
        }}
        """,
        encoding="utf-8",
    )
    sources = [path.name for path in folder.iterdir() if path.suffix == ".c"]
    call(folder, require_tool("gcc"), "-std=c99", *SANITIZERS, *sources, "-o", "host")
    assert call(folder, "./host") == "3 3\n3 3\n"


def test_shared_data_are_not_joined(
    talk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = talk.read_text(encoding="utf-8")
    talk.write_text(text + "shared: {n: 0..99 wrap = 0}\n", encoding="utf-8")
    assert execute(["compile", str(talk), "--with", "world", "--out", str(tmp_path / "made")]) == 0
    assert "`shared` data are not joined in C" in capsys.readouterr().err
    assert not (tmp_path / "made" / "talk.c").exists()


def test_what_a_connection_cannot_carry_is_said(
    tmp_path: Path, talk: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = talk.read_text(encoding="utf-8")
    talk.write_text(text.replace("west.call -> judge.called_for", "west.look -> judge.whistle"))
    assert execute(["compile", str(talk), "--with", "world", "--out", str(tmp_path / "made")]) == 0
    assert "`west.look` returns a value" in capsys.readouterr().err
    assert (
        execute(
            ["compile", str(talk), "--with", "world", "--out", str(tmp_path), "--without", "queue"]
        )
        == 2
    )


@pytest.mark.slow
@pytest.mark.parametrize(("count", "width"), [(255, "uint8_t"), (256, "uint16_t")])
def test_the_number_of_the_machine_that_runs_is_wide_enough(
    count: int, width: str, tmp_path: Path
) -> None:
    (tmp_path / "node.yaml").write_text(
        "chart: Node\nevents: {in: [go], out: [pass]}\nstates: {a: {on: {go: {do: send pass}}}}\n"
    )
    path = tmp_path / "ring.yaml"
    path.write_text(
        f"system: Ring\nmachines: {{'n[i in 0..{count - 1}]': node.yaml}}\n"
        f"connect: ['n[i].pass -> n[(i + 1) % {count}].go']\nenvironment: {{may: []}}\n"
    )
    assert execute(["compile", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert f"{width} working;" in (tmp_path / "out" / "ring.h").read_text()


RING = """\
chart: Node
events: {in: [token, go], out: [passed]}
initial: idle
states:
  idle: {on: {go: sent, token: had}}
  sent: {entry: send passed, after: {2ms: idle}}
  had: {after: {3ms: {target: idle, do: send passed}}}
"""


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize("count", [255, 257] if LARGE else [20])
def test_a_ring_of_many_machines_is_the_same_joined_in_c(
    count: int, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    """Each machine has code of its own, since each is connected to another one."""
    (tmp_path / "node.yaml").write_text(RING, encoding="utf-8")
    path = tmp_path / "ring.yaml"
    path.write_text(
        f"system: Ring\nmachines: {{'n[i in 0..{count - 1}]': node.yaml}}\n"
        f"connect: ['n[i].passed -> n[(i + 1) % {count}].token']\n"
        f"environment: {{may: ['n[0].go', 'n[{count - 1}].go']}}\n",
        encoding="utf-8",
    )
    got, expected = built(path, tmp_path / "made", require_tool("gcc"), 3, 6)
    assert got == expected
    assert len({line.split()[0] for line in got}) > count
