"""Test every counted item at the limits of 8 and 16 bits, on every runtime and engine.

``python -m devtools.sizes`` prints a table: the item, its number, and for each runtime and engine
whether it agrees with the interpreter. A rejected size shows the rule. A row with ``differs`` or
``crashed`` is a defect; the program then exits with 1.
"""

from __future__ import annotations

import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import click

import fsmkit
from devtools.differential import first_difference
from devtools.runtimes import harness
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError, Severity
from fsmkit.testing.harness.harness import INTERPRETER
from fsmkit.verify.report.verdict import Verdict

BYTE = (255, 256, 257)
WORD = (65_535, 65_536, 65_537)
DEPTHS = (100, 1_000, 10_000)
RUNTIMES = ("python", "c", "c-size", "javascript", "pyext")
ENGINES = ("c", "python")
SECONDS = 60.0
"""The time limit of a check."""
START = ("start 0", "run 0")


@dataclass(frozen=True, slots=True)
class Sized:
    """A chart or a system with a number of something: its files, and a script for a chart."""

    main: str
    script: tuple[str, ...] = ()
    others: Mapping[str, str] = ()  # type: ignore[assignment]

    def write(self, folder: Path) -> Path:
        """Write the files to a folder; return the path of the first."""
        for name, text in dict(self.others).items():
            (folder / name).write_text(text, encoding="utf-8")
        path = folder / "main.yaml"
        path.write_text(self.main, encoding="utf-8")
        return path


def _chart(states: str, *, head: str = "", events: str = "in: [go, far]", first: str = "s0") -> str:
    """Return a chart with a property that an engine decides by the counted items."""
    return (
        f"chart: Sized\n{head}events: {{{events}}}\nenvironment: {{may: [go]}}\n"
        f"properties: {{never_last: {{never: In(last)}}}}\n"
        f"initial: {first}\nstates:\n{states}  last: {{rest: true}}\n"
    )


def _posts(*events: str) -> tuple[str, ...]:
    """Return the script that posts events one after another, each with a reaction."""
    lines = [*START]
    for at, event in enumerate(events, 1):
        lines += [f"post {event}", f"run {at}"]
    return (*lines, "dump", "save", f"restore {len(events)}", "dump")


def states(count: int) -> Sized:
    """Return a chart of sibling states; the events lead to the second and the last."""
    rows = [
        f"  s{n}: {{on: {{go: {f's{n + 1}' if n + 2 < count else 'last'}, far: last}}}}\n"
        for n in range(count - 1)
    ]
    return Sized(_chart("".join(rows)), _posts("go", "go", "far"))


def regions(count: int) -> Sized:
    """Return a chart of regions that all react to one event."""
    rows = [
        f"      r{n}: {{initial: a{n}, states: {{a{n}: {{on: {{go: b{n}}}}}, b{n}: {{}}}}}}\n"
        for n in range(count)
    ]
    far = f"  s0:\n    on: {{far: {{if: In(b{count - 1}), target: last}}}}\n    regions:\n"
    return Sized(_chart(far + "".join(rows)), _posts("go", "far"))


def histories(count: int) -> Sized:
    """Return a chart with a history in each of many states; the last one is used."""
    rows = [
        f"  p{n}: {{initial: a{n}, on: {{far: s0}}, states: {{h{n}: {{history: shallow, "
        f"default: a{n}}}, a{n}: {{on: {{go: b{n}}}}}, b{n}: {{on: {{go: last}}}}}}}}\n"
        for n in range(count)
    ]
    head = f"  s0: {{on: {{go: h{count - 1}}}}}\n"
    return Sized(_chart(head + "".join(rows)), _posts("go", "go", "far", "go", "go"))


def timers(count: int) -> Sized:
    """Return a chart of regions with a timer in each; the last one expires last."""
    rows = [
        f"      r{n}: {{initial: a{n}, states: {{a{n}: {{after: {{{n % 7 + 1}ms: b{n}}}}}, "
        f"b{n}: {{}}}}}}\n"
        for n in range(count)
    ]
    far = f"  s0:\n    on: {{go: {{if: In(b{count - 1}), target: last}}}}\n    regions:\n"
    waits = (f"run {at}" for at in range(1, 9))
    script = (*START, "save", "restore 0", *waits, "dump", "post go", "run 10", "dump")
    return Sized(_chart(far + "".join(rows)), script)


