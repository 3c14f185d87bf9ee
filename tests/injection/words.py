"""Reserved words of every notation as every kind of name: ``python -m tests.injection.words``.

A chart holds many words in one kind of place (its states, its events, ...), so that a compiler or a
parser runs once for many words.
"""

from __future__ import annotations

import json
import keyword
import re
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from unittest.mock import patch

import click

from fsmkit.carriers.can.dbc_writing import WORDS as DBC
from fsmkit.carriers.ros.definitions import KEYWORDS as IDL
from fsmkit.codegen.c import reserved as c
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.export.cspm.identifiers import TAKEN as CSPM
from fsmkit.export.promela.words import WORDS as PROMELA
from fsmkit.export.uppaal.names import FLAT as UPPAAL
from fsmkit.system.any_file import load_any
from tests.injection import judges
from tests.injection.outputs import OUTPUTS, Output, judge

ECMASCRIPT = """
    abstract any arguments as async await boolean break case catch class const constructor continue
    debugger declare default delete do else enum eval export extends false finally for from function
    get if implements import in infer instanceof interface is keyof let module namespace never new
    null number object of package private protected prototype public readonly require return set
    static string super switch symbol this throw true try type typeof undefined unique unknown var
    void while with yield Array Boolean Error Infinity Machine NaN Number Object String Symbol
    Uint8Array globalThis rt saving host definition
"""
JANI = """
    action actions assignments automata automaton clock constants-definition edges effect elements
    exp guard initial-value input-enable int jani-version kind left location locations name op
    output-params probability properties rate real restrict-initial right synchronise syncs system
    time-progress transient value variables
"""
DOT = "node edge graph digraph subgraph strict"
DIAGRAMS = """
    end state note direction stateDiagram stateDiagram-v2 sequenceDiagram classDef class click style
    default hide empty description scale choice fork join history participant actor loop alt opt par
    rect activate deactivate startuml enduml left right top bottom of as also is up down skinparam
    title header footer legend caption page newpage partition group ref create destroy return
"""
FMI = "fmiModelDescription time unit none inf nan fmi2Component fmi3Instance value variable"
PYTHON = (
    *keyword.kwlist,
    *keyword.softkwlist,
    *["self", "cls", "print", "int", "str", "None_", "Any", "IntEnum", "mro"],
)
OTHERS = """
    process block par proc map sort var struct act init allow hide rename comm sum delta tau nil
    exit stop choice hide in end type is module specification behaviour i rendezvous
"""
LETTERS = """
    öffnen Öffnen ändern schließen état naïve łódź пуск стоп Пуск ожидание κλειστό Ω 電機 电机
    시작 🚀 a→b ﬁnal ½
"""
CASES = "userhold userHold UserHold USERHOLD user_hold user-hold flash.top flashTop a-b a_b A_b"
NOTATIONS: dict[str, tuple[str, ...]] = {
    "C and C++": (*c.LOCALS, "errno", "stdin", "NULL", "EOF", "INT_MAX", "M_PI", "main", "exit"),
    "machines in C": tuple(c.FUNCTIONS | c.MEMBERS | c.INSIDE | c.INVOKING | c.HEADERS | c.GROUPS),
    "Python": PYTHON,
    "JavaScript": tuple(ECMASCRIPT.split()),
    "UPPAAL": tuple(UPPAAL),
    "Promela": tuple(PROMELA),
    "CSPm": tuple(CSPM),
    "JANI": tuple(JANI.split()),
    "DOT": tuple(DOT.split()),
    "Mermaid and PlantUML": tuple(DIAGRAMS.split()),
    "DBC": tuple(DBC),
    "IDL": tuple(IDL),
    "FMI": tuple(FMI.split()),
    "mCRL2 and LOTOS": tuple(OTHERS.split()),
    "letters": tuple(LETTERS.split()),
    "cases": tuple(CASES.split()),
}
"""Words by the notation that has them for something else."""
ALL = tuple(sorted({word for words in NOTATIONS.values() for word in words}))

Files = dict[str, str]


def _chart(**keys: object) -> str:
    return json.dumps({"chart": "Words", "initial": "s0", **keys}, ensure_ascii=False)


def _chain(count: int, **more: Callable[[int], object]) -> dict[str, object]:
    """Return states that an event `go` leads through; ``more``: keys of the transition in each."""
    found: dict[str, object] = {}
    for n in range(count):
        keys = {key: make(n) for key, make in more.items()}
        found[f"s{n}"] = {"on": {"go": {"target": f"s{n + 1}", **keys}}}
    found[f"s{count}"] = {"rest": True}
    return found


