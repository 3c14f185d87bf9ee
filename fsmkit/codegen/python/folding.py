"""The text of `fsmkit.runtime.python` for one chart: without what it is known never to need."""

from __future__ import annotations

import ast
import re
from collections.abc import Container, Iterable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from textwrap import indent
from typing import Any, cast

from fsmkit.chart.statements import Destination
from fsmkit.codegen.python.lines import Piece, Uses
from fsmkit.plan import Features
from fsmkit.plan.image import Image

Facts = Mapping[str, object]
"""Values of expressions, by their text as `ast.unparse` gives it."""
TRACE = ("trace", "_cause")
"""Variables that nothing but the trace needs."""
QUOTED = re.compile(r"(?<![\w'])(f?)'([^'\"\\\n]*)'")
"""A string as `ast.unparse` quotes it."""


UNRECORDED: Facts = {"self.records is not None": False}
"""What holds of a machine that is not recorded."""


def counted_facts(*, covered: bool) -> Facts:
    """Return what holds of a machine that counts what tests reach, or does not."""
    return {"self._counting is not None": covered}


def recorded_facts(*, saves: bool) -> Facts:
    """Return what holds of a recorded machine; ``saves``: saved machines are records, too."""
    known = ("self.records is not None", "self.trace is not None", "child.trace is not None")
    return {**dict.fromkeys(known, True), "self._RECORD_SAVES": saves}


def facts_of(features: Features, image: Image | None, *, is_traced: bool) -> Facts:
    """Return what holds in every step of a machine with these features."""
    is_timed = features.timeouts or features.delays
    rows: list[tuple[object, dict[str, object]]] = [
        (is_traced, {"self.trace": None, "self._cause": None}),
        (is_timed, {"self._timer_count": 0, "self._is_due(now)": False}),
        (features.timeouts, {"what < 0": True}),
        (features.delays, {"what < 0": False, "self._sends": 0}),
        (Destination.INTERNAL in features.delays, {"route == 1": False}),
        (Destination.PORT in features.delays, {"route == 2": False}),
        (Destination.SELF in features.delays, {"route == 0": False}),
        (features.periods, {"self.PERIODS[transition]": 0}),
        (features.timed_guards, {"self._GUARDS[transition] is None": True}),
        (features.alternatives, {"self.OTHERS[transition]": ()}),
        (features.regions, {"chosen & chosen - 1": 0}),
        (features.raises or features.fails or Destination.INTERNAL in features.delays,
         {"self._internal_count": 0}),
        (features.deferral, {"self._deferred_count": 0, "self._is_deferred": False}),
        (features.samples_inputs, {"self.SAMPLES_INPUTS": False}),
        (is_traced or features.calls or features.logs, {"BaseException": None}),
        (features.error_faults, {"event in self.ERRORS": False}),
        (features.payload, {"self.WIDTH": 0, "range(self.WIDTH)": ()}),
    ]  # fmt: skip
    if image is not None:
        rows += [
            (False, {"enumerate(self._SLOT_BYTES)": (), "sum(self._SLOT_BYTES)": 0}),
            (image.deferred, {"self._DEFERRABLE": 0}),
            (image.timers, {"self._ARMED": 0}),
        ]
    return {
        text: value for is_needed, facts in rows if not is_needed for text, value in facts.items()
    }


class Folding(ast.NodeTransformer):
    """Replaces known expressions by their values, and leaves out what then does nothing."""

    def __init__(self, facts: Facts) -> None:
        """Fold by these."""
        self._facts = facts

    def visit(self, node: ast.AST) -> Any:
        """Return what takes the place of a node."""
        if isinstance(node, ast.expr) and not isinstance(getattr(node, "ctx", None), ast.Store):
            text = ast.unparse(node)
            if text in self._facts:
                return ast.Constant(cast(Any, self._facts[text]))
        return super().visit(node)

    def visit_If(self, node: ast.If) -> Any:
        """Return the branch that is sure, none where that does nothing."""
        self.generic_visit(node)
        if isinstance(node.test, ast.Constant):
            return node.body if node.test.value else node.orelse
        return node if node.body or node.orelse else None

    def visit_For(self, node: ast.For) -> Any:
        """Return a loop, none over nothing."""
        self.generic_visit(node)
        is_empty = isinstance(node.iter, ast.Constant) and not node.iter.value
        return node if node.body and not is_empty else None

    def visit_Try(self, node: ast.Try) -> Any:
        """Return a ``try`` without the handlers of what is never raised: of a type that is None."""
        self.generic_visit(node)
        node.handlers = [h for h in node.handlers if not isinstance(h.type, ast.Constant)]
        return node

    def visit_BoolOp(self, node: ast.BoolOp) -> Any:
        """Return a conjunction or disjunction without the operands that do not count."""
        is_and = isinstance(node.op, ast.And)
        kept: list[ast.expr] = []
        for value in node.values:
            operand = self.visit(value)
            if isinstance(operand, ast.Constant) and not isinstance(value, ast.Constant):
                if bool(operand.value) is not is_and:
                    return ast.Constant(operand.value)
            else:
                kept.append(operand)
        if not kept:
            return ast.Constant(is_and)
        node.values = kept
        return node if len(kept) > 1 else kept[0]

    def visit_BinOp(self, node: ast.BinOp) -> Any:
        """Return a sum without zeros, a product with zero as that."""
        node.left, node.right = self.visit(node.left), self.visit(node.right)
        sides = node.left, node.right
        zeros = [isinstance(side, ast.Constant) and side.value == 0 for side in sides]
        if isinstance(node.op, ast.Add) and any(zeros):
            return sides[zeros[0]]
        is_product = isinstance(node.op, ast.Mult) and not isinstance(node.left, ast.List)
        return ast.Constant(0) if is_product and any(zeros) else node

    def visit_Compare(self, node: ast.Compare) -> Any:
        """Return what a comparison of known values comes to."""
        self.generic_visit(node)
        if all(isinstance(each, ast.Constant) for each in (node.left, *node.comparators)):
            return ast.Constant(eval(ast.unparse(node)))  # noqa: S307  (of constants of ours)
        return node

    def visit_IfExp(self, node: ast.IfExp) -> Any:
        """Return the alternative that is sure."""
        self.generic_visit(node)
        if isinstance(node.test, ast.Constant):
            return node.body if node.test.value else node.orelse
        return node