def timed_states(count: int) -> Sized:
    """Return a chart of states that time out one after another."""
    rows = [
        f"  s{n}: {{after: {{2ms: {f's{n + 1}' if n + 1 < count else 'last'}}}, "
        f"on: {{far: s{count - 1}}}}}\n"
        for n in range(count)
    ]
    script = (*START, "run 2", "run 3", "post far", "run 4", "run 5", "save", "restore 5", "run 6")
    return Sized(_chart("".join(rows)), (*script, "dump"))


def microsteps(count: int) -> Sized:
    """Return a chart that takes just as many microsteps as it may, and with `far` one more."""
    rows = (
        "  s0: {on: {go: b, far: {target: b, do: k = 0}}}\n"
        f"  b: {{always: [{{if: k < {count - 2}, do: k += 1}}, {{target: last}}]}}\n"
    )
    head = f"capacity: {{microsteps: {count}}}\ndata: {{k: 0..100000 = 0}}\n"
    return Sized(_chart(rows, head=head), _posts("go"))


def queued(count: int) -> Sized:
    """Return a chart with a queue that is filled, and one event more."""
    rows = "  s0: {on: {go: {do: n += 1}, far: {if: n > 3, target: last}}}\n"
    head = f"capacity: {{queue: {count}}}\ndata: {{n: 0..7 wrap = 0}}\n"
    fill = ["post go"] * (count - 1)
    script = (*START, *fill, "post far", "post far", "save", "restore 0", "run 1", "dump")
    return Sized(_chart(rows, head=head), script)


def deferred(count: int) -> Sized:
    """Return a chart that defers as many events as its queue has places."""
    rows = (
        "  s0: {defer: [go], on: {far: b}}\n"
        "  b: {on: {go: {do: n += 1}, far: {if: n > 3, target: last}}}\n"
    )
    head = f"capacity: {{queue: {count}}}\ndata: {{n: 0..100000 = 0}}\n"
    fill = [line for n in range(count - 1) for line in ("post go", f"run {n}")]
    script = (*START, *fill, "save", f"restore {count}", "post far", f"run {count}", "dump")
    return Sized(_chart(rows, head=head), script)


def raised(count: int) -> Sized:
    """Return a chart that raises as many internal events as it may."""
    raises = "; ".join(["raise inner"] * count)
    rows = f'  s0: {{on: {{go: {{do: "{raises}"}}, inner: {{do: n += 1}}, far: last}}}}\n'
    head = f"capacity: {{internal: {count}, microsteps: {count + 2}}}\ndata: {{n: 0..100000 = 0}}\n"
    return Sized(_chart(rows, head=head, events="in: [go, far], internal: [inner]"), _posts("go"))


def delayed(count: int) -> Sized:
    """Return a chart that sends as many delayed events as can be pending."""
    sends = "; ".join(f"send far after {n % 5 + 1}ms" for n in range(count))
    rows = f'  s0: {{on: {{go: {{do: "{sends}"}}, far: {{do: n += 1}}}}}}\n'
    head = f"capacity: {{delayed: {count}, queue: 8}}\ndata: {{n: 0..100000 = 0}}\n"
    waits = (f"run {at}" for at in range(1, 8))
    return Sized(_chart(rows, head=head), (*START, "post go", "run 0", *waits, "dump"))


def events(count: int) -> Sized:
    """Return a chart of many events; the last one is used."""
    names = ", ".join(["go", "far", *(f"e{n}" for n in range(count - 2))])
    rows = f"  s0: {{on: {{e{count - 3}: b, go: b}}}}\n  b: {{on: {{far: last, go: last}}}}\n"
    script = _posts(f"e{count - 3}", "e0", "far")
    return Sized(_chart(rows, events=f"in: [{names}]"), script)