def states(words: Sequence[str]) -> Files:
    """Return a chart whose states and transitions are called so."""
    found: dict[str, object] = {
        word: {"on": {"go": {"id": f"t-{n}" if n % 2 else word, "target": after}}}
        for n, (word, after) in enumerate(pairwise(words))
    }
    found[words[-1]] = {"rest": True}
    text = json.dumps(
        {"chart": "Words", "events": {"in": ["go"]}, "initial": words[0], "states": found}
    )
    return {"w.yaml": text}


def regions(words: Sequence[str]) -> Files:
    """Return a chart whose regions and histories are called so."""
    few = words[:12]
    inner = {
        word: {"initial": f"a{n}", "states": {f"a{n}": {"on": {"go": f"b{n}"}}, f"b{n}": {}}}
        for n, word in enumerate(few)
    }
    states_ = {"s0": {"regions": inner, "on": {"off": "s1"}}, "s1": {"rest": True}}
    return {"w.yaml": _chart(events={"in": ["go", "off"]}, states=states_)}


def in_events(words: Sequence[str]) -> Files:
    """Return a chart that handles events called so."""
    chain: dict[str, object] = {
        f"s{n}": {"on": {word: f"s{n + 1}"}} for n, word in enumerate(words)
    }
    chain[f"s{len(words)}"] = {"rest": True}
    return {"w.yaml": _chart(events={"in": list(words)}, states=chain)}


def out_events(words: Sequence[str]) -> Files:
    """Return a chart that sends events called so."""
    chain = _chain(len(words), do=lambda n: f"send {words[n]}")
    return {"w.yaml": _chart(events={"in": ["go"], "out": list(words)}, states=chain)}


def fields(words: Sequence[str]) -> Files:
    """Return a chart whose events have fields called so."""
    events = [f"e{n}({word} 0..1)" for n, word in enumerate(words)]
    chain: dict[str, object] = {
        f"s{n}": {"on": {f"e{n}": {"target": f"s{n + 1}", "do": f"x = event.{word}"}}}
        for n, word in enumerate(words)
    }
    chain[f"s{len(words)}"] = {"rest": True}
    data = {"x": "0..1 = 0"}
    return {"w.yaml": _chart(events={"in": events}, data=data, states=chain)}


def data(words: Sequence[str]) -> Files:
    """Return a chart with data called so."""
    chain = _chain(len(words), do=lambda n: f"{words[n]} = 1")
    declared = dict.fromkeys(words, "0..1 = 0")
    return {"w.yaml": _chart(events={"in": ["go"]}, data=declared, states=chain)}


def wires(words: Sequence[str]) -> Files:
    """Return a chart with inputs and outputs called so."""
    half = (len(words) + 1) // 2
    ins, outs = words[:half], words[half:]
    chain = _chain(
        half,
        **{"if": lambda n: f"not {ins[n]}"},
        do=lambda n: f"{outs[n]} = true" if n < len(outs) else "log 'x', 1",
    )
    more = {"outputs": dict.fromkeys(outs, "bool = false")} if outs else {}
    declared = dict.fromkeys(ins, "bool")
    return {"w.yaml": _chart(events={"in": ["go"]}, inputs=declared, states=chain, **more)}


def constants(words: Sequence[str]) -> Files:
    """Return a chart with constants called so."""
    chain = _chain(len(words), do=lambda n: f"x = {words[n]}")
    declared = dict.fromkeys(words, 3)
    more = {"constants": declared, "data": {"x": "0..9 = 0"}}
    return {"w.yaml": _chart(events={"in": ["go"]}, states=chain, **more)}


def members(words: Sequence[str]) -> Files:
    """Return a chart with an enumeration whose members are called so."""
    chain = _chain(len(words), do=lambda n: f"x = Kind.{words[n]}")
    more = {"types": {"Kind": list(words)}, "data": {"x": f"Kind = {words[0]}"}}
    return {"w.yaml": _chart(events={"in": ["go"]}, states=chain, **more)}


def types(words: Sequence[str]) -> Files:
    """Return a chart with enumerations and records called so, and with parts of records."""
    half = (len(words) + 1) // 2
    declared: dict[str, object] = {word: ["lo", f"hi{n}"] for n, word in enumerate(words[:half])}
    declared |= {word: {word: "0..1"} for word in words[half:]}
    variables = {f"x{n}": word for n, word in enumerate(words)}
    chain = _chain(
        len(words),
        do=lambda n: f"x{n} = {words[n]}.hi{n}" if n < half else f"x{n}.{words[n]} = 1",
    )
    more = {"types": declared, "data": variables}
    return {"w.yaml": _chart(events={"in": ["go"]}, states=chain, **more)}


