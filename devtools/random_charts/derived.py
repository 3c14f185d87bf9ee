"""Random charts that extend a random chart: new states, changed content, overridden transitions."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from devtools.random_charts.behaviour import Behaviour
from devtools.random_charts.choices import Choices
from devtools.random_charts.content import PLACE, SOURCE, Content, Event, text
from devtools.random_charts.tree import HISTORIES, Grower, Node
from devtools.random_charts.vocabulary import Named, literal
from fsmkit.chart.inheritance.override_transitions import same_trigger
from fsmkit.chart.inheritance.resolve import resolve_inheritance
from fsmkit.diagnostics import Findings
from fsmkit.document import document as doc
from fsmkit.document.walk import states
from fsmkit.language import IntType
from fsmkit.language.statements.tree import Block, Branch, If, Super, WrittenStatement

COUNTER = IntType(0, 9)
STATES = 4
"""About as many new states at most in one place."""


def derive(
    choices: Choices, documents: tuple[doc.Document, ...], content: Content
) -> tuple[tuple[doc.Document, ...], Content]:
    """Return the documents with one before them that extends the first, and what it can name."""
    level = len(documents)
    resolved = resolve_inheritance(documents, Findings()).document
    event = Event(f"x{level}", (), frozenset({doc.Direction.IN}))
    names = content.names
    content = Content(
        choices,
        replace(names, variables=(*names.variables, Named(f"w{level}", COUNTER))),
        (*content.events, event),
    )
    deriver = _Deriver(choices, level, content, resolved)
    deriver.grow()
    root, refine = deriver.states()
    document = doc.Document(
        SOURCE,
        text(f"Random{level}"),
        root,
        extends=text("base.yaml"),
        data=(*deriver.data(), doc.DocData(text(f"w{level}"), text(str(COUNTER)), text("0"))),
        events=(doc.DocEvent(text(event.name), (), doc.Direction.IN),),
        refine=refine,
    )
    ids = tuple(node.id for node in deriver.root.below() if node.is_real and "." not in node.id)
    content = Content(choices, replace(content.names, states=ids), content.events)
    base = deriver.marked_abstract(documents[0])
    return (document, base, *documents[1:]), content


@dataclass
class _Deriver:
    choices: Choices
    level: int
    content: Content
    base: doc.Document
    root: Node = field(init=False)
    inherited: dict[str, doc.DocState] = field(init=False)
    """By id; without the root."""
    behaviour: Behaviour = field(init=False)
    filled: set[str] = field(default_factory=set)
    """Inherited states that were without children."""

    def __post_init__(self) -> None:
        self.root = _nodes(self.base.root, None)
        found = ((s.id.value, s) for s in states(self.base.root) if s.id is not None)
        self.inherited = dict(found)

    # --- new states -------------------------------------------------------------------------

    def grow(self) -> None:
        """Add states to the tree, here and there."""
        grower = Grower(self.choices, STATES, made=100 * self.level)
        old = frozenset(self.root.walk())
        inner = [
            n for n in old if n.kind in (doc.Kind.ATOMIC, doc.Kind.COMPOUND, doc.Kind.PARALLEL)
        ]
        inner.sort(key=lambda node: node.id)
        for place in self.choices.some(inner, 3):
            grower.budget = STATES
            self._grow_in(grower, place)
        self.behaviour = Behaviour(
            self.choices, self.root, self.content, level=self.level, inherited=old
        )

    def _grow_in(self, grower: Grower, node: Node) -> None:
        if node.kind is doc.Kind.ATOMIC:
            self.filled.add(node.id)
            node.kind = doc.Kind.PARALLEL if self.choices.chance(30) else doc.Kind.COMPOUND
            grower.fill(node)
            return
        # the data of final states would go with the done event of the region
        may_split = node.kind is doc.Kind.COMPOUND and node.parent is not None and not node.can_end
        if may_split and self.choices.chance(40):
            main = Node(f"{node.id}.main", doc.Kind.COMPOUND, node)
            main.children = [c for c in node.children if c.kind is not doc.Kind.DEEP_HISTORY]
            for child in main.children:
                child.parent = main
            node.children = [main, *(c for c in node.children if c.kind is doc.Kind.DEEP_HISTORY)]
            node.kind = doc.Kind.PARALLEL
        could_end = node.can_end
        added = grower.add_to(node)
        if could_end and not node.can_end:  # a transition on its done event would be an error
            grower.end(added)

    # --- content of the derived chart --------------------------------------------------------

    def states(self) -> tuple[doc.DocState, tuple[doc.DocState, ...]]:
        """Return the root, with the new top-level states, and the changes of inherited ones."""
        root = doc.DocState(None, doc.Kind.COMPOUND, PLACE, children=self._new_children(self.root))
        nodes = [node for node in self.root.below() if node.id in self.inherited]
        changed = [n for n in nodes if self._has_new(n) or self.choices.chance(45)]
        return root, tuple(self._entry(node, self.inherited[node.id]) for node in changed)

    def _has_new(self, node: Node) -> bool:
        return any(self._is_new(child) for child in node.children)

    def _is_new(self, node: Node) -> bool:
        return node.id not in self.inherited and not node.id.endswith(".main")

    def _new_children(self, node: Node) -> tuple[doc.DocState, ...]:
        return tuple(self.behaviour.state(n) for n in node.children if self._is_new(n))

    def _entry(self, node: Node, base: doc.DocState) -> doc.DocState:
        children = self._new_children(node)
        kind = doc.Kind.ATOMIC
        if children:
            kind = node.kind
        entry = doc.DocState(text(node.id), kind, PLACE, children=children)
        if node.id in self.filled:
            entry = replace(entry, initial=self.behaviour.initial(node))
        elif base.initial is not None and node.kind is not doc.Kind.PARALLEL and self._perhaps(40):
            entry = self._with_initial(entry, node, base.initial)
        if node.is_real:
            entry = self._with_content(entry, base, "entry")
            entry = self._with_content(entry, base, "exit")
        if node.has_behaviour:
            own = [self.behaviour.transition(node) for _ in range(self.choices.integer(0, 2))]
            own = [replace(t, first=self.choices.chance(40)) for t in own]
            entry = replace(
                entry,
                transitions=(*self._overrides(node, base), *own),
                defer=self.behaviour.defer(node) if self._perhaps(20) else (),
            )
        return entry

    def _perhaps(self, percent: int) -> bool:
        return self.choices.chance(percent)

    def _with_initial(
        self, entry: doc.DocState, node: Node, base: doc.DocTransition
    ) -> doc.DocState:
        made = self.behaviour.initial(node)
        if made is None:
            return entry
        content = made.content
        if content is not None and base.content and self._perhaps(60):
            content = self._around_super(content)
        word = "default" if node.kind in HISTORIES else "initial"
        return replace(
            entry,
            initial=replace(made, content=content),
            overrides=entry.overrides | {word},
        )

    def _with_content(self, entry: doc.DocState, base: doc.DocState, which: str) -> doc.DocState:
        if not self._perhaps(40):
            return entry
        old = base.entry if which == "entry" else base.exit
        blocks: tuple[Block, ...] = (self.content.block(most=2),)
        overrides = entry.overrides
        match self.choices.integer(0, 4):
            case 0 | 1:
                blocks = (self._around_super(blocks[0]),)
            case 2:
                blocks = ((Super(PLACE),), *blocks)
            case 3:
                overrides |= {which}
            case _ if old:
                blocks, overrides = (), overrides | {which}
        if which == "entry":
            return replace(entry, entry=blocks, overrides=overrides)
        return replace(entry, exit=blocks, overrides=overrides)

    def _around_super(self, block: Block) -> Block:
        """Return statements with ``super`` before, after or within a condition among them."""
        place = self.choices.integer(0, len(block))
        statement: WrittenStatement = Super(PLACE)
        if self._perhaps(25):
            branch = Branch(text(self.content.terms.boolean(1)), (Super(PLACE),))
            statement = If((branch,), PLACE)
        return (*block[:place], statement, *block[place:])

    def _overrides(self, node: Node, base: doc.DocState) -> tuple[doc.DocTransition, ...]:
        found = []
        for old in base.transitions:
            is_unique = sum(same_trigger(old, other) for other in base.transitions) == 1
            if (is_unique or old.id is not None) and self._perhaps(40):
                name = "true"
                if old.id is not None and (not is_unique or self._perhaps(50)):
                    name = old.id.value
                found.append(replace(self._override(node, old), override=text(name)))
        return tuple(found)

    def _override(self, node: Node, old: doc.DocTransition) -> doc.DocTransition:
        content = self.content.at(self._event(old))
        guard = None
        if self._perhaps(50):
            word = self.choices.pick(("super and ", "super or ", "not super or ", ""))
            guard = text(f"{word}({content.terms.boolean(1)})")
        block = None
        if self._perhaps(60):
            block = content.block(most=2)
            block = self._around_super(block) if self._perhaps(65) else block
        targets = self.behaviour.targets(node) if self._perhaps(30) else ()
        return doc.DocTransition(
            old.trigger,
            PLACE,
            events=old.events,
            delay=old.delay,
            guard=guard,
            targets=tuple(text(target.id) for target in targets),
            content=block,
        )

    def _event(self, transition: doc.DocTransition) -> Event | None:
        if transition.trigger is not doc.Trigger.EVENT or len(transition.events) != 1:
            return None
        name = transition.events[0].value
        return next((e for e in self.content.events if e.name == name), None)

    def data(self) -> tuple[doc.DocData, ...]:
        """Return inherited variables with another start value."""
        names = {d.name.value for d in self.base.data}
        found = [
            doc.DocData(text(v.name), None, text(literal(self.choices, v.type)))
            for v in self.content.names.of(IntType, writable=True)
            if v.name in names and self.choices.chance(30)
        ]
        return tuple(found)

    def marked_abstract(self, base: doc.Document) -> doc.Document:
        """Return the base with some of the states that are filled here marked abstract."""
        marked = {name for name in sorted(self.filled) if self.choices.chance(40)}
        return replace(base, root=_marked(base.root, marked))


def _nodes(state: doc.DocState, parent: Node | None) -> Node:
    kind = state.kind
    if kind is doc.Kind.ATOMIC and state.children:
        kind = doc.Kind.COMPOUND
    node = Node("" if state.id is None else state.id.value, kind, parent)
    node.children = [_nodes(child, node) for child in state.children]
    return node


def _marked(state: doc.DocState, marked: set[str]) -> doc.DocState:
    is_abstract = state.id is not None and state.id.value in marked
    children = tuple(_marked(child, marked) for child in state.children)
    return replace(state, children=children, abstract=is_abstract)