def fields(count: int) -> Sized:
    """Return a chart with an event of many fields."""
    listed = ", ".join(f"f{n} 0..3" for n in range(count))
    rows = (
        f"  s0: {{on: {{go: b, big: {{if: event.f{count - 1} == 2, target: last}}}}}}\n  b: {{}}\n"
    )
    script = (*START, f"post big {' '.join(['1'] * (count - 1))} 2", "save", "restore 0", "run 1")
    return Sized(_chart(rows, events=f'in: [go, far, "big({listed})"]'), (*script, "dump"))


def members(count: int) -> Sized:
    """Return a chart with an enumeration of many members; the last one is used."""
    head = (
        f"types: {{Kind: [{', '.join(f'm{n}' for n in range(count))}]}}\ndata: {{k: Kind = m0}}\n"
    )
    rows = (
        f"  s0: {{on: {{go: {{if: k == Kind.m0, do: k = Kind.m{count - 1}, target: b}}}}}}\n"
        f"  b: {{on: {{far: {{if: k == Kind.m{count - 1}, target: last}}}}}}\n"
    )
    return Sized(_chart(rows, head=head), _posts("go", "far"))


def data(count: int) -> Sized:
    """Return a chart of many variables; the last one is used."""
    head = f"data: {{{', '.join(f'v{n}: 0..9 = {n % 10}' for n in range(count))}}}\n"
    rows = f"  s0: {{on: {{go: {{if: v{count - 1} < 9, do: v{count - 1} += 1}}, far: last}}}}\n"
    return Sized(_chart(rows, head=head), _posts("go", "far"))


def inputs(count: int) -> Sized:
    """Return a chart of many inputs; the last one is used."""
    head = f"inputs: {{{', '.join(f'v{n}: 0..9' for n in range(count))}}}\n"
    rows = f"  s0: {{on: {{go: {{if: v{count - 1} == 3, target: last}}}}}}\n"
    script = (*START, f"input v{count - 1} 3", "post go", "run 1", "dump", "save", "restore 1")
    return Sized(_chart(rows, head=head), script)


def constants(count: int) -> Sized:
    """Return a chart of many constants; the last one is used."""
    listed = ", ".join(f"K{n}: {n}" for n in range(count))
    head = f"constants: {{{listed}}}\ndata: {{x: 0..99999 = 0}}\n"
    rows = f"  s0: {{on: {{go: {{target: last, do: x = K{count - 1}}}}}}}\n"
    return Sized(_chart(rows, head=head), _posts("go"))


def transitions(count: int) -> Sized:
    """Return a chart with many guarded transitions on one event; the last one is taken."""
    ways = ", ".join([*(f"{{if: k == {n + 1}, target: b}}" for n in range(count - 1)), "last"])
    rows = f"  s0: {{on: {{go: [{ways}]}}}}\n  b: {{}}\n"
    return Sized(_chart(rows, head="data: {k: 0..100000 = 0}\n"), _posts("go"))


def operations(count: int) -> Sized:
    """Return a chart of many operations; the last one is called."""
    head = f"operations: [{', '.join(f'op{n}(x 0..9)' for n in range(count))}]\n"
    rows = f"  s0: {{on: {{go: {{target: last, do: op{count - 1}(3)}}}}}}\n"
    return Sized(_chart(rows, head=head.replace("(x 0..9)", '"', 0)), _posts("go"))


def parameters(count: int) -> Sized:
    """Return a chart with an operation and a function of many parameters; both are called."""
    listed = ", ".join(f"x{n} 0..3" for n in range(count))
    values = ", ".join(["1"] * (count - 1) + ["2"])
    head = (
        f'operations: ["op({listed})"]\n'
        f'functions:\n  ? "last_of({listed}) -> 0..3"\n  : x{count - 1}\n'
    )
    rows = (
        f'  s0: {{on: {{go: {{do: "op({values})", target: b}}}}}}\n'
        f'  b: {{on: {{go: {{if: "last_of({values}) == 2", target: last}}}}}}\n'
    )
    return Sized(_chart(rows, head=head), _posts("go", "go"))


