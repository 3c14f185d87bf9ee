"""Random statecharts, valid by construction: `random_document` and the strategy `documents`.

They hold whatever the two notations can say of one chart without inheritance and invocation, in
combinations nobody would write by hand. `run` on them always ends: immediate sends to the own queue
are counted, and every delay is at least a tick.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hypothesis import strategies as st

from fsmkit.diagnostics import Text
from fsmkit.expressions import EnumType, Field
from fsmkit.model.document import (
    Block,
    Direction,
    DocAssign,
    DocCapacity,
    DocConstant,
    DocData,
    DocEvent,
    DocField,
    DocOperation,
    DocState,
    DocTransition,
    DocType,
    Document,
    Kind,
    Trigger,
)
from fsmkit.testing.choices import Choices, DrawnChoices
from fsmkit.testing.content import (
    DELAYS,
    MOST_TURNS,
    PLACE,
    SENT,
    SOURCE,
    TURNS,
    Content,
    Event,
    text,
)
from fsmkit.testing.declarations import Declared, declare
from fsmkit.testing.terms import Terms
from fsmkit.testing.tree import HISTORIES, Grower, Node
from fsmkit.testing.vocabulary import Names

if TYPE_CHECKING:
    from hypothesis.strategies import DrawFn


@st.composite
def documents(draw: DrawFn, states: int = 16) -> Document:
    """Draw a random document of about that many states at most."""
    return random_document(DrawnChoices(draw), states)


def random_document(choices: Choices, states: int = 16) -> Document:
    """Return a document of about that many states at most."""
    root = Grower(choices, choices.integer(1, states)).root()
    declared = declare(choices)
    ids = tuple(node.id for node in root.below() if node.is_real)
    names = Names(declared.variables, ids, declared.operations, declared.constants)
    maker = _Maker(choices, root, Content(choices, names, declared.events))
    return _assemble(choices, declared, maker.state(root))


class _Maker:
    """Gives behaviour to a tree of states."""

    def __init__(self, choices: Choices, root: Node, content: Content) -> None:
        self._choices = choices
        self._root = root
        self._content = content
        self._terms = Terms(choices, content.names)
        self._states = root.below()
        self._received = [e for e in content.events if e.is_received]

    def state(self, node: Node) -> DocState:
        """Return a state with all below it."""
        is_state = node.parent is not None and node.is_real
        return DocState(
            text(node.id) if node.id else None,
            node.kind,
            PLACE,
            initial=self._initial(node),
            children=tuple(self.state(child) for child in node.children),
            transitions=self._transitions(node),
            entry=self._handlers() if is_state else (),
            exit=self._handlers() if is_state else (),
            defer=self._defer() if node.has_behaviour else (),
        )

    def _handlers(self) -> tuple[Block, ...]:
        if not self._choices.chance(30):
            return ()
        if self._choices.chance(10):
            return (self._content.block(most=2), self._content.block(most=2))
        return (self._content.block(most=2),)

    def _defer(self) -> tuple[Text, ...]:
        received = [e.name for e in self._received if Direction.IN in e.directions]
        if not received or not self._choices.chance(6):
            return ()
        return tuple(text(name) for name in self._choices.some(received, 2))

    # --- transitions of pseudo-states -------------------------------------------------------

    def _initial(self, node: Node) -> DocTransition | None:
        if node.kind in HISTORIES:
            return self._default(node)
        if node.kind is not Kind.COMPOUND:
            return None
        children = [child for child in node.children if child.is_real]
        targets: tuple[Node, ...] = (children[0],)
        kind = self._choices.integer(0, 9)
        if kind in (6, 7):
            targets = (self._choices.pick(children),)
        elif kind == 8:
            targets = (self._choices.pick([n for n in node.below() if n.is_real]),)
        elif kind == 9:
            targets = self._spread(node) or targets
        content = self._pseudo_content() if node.parent is not None else None
        return _always(targets, content)

    def _default(self, node: Node) -> DocTransition:
        parent = node.parent
        assert parent is not None  # noqa: S101
        if parent.kind is Kind.PARALLEL:
            regions = tuple(child for child in parent.children if child.is_real)
            return _always(regions, self._pseudo_content())
        deep = node.kind is Kind.DEEP_HISTORY
        inside = parent.below() if deep else parent.children
        real = [n for n in inside if n.is_real]
        return _always((self._choices.pick(real),), self._pseudo_content())

    def _pseudo_content(self) -> Block | None:
        return self._content.block(most=2) if self._choices.chance(25) else None

    def _spread(self, node: Node) -> tuple[Node, ...]:
        """Return targets in several regions of one parallel state below ``node``, if any."""
        parallels = [n for n in node.below() if n.kind is Kind.PARALLEL]
        if not parallels:
            return ()
        parallel = self._choices.pick(parallels)
        regions = [child for child in parallel.children if child.is_real]
        return tuple(
            self._choices.pick([n for n in region.walk() if n.is_real or n is not region])
            for region in self._choices.some(regions, len(regions))
        )

    # --- transitions ------------------------------------------------------------------------

    def _transitions(self, node: Node) -> tuple[DocTransition, ...]:
        if node.kind is Kind.CHOICE:
            return self._branches(node)
        if not node.has_behaviour:
            return ()
        found = [self._transition(node) for _ in range(self._choices.pick((1, 2, 0, 3, 2, 4)))]
        # an unhandled error stops the machine, which most charts should survive
        if node.depth == 1 and self._choices.chance(92):
            content = self._content.block(most=1) if self._choices.chance(20) else None
            found.append(self._taken(Trigger.EVENT, (), events=("error",), content=content))
        return tuple(found)

    def _branches(self, node: Node) -> tuple[DocTransition, ...]:
        # towards real states that can be left or that end, so that most choices come to rest
        calm = [n for n in self._states if n.kind in (Kind.ATOMIC, Kind.FINAL)]
        found = []
        for _ in range(self._choices.integer(0, 2)):
            target = self._choices.pick(calm + self._states)
            if target is not node:
                guard = self._terms.boolean(2)
                found.append(self._taken(Trigger.EVENTLESS, (target,), guard=guard))
        rest = self._choices.pick(calm or self._states)
        content = self._content.block(most=1) if self._choices.chance(30) else None
        return (*found, self._taken(Trigger.EVENTLESS, (rest,), content=content))

    def _transition(self, node: Node) -> DocTransition:
        kind = self._choices.integer(0, 19)
        if kind < 12:
            return self._on_event(node)
        content = self._content.block(most=2) if self._choices.chance(50) else None
        targets = self._targets(node)
        guard = self._terms.test() if self._choices.chance(35) else None
        internal = self._choices.chance(20)
        if kind < 16:
            delay = self._choices.pick(DELAYS)
            trigger = Trigger.EVERY if kind == 15 else Trigger.AFTER
            return self._taken(
                trigger, targets, guard=guard, content=content, internal=internal, delay=delay
            )
        if kind < 18:
            return self._on_platform_event(targets, guard, content)
        return self._eventless(targets, content, internal=internal)

    def _eventless(
        self, targets: tuple[Node, ...], content: Block | None, *, internal: bool
    ) -> DocTransition:
        kind = self._choices.integer(0, 19)
        guard = self._terms.boolean(2) if kind < 19 else None
        if kind < 14:  # counted, so that most loops come to an end
            guard = f"({guard}) and {TURNS} < {self._choices.integer(1, MOST_TURNS)}"
            count = DocAssign(text(TURNS), text("1"), PLACE, "+")
            content = (count, *(content or ()))
        return self._taken(
            Trigger.EVENTLESS, targets, guard=guard, content=content, internal=internal
        )

    def _on_event(self, node: Node) -> DocTransition:
        descriptors, event = self._descriptors()
        content = self._content.at(event)
        reply = event.reply if event is not None else None
        block = content.block(reply=reply) if self._choices.chance(50) else None
        guard = content.terms.test() if self._choices.chance(35) else None
        return self._taken(
            Trigger.EVENT,
            self._targets(node),
            events=descriptors,
            guard=guard,
            content=block,
            internal=self._choices.chance(25),
        )

    def _descriptors(self) -> tuple[tuple[str, ...], Event | None]:
        """Return descriptors, and the event whose payload they leave no doubt about."""
        kind = self._choices.integer(0, 19)
        if kind < 15:
            event = self._choices.pick(self._received)
            return (event.name,), event
        if kind == 15:
            return ("*",), None
        dotted = [e.name.split(".")[0] for e in self._received if "." in e.name]
        if kind == 16 and dotted:
            return (self._choices.pick(dotted),), None
        return tuple(e.name for e in self._choices.some(self._received, 3)), None

    def _on_platform_event(
        self, targets: tuple[Node, ...], guard: str | None, content: Block | None
    ) -> DocTransition:
        ended = [
            node.id
            for node in self._states
            if any(child.kind is Kind.FINAL for child in node.children)
        ]
        ended += [n.id for n in self._states if n.kind is Kind.PARALLEL and _can_end(n)]
        event = self._choices.pick(("error.execution", "error.range", "error", "done.state"))
        if event == "done.state":
            event = f"done.state.{self._choices.pick(ended)}" if ended else "error"
        return self._taken(Trigger.EVENT, targets, events=(event,), guard=guard, content=content)

    def _targets(self, node: Node) -> tuple[Node, ...]:
        kind = self._choices.integer(0, 19)
        others = [n for n in self._states if n is not node]
        below = node.below()
        if kind >= 18 and (spread := self._spread(self._root)):
            return spread
        if kind in (3, 4) or not others:
            return ()
        if kind in (5, 6) and below:
            return (self._choices.pick(below),)
        if kind == 7:
            return (node,)
        if kind in (8, 9) and (histories := [n for n in others if not n.is_real]):
            return (self._choices.pick(histories),)
        if kind < 15 and node.parent is not None:
            siblings = [n for n in node.parent.below() if n is not node]
            if siblings:
                return (self._choices.pick(siblings),)
        return (self._choices.pick(others),)

    def _taken(
        self,
        trigger: Trigger,
        targets: tuple[Node, ...],
        *,
        events: tuple[str, ...] = (),
        guard: str | None = None,
        content: Block | None = None,
        internal: bool = False,
        delay: str | None = None,
    ) -> DocTransition:
        return DocTransition(
            trigger,
            PLACE,
            events=tuple(text(name) for name in events),
            delay=None if delay is None else text(delay),
            guard=None if guard is None else text(guard),
            targets=tuple(text(target.id) for target in targets),
            internal=internal and bool(targets),
            content=content,
            ordered=True,
        )


def _always(targets: tuple[Node, ...], content: Block | None) -> DocTransition:
    names = tuple(text(target.id) for target in targets)
    return DocTransition(Trigger.INITIAL, PLACE, targets=names, content=content)


def _can_end(node: Node) -> bool:
    """Whether a state can be in a final configuration, by its tree alone."""
    if node.kind is Kind.PARALLEL:
        return all(_can_end(child) for child in node.children if child.is_real)
    return any(child.kind is Kind.FINAL for child in node.children)


def _assemble(choices: Choices, declared: Declared, root: DocState) -> Document:
    types = tuple(
        DocType(text(type_.name), tuple(text(m) for m in type_.members))
        if isinstance(type_, EnumType)
        else DocType(text(type_.name), fields=_fields(type_.fields))
        for type_ in declared.types
    )
    return Document(
        SOURCE,
        text("Random"),
        root,
        types=types,
        constants=tuple(DocConstant(text(n), text(str(v))) for n, v in declared.constants),
        data=(
            *(_data(name, type_, init) for name, type_, init in declared.data),
            DocData(text(SENT), text("0..100"), text("0")),
            DocData(text(TURNS), text("0..100"), text("0")),
        ),
        inputs=tuple(_data(name, type_, None) for name, type_, _ in declared.inputs),
        outputs=tuple(_data(name, type_, init) for name, type_, init in declared.outputs),
        operations=tuple(
            DocOperation(
                text(o.name),
                _fields(o.parameters),
                None if o.result is None else text(str(o.result)),
            )
            for o in declared.operations
        ),
        events=tuple(
            DocEvent(
                text(e.name),
                _fields(e.fields),
                direction,
                None if e.reply is None else text(str(e.reply)),
            )
            for e in declared.events
            for direction in sorted(e.directions, key=lambda d: d.value)
        ),
        capacities=_capacities(choices),
    )


def _data(name: str, type_: object, init: str | None) -> DocData:
    return DocData(text(name), text(str(type_)), None if init is None else text(init))


def _fields(fields: tuple[Field, ...]) -> tuple[DocField, ...]:
    return tuple(DocField(text(f.name), text(str(f.type))) for f in fields)


def _capacities(choices: Choices) -> tuple[DocCapacity, ...]:
    def maybe(name: str, percent: int, *values: int) -> list[DocCapacity]:
        if not choices.chance(percent):
            return []
        return [DocCapacity(text(name), text(str(choices.pick(values))))]

    return (
        *maybe("queue", 40, 8, 4, 2, 1),
        *maybe("internal", 85, 24, 16, 16, 12, 3),
        *maybe("delayed", 40, 4, 3, 1),
        *maybe("microsteps", 30, 100, 40, 12),
    )
