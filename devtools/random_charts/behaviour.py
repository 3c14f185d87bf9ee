"""Random behaviour for a tree of states: content, transitions, defaults, data of final states."""

from __future__ import annotations

from devtools.random_charts.aims import Aims
from devtools.random_charts.choices import Choices
from devtools.random_charts.content import DELAYS, MOST_TURNS, PLACE, TURNS, Content, Event, text
from devtools.random_charts.declarations import COLOR
from devtools.random_charts.terms import Terms
from devtools.random_charts.tree import Node
from fsmkit.diagnostics import Text
from fsmkit.document.document import Direction, DocState, DocTransition, Kind, Trigger
from fsmkit.language import BOOL, FLOAT64, INT32, SYMBOL, Field, IntType, Type
from fsmkit.language.statements.tree import Assign, Block, DocArgument, Log

DONE_TYPES: tuple[Type, ...] = (INT32, BOOL, INT32, COLOR, SYMBOL, FLOAT64)
"""Types of the data of final states, which follow from their values."""


class Behaviour:
    """Gives behaviour to a tree of states."""

    def __init__(
        self,
        choices: Choices,
        root: Node,
        content: Content,
        *,
        level: int = 0,
        inherited: frozenset[Node] = frozenset(),
    ) -> None:
        """Start from a tree. ``level``: the number of bases; each level has ids of its own."""
        self._choices = choices
        self._root = root
        self._content = content
        self._terms = Terms(choices, content.names)
        self._aims = Aims(choices, root)
        self._states = root.below()
        self._level = level
        self._inherited = inherited
        self._made = 0
        self._received = [e for e in content.events if e.is_received]
        self._done = {node.id: self._done_fields(node) for node in self._states}

    def state(self, node: Node) -> DocState:
        """Return a state with all below it."""
        is_state = node.parent is not None and node.is_real
        return DocState(
            text(node.id) if node.id else None,
            node.kind,
            PLACE,
            initial=self.initial(node),
            children=tuple(self.state(child) for child in node.children),
            transitions=self._transitions(node),
            entry=self._handlers() if is_state else (),
            exit=self._handlers() if is_state else (),
            defer=self.defer(node) if node.has_behaviour else (),
            done_data=self._done_data(node),
        )

    # --- data of final states ---------------------------------------------------------------

    def _done_fields(self, node: Node) -> tuple[Field, ...]:
        """Return what goes with the done event of a state: each final state gives some of it."""
        finals = [child for child in node.children if child.kind is Kind.FINAL]
        if not finals or finals[0] in self._inherited or not self._choices.chance(60):
            return ()
        count = self._choices.integer(1, 2)
        return tuple(
            Field(f"d{self._level}{n}", self._choices.pick(DONE_TYPES)) for n in range(count)
        )

    def _done_data(self, node: Node) -> tuple[DocArgument, ...]:
        parent = node.parent
        if node.kind is not Kind.FINAL or parent is None or parent.parent is None:
            return ()
        fields = self._done[parent.id]
        first = next(child for child in parent.children if child.kind is Kind.FINAL)
        if node is not first:  # omitted values have the default
            fields = tuple(f for f in fields if self._choices.chance(70))
        return tuple(DocArgument(text(f.name), text(self._done_value(f.type))) for f in fields)

    def _done_value(self, type_: Type) -> str:
        if not isinstance(type_, IntType):
            return self._terms.value(type_, 1)
        term = self._terms.integer(1)
        is_int32 = type_.lo <= term.type.lo and term.type.hi <= type_.hi
        return term.text if is_int32 else str(self._choices.integer(0, 9))

    def _handlers(self) -> tuple[Block, ...]:
        if not self._choices.chance(30):
            return ()
        if self._choices.chance(10):
            return (self._content.block(most=2), self._content.block(most=2))
        return (self._content.block(most=2),)

    def defer(self, node: Node) -> tuple[Text, ...]:
        """Return, rarely, events that a state keeps for later: more often where regions differ."""
        received = [e.name for e in self._received if Direction.IN in e.directions]
        is_shared = node.is_in_region or node.kind is Kind.PARALLEL
        if not received or not self._choices.chance(15 if is_shared else 6):
            return ()
        return tuple(text(name) for name in self._choices.some(received, 2))

    # --- transitions of pseudo-states -------------------------------------------------------

    def initial(self, node: Node) -> DocTransition | None:
        """Return the initial transition of a compound state or the default of a history."""
        targets = self._aims.initial(node)
        if not targets:
            return None
        has_content = node.parent is not None and self._choices.chance(25)
        content = self._content.block(most=2) if has_content else None
        names = tuple(text(target.id) for target in targets)
        return DocTransition(Trigger.INITIAL, PLACE, targets=names, content=content)

    # --- transitions ------------------------------------------------------------------------

    def _transitions(self, node: Node) -> tuple[DocTransition, ...]:
        if node.kind is Kind.CHOICE:
            return self._branches(node)
        if not node.has_behaviour:
            return ()
        found = [self.transition(node) for _ in range(self._choices.pick((1, 2, 0, 3, 2, 4)))]
        if node.can_end and self._choices.chance(60):
            found.insert(0, self._on_done(node.id, self._aims.targets(node)))
        # an unhandled error stops the machine, which most charts should survive
        if node.depth == 1 and self._choices.chance(92):
            content = self._content.block(most=1) if self._choices.chance(20) else None
            found.append(self._taken(Trigger.EVENT, (), events=("error",), content=content))
        return tuple(found)

    def _branches(self, node: Node) -> tuple[DocTransition, ...]:
        # towards states that can be left or are final, so that most choices end
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

    def transition(self, node: Node) -> DocTransition:
        """Return a transition of a state: on an event, after a delay, or without either."""
        kind = self._choices.integer(0, 19)
        if kind < 12:
            return self._on_event(node)
        content = self._content.block(most=2) if self._choices.chance(50) else None
        targets = self.targets(node)
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
        if kind < 14:  # counted, so that most loops end
            guard = f"({guard}) and {TURNS} < {self._choices.integer(1, MOST_TURNS)}"
            count = Assign(text(TURNS), text("1"), PLACE, "+")
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
            self.targets(node),
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
        ended = [node.id for node in self._states if node.can_end]
        event = self._choices.pick(("error.execution", "error.range", "error", "done.state"))
        if event == "done.state" and ended:
            return self._on_done(self._choices.pick(ended), targets)
        if event == "done.state":
            event = "error"
        return self._taken(Trigger.EVENT, targets, events=(event,), guard=guard, content=content)

    def _on_done(self, ended: str, targets: tuple[Node, ...]) -> DocTransition:
        event = Event(f"done.state.{ended}", self._done.get(ended, ()), frozenset())
        content = self._content.at(event)
        guard = content.terms.test() if self._choices.chance(35) else None
        block = content.block(most=2) if self._choices.chance(50) else None
        if event.fields and self._choices.chance(80):
            shown = tuple(text(f"event.{f.name}") for f in event.fields)
            block = (Log(None, shown, PLACE), *(block or ()))
        return self._taken(Trigger.EVENT, targets, events=(event.name,), guard=guard, content=block)

    def targets(self, node: Node) -> tuple[Node, ...]:
        """Return targets for a transition of a state."""
        return self._aims.targets(node)

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
            id=self._id(),
        )

    def _id(self) -> Text | None:
        if not self._choices.chance(25):
            return None
        self._made += 1
        return text(f"t{self._level}_{self._made}")