class Stores(ast.NodeTransformer):
    """Leaves out the assignments to attributes that nothing reads."""

    def __init__(self, dead: Container[str]) -> None:
        """Leave out those of attributes that are ``dead``."""
        self._dead = dead

    def visit_Assign(self, node: ast.Assign) -> Any:
        """Return an assignment that somebody reads."""
        return None if self._is_dead(node.targets) else node

    def visit_AugAssign(self, node: ast.AugAssign) -> Any:
        """Return an assignment that somebody reads."""
        return None if self._is_dead([node.target]) else node

    def visit_If(self, node: ast.If) -> Any:
        """Return a choice under which anything is left."""
        self.generic_visit(node)
        return node if node.body or node.orelse else None

    def _is_dead(self, targets: Iterable[ast.expr]) -> bool:
        return all(
            isinstance(target, ast.Attribute) and target.attr in self._dead for target in targets
        )


def uses_of(tree: ast.AST) -> Uses:
    """Return the names that a definition of the library reads."""
    names: set[str] = set()
    attributes: set[str] = set()
    own: set[str] = set()
    for part in ast.walk(tree):
        if isinstance(part, ast.Attribute):
            attributes |= {part.attr} if isinstance(part.ctx, ast.Load) else set()
        elif isinstance(part, ast.Name):
            names.add(part.id)
            own |= set() if isinstance(part.ctx, ast.Load) else {part.id}
        elif isinstance(part, ast.arg):
            own.add(part.arg)
    return Uses(frozenset(names | attributes), frozenset(names - own))


@dataclass(frozen=True, eq=False)
class FoldedMethod:
    """A method, or a table, without what is never needed: its name, its source, what is left."""

    name: str
    source: str
    tree: ast.stmt
    is_changed: bool

    @cached_property
    def uses(self) -> Uses:
        """The names that it reads: variables, and attributes of anything."""
        return uses_of(self.tree)

    @property
    def names(self) -> frozenset[str]:
        """All of them."""
        return self.uses.names

    @cached_property
    def text(self) -> str:
        """Its text: the source, or what is left of it."""
        if self.is_changed and isinstance(self.tree, ast.FunctionDef):
            return printed(self.tree, self.source)
        return self.source

    @cached_property
    def _stored(self) -> frozenset[str]:
        """The private attributes that it assigns, of which some may be read by nobody."""
        parts = (part for part in ast.walk(self.tree) if isinstance(part, ast.Attribute))
        names = (part.attr for part in parts if isinstance(part.ctx, ast.Store))
        return frozenset(name for name in names if name.startswith("_") or name in TRACE)

    def without_stores(self, read: AbstractSet[str]) -> FoldedMethod:
        """Return it without the assignments to private attributes that nobody reads."""
        dead = self._stored - read
        return _without_stores(self, dead) if dead else self


@lru_cache(maxsize=1 << 12)
def _without_stores(method: FoldedMethod, dead: frozenset[str]) -> FoldedMethod:
    copy = ast.parse(method.text).body[0]  # much faster than a deep copy
    size = _size(copy)
    tree = Stores(dead).visit(copy)
    if _size(tree) == size:
        return method
    return FoldedMethod(method.name, method.text, tree, is_changed=True)


def folded_method(method: Piece, facts: Facts) -> FoldedMethod:
    """Return a method of which some facts hold; few of these concern one method."""
    known = sorted(facts.keys() & _expressions(method))
    return _folded(method, tuple((text, facts[text]) for text in known))


@cache
def _expressions(method: Piece) -> frozenset[str]:
    """Return the texts of the expressions in a method."""
    parts = ast.walk(ast.parse(method.text))
    return frozenset(ast.unparse(part) for part in parts if isinstance(part, ast.expr))


@cache
def _folded(method: Piece, facts: tuple[tuple[str, object], ...]) -> FoldedMethod:
    tree = ast.parse(method.text).body[0]
    before = ast.unparse(tree)
    folded = Folding(dict(facts)).visit(tree)
    return FoldedMethod(method.name, method.text, folded, ast.unparse(folded) != before)


def _size(tree: ast.AST) -> int:
    return sum(1 for _ in ast.walk(tree))


def printed(method: ast.FunctionDef, text: str) -> str:
    """Return a folded method, whose source is ``text``."""
    doc, *rest = method.body
    head = text.splitlines()[: doc.end_lineno]
    body = [QUOTED.sub(r'\1"\2"', ast.unparse(statement)) for statement in rest]
    return "\n".join([*head, *(indent(each, "    ") for each in body)])
