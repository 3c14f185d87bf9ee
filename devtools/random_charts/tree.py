"""Random trees of states, before they have behaviour."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from devtools.random_charts.choices import Choices
from fsmkit.document.document import Kind

LETTERS = {
    Kind.ATOMIC: "s",
    Kind.COMPOUND: "c",
    Kind.PARALLEL: "p",
    Kind.FINAL: "f",
    Kind.SHALLOW_HISTORY: "h",
    Kind.DEEP_HISTORY: "d",
    Kind.CHOICE: "x",
}
HISTORIES = (Kind.SHALLOW_HISTORY, Kind.DEEP_HISTORY)
DEEPEST = 5


@dataclass(eq=False)
class Node:
    """A state of the tree; the root is compound and has no id."""

    id: str
    kind: Kind
    parent: Node | None
    children: list[Node] = field(default_factory=list)

    def walk(self) -> Iterator[Node]:
        """Yield this state and all below it, in document order."""
        yield self
        for child in self.children:
            yield from child.walk()

    def below(self) -> list[Node]:
        """Return all states below this one, in document order."""
        return list(self.walk())[1:]

    def is_below(self, other: Node) -> bool:
        """Whether this lies strictly below another state."""
        return self.parent is not None and (self.parent is other or self.parent.is_below(other))

    @property
    def depth(self) -> int:
        """Number of proper ancestors."""
        return 0 if self.parent is None else self.parent.depth + 1

    @property
    def is_real(self) -> bool:
        """Whether this can be active: no history."""
        return self.kind not in HISTORIES

    @property
    def is_in_region(self) -> bool:
        """Whether other regions can be active at the same time."""
        parent = self.parent
        return parent is not None and (parent.kind is Kind.PARALLEL or parent.is_in_region)

    @property
    def can_end(self) -> bool:
        """Whether this can be in a final configuration, by its tree alone: ``done.state`` of it."""
        if self.kind is Kind.PARALLEL:
            return all(child.can_end for child in self.children if child.is_real)
        return any(child.kind is Kind.FINAL for child in self.children)

    @property
    def has_behaviour(self) -> bool:
        """Whether this can have event transitions of its own."""
        return self.parent is not None and self.kind in (
            Kind.ATOMIC,
            Kind.COMPOUND,
            Kind.PARALLEL,
        )


@dataclass
class Grower:
    """Grows one tree within a budget of states."""

    choices: Choices
    budget: int
    made: int = 0

    def root(self) -> Node:
        """Return a whole tree."""
        root = Node("", Kind.COMPOUND, None)
        self._fill_compound(root)
        return root

    def fill(self, node: Node) -> None:
        """Give children to a state that has none."""
        if node.kind is Kind.PARALLEL:
            self._fill_parallel(node)
        else:
            self._fill_compound(node)

    def add_to(self, node: Node) -> Node:
        """Add a child to a state that has some, and return it."""
        return self._add(node, Kind.COMPOUND if node.kind is Kind.PARALLEL else self._any(node))

    def end(self, region: Node) -> None:
        """Give a region a final child."""
        self._add(region, Kind.FINAL)

    def _add(self, parent: Node, kind: Kind) -> Node:
        self.made += 1
        self.budget -= 1
        node = Node(f"{LETTERS[kind]}{self.made}", kind, parent)
        parent.children.append(node)
        if kind is Kind.COMPOUND:
            self._fill_compound(node)
        elif kind is Kind.PARALLEL:
            self._fill_parallel(node)
        return node

    def _fill_compound(self, node: Node) -> None:
        # the first child can be the default one: it is real and can be left
        self._add(node, self._substantial(node))
        for _ in range(self.choices.integer(0, 3)):
            if self.budget <= 0:
                break
            self._add(node, self._any(node))
        if node.parent is not None and self.choices.chance(25):
            self._add(node, Kind.FINAL)
        if node.is_in_region and self.choices.chance(30):
            self._add(node, self.choices.pick(HISTORIES))

    def _fill_parallel(self, node: Node) -> None:
        for _ in range(self.choices.pick((2, 2, 2, 3))):
            kind = self.choices.integer(0, 9) if node.depth < DEEPEST - 1 else 9
            if kind < 8:
                self._add(node, Kind.COMPOUND)
            elif kind == 8 and self.budget > 0:
                self._add(node, Kind.PARALLEL)
            else:
                self._add(node, Kind.ATOMIC)
        if self.choices.chance(12):
            self._add(node, self.choices.pick(HISTORIES))

    def _substantial(self, parent: Node) -> Kind:
        kind = self.choices.integer(0, 9)
        if kind < 5 or self.budget <= 0 or parent.depth >= DEEPEST:
            return Kind.ATOMIC
        return Kind.COMPOUND if kind < 8 else Kind.PARALLEL

    def _any(self, parent: Node) -> Kind:
        kind = self.choices.integer(0, 15)
        match kind:
            case 7 | 8:
                return Kind.FINAL
            case 9:
                return Kind.CHOICE
            case 10 | 11 if parent.parent is not None:
                return HISTORIES[kind - 10]
            case 12 | 13 | 14 | 15 if self.budget > 0 and parent.depth < DEEPEST:
                return Kind.COMPOUND if kind < 14 else Kind.PARALLEL
            case _:
                return Kind.ATOMIC