def functions(count: int) -> Sized:
    """Return a chart of many functions; the last one is called."""
    listed = "".join(f"  f{n}(x 0..9) -> 0..99: x + {n % 50}\n" for n in range(count))
    rows = f"  s0: {{on: {{go: {{if: f{count - 1}(3) > 2, target: last}}}}}}\n"
    return Sized(_chart(rows, head=f"functions:\n{listed}"), _posts("go"))


def elements(count: int) -> Sized:
    """Return a chart with an array of many elements; the last one is used."""
    head = f'data: {{a: "0..3[{count}] = 0", i: 0..100000 = 0}}\n'
    rows = (
        f'  s0: {{on: {{go: {{do: "i = {count - 1}; a[i] = 2"}}, '
        f'far: {{if: "a[{count - 1}] == 2", target: last}}}}}}\n'
    )
    return Sized(_chart(rows, head=head), _posts("go", "far"))


def strings(count: int) -> Sized:
    """Return a chart of many strings; the last one is used."""
    head = "data: {s: symbol}\n"
    content = "; ".join(f"s = 'x{n}'" for n in range(count - 1))
    rows = (
        f'  s0: {{on: {{go: {{do: "{content}"}}, '
        f"far: {{if: \"s == 'x{count - 2}'\", target: last}}}}}}\n"
    )
    return Sized(_chart(rows, head=head), _posts("go", "far"))


def record_fields(count: int) -> Sized:
    """Return a chart with a record of many fields; the last one is used."""
    listed = ", ".join(f"f{n}: 0..9" for n in range(count))
    head = f"types: {{Row: {{{listed}}}}}\ndata: {{r: Row}}\n"
    rows = (
        f"  s0: {{on: {{go: {{do: r.f{count - 1} = 3}}, "
        f"far: {{if: r.f{count - 1} == 3, target: last}}}}}}\n"
    )
    return Sized(_chart(rows, head=head), _posts("go", "far"))


def terms(count: int) -> Sized:
    """Return a chart with a guard of many terms."""
    guard = " and ".join(f"k != {n + 1}" for n in range(count))
    rows = f"  s0: {{on: {{go: {{if: {guard}, target: last}}}}}}\n"
    return Sized(_chart(rows, head="data: {k: 0..100000 = 0}\n"), _posts("go"))


def statements(count: int) -> Sized:
    """Return a chart with many statements in a block."""
    content = "; ".join(["k += 1"] * count)
    rows = f'  s0: {{on: {{go: {{do: "{content}", target: last}}}}}}\n'
    return Sized(_chart(rows, head="data: {k: 0..100000 = 0}\n"), _posts("go"))


def copies(count: int) -> Sized:
    """Return a chart with an array of copies of another one."""
    used = (
        "chart: Part\nevents: {in: [go]}\ndata: {n: 0..9 = 0}\ninitial: a\n"
        "states: {a: {on: {go: {target: b, do: n += 1}}}, b: {}}\n"
    )
    rows = (
        f"  s0:\n    on: {{far: {{if: 'In(part[{count - 1}].b)', target: last}}}}\n    regions:\n"
        f'      "part[i in 0..{count - 1}]": {{use: part.yaml, bind: {{go: go}}}}\n'
    )
    return Sized(_chart(rows), _posts("go", "far"), {"part.yaml": used})


def invocations(count: int) -> Sized:
    """Return a chart that can invoke many machines, and does invoke the last one."""
    inner = (
        "chart: Inner\nevents: {in: [go]}\ninitial: a\n"
        "states: {a: {on: {go: end}}, end: {final: true}}\n"
    )
    rows = [
        f"  s{n}: {{invoke: {{id: c{n}, src: inner.yaml}}, on: {{far: s{count - 1}, "
        f"go: {{do: 'send go to \"#_c{n}\"'}}, done.invoke.c{n}: last}}}}\n"
        for n in range(count)
    ]
    return Sized(_chart("".join(rows)), _posts("far", "go"), {"inner.yaml": inner})


