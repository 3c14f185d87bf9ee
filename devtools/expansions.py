"""Test the meaning of copies: `use` equals the chart written out by hand.

``python -m devtools.expansions --charts 200`` takes random charts that use others, writes each out
in the notation without copies (``left__moving`` for ``left.moving``), and compares the charts in
all parts and the Plans. The sources are changed here word by word, as a person would do it,
without `fsmkit.chart.copies`.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import click

from devtools.differential import elaborated, written
from devtools.random_charts.choices import Choices, SeededChoices
from devtools.random_charts.content import PLACE, SOURCE, text
from devtools.random_charts.using import LEVEL, OVER, is_sound, used_document
from fsmkit.chart.chart import Capacities, Chart
from fsmkit.chart.views.chart_json import chart_document
from fsmkit.chart.views.origins import Origins
from fsmkit.diagnostics import Text
from fsmkit.document import document as doc
from fsmkit.document.walk import EXPRESSIONS, states
from fsmkit.language.statements import tree as stmt
from fsmkit.plan import lower

NOWHERE = Origins({}, {}, {}, {})
ASIDE = ("at", "origin", "copies", "descriptors")
"""Fields about the notation of a chart."""
BOUNDS = ("queue", "internal", "microsteps", "delayed")
HISTORIES = (doc.Kind.SHALLOW_HISTORY, doc.Kind.DEEP_HISTORY)
_WORD = re.compile(
    r'"(?:\\.|[^"\\])*"|\bIn\((?P<state>\w+)\)|(?<![\w.])(?P<name>[A-Za-z_]\w*)(?P<call>\()?'
)


@dataclass(frozen=True)
class Copy:
    """The renamed words of a used chart in one copy."""

    prefix: str
    alone: Chart
    names: Mapping[str, str]
    """The names or expressions of variables, constants and operations here."""
    calls: Mapping[str, tuple[tuple[str, ...], str]]
    """Operations that are calls here: the names of their parameters, and the call."""
    events: Mapping[str, str]
    raised: frozenset[str]
    """Events that are sent there and raised here."""

    def own(self, name: str) -> str:
        """Return the new name of an unbound name."""
        return f"{self.prefix}__{name}"

    def expression(self, words: str) -> str:
        """Return an expression in the words of the chart around."""
        found, at = "", 0
        while (match := _WORD.search(words, at)) is not None:
            found += words[at : match.start()]
            name, at = match["name"], match.end()
            if match["state"]:
                found += f"In({self.own(match['state'])})"
            elif match["call"] and name in self.calls:
                arguments, at = _arguments(words, at)
                parameters, call = self.calls[name]
                given = dict(zip(parameters, map(self.expression, arguments), strict=True))
                found += _given(call, given)
            else:
                found += self.names.get(name, name) + (match["call"] or "") if name else match[0]
        return found + words[at:]

    def event(self, name: str) -> str:
        """Return the name of an event of the used chart."""
        if name.startswith("error."):
            return name
        if name.startswith("done.state."):
            return f"done.state.{self.own(name.removeprefix('done.state.'))}"
        return self.events.get(name, self.own(name))

    def descriptors(self, asked: Sequence[Text]) -> tuple[Text, ...]:
        """Return the events that the used chart knows and that descriptors match."""
        found: list[str] = []
        for descriptor in asked:
            word = descriptor.value.removesuffix(".*")
            found += [
                self.event(e.name)
                for e in self.alone.events
                if word == "*" or e.name == word or e.name.startswith(f"{word}.")
            ]
        return tuple(text(name) for name in dict.fromkeys(found))

    def part(self, part: Any) -> Any:
        """Return a part of the used chart as it is written in the chart around."""
        if isinstance(part, tuple):
            return tuple(self.part(each) for each in part)
        if isinstance(part, Text):
            return text(self.expression(part.value))
        if not is_dataclass(part) or isinstance(part, type) or part is PLACE:
            return part
        changed = self._named(part)
        if (
            isinstance(part, stmt.DocSend)
            and part.event is not None
            and part.event.value in self.raised
        ):
            return stmt.Raise(changed["event"], self.part(part.arguments), PLACE)
        for each in fields(part):
            value = getattr(part, each.name)
            is_name = isinstance(value, Text) and each.name not in (*EXPRESSIONS, "delay")
            if each.name not in changed and not is_name and each.name != "span":
                changed[each.name] = self.part(value)
        return replace(part, **changed)

    def _named(self, part: Any) -> dict[str, Any]:
        """Return the fields of a part that hold names."""

        def renamed(value: Text | None, by: Callable[[str], str]) -> Text | None:
            return None if value is None else text(by(value.value))

        match part:
            case doc.DocState(id=id_, defer=defer):
                return {"id": renamed(id_, self.own), "defer": self.descriptors(defer)}
            case doc.DocTransition(events=events, targets=targets, id=id_):
                inner = tuple(text(self.own(t.value)) for t in targets)
                asked = self.descriptors(events)
                return {"events": asked, "targets": inner, "id": renamed(id_, self.own)}
            case stmt.DocSend(event=event, id=id_):
                return {"event": renamed(event, self.event), "id": renamed(id_, self.own)}
            case stmt.Raise(event=event):
                return {"event": renamed(event, self.event)}
            case stmt.DocCancel(id=id_):
                return {"id": renamed(id_, self.own)}
            case stmt.Log(label=label):
                return {"label": renamed(label, self.own)}
            case _:
                return {}


def _given(call: str, values: Mapping[str, str]) -> str:
    return re.sub(r"[A-Za-z_]\w*", lambda match: values.get(match[0], match[0]), call)


def _arguments(words: str, at: int) -> tuple[list[str], int]:
    """Return the arguments of a call whose parenthesis is open, and where it ends."""
    found, depth, begin = [], 1, at
    while depth:
        char = words[at]
        if char == '"':
            at = words.index('"', at + 1)
        depth += (char in "([") - (char in ")]")
        if not depth or (depth == 1 and char == ","):
            found.append(words[begin:at].strip())
            begin = at + 1
        at += 1
    return [argument for argument in found if argument], at


# --- by hand ----------------------------------------------------------------------------------


def by_hand(document: doc.Document) -> doc.Document:
    """Return a chart of top-level states, one or more of which use others, without copies."""
    made = document
    bounds: dict[str, list[int]] = {b: [] for b in BOUNDS}
    for bound in BOUNDS[:-1]:
        bounds[bound].append(getattr(Capacities(), bound))
    targets: dict[str, tuple[Text, ...]] = {}
    for state in document.root.children:
        if state.use is None:
            continue
        (used,) = state.use.loaded
        if any(inner.use is not None for inner in states(used.root)):
            used = by_hand(used)
        copy = copy_of(document, state, elaborated((used,)))
        for bound, values in bounds.items():
            if bound != "delayed" or _delays(used):
                values.append(getattr(copy.alone.capacities, bound))
        made = _with(made, state, used, copy)
        assert state.id is not None  # noqa: S101
        targets |= {
            f"{state.id.value}.{entry.name.value}": tuple(
                text(copy.own(t.value)) for t in entry.targets
            )
            for entry in used.entries
        }

    def aimed(part: Any) -> Any:
        if isinstance(part, tuple):
            return tuple(aimed(each) for each in part)
        if isinstance(part, doc.DocTransition):
            wanted = [targets.get(t.value, (t,)) for t in part.targets]
            return replace(part, targets=tuple(t for each in wanted for t in each))
        if isinstance(part, doc.DocState):
            return replace(part, transitions=aimed(part.transitions), children=aimed(part.children))
        return part

    said = {capacity.name.value for capacity in document.capacities}
    missing = tuple(
        doc.DocCapacity(text(bound), text(str((sum if bound == "delayed" else max)(values))))
        for bound, values in bounds.items()
        if bound not in said and values
    )
    return replace(made, root=aimed(made.root), capacities=(*document.capacities, *missing))


def copy_of(host: doc.Document, state: doc.DocState, alone: Chart) -> Copy:
    """Return the words of a used chart in a state of a chart."""
    assert state.id is not None  # noqa: S101
    assert state.use is not None  # noqa: S101
    prefix = state.id.value
    bound = {b.name.value: b.value.value for b in state.use.bind}
    variables = [d.name for d in (*alone.data, *alone.inputs, *alone.outputs)]
    named = [
        *variables,
        *(name for name, _ in alone.constants),
        *(o.name for o in alone.operations),
    ]
    calls = {
        o.name: (tuple(p.name for p in o.parameters), bound[o.name])
        for o in alone.operations
        if "(" in bound.get(o.name, "")
    }
    names = {
        name: (bound[name] if bound[name].isidentifier() else f"({bound[name]})")
        if name in bound and name not in calls
        else f"{prefix}__{name}"
        for name in named
    }
    events = {e.name: bound[e.name] for e in alone.events if e.name in bound}
    internal = {e.name.value for e in host.events if e.direction is doc.Direction.INTERNAL}
    out = {e.name for e in alone.events if doc.Direction.OUT in e.directions}
    raised = frozenset(name for name, here in events.items() if name in out and here in internal)
    return Copy(prefix, alone, names, calls, events, raised)


def _with(host: doc.Document, state: doc.DocState, used: doc.Document, copy: Copy) -> doc.Document:
    """Return a chart in which one state has the content of the chart that it uses."""
    use = state.use
    assert use is not None  # noqa: S101
    bound = {b.name.value for b in use.bind}
    given = {c.name.value: c.value for c in use.constants}
    start = {s.name.value: s.value for s in use.start}

    def own(kind: Sequence[Any]) -> list[Any]:
        return [each for each in kind if each.name.value not in bound]

    def variables(
        group: Sequence[doc.DocData], values: Mapping[str, Text]
    ) -> tuple[doc.DocData, ...]:
        return tuple(
            doc.DocData(
                text(copy.own(d.name.value)), d.type, values.get(d.name.value) or copy.part(d.init)
            )
            for d in own(group)
        )

    exits = {e.name.value: e for e in use.exits}
    children = tuple(_child(child, exits, copy) for child in used.root.children)
    initial = used.root.initial or doc.DocTransition(
        doc.Trigger.INITIAL,
        PLACE,
        targets=(next(c.id for c in used.root.children if c.id and c.kind not in HISTORIES),),
    )
    again = tuple(
        stmt.Assign(d.name, d.init, PLACE)
        for d in variables(used.data, start)
        if d.init is not None and use.reset
    )
    initial = copy.part(initial)
    initial = replace(initial, content=(*again, *(initial.content or ())) or None)
    filled = replace(
        state,
        kind=doc.Kind.COMPOUND,
        use=None,
        initial=initial,
        children=children,
        transitions=(*state.transitions, *copy.part(used.root.transitions)),
    )
    known = {t.name.value for t in host.types}
    return replace(
        host,
        root=replace(
            host.root, children=tuple(filled if c is state else c for c in host.root.children)
        ),
        types=(*host.types, *(t for t in used.types if t.name.value not in known)),
        constants=(
            *host.constants,
            *(
                doc.DocConstant(
                    text(copy.own(c.name.value)), given.get(c.name.value) or copy.part(c.value)
                )
                for c in used.constants
            ),
        ),
        data=(*host.data, *variables(used.data, start)),
        inputs=(*host.inputs, *variables(used.inputs, {})),
        outputs=(*host.outputs, *variables(used.outputs, {})),
        operations=(
            *host.operations,
            *(replace(o, name=text(copy.own(o.name.value))) for o in own(used.operations)),
        ),
        events=(
            *host.events,
            *(replace(e, name=text(copy.event(e.name.value))) for e in own(used.events)),
        ),
    )


def _child(child: doc.DocState, exits: Mapping[str, doc.DocExit], copy: Copy) -> doc.DocState:
    """Return a state at the top of a used chart; an exit point that is bound is a choice."""
    assert child.id is not None  # noqa: S101
    made: doc.DocState = copy.part(child)
    bound = exits.get(child.id.value)
    if bound is None:
        return made
    data = {a.name.value: copy.expression(a.value.value) for a in child.done_data}

    def words(value: Any) -> Any:
        if isinstance(value, Text):
            return text(re.sub(r"exit\.(\w+)", lambda m: f"({data[m[1]]})", value.value))
        if isinstance(value, stmt.Assign):
            return replace(value, value=words(value.value))
        return value

    transitions = tuple(
        replace(t, guard=words(t.guard), content=t.content and tuple(map(words, t.content)))
        for t in bound.transitions
    )
    return replace(made, kind=doc.Kind.CHOICE, done_data=(), transitions=transitions)


# --- a family of charts -----------------------------------------------------------------------


def random_host(choices: Choices, number: int) -> doc.Document:
    """Return a chart with one or two copies, in which some of their names are bound."""
    while True:
        inner = used_document(choices, number)
        if choices.chance(30):
            inner = replace(_host(choices, "Between", inner, ("inner",)), name=text("Between"))
            inner = replace(inner, source=replace(SOURCE, name=f"between{number}.yaml"))
        names = ("left", "right") if choices.chance(40) else ("left",)
        found = _host(choices, "Host", inner, names)
        if is_sound((found,)):
            return found


def _host(choices: Choices, name: str, used: doc.Document, copies: Sequence[str]) -> doc.Document:
    alone = elaborated((used,))
    document = doc.Document(
        SOURCE,
        text(name),
        doc.DocState(None, doc.Kind.COMPOUND, PLACE),
        types=used.types,
        events=tuple(doc.DocEvent(text(e), (), doc.Direction.IN) for e in ("begin", "leave")),
        capacities=used.capacities,
    )
    idle = doc.DocState(text("idle"), doc.Kind.ATOMIC, PLACE, rest=True)
    children = []
    for copy in copies:
        document, use = _joined(choices, document, used, alone, copy)
        entries = [f"{copy}.{e.name.value}" for e in used.entries]
        target = choices.pick((copy, *entries))
        begin = doc.DocTransition(
            doc.Trigger.EVENT, PLACE, (text("begin"),), targets=(text(target),), ordered=True
        )
        idle = replace(idle, transitions=(*idle.transitions, begin))
        leave = replace(begin, events=(text("leave"),), targets=(text("idle"),))
        children.append(
            doc.DocState(text(copy), doc.Kind.ATOMIC, PLACE, use=use, transitions=(leave,))
        )
    return replace(document, root=replace(document.root, children=(idle, *children)))


def _joined(
    choices: Choices, document: doc.Document, used: doc.Document, alone: Chart, copy: str
) -> tuple[doc.Document, doc.DocUse]:
    """Return a chart with declarations bound to names of a used one, and the use."""
    bind: list[tuple[str, str]] = []
    data: list[doc.DocData] = []
    inputs: list[doc.DocData] = []
    outputs: list[doc.DocData] = []
    operations, events = [], []
    for kind, of, put in (("d", used.data, data), ("o", used.outputs, outputs)):
        for variable in of:
            if choices.chance(30):
                here = f"h_{kind}_{copy}_{len(bind)}"
                put.append(replace(variable, name=text(here), init=_start(variable)))
                bind.append((variable.name.value, here))
    for variable in used.inputs:
        if choices.chance(60):
            here = f"h_i_{copy}_{len(bind)}"
            inputs.append(replace(variable, name=text(here)))
            is_truth = variable.type is not None and variable.type.value == "bool"
            bind.append((variable.name.value, f"not {here}" if is_truth else here))
    for each in used.operations:
        if choices.chance(60):
            here = f"h_op_{copy}_{len(bind)}"
            listed = ", ".join(p.name.value for p in each.parameters)
            more = choices.chance(50)
            extra = (stmt.DocField(text(f"more_{copy}"), text("0..9")),) if more else ()
            operations.append(doc.DocOperation(text(here), (*extra, *each.parameters), each.result))
            called = f"{here}({choices.integer(0, 9)}{', ' if listed else ''}{listed})"
            bind.append((each.name.value, called if more else here))
    both = {e.name for e in alone.events if len(e.directions) > 1}
    for event in used.events:
        name = event.name.value
        if event.direction is doc.Direction.INTERNAL or name in both or not choices.chance(40):
            continue
        here = f"h_e_{copy}_{len(bind)}"
        is_out = event.direction is doc.Direction.OUT
        heard = (
            doc.Direction.INTERNAL if is_out and not _is_delayed(used, name) else event.direction
        )
        events.append(
            doc.DocEvent(text(here), event.fields, heard if choices.chance(40) else event.direction,
                     event.reply)
        )  # fmt: skip
        bind.append((name, here))
    finals = [c for c in used.root.children if c.kind is doc.Kind.FINAL and c.id]
    out = doc.DocTransition(doc.Trigger.EVENTLESS, PLACE, targets=(text("idle"),))
    exits = []
    for final in finals:
        assert final.id is not None  # noqa: S101
        if choices.chance(70):
            guarded = replace(out, guard=text(f"exit.n > {choices.integer(2, 6)}"))
            has_data = final.id.value == OVER and choices.chance(50)
            exits.append(doc.DocExit(final.id, (guarded, out) if has_data else (out,)))
    constants = {c.name.value for c in used.constants}
    level = (stmt.DocArgument(text(LEVEL), text(str(choices.integer(0, 9)))),)
    bound = {name for name, _ in bind}
    use = doc.DocUse(
        PLACE,
        chart=text(used.source.name),
        constants=level if LEVEL in constants and choices.chance(50) else (),
        start=(stmt.DocArgument(text("started"), text("5")),)
        if any(d.name.value == "started" for d in used.data)
        and "started" not in bound
        and choices.chance(50)
        else (),
        bind=tuple(stmt.DocArgument(text(name), text(here)) for name, here in bind),
        exits=tuple(exits),
        loaded=(used,),
    )
    return (
        replace(
            document,
            data=(*document.data, *data),
            inputs=(*document.inputs, *inputs),
            outputs=(*document.outputs, *outputs),
            operations=(*document.operations, *operations),
            events=(*document.events, *events),
        ),
        use,
    )


def _start(data: doc.DocData) -> Text | None:
    """Return a start value that means the same where the names of the chart are not known."""
    if data.init is not None and LEVEL in data.init.value:
        return text("3")
    return data.init


def _delays(used: doc.Document) -> bool:
    """Whether a chart sends anything later."""
    return any(isinstance(p, stmt.DocSend) and (p.delay or p.delay_expr) for p in _parts(used.root))


def _is_delayed(used: doc.Document, event: str) -> bool:
    """Return whether an event is sent with a delay, so that it is never raised."""
    return any(
        isinstance(part, stmt.DocSend)
        and part.event is not None
        and part.event.value == event
        and (part.delay or part.delay_expr or part.id or part.target)
        for part in _parts(used.root)
    ) or any(state.use is not None for state in states(used.root))


def _parts(part: Any) -> list[Any]:
    if isinstance(part, tuple):
        return [p for each in part for p in _parts(each)]
    if not is_dataclass(part) or isinstance(part, type | Text) or part is PLACE:
        return []
    return [part, *(p for f in fields(part) for p in _parts(getattr(part, f.name)))]


# --- comparison -------------------------------------------------------------------------------


def meaning(chart: Chart) -> object:
    """Return the content of a chart and its Plan, with written-out names of copies."""
    document = json.loads(json.dumps(chart_document(chart, NOWHERE)))
    del document["sources"]
    plan = lower(chart)
    parts = {f.name: getattr(plan, f.name) for f in fields(plan) if f.name != "chart"}
    return _plain(document), repr(parts)


def _plain(part: Any) -> Any:
    if isinstance(part, dict):
        return {k: _plain(v) for k, v in part.items() if k not in ASIDE}
    if isinstance(part, list):
        return [_plain(each) for each in part]
    return re.sub(r"\b(left|right|inner)\.", r"\1__", part) if isinstance(part, str) else part


def compare(document: doc.Document) -> str:
    """Return the first difference to the chart written out by hand; empty if equal."""
    hand = replace(by_hand(document), name=document.name)
    expected, got = meaning(elaborated((hand,))), meaning(elaborated((document,)))
    if expected == got:
        return ""
    a, b = (json.dumps(each, indent=1).splitlines() for each in (expected, got))
    first = next(
        (n for n, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b))
    )
    shown = ("\n".join(each[max(0, first - 6) : first + 6]) for each in (a, b))
    return "\n--- by hand\n{}\n--- used\n{}".format(*shown)


@click.command()
@click.option("--charts", default=200, show_default=True, help="How many charts.")
@click.option("--seed", default=0, show_default=True)
@click.option("--first", default=0, show_default=True, help="The number of the first.")
def main(charts: int, seed: int, first: int) -> None:
    """Compare charts that use others with those written out by hand."""
    differing = copies = 0
    for number in range(first, first + charts):
        document = random_host(SeededChoices(f"hand:{seed}:{number}"), number)
        copies += len(elaborated((document,)).copies)
        found = compare(document)
        if found:
            differing += 1
            if differing == 1:
                for part in (document, *_loaded(document), by_hand(document)):
                    click.echo(written(part))
                    click.echo("---")
            click.echo(f"chart {number}: {found}")
    click.echo(f"{charts} charts with {copies} copies: {differing} differ from those by hand")
    sys.exit(bool(differing))


def _loaded(document: doc.Document) -> list[doc.Document]:
    return [
        inner
        for state in states(document.root)
        if state.use is not None
        for used in state.use.loaded
        for inner in (used, *_loaded(used))
    ]


if __name__ == "__main__":
    main()
