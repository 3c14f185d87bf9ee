"""Choose targets of random transitions: mostly one state, of any kind and distance."""

from __future__ import annotations

from dataclasses import dataclass

from devtools.random_charts.choices import Choices
from devtools.random_charts.tree import HISTORIES, Node
from fsmkit.document.document import Kind


@dataclass(frozen=True)
class Aims:
    """Picks targets in a tree."""

    choices: Choices
    root: Node

    def targets(self, node: Node) -> tuple[Node, ...]:
        """Return targets for a transition of a state: none, one, or one in each of some regions."""
        kind = self.choices.integer(0, 19)
        others = [n for n in self.root.below() if n is not node]
        below = node.below()
        if kind >= 18 and (spread := self._spread(self.root)):
            return spread
        if kind == 17 and (several := self._histories()):
            return several
        if kind in (3, 4) or not others:
            return ()
        if kind in (5, 6) and below:
            return (self.choices.pick(below),)
        if kind == 7:
            return (node,)
        if kind in (8, 9) and (histories := [n for n in others if not n.is_real]):
            return (self.choices.pick(histories),)
        if kind in (10, 11) and node.parent is not None:
            finals = [n for n in node.parent.children if n.kind is Kind.FINAL]
            if finals:
                return (self.choices.pick(finals),)
        if kind < 15 and node.parent is not None:
            siblings = [n for n in node.parent.below() if n is not node]
            if siblings:
                return (self.choices.pick(siblings),)
        return (self.choices.pick(others),)

    def initial(self, node: Node) -> tuple[Node, ...]:
        """Return the initial states of a compound state or the default of a history, else none."""
        if node.kind in HISTORIES:
            return self._default(node)
        if node.kind is not Kind.COMPOUND:
            return ()
        children = [child for child in node.children if child.is_real]
        kind = self.choices.integer(0, 9)
        if kind in (6, 7):
            return (self.choices.pick(children),)
        if kind == 8:
            return (self.choices.pick([n for n in node.below() if n.is_real]),)
        return (kind == 9 and self._spread(node)) or (children[0],)

    def _default(self, node: Node) -> tuple[Node, ...]:
        parent = node.parent
        assert parent is not None  # noqa: S101
        if parent.kind is Kind.PARALLEL:
            return tuple(child for child in parent.children if child.is_real)
        deep = node.kind is Kind.DEEP_HISTORY
        inside = parent.below() if deep else parent.children
        return (self.choices.pick([n for n in inside if n.is_real]),)

    def _histories(self) -> tuple[Node, ...]:
        """Return histories in several regions of one parallel state, if there are such."""
        parallels = [n for n in self.root.below() if n.kind is Kind.PARALLEL]
        found = [
            [[n for n in region.below() if not n.is_real] for region in parallel.children]
            for parallel in parallels
        ]
        several = [kept for each in found if len(kept := [h for h in each if h]) > 1]
        if not several:
            return ()
        return tuple(self.choices.pick(each) for each in self.choices.pick(several))

    def _spread(self, node: Node) -> tuple[Node, ...]:
        """Return targets in several regions of one parallel state below ``node``, if any."""
        parallels = [n for n in node.below() if n.kind is Kind.PARALLEL]
        if not parallels:
            return ()
        parallel = self.choices.pick(parallels)
        regions = [child for child in parallel.children if child.is_real]
        return tuple(
            self.choices.pick([n for n in region.walk() if n.is_real or n is not region])
            for region in self.choices.some(regions, len(regions))
        )