def machines(count: int) -> Sized:
    """Return a system of many machines in a ring, of which few can do anything."""
    node = (
        "chart: Node\nconstants: {IS_FIRST: false}\n"
        "events: {in: [token, go], out: [passed]}\ninitial: idle\n"
        "states: {idle: {on: {go: {if: IS_FIRST, target: sent}, token: had}},"
        " sent: {entry: send passed, rest: true}, had: {rest: true}}\n"
    )
    last = count - 1
    system = (
        f'system: Ring\nmachines:\n  "node[i in 0..{last}]": '
        f"{{chart: node.yaml, with: {{IS_FIRST: i == {last}}}}}\n"
        f"connect:\n  - node[i].passed -> node[(i + 1) % {count}].token\n"
        f'environment: {{may: ["node[{last}].go"]}}\n'
        f'properties: {{never_had: {{never: "node[0].In(had)"}}}}\n'
    )
    return Sized(system, (), {"node.yaml": node})


def connections(count: int) -> Sized:
    """Return a system of two machines with many connections of events; the last one is used."""
    names = [f"e{n}" for n in range(count)]
    left = (
        f"chart: Left\nevents: {{in: [go], out: [{', '.join(names)}]}}\ninitial: a\n"
        f"states: {{a: {{on: {{go: {{target: b, do: send {names[-1]}}}}}}}, b: {{rest: true}}}}\n"
    )
    right = (
        f"chart: Right\nevents: {{in: [{', '.join(names)}]}}\ninitial: a\n"
        f"states: {{a: {{rest: true, on: {{{names[0]}: c, {names[-1]}: had}}}}, "
        "c: {rest: true}, had: {rest: true}}\n"
    )
    links = "".join(f"  - left.{name} -> right.{name}\n" for name in names)
    return _pair(left, right, links)


def levels(count: int) -> Sized:
    """Return a system of two machines with many outputs connected to inputs; the last is used."""
    names = [f"v{n}" for n in range(count)]
    left = (
        f"chart: Left\noutputs: {{{', '.join(f'{name}: 0..3 = 0' for name in names)}}}\n"
        f"events: {{in: [go]}}\ninitial: a\n"
        f"states: {{a: {{on: {{go: {{target: b, do: {names[-1]} = 2}}}}}}, b: {{rest: true}}}}\n"
    )
    right = (
        f"chart: Right\ninputs: {{{', '.join(f'{name}: 0..3' for name in names)}}}\n"
        f"initial: a\nstates: {{a: {{rest: true, always: [{{if: {names[-1]} == 2, target: had}}, "
        f"{{if: {names[0]} == 2, target: c}}]}}, c: {{rest: true}}, had: {{rest: true}}}}\n"
    )
    links = "".join(f"  - left.{name} -> right.{name}\n" for name in names)
    return _pair(left, right, links)


def _pair(left: str, right: str, links: str) -> Sized:
    """Return a system of two connected machines, with a property that is violated."""
    system = (
        "system: Pair\nmachines: {left: left.yaml, right: right.yaml}\n"
        f"connect:\n{links}environment: {{may: [left.go]}}\n"
        "properties: {never_had: {never: right.In(had)}, never_c: {never: right.In(c)}}\n"
    )
    return Sized(system, (), {"left.yaml": left, "right.yaml": right})


def properties(count: int) -> Sized:
    """Return a chart with many properties, of which the last one is violated."""
    listed = "".join(
        f"  p{n}: {{never: In({'last' if n == count - 1 else 's9'})}}\n" for n in range(count)
    )
    return Sized(
        f"chart: Sized\nevents: {{in: [go]}}\nenvironment: {{may: [go]}}\nproperties:\n{listed}"
        "initial: s0\nstates:\n  s0: {on: {go: last}}\n  s9: {}\n  last: {rest: true}\n",
        _posts("go"),
    )


def nested_states(count: int) -> Sized:
    """Return a chart of states in each other."""
    inner = "on: {go: last}"
    for n in range(count - 1, -1, -1):
        inner = f"states: {{s{n}: {{{inner}}}}}"
    return Sized(_chart(f"  top: {{{inner}}}\n", first="top"), _posts("go"))


