"""Find conversions that may leave their range, given the conditions that hold there.

The conversion in ``if n < 8 { n += 1 }`` cannot. A condition holds until a variable in it is
assigned. Inputs and results of operations may change at any time, so nothing is known of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import fsmkit.language as lang
from fsmkit.chart.analysis.exclusion import MOST_CASES, Fact, can_hold_together, cases
from fsmkit.chart.analysis.ranges import range_of, within
from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.content import values, variables, written
from fsmkit.chart.statements import Block, ForEach, If, Statement
from fsmkit.document.document import Kind
from fsmkit.language.arithmetic import exact
from fsmkit.language.conversion import bounds
from fsmkit.language.statements.tree import bodies, statements
from fsmkit.language.walk import calls, nodes, parts, rewrite, root, subexpressions

Facts = tuple[Fact, ...]
MOST_SPLITS = 5
"""Conditional expressions in one value that are looked into: each doubles the work."""


def facts_in_content(chart: Chart, transition: Transition) -> Facts:
    """Return the facts of a transition's guard that still hold when its content starts.

    Exit handlers run in between, and the content of transitions in other regions.
    """
    if transition.guard is None:
        return ()
    between = [b for s in chart.states for b in s.on_exit]
    between += [t.content for t in chart.transitions if _is_beside(chart, t, transition)]
    return _without(_lasting(transition.guard, holds=True), _assigned(between))


def _is_beside(chart: Chart, one: Transition, other: Transition) -> bool:
    """Return whether two transitions can be taken in one microstep."""
    above = (one.source, *chart.ancestors(one.source))
    common = next(s for s in (other.source, *chart.ancestors(other.source)) if s in above)
    is_apart = common not in (one.source, other.source)
    return is_apart and chart.states[common].kind is Kind.PARALLEL


def leaving(chart: Chart, block: Block, facts: Facts) -> Iterator[tuple[Statement, lang.Convert]]:
    """Yield the conversions in a block that may saturate, each with its statement.

    ``facts`` hold at first.
    """
    for statement in block:
        assigned = _assigned([(statement,)])
        match statement:
            case If(branches):
                known = facts
                for branch in branches:
                    if branch.condition is None:
                        yield from leaving(chart, branch.body, known)
                        continue
                    for found in leaving_in(chart, branch.condition, known):
                        yield statement, found
                    held = _lasting(branch.condition, holds=True)
                    yield from leaving(chart, branch.body, (*known, *held))
                    known = (*known, *_lasting(branch.condition, holds=False))
            case ForEach():
                for value in values(statement):
                    for found in leaving_in(chart, value, facts):
                        yield statement, found
                for body in bodies(statement):
                    yield from leaving(chart, body, _without(facts, assigned))
            case _:
                for value in values(statement):
                    for found in leaving_in(chart, value, facts):
                        yield statement, found
        facts = _without(facts, assigned)


def leaving_in(chart: Chart, expr: lang.Expr, facts: Facts = ()) -> Iterator[lang.Convert]:
    """Yield the conversions in an expression that may saturate while facts hold."""
    match folded := lang.fold(expr):
        case lang.Conditional(test, then, otherwise):
            yield from leaving_in(chart, test, facts)
            yield from leaving_in(chart, then, (*facts, *_steady(test, holds=True)))
            yield from leaving_in(chart, otherwise, (*facts, *_steady(test, holds=False)))
        case lang.Binary(lang.BinaryOp.AND | lang.BinaryOp.OR as op, left, right):
            yield from leaving_in(chart, left, facts)
            known = _steady(left, holds=op is lang.BinaryOp.AND)
            yield from leaving_in(chart, right, (*facts, *known))
        case lang.Convert(operand):
            if _can_leave(chart, folded, operand, facts):
                yield folded
            yield from leaving_in(chart, operand, facts)
        case _:
            for part in parts(folded):
                yield from leaving_in(chart, part, facts)


def _can_leave(
    chart: Chart,
    conversion: lang.Convert,
    operand: lang.Expr,
    facts: Facts,
    splits: int = MOST_SPLITS,
) -> bool:
    """Return whether an operand may lie outside of the type of a conversion.

    ``splits``: so many of the conditional expressions in it are taken apart into their two sides.
    """
    type_ = conversion.type
    is_saturating = isinstance(type_, lang.IntType) and type_.overflow is lang.Overflow.SATURATE
    if not is_saturating and not isinstance(type_, lang.DurationType):
        return False
    assert isinstance(type_, lang.IntType | lang.DurationType)  # noqa: S101  (just tested)
    low, high, _ = bounds(type_)
    own = range_of(operand)
    if own is not None and within(own, (low, high)):
        return False
    if own is None:
        return True
    chosen = next((p for p in subexpressions(operand) if isinstance(p, lang.Conditional)), None)
    if chosen is not None and splits:
        return any(
            _can_leave(
                chart,
                conversion,
                lang.fold(_with(operand, chosen, side)),
                (*facts, *_steady(chosen.test, holds=holds)),
                splits - 1,
            )
            for side, holds in ((chosen.then, True), (chosen.otherwise, False))
        )
    few = _few(facts)
    return any(
        can_hold_together(chart, [*few, (_compared(operand, op, bound), True)])
        for op, bound in ((lang.BinaryOp.LT, low), (lang.BinaryOp.GT, high))
    )


def _with(expr: lang.Expr, part: lang.Expr, instead: lang.Expr) -> lang.Expr:
    """Return an expression in which another one stands instead of a part."""
    return rewrite(expr, lambda each: instead if each is part else None)


def _compared(operand: lang.Expr, op: lang.BinaryOp, bound: int) -> lang.Binary:
    literal = lang.Literal(bound, exact(bound, bound), operand.span)
    return lang.Binary(op, operand, literal, lang.BOOL, operand.span)


def _few(facts: Facts) -> Sequence[Fact]:
    """Return the facts whose alternatives can be compared; omitting a fact is safe."""
    found: list[Fact] = []
    count = 1
    for expr, holds in facts:
        count *= max(len(cases(expr, holds=holds)), 1)
        if count > MOST_CASES:
            break
        found.append((expr, holds))
    return found


def _steady(expr: lang.Expr, *, holds: bool) -> Facts:
    """Return the facts of a condition that a second evaluation cannot change."""
    match expr:
        case lang.Unary(lang.UnaryOp.NOT, operand):
            return _steady(operand, holds=not holds)
        case lang.Binary(lang.BinaryOp.AND, left, right) if holds:
            return (*_steady(left, holds=True), *_steady(right, holds=True))
        case lang.Binary(lang.BinaryOp.OR, left, right) if not holds:
            return (*_steady(left, holds=False), *_steady(right, holds=False))
        case _:
            called = any(isinstance(node, lang.CallFunction) for node in nodes(expr))
            is_steady = not called and not calls(expr)
            return ((expr, holds),) if is_steady else ()


def _lasting(expr: lang.Expr, *, holds: bool) -> Facts:
    """Return the facts of a condition that only assignments of the chart can change."""
    return tuple(fact for fact in _steady(expr, holds=holds) if all(map(_lasts, nodes(fact[0]))))


def _lasts(node: object) -> bool:
    if isinstance(node, lang.Variable):
        return node.storage in (lang.Storage.DATA, lang.Storage.OUTPUT)
    return not isinstance(node, lang.InState)


def _assigned(blocks: Iterable[Block]) -> frozenset[str]:
    """Return the variables that blocks assign."""
    return frozenset(
        root(location).name
        for block in blocks
        for statement in statements(block)
        for location in written(statement)
    )


def _without(facts: Facts, assigned: frozenset[str]) -> Facts:
    return tuple(fact for fact in facts if not assigned & variables(fact[0]))
