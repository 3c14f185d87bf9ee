"""Number the states in document order, generate missing ids, and visit handlers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from fsmkit.diagnostics import Findings, Span
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.document.document import HISTORIES, DocInvoke, DocState, DocTransition, Document, Kind
from fsmkit.language import Literal
from fsmkit.language.statements.tree import Block


@fast_init
@dataclass(frozen=True, slots=True)
class Node:
    """A numbered state. ``children`` holds histories too; ``kind`` is as in the Chart."""

    index: int
    id: str
    kind: Kind
    parent: int | None
    children: tuple[int, ...]
    depth: int
    last: int
    """The last descendant: those are exactly ``index + 1 ... last``."""
    state: DocState

    @property
    def is_history(self) -> bool:
        """Whether this is a history pseudo-state."""
        return self.kind in HISTORIES


@dataclass(frozen=True)
class Tree:
    """The states of a document, numbered; 0 is the root."""

    nodes: tuple[Node, ...]
    points: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    """The states that the entry points of copies enter, by dotted name."""
    constants: Mapping[str, Literal] = field(default_factory=dict)
    """Possible indices of an array of copies."""

    @cached_property
    def index(self) -> dict[str, int]:
        """Indices by id, without the root: its name is not a state's."""
        return {node.id: node.index for node in reversed(self.nodes) if node.index}

    def is_descendant(self, state: int, ancestor: int) -> bool:
        """Whether ``state`` lies strictly below ``ancestor``."""
        return ancestor < state <= self.nodes[ancestor].last

    def ancestors(self, state: int) -> tuple[int, ...]:
        """Return the proper ancestors, nearest first, the root last."""
        found = []
        parent = self.nodes[state].parent
        while parent is not None:
            found.append(parent)
            parent = self.nodes[parent].parent
        return tuple(found)

    def parent(self, node: Node) -> Node:
        """Return the parent of a state; of the root, the root."""
        return self.nodes[node.parent or 0]

    def lca(self, first: int, second: int) -> int:
        """Return the nearest state that is or holds both."""
        return next(
            s
            for s in (first, *self.ancestors(first))
            if s == second or self.is_descendant(second, s)
        )

    def real_children(self, state: int) -> tuple[int, ...]:
        """Return the children that can be active: all but histories."""
        return tuple(c for c in self.nodes[state].children if not self.nodes[c].is_history)


def number_states(document: Document, findings: Findings) -> Tree:
    """Return the tree of a document; a second state of one id is a finding."""
    taken = _ids(document, findings)
    builder = _Builder(set(taken))
    builder.add(document.root, None, 0, _root_id(document, taken))
    return Tree(tuple(builder.nodes))


@dataclass
class _Builder:
    taken: set[str]
    nodes: list[Node] = field(default_factory=list)

    def add(self, state: DocState, parent: int | None, depth: int, name: str) -> int:
        index = len(self.nodes)
        kind = _kind(state, is_root=parent is None)
        self.nodes.append(Node(index, name, kind, parent, (), depth, index, state))
        children = tuple(
            self.add(child, index, depth + 1, self._id(child, name if index else "state", number))
            for number, child in enumerate(state.children, 1)
        )
        last = len(self.nodes) - 1
        self.nodes[index] = Node(index, name, kind, parent, children, depth, last, state)
        return index

    def _id(self, state: DocState, parent: str, number: int) -> str:
        """Return the id of a state; generate one from its position if it has none (SCXML 3.14)."""
        if state.id is not None:
            return state.id.value
        made = f"{parent}.{number}"
        while made in self.taken:
            made += "_"
        self.taken.add(made)
        return made


def _kind(state: DocState, *, is_root: bool) -> Kind:
    if is_root or (
        state.kind is Kind.ATOMIC and any(c.kind not in HISTORIES for c in state.children)
    ):
        return Kind.COMPOUND
    if state.kind is Kind.COMPOUND and not any(c.kind not in HISTORIES for c in state.children):
        return Kind.ATOMIC
    return state.kind


def _root_id(document: Document, taken: Iterable[str]) -> str:
    name = document.name.value or "<root>"
    return name if name not in taken else "<root>"


def _ids(document: Document, findings: Findings) -> dict[str, Span]:
    """Return the place of every id that is written; the first of equal ones counts."""
    found: dict[str, Span] = {}
    pending = list(reversed(document.root.children))
    while pending:
        state = pending.pop()
        pending += reversed(state.children)
        if state.id is None:
            continue
        if state.id.value in found:
            findings.add(
                "duplicate-state",
                f"there are two states `{state.id}`",
                state.id,
                label="the second",
                secondary=[(found[state.id.value], "the first")],
                help="rename one of them: ids are unique in a chart, at any depth",
            )
        else:
            found[state.id.value] = state.id.span
    return found


@fast_init
@dataclass(frozen=True, slots=True)
class Place:
    """A handler and whose it is: a transition's content, a finalize, or entry, exit, script."""

    block: Block
    transition: DocTransition | None = None
    invoke: DocInvoke | None = None


def places(document: Document, tree: Tree) -> Iterator[Place]:
    """Return every handler, in document order."""
    yield Place(document.script)
    for node in tree.nodes:
        state = node.state
        for block in (*state.entry, *state.exit):
            yield Place(block)
        for transition in (*([state.initial] if state.initial else []), *state.transitions):
            yield Place(transition.content or (), transition)
        for invoke in state.invokes:
            yield Place(invoke.finalize or (), invoke=invoke)