def nested_brackets(count: int) -> Sized:
    """Return a chart with a guard in many brackets."""
    guard = f"{'(' * count}k == 0{')' * count}"
    rows = f"  s0: {{on: {{go: {{if: {guard}, target: last}}}}}}\n"
    return Sized(_chart(rows, head="data: {k: 0..9 = 0}\n"), _posts("go"))


def nested_choices(count: int) -> Sized:
    """Return a chart with a value of conditions in each other."""
    value = "0"
    for n in range(count):
        value = f"(k == {n % 9 + 1} ? {n % 9} : {value})"
    rows = f'  s0: {{on: {{go: {{do: "k = {value}", target: last}}}}}}\n'
    return Sized(_chart(rows, head="data: {k: 0..9 = 0}\n"), _posts("go"))


def negations(count: int) -> Sized:
    """Return a chart with a guard of many negations."""
    rows = f"  s0: {{on: {{go: {{if: {'not ' * count}k == {count % 2}, target: last}}}}}}\n"
    return Sized(_chart(rows, head="data: {k: 0..9 = 0}\n"), _posts("go"))


def nested_statements(count: int) -> Sized:
    """Return a chart with `if` in each other."""
    content = "k += 1"
    content = "if k == 0 { " * count + content + " }" * count
    rows = f'  s0: {{on: {{go: {{do: "{content}", target: last}}}}}}\n'
    return Sized(_chart(rows, head="data: {k: 0..9 = 0}\n"), _posts("go"))


def nested_copies(count: int) -> Sized:
    """Return a chart with nested uses of charts."""
    others = {
        f"c{n}.yaml": f"chart: C{n}\nevents: {{in: [go]}}\ninitial: a\n"
        f"states: {{a: {{use: c{n + 1}.yaml, bind: {{go: go}}}}}}\n"
        for n in range(count - 1)
    }
    others[f"c{count - 1}.yaml"] = (
        "chart: End\nevents: {in: [go]}\ninitial: a\nstates: {a: {on: {go: b}}, b: {}}\n"
    )
    rows = "  s0: {use: c0.yaml, bind: {go: go}, on: {far: last}}\n"
    return Sized(_chart(rows), _posts("go", "far"), others)


COUNTED: tuple[Callable[[int], Sized], ...] = (
    states, regions, histories, timers, timed_states, microsteps, queued, deferred, raised, delayed,
    events, fields, record_fields, members, data, inputs, constants, functions, strings, elements,
    transitions, operations, parameters, terms, statements, copies, invocations, machines,
    connections, levels, properties,
)  # fmt: skip
NESTED: tuple[Callable[[int], Sized], ...] = (
    nested_states, nested_brackets, nested_choices, negations, nested_statements, nested_copies,
)  # fmt: skip
BY_NAME = {each.__name__: each for each in (*COUNTED, *NESTED)}
AGREES, SLOW = "agrees", f"not decided in {SECONDS:.0f} s"
Cells = Mapping[str, str]


def outcomes(
    sized: Sized, folder: Path, runtimes: Sequence[str] = RUNTIMES, engines: Sequence[str] = ENGINES
) -> Iterator[tuple[str, str]]:
    """Yield by runtime and by engine whether it agrees, or why the size is rejected there.

    A size that is rejected when it is read has this one outcome, since no runtime is reached then.
    """
    path = sized.write(folder)
    try:
        subject = fsmkit.read(path)
    except Exception as error:  # noqa: BLE001  (a crash is a result of this program)
        yield "read", _rejection(error)
        return
    if isinstance(subject, Chart) and sized.script:
        expected = INTERPRETER.run(subject, sized.script)
        for name in runtimes:
            yield name, _compared(name, subject, sized.script, expected)
    verdicts = []
    for name in engines:
        found = _verdict(path, name)
        verdicts.append(found)
        is_decided = SLOW not in (found, verdicts[0])
        yield f"check {name}", f"differs: {found}" if is_decided and found != verdicts[0] else found