def operations(words: Sequence[str]) -> Files:
    """Return a chart with operations, and parameters, called so."""
    declared = [f"{word}({word}_ int32) -> 0..2" for word in words]
    declared += [f"op{n}({word} int32)" for n, word in enumerate(words)]
    chain = _chain(len(words), do=lambda n: f"x = {words[n]}(1); op{n}(2)")
    more = {"operations": declared, "data": {"x": "0..2 = 0"}}
    return {"w.yaml": _chart(events={"in": ["go"]}, states=chain, **more)}


def functions(words: Sequence[str]) -> Files:
    """Return a chart with functions and local variables called so."""
    declared = {f"{word}({word}_ 0..1) -> 0..1": f"{word}_" for word in words}
    chain = _chain(len(words), do=lambda n: f"var l_{n} = {words[n]}(1); x = l_{n}")
    more = {"functions": declared, "data": {"x": "0..1 = 0"}}
    return {"w.yaml": _chart(events={"in": ["go"]}, states=chain, **more)}


def variables(words: Sequence[str]) -> Files:
    """Return a chart with local variables called so."""
    chain = _chain(len(words), do=lambda n: f"var {words[n]} = x; x = 1 - {words[n]}")
    return {"w.yaml": _chart(events={"in": ["go"]}, data={"x": "0..1 = 0"}, states=chain)}


def invocations(words: Sequence[str]) -> Files:
    """Return a chart with invocations called so."""
    few = words[:12]
    chain: dict[str, object] = {
        f"s{n}": {
            "invoke": {"id": word, "src": "inner.yaml"},
            "on": {"go": f"s{n + 1}", f"done.invoke.{word}": f"s{n + 1}"},
        }
        for n, word in enumerate(few)
    }
    chain[f"s{len(few)}"] = {"rest": True}
    inner = {
        "chart": "Inner",
        "initial": "i",
        "states": {"i": {"after": {"2ms": "f"}}, "f": {"final": True}},
    }
    return {
        "w.yaml": _chart(events={"in": ["go"]}, states=chain),
        "inner.yaml": json.dumps(inner),
    }


def machines(words: Sequence[str]) -> Files:
    """Return a system with machines and properties called so."""
    few = words[:20]
    part = {
        "chart": "Part", "events": {"in": ["go"]}, "initial": "a",
        "states": {"a": {"rest": True, "on": {"go": "b"}}, "b": {"rest": True, "on": {"go": "a"}}},
    }  # fmt: skip
    system = {
        "system": "Words",
        "machines": dict.fromkeys(few, "part.yaml"),
        "environment": {"may": [f"{few[0]}.go"]},
        "properties": {word: {"reachable": f"{few[0]}.In(b)"} for word in few},
    }
    return {"w.yaml": json.dumps(system, ensure_ascii=False), "part.yaml": json.dumps(part)}


def charts(words: Sequence[str]) -> Files:
    """Return a system of charts called so."""
    few = words[:12]
    files = {
        f"p{n}.yaml": json.dumps(
            {"chart": word, "events": {"in": ["go"]}, "initial": "a",
             "states": {"a": {"rest": True, "on": {"go": "a"}}}}
        )
        for n, word in enumerate(few)
    }  # fmt: skip
    system = {
        "system": few[0],
        "machines": {f"m{n}": f"p{n}.yaml" for n in range(len(few))},
        "environment": {"may": ["m0.go"]},
    }
    return {"w.yaml": json.dumps(system, ensure_ascii=False), **files}


KINDS = {
    each.__name__: each
    for each in (
        *(states, regions, in_events, out_events, fields, data, wires, constants, members, types),
        *(operations, functions, variables, invocations, machines, charts),
    )
}
"""What makes a chart or a system of many words, by the kind of name."""
SIZE = {"regions": 6, "invocations": 6, "machines": 12, "charts": 12}
"""How many words fit into one chart, of kinds whose states multiply."""
MOST = 200
"""How many words fit into one chart."""
EXPLORED = 60
"""The same of a chart that is explored or drawn."""
NOTHING = re.compile(r"(?!)")
OF_SYSTEMS = frozenset({"machines", "charts"})
COMPILED = ("c", "c with all", "c size", "python", "pyext", "fmu", "javascript")
OF_SYSTEM = ("c of a system", "python of a deployment")
EXPORTED = ("aut", "cspm", "export dot", "jani", "promela", "uppaal", "uppaal flat")
DRAWN = tuple(output.name for output in OUTPUTS if output.name.startswith("draw "))
WRITTEN = ("to scxml", "to yaml")


