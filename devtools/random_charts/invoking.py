"""Random charts that invoke random charts, up to two levels deep (SCXML 6.4, 6.5).

The charts are those of `random_document` with additional events that they exchange.
"""

from __future__ import annotations

import re
from dataclasses import fields, is_dataclass, replace
from typing import TypeVar, cast

from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import Choices
from devtools.random_charts.content import DELAYS, PLACE, text
from fsmkit.diagnostics import Source, Span, Text
from fsmkit.document import document as doc
from fsmkit.language.statements import tree as stmt

OVER = "over"
SAID, GIVEN, HEARD = "said", "given", "heard"
"""Data: number of sent messages, argument of an invoked chart, last received value."""
MOST_SAID = 12
"""Two charts that answer each other for ever would let `run` take very long."""
NUMBER = "0..99"
MICROSTEPS = "12"
"""Rounds of microsteps for a chart that ends immediately and is invoked again."""
UP, DOWN = ("up", "up.more"), ("down", "down.more")
"""Events to the invoker, and to the invoked; the first of each has a payload."""


def random_invoking(choices: Choices, states: int = 9) -> doc.Document:
    """Return a document whose states invoke others."""
    return _invoking(choices, states, 0, "Random")


def _invoking(
    choices: Choices, states: int, depth: int, name: str, path: str | None = None
) -> doc.Document:
    """Return a chart that may invoke others; ``path`` makes it known among charts of its name."""
    path = path or name
    document = _talking(_with_own_operations(random_document(choices, states), path), name, depth)
    inner: list[doc.DocInvoke] = []
    if depth == 0 or (depth == 1 and choices.chance(30)):
        for number in range(choices.integer(1, 2)):
            own = f"Inner{depth}{number}"
            inside = f"{path}{own}" if depth else own
            chart = _invoking(choices, 5, depth + 1, own, inside)
            inner.append(_invoke(choices, f"i{number}", chart))
    ids = [invoke.id.value for invoke in inner if invoke.id is not None]
    ends = [f"done.invoke.{i}" for i, one in zip(ids, inner, strict=True) if _can_end(one)]
    document = _ending(document) if depth else document
    speaker = _Speaker(choices, tuple(ids), tuple(ends), is_invoked=depth > 0)
    root = speaker.state(document.root)
    for invoke in inner:
        places = [s.id.value for s in _below(root) if s.id and s.kind in _INVOKING]
        if places:
            root = _placed(root, choices.pick(places), invoke)
    return replace(document, root=root)


_INVOKING = (doc.Kind.ATOMIC, doc.Kind.COMPOUND, doc.Kind.PARALLEL)


def _ending(document: doc.Document) -> doc.Document:
    """Return a document with a final top-level state as target of received messages."""
    over = doc.DocState(
        text(OVER), doc.Kind.FINAL, PLACE, done_data=(stmt.DocArgument(text("n"), text(GIVEN)),)
    )
    return replace(document, root=replace(document.root, children=(*document.root.children, over)))


def _can_end(invoke: doc.DocInvoke) -> bool:
    chart = invoke.content
    return chart is not None and any(s.kind is doc.Kind.FINAL for s in chart.root.children)


def _talking(document: doc.Document, name: str, depth: int) -> doc.Document:
    """Return a document with the events of the conversation; an invoked one has no inputs."""
    numbers = [stmt.DocField(text("n"), text(NUMBER))]
    events = [
        doc.DocEvent(text(event), tuple(numbers) if event in ("up", "down") else (), direction)
        for event, direction in _directed(depth)
    ]
    data = tuple(doc.DocData(text(n), text(NUMBER), text("0")) for n in (SAID, GIVEN, HEARD))
    inputs = () if depth else document.inputs
    more = document.inputs if depth else ()
    return replace(
        document,
        name=text(name),
        events=(*document.events, *events),
        data=(*data, *more, *document.data),
        inputs=inputs,
        capacities=(
            *(c for c in document.capacities if c.name.value not in ("tick", "microsteps")),
            doc.DocCapacity(text("microsteps"), text(MICROSTEPS)),
        ),
    )


Part = TypeVar("Part")


def _with_own_operations(document: doc.Document, name: str) -> doc.Document:
    """Return a document whose operations differ in name from those of another chart."""
    document = _with_own_events(document, name) if name != "Random" else document
    names = [operation.name.value for operation in document.operations]
    if not names:
        return document
    pattern = re.compile(rf"\b({'|'.join(map(re.escape, names))})\b(?=\s*\()")
    operations = tuple(replace(o, name=text(f"{o.name.value}_{name}")) for o in document.operations)
    return replace(_renamed(document, pattern, f"_{name}"), operations=operations)


def _with_own_events(document: doc.Document, name: str) -> doc.Document:
    """Return a document whose events have a first token of its own."""
    known = {event.name.value for event in document.events}
    known |= {known_name.rpartition(".")[0] for known_name in known} - {""}
    pattern = re.compile(rf"^({'|'.join(map(re.escape, sorted(known)))})(?=(\.\*)?$)")
    return _renamed(document, pattern, "", f"{name}.") if known else document