def _compared(name: str, chart: Chart, script: Sequence[str], expected: Sequence[str]) -> str:
    try:
        difference = first_difference(name, expected, harness(name).run(chart, script))
    except Exception as error:  # noqa: BLE001  (a crash is a result of this program)
        return _rejection(error)
    return AGREES if difference is None else f"differs: {difference}"


def _verdict(path: Path, engine: str) -> str:
    try:
        report = fsmkit.check(path, engine=engine, time="discrete", timeout=SECONDS)
    except Exception as error:  # noqa: BLE001  (a crash is a result of this program)
        return _rejection(error)
    if Verdict.UNDECIDED in {each.verdict for each in report.results}:
        return SLOW
    found = {each.name: each.verdict.value for each in report.results}
    violated = ", ".join(name for name, verdict in found.items() if verdict == "violated")
    return f"{len(found)} verdicts, violated: {violated or 'none'}"


def _rejection(error: Exception) -> str:
    """Return the rules by which something is rejected, or the crash."""
    if not isinstance(error, FsmkitError):
        return f"crashed: {type(error).__name__}: {traceback.format_exc(limit=-2)[-300:]}"
    rules = {d.rule.name: d.message for d in error.diagnostics if d.severity is Severity.ERROR}
    if rules.keys() & {"harness-failed", "c-compiler-failed", "explorer-build"}:
        return f"crashed: {' '.join(rules.values())[:300]}"
    return f"rejected: {', '.join(sorted(rules))}"


def is_defect(outcome: str) -> bool:
    """Return whether an outcome is neither agreement nor a rejection."""
    return outcome.startswith(("differs", "crashed"))


def row(kind: str, count: int, runtimes: Sequence[str], engines: Sequence[str]) -> Cells:
    """Return the outcomes of a counted thing at a size."""
    with tempfile.TemporaryDirectory(prefix="fsmkit-sizes-") as name:
        return dict(outcomes(BY_NAME[kind](count), Path(name), runtimes, engines))


def table(
    kinds: Iterable[str], counts: Sequence[int], runtimes: Sequence[str], engines: Sequence[str]
) -> Iterator[tuple[str, int, Cells, float]]:
    """Yield for each kind and size its outcomes and the elapsed seconds."""
    for kind in kinds:
        nested = BY_NAME[kind] in NESTED
        for count in DEPTHS if nested and counts in (BYTE, WORD, (*BYTE, *WORD)) else counts:
            before = time.perf_counter()
            cells = row(kind, count, runtimes, engines)
            yield kind, count, cells, time.perf_counter() - before


def _names(value: str, known: Iterable[str]) -> tuple[str, ...]:
    chosen = tuple(name.strip() for name in value.split(",") if name.strip())
    unknown = set(chosen) - set(known)
    if unknown:
        raise click.BadParameter(f"{', '.join(unknown)}; use {', '.join(known)}")
    return chosen


@click.command()
@click.option("--kinds", default=",".join(BY_NAME), help="Counted things, with commas.")
@click.option("--counts", default="255,256,257", show_default=True, help="Sizes, with commas.")
@click.option("--runtimes", default=",".join(RUNTIMES), show_default=True)
@click.option("--engines", default=",".join(ENGINES), show_default=True)
def main(kinds: str, counts: str, runtimes: str, engines: str) -> None:
    """Print the table; end with 1 if some runtime or engine disagrees."""
    sizes = tuple(int(count) for count in counts.split(","))
    failed = False
    found = table(
        _names(kinds, BY_NAME), sizes, _names(runtimes, RUNTIMES), _names(engines, ENGINES)
    )
    print("| counted | number | seconds | result |\n|---|---|---|---|")  # noqa: T201
    for kind, count, cells, seconds in found:
        failed |= any(map(is_defect, cells.values()))
        groups: dict[str, list[str]] = {}
        for name, outcome in cells.items():
            groups.setdefault(outcome, []).append(name)
        told = "; ".join(f"{', '.join(names)}: {outcome}" for outcome, names in groups.items())
        print(f"| {kind} | {count:,} | {seconds:.1f} | {told} |", flush=True)  # noqa: T201
    sys.exit(failed)


if __name__ == "__main__":
    main()