@dataclass
class Tally:
    """Counts of words, each in a kind of name through an output."""

    right: int = 0
    unread: int = 0
    """The language of charts has the word for something else."""
    rejected: int = 0
    """By an output that cannot express the chart, whatever its names."""
    wrong: list[str] = field(default_factory=list)


def readable(
    make: Callable[[Sequence[str]], Files], words: Sequence[str], folder: Path
) -> list[str]:
    """Return the words that the language of charts accepts in a kind of place."""
    if not words:
        return []
    findings = Findings()
    try:
        load_any(_written(make(words), folder), findings)
        findings.stop_on_errors()
    except FsmkitError:
        if len(words) == 1:
            return []
        half = len(words) // 2
        return [
            *readable(make, words[:half], folder),
            *readable(make, words[half:], folder),
        ]
    return list(words)


def _written(files: Files, folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / "w.yaml"


def outputs_of(kind: str) -> Iterator[Output]:
    """Yield the outputs for a kind of name."""
    wanted = (*(OF_SYSTEM if kind in OF_SYSTEMS else COMPILED), *EXPORTED, *DRAWN, *WRITTEN)
    for output in OUTPUTS:
        if output.name in wanted and not (kind in OF_SYSTEMS and output.name in (*DRAWN, *WRITTEN)):
            yield output


def tried(kind: str, words: Sequence[str], outputs: Sequence[Output], folder: Path) -> Tally:
    """Put the words into names of a kind, write the outputs, and have each read."""
    tally, make = Tally(), KINDS[kind]
    stand = readable(make, words, folder / "read")
    tally.unread = (len(words) - len(stand)) * len(outputs)
    for output in outputs:
        most = min(SIZE.get(kind, MOST), EXPLORED if output.name in (*EXPORTED, *DRAWN) else MOST)
        for first in range(0, len(stand), most):
            some = stand[first : first + most]
            where = folder / f"{output.name.replace(' ', '_')}_{first}"
            _through(output, kind, some, where, tally)
    return tally


def _through(output: Output, kind: str, words: Sequence[str], where: Path, tally: Tally) -> None:
    """Write one output of some words; if it is wrong, find the words that are."""
    file = _written(KINDS[kind](words), where.with_suffix(".source"))
    try:
        with patch.object(judges, "FOREIGN", NOTHING):  # here `system` is a name
            is_written = judge(output, file, where)
    except Exception as error:  # noqa: BLE001  (whatever goes wrong is counted, with its cause)
        if len(words) > 1:
            half = len(words) // 2
            before = len(tally.wrong)
            for n, part in enumerate((words[:half], words[half:])):
                _through(output, kind, part, where.with_name(f"{where.name}{n}"), tally)
            if len(tally.wrong) > before:
                return
            tally.right -= len(words)
        tally.wrong.append(f"{kind} {list(words)[:12]} through {output.name}: {str(error)[:700]}")
        return
    if is_written:
        tally.right += len(words)
    else:
        tally.rejected += len(words)


@click.command()
@click.option("--kind", "kinds", multiple=True, type=click.Choice(list(KINDS)))
@click.option("--output", "names", multiple=True, help="Only these outputs.")
@click.option("--notation", "notations", multiple=True, type=click.Choice(list(NOTATIONS)))
def main(kinds: tuple[str, ...], names: tuple[str, ...], notations: tuple[str, ...]) -> None:
    """Write every reserved word as every kind of name in every notation."""
    words = sorted({w for n in notations for w in NOTATIONS[n]}) if notations else ALL
    total = Tally()
    for kind in kinds or KINDS:
        for output in outputs_of(kind):
            if names and output.name not in names:
                continue
            with tempfile.TemporaryDirectory(prefix="fsmkit-") as folder:
                found = tried(kind, words, [output], Path(folder))
            total.right += found.right
            total.unread += found.unread
            total.rejected += found.rejected
            total.wrong += found.wrong
            click.echo(
                f"{kind}, {output.name}: {found.right} right, {found.unread} words of the "
                f"language, {found.rejected} rejected, {len(found.wrong)} wrong"
            )
            for wrong in found.wrong:
                click.echo(f"  {wrong}")
    click.echo(
        f"{len(words)} words: {total.right:,} names right, {total.unread:,} words of the language, "
        f"{total.rejected:,} rejected, {len(total.wrong)} wrong"
    )
    sys.exit(1 if total.wrong else 0)


if __name__ == "__main__":
    main()