def _renamed(part: Part, pattern: re.Pattern[str], name: str, before: str = "") -> Part:
    """Return a part of a document with something before and behind the names that match."""
    match part:
        case Text(value=value):
            return cast("Part", text(pattern.sub(rf"{before}\g<1>{name}", value)))
        case tuple():
            return cast("Part", tuple(_renamed(inner, pattern, name, before) for inner in part))
        case _ if is_dataclass(part) and not isinstance(part, Span | Source | type):
            held = {f.name: getattr(part, f.name) for f in fields(part)}
            changed = {key: _renamed(value, pattern, name, before) for key, value in held.items()}
            return cast("Part", type(part)(**changed))
        case _:
            return part


def _directed(depth: int) -> list[tuple[str, doc.Direction]]:
    found: list[tuple[str, doc.Direction]] = []
    if depth < 2:
        found += [(event, doc.Direction.OUT) for event in DOWN]
        found += [(event, doc.Direction.IN) for event in UP]
    if depth:
        found += [(event, doc.Direction.IN) for event in DOWN]
        found += [(event, doc.Direction.OUT) for event in UP]
    return found


def _invoke(choices: Choices, name: str, chart: doc.Document) -> doc.DocInvoke:
    finalize: stmt.Block | None = None
    if choices.chance(40):
        finalize = (_assign(HEARD, f"{HEARD} + 7"),)
    given = ("3", f"{SAID}", f"{GIVEN} + 1", f"99 / {HEARD}")
    return doc.DocInvoke(
        PLACE,
        id=text(name),
        content=chart,
        autoforward=choices.chance(25),
        arguments=(
            (stmt.DocArgument(text(GIVEN), text(choices.pick(given))),)
            if choices.chance(60)
            else ()
        ),
        finalize=finalize,
        loaded=(("", (chart,)),),
    )


def _assign(name: str, value: str) -> stmt.Assign[Text, Text]:
    return stmt.Assign(text(name), text(value), PLACE)


class _Speaker:
    """Adds messages to the states of a chart."""

    def __init__(
        self,
        choices: Choices,
        names: tuple[str, ...],
        ends: tuple[str, ...],
        *,
        is_invoked: bool,
    ) -> None:
        self.choices = choices
        self.ends = ends
        self.names = names
        self.targets = [f"#_{name}" for name in names] + (["#_parent"] if is_invoked else [])

    def state(self, state: doc.DocState) -> doc.DocState:
        """Return a state that may send messages when entered and left, and react to them."""
        children = tuple(self.state(child) for child in state.children)
        if state.kind not in (*_INVOKING, doc.Kind.FINAL) or state.id is None:
            return replace(state, children=children)
        entry, exit_ = state.entry, state.exit
        if self.targets and self.choices.chance(35):
            entry = (*entry, self.say())
        if self.targets and self.choices.chance(20):
            exit_ = (*exit_, self.say())
        transitions = state.transitions
        if state.kind is not doc.Kind.FINAL and self.choices.chance(45):
            transitions = (*transitions, self.listen())
        return replace(state, children=children, entry=entry, exit=exit_, transitions=transitions)

    def say(self) -> stmt.Block:
        """Return the sending of a message, limited in number."""
        target = self.choices.pick(self.targets)
        plain = UP if target == "#_parent" else DOWN
        event = self.choices.pick(plain)
        number = (stmt.DocArgument(text("n"), text(GIVEN)),) if event in ("up", "down") else ()
        delay: Text | None = text(self.choices.pick(DELAYS)) if self.choices.chance(40) else None
        send = stmt.DocSend(PLACE, text(event), target=text(target), arguments=number, delay=delay)
        condition = text(f"{SAID} < {MOST_SAID}")
        return (stmt.If((stmt.Branch(condition, (_assign(SAID, f"{SAID} + 1"), send)),), PLACE),)

    def listen(self) -> doc.DocTransition:
        """Return a transition on a message, or on the end of an invoked machine."""
        heard = [UP[0], *UP, *self.ends, "error.communication"] if self.names else []
        if "#_parent" in self.targets:
            heard += [DOWN[0], *DOWN]
        event = self.choices.pick(heard or ["error.execution"])
        content: list[stmt.Assign[Text, Text]] = []
        if event in ("up", "down"):
            # the plain name also matches the one with more tokens, which has no payload
            content = [_assign(HEARD, f"{HEARD} + 1")]
        block: stmt.Block = tuple(content)
        if self.targets and self.choices.chance(40):
            block = (*block, *self.say())
        ends = "#_parent" in self.targets and self.choices.chance(40)
        return doc.DocTransition(
            doc.Trigger.EVENT,
            PLACE,
            events=(text(event),),
            targets=(text(OVER),) if ends else (),
            content=block,
            ordered=True,
        )


def _below(state: doc.DocState) -> list[doc.DocState]:
    found = []
    for child in state.children:
        found += [child, *_below(child)]
    return found


def _placed(state: doc.DocState, name: str, invoke: doc.DocInvoke) -> doc.DocState:
    if state.id is not None and state.id.value == name:
        return replace(state, invokes=(*state.invokes, invoke))
    return replace(state, children=tuple(_placed(c, name, invoke) for c in state.children))
