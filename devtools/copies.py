"""Test copies: a used chart behaves in its copy as it does alone, on every runtime.

``python -m devtools.copies --charts 500`` takes random charts, and for each one a chart that only
uses it: inside another chart, as an element of an array, with bound names. The trace of the using
chart, in the names and numbers of the used one, must equal that of the used chart alone, up to the
macrostep in which it ends.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import click

from devtools.differential import (
    BATCH,
    Case,
    Divergence,
    elaborated,
    first_difference,
    random_documents,
    traces_of,
    written,
)
from devtools.random_charts.choices import Choices, SeededChoices
from devtools.random_charts.content import PLACE, SOURCE, text
from devtools.random_charts.scripts import random_script
from devtools.random_charts.using import is_sound, random_using
from devtools.runtimes import harness
from devtools.runtimes import runtimes as named
from fsmkit.chart.chart import Chart, Data
from fsmkit.chart.format import format_operation
from fsmkit.diagnostics import Source, Text
from fsmkit.document import document as doc
from fsmkit.language import EnumType, Field, Literal, RecordType, format_value
from fsmkit.language.statements.tree import DocArgument, DocField
from fsmkit.testing.harness.harness import INTERPRETER, Harness

RUNTIMES = ("interpreter", "c-size", "python")


@dataclass(frozen=True)
class Pair:
    """A used chart alone, and a chart with a copy of it.

    ``names``: the bindings, by name in the used chart.
    """

    alone: Case
    around: Chart
    documents: tuple[doc.Document, ...]
    prefix: str
    names: Mapping[str, str] = field(default_factory=dict)

    def name(self, inner: str) -> str:
        """Return the name in the using chart."""
        return self.names.get(inner, f"{self.prefix}.{inner}")

    def script(self) -> list[str]:
        """Return the script in the names of the using chart."""
        lines = []
        for line in self.alone.script:
            verb, *words = line.split(" ")
            if verb in ("post", "dispatch", "ask", "input", "returns"):
                words[0] = self.name(words[0])
            elif verb == "within":
                words[1] = self.name(words[1])
            lines.append(" ".join((verb, *words)))
        return lines

    def translated(self, trace: Sequence[str]) -> list[str]:
        """Return a trace in the names and numbers of the used chart."""
        back = {here: inner for inner, here in self.names.items()}
        transitions = self._transitions()
        own = {"+ " + state for state in self._around()} | {"- " + s for s in self._around()}

        def word(token: str) -> str:
            done = f"done.state.{self.prefix}."
            if token.startswith(done):
                return f"done.state.{token.removeprefix(done)}"
            return back.get(token) or token.removeprefix(f"{self.prefix}.")

        found = []
        for line in trace:
            if line in own:
                continue
            verb, *rest = line.split(" ")
            if verb == "t":
                number = transitions.get(int(rest[0]))
                if number is not None:
                    found.append(f"t {number}")
                continue
            if verb.startswith("@") and rest[:2] == [">", "timeout"]:
                rest[2] = str(transitions[int(rest[2])])
            names = range(len(rest)) if verb == "=" else _places(verb)
            found.append(
                " ".join((verb, *(word(r) if n in names else r for n, r in enumerate(rest))))
            )
        return found

    def _around(self) -> list[str]:
        parts = self.prefix.split(".")
        return [".".join(parts[: n + 1]) for n in range(len(parts))]

    def _transitions(self) -> dict[int, int]:
        base = self.around.state_index[self.prefix]
        found = {}
        for state in self.alone.chart.states:
            here = self.around.states[base + state.index]
            if state.initial is not None and here.initial is not None:
                found[here.initial] = state.initial
            if state.index:
                found |= dict(zip(here.transitions, state.transitions, strict=True))
        return found


def _places(verb: str) -> Sequence[int]:
    """Return which words of a line are names of the chart."""
    if verb.startswith("@"):
        return (2,)
    return () if verb in ("reply", "fault", "full", "error", "answer") else (0,)


def random_pair(choices: Choices, number: int) -> Pair:
    """Return a random chart and one that uses it."""
    while True:
        documents = _plain(choices)
        used = replace(documents[0], source=Source(f"used{number}.yaml", ""))
        documents = (used, *documents[1:])
        alone = elaborated(documents)
        script = random_script(choices, alone)
        names = _names(choices, alone)
        host, prefix = _host(choices, documents, alone, names)
        if is_sound((host,)):
            case = Case(documents, alone, script, f"pair {number}")
            return Pair(case, elaborated((host,)), (host, *documents), prefix, names)


def _plain(choices: Choices) -> tuple[doc.Document, ...]:
    """Return a chart of the action language; other dialects restrict names."""
    while True:
        documents = random_using(choices) if choices.chance(25) else random_documents(choices)
        chart = elaborated(documents)
        is_plain = documents[0].datamodel == "fsmkit" and not chart.invocations
        if is_plain and not chart.abstract:
            return documents


def _names(choices: Choices, alone: Chart) -> dict[str, str]:
    """Return the bindings to names of the using chart, each of the same kind."""
    declared = [d.name for d in (*alone.data, *alone.inputs, *alone.outputs)]
    declared += [o.name for o in alone.operations]
    declared += [
        e.name
        for e in alone.events
        if len(e.directions) == 1 and doc.Direction.INTERNAL not in e.directions
    ]
    taken: dict[str, str] = {}
    for name in declared:
        if choices.chance(30):
            taken[name] = f"h_{name.replace('.', '_')}"
    return taken


def _host(
    choices: Choices, documents: tuple[doc.Document, ...], alone: Chart, names: Mapping[str, str]
) -> tuple[doc.Document, str]:
    """Return a chart around a copy, and the name of that."""
    bind = tuple(DocArgument(text(inner), text(here)) for inner, here in names.items())
    use = doc.DocUse(PLACE, chart=text("used.yaml"), bind=bind, loaded=documents)
    is_nested = not names and choices.chance(40)
    if is_nested:
        inner = _document(
            "Between", alone, {}, (doc.DocState(text("inner"), doc.Kind.ATOMIC, PLACE, use=use),)
        )
        between = replace(inner, source=Source("between.yaml", ""))
        use = doc.DocUse(PLACE, chart=text("between.yaml"), loaded=(between,))
    name = choices.pick(("main", "axis"))
    state = doc.DocState(text(name), doc.Kind.ATOMIC, PLACE, use=use)
    prefix = name
    others: tuple[doc.DocState, ...] = ()
    if name == "axis":
        state = replace(state, index_range=text("i in 0..2"))
        prefix = "axis.0"
    else:
        others = (replace(state, id=text("other")),)
    prefix += ".inner" if is_nested else ""
    return _document("Around", alone, names, (state, *others)), prefix


def _document(
    name: str, alone: Chart, names: Mapping[str, str], states: tuple[doc.DocState, ...]
) -> doc.Document:
    types = tuple(_type(t) for t in alone.types if isinstance(t, EnumType | RecordType))
    inits = {d.name: d.init for d in (*alone.data, *alone.outputs)}
    capacities = alone.capacities

    def variables(group: Sequence[Data]) -> tuple[doc.DocData, ...]:
        return tuple(
            doc.DocData(text(names[d.name]), text(str(d.type)), _start(d, inits))
            for d in group
            if d.name in names
        )

    return doc.Document(
        SOURCE,
        text(name),
        doc.DocState(None, doc.Kind.COMPOUND, PLACE, children=states),
        types=types,
        data=variables(alone.data),
        inputs=tuple(replace(d, init=None) for d in variables(alone.inputs)),
        outputs=variables(alone.outputs),
        operations=tuple(
            doc.DocOperation(
                text(names[o.name]), _fields(o.parameters),
                None if o.result is None else text(format_operation(o, alone).partition(" -> ")[2]),
            )
            for o in alone.operations
            if o.name in names
        ),
        events=tuple(
            doc.DocEvent(
                text(names[e.name]), _fields(e.fields), direction,
                None if e.reply is None else text(str(e.reply)),
            )
            for e in alone.events
            if e.name in names
            for direction in e.directions
        ),
        capacities=tuple(
            doc.DocCapacity(text(word), text(str(getattr(capacities, word))))
            for word in ("queue", "internal", "delayed", "microsteps")
        ),
    )  # fmt: skip


def _start(data: Data, inits: Mapping[str, Literal]) -> Text | None:
    literal = inits.get(data.name)
    if literal is None or isinstance(literal.type, RecordType):
        return None
    return text(format_value(literal.value, literal.type, 1000))


def _type(type_: EnumType | RecordType) -> doc.DocType:
    if isinstance(type_, EnumType):
        return doc.DocType(text(type_.name), tuple(doc.DocMember(text(m)) for m in type_.members))
    return doc.DocType(text(type_.name), fields=_fields(type_.fields))


def _fields(fields: Sequence[Field]) -> tuple[DocField, ...]:
    return tuple(DocField(text(f.name), text(str(f.type))) for f in fields)


def until_the_end(trace: Sequence[str]) -> int:
    """Return how many lines there are before the macrostep in which a machine ends."""
    begin = 0
    for number, line in enumerate(trace):
        if line.startswith("@"):
            begin = number
        if line.startswith("= ") and line.endswith("finished"):
            return begin
    return len(trace)


def compare_pair(pair: Pair, runtime: Harness) -> Divergence | None:
    """Return the first difference between the copy and the chart alone, on a runtime."""
    (found,) = compare_pairs([pair], runtime)
    return found


def compare_pairs(pairs: Sequence[Pair], runtime: Harness) -> list[Divergence | None]:
    """Return the same for several pairs, which are compiled together."""
    traces = traces_of(runtime, [Case(p.documents, p.around, tuple(p.script())) for p in pairs])
    return [_compared(p, runtime.name, got) for p, got in zip(pairs, traces, strict=True)]


def _compared(pair: Pair, runtime: str, trace: Sequence[str] | None) -> Divergence | None:
    if trace is None:
        return Divergence(runtime, 0, "a trace", "(rejected)")
    expected = INTERPRETER.run(pair.alone.chart, pair.alone.script)
    got = pair.translated(trace)
    known = {d.name for d in (*pair.alone.chart.data, *pair.alone.chart.outputs)}
    expected, got = dumps_sorted(expected, known), dumps_sorted(got, known)
    end = until_the_end(expected)
    return first_difference(runtime, expected[:end], got[:end] if end < len(expected) else got)


def dumps_sorted(trace: Sequence[str], known: set[str]) -> list[str]:
    """Return a trace whose dumps are sorted by name.

    Only the ``known`` variables are kept, as there may be other copies.
    """
    found: list[str] = []
    dumped: list[str] = []
    for line in (*trace, ""):
        if line.startswith("d "):
            dumped += [line] if line.split(" ")[1] in known else []
            continue
        found += [*sorted(dumped), line]
        dumped = []
    return found[:-1]


def pairs(seed: int, first: int, count: int) -> Iterator[Pair]:
    """Yield pairs, each a function of the seed and its number."""
    for number in range(first, first + count):
        yield random_pair(SeededChoices(f"copies:{seed}:{number}"), number)


def explain(pair: Pair, found: Divergence) -> str:
    """Return everything needed to look into a difference."""
    texts = "\n---\n".join(written(document) for document in pair.documents)
    script = "\n".join(pair.alone.script)
    return f"{pair.alone.name}\n{texts}\n--- script\n{script}\n---\n{found}"


@click.command()
@click.option("--charts", default=500, show_default=True, help="How many pairs.")
@click.option("--seed", default=0, show_default=True)
@click.option("--first", default=0, show_default=True, help="The number of the first pair.")
@click.option("--runtimes", callback=named, default=",".join(RUNTIMES), show_default=True)
def main(charts: int, seed: int, first: int, runtimes: tuple[str, ...]) -> None:
    """Compare copies with the charts that they are copies of."""
    chosen = [harness(name) for name in runtimes]
    differing = 0
    for begin in range(first, first + charts, BATCH):
        batch = [*pairs(seed, begin, min(BATCH, first + charts - begin))]
        for runtime in chosen:
            for pair, found in zip(batch, compare_pairs(batch, runtime), strict=True):
                if found is not None:
                    click.echo(f"{pair.alone.name}: {found}" if differing else explain(pair, found))
                    differing += 1
    click.echo(f"{charts} pairs on {', '.join(runtimes)}: {differing} differences")
    sys.exit(bool(differing))


if __name__ == "__main__":
    main()
