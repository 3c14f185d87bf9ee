"""Effects of evaluation and execution: failures, changes, and effects that the host notices.

The effects of a node include those of the nodes below it. A tuple of nodes counts as a node.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.analysis.ranges import within
from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.content import values, variables, written
from fsmkit.chart.forms import by_form
from fsmkit.document.document import Kind
from fsmkit.language.conversion import integer_bounds
from fsmkit.language.statements.tree import bodies, statements
from fsmkit.language.walk import can_have_children, child_getter, root

# --- failing --------------------------------------------------------------------------------------


def is_never_zero(divisor: lang.Expr) -> bool:
    """Whether a divisor is provably not 0."""
    if isinstance(divisor, lang.Literal):
        return divisor.value != 0
    bounds = integer_bounds(divisor.type)
    return bounds is not None and not bounds[0] <= 0 <= bounds[1]


def is_inside(index: lang.Expr, length: int) -> bool:
    """Whether an index provably lies within an array."""
    if isinstance(index, lang.Literal) and isinstance(index.value, int):
        return 0 <= index.value < length
    bounds = integer_bounds(index.type)
    return bounds is not None and within(bounds, (0, length - 1))


def can_fail(node: object) -> bool:
    """Whether evaluating may end in an error of content or in a fault."""
    return bool(_facts(node) & FAILS)


def can_fault(node: object) -> bool:
    """Whether evaluating can put the machine into a fault."""
    return bool(_facts(node) & FAULTS)


def can_end(node: object) -> bool:
    """Whether a statement, its conditions, or a statement of a block can end its block."""
    return bool(_facts(node) & (FAILS | ENDS))


def can_break_off(statement: stmt.Statement) -> bool:
    """Whether a statement can end its block if a failing condition counts as false.

    (SCXML 5.9.1.) A condition that faults ends it all the same.
    """
    if not can_end(statement):
        return False
    own = values(statement)
    if can_fault(own) if isinstance(statement, stmt.If) else can_fail((own, written(statement))):
        return True
    return ends(statement) or any(can_break_off(s) for body in bodies(statement) for s in body)


def ends(statement: stmt.Statement) -> bool:
    """Whether a statement can end its block although its expressions evaluate without failure."""
    match statement:
        case stmt.Fail():
            return True
        case stmt.Send(delay=delay):  # which may be negative
            return delay is not None and not isinstance(delay, lang.Literal)
        case _:
            return False


# --- noticing -------------------------------------------------------------------------------------


def has_effect(node: object) -> bool:
    """Whether evaluating twice differs from once: it calls the host or may report a range error.

    Coverage counters also make a difference.
    """
    return bool(_facts(node) & (CALLS | SATURATES | COUNTS))


def can_stop(node: object) -> bool:
    """Whether evaluating may raise an error event, or stop the machine by a fault."""
    return bool(_facts(node) & (FAILS | SATURATES))


def needs_order(left: lang.Expr, right: lang.Expr) -> bool:
    """Whether the order in which two operands are evaluated is observable."""
    one, other = _facts(left), _facts(right)
    does, fails = CALLS | SATURATES | COUNTS, CALLS | SATURATES | COUNTS | FAILS
    return bool((one & does and other & fails) or (other & does and one & fails))


def observes(node: object) -> bool:
    """Whether content reads the active states, or calls the host, which can read them."""
    return bool(_facts(node) & OBSERVES)


def is_plain(block: stmt.Block) -> bool:
    """Whether a handler only assigns, without failures, range errors or calls of the host.

    The active states are then not observable while it runs.
    """
    is_quiet = not _facts(block) & (CALLS | SATURATES | FAILS | TESTS_STATE)
    return is_quiet and all(isinstance(statement, stmt.Assign) for statement in block)


def reads_event(node: object) -> bool:
    """Whether a node reads a field of the current event."""
    return bool(_facts(node) & READS_EVENT)


@dataclass(frozen=True, slots=True)
class Outcomes:
    """The possible effects of a node, collected in one walk."""

    facts: int

    def __or__(self, other: Outcomes) -> Outcomes:
        """Return the effects that are possible in either of two nodes."""
        return Outcomes(self.facts | other.facts)

    @property
    def can_stop(self) -> bool:
        """As the function of that name; so are the others."""
        return bool(self.facts & (FAILS | SATURATES))

    @property
    def can_end(self) -> bool:
        """Whether a statement can end its block."""
        return bool(self.facts & (FAILS | ENDS))

    @property
    def calls(self) -> bool:
        """Whether the host is called."""
        return bool(self.facts & CALLS)

    @property
    def reads_event(self) -> bool:
        """Whether the node reads a field of the current event."""
        return bool(self.facts & READS_EVENT)

    @property
    def reads_event_name(self) -> bool:
        """Whether the name or the type of the current event occurs."""
        return bool(self.facts & READS_NAME)


def outcomes(node: object) -> Outcomes:
    """Return the possible effects of a node, such as a whole chart, in one walk."""
    return Outcomes(_facts(node))


# --- the facts of a node --------------------------------------------------------------------------

FAILS, FAULTS, SATURATES, CALLS, OBSERVES, TESTS_STATE, READS_EVENT, READS_NAME, ENDS, COUNTS = (
    1 << bit for bit in range(10)
)
"""The possible effects of an expression or a statement, with the nodes below it."""
MOST = 1 << 18
"""Nodes whose facts are kept: the printers look at the same ones many times."""
_known: dict[int, tuple[object, int]] = {}


def _facts(node: Any) -> int:
    """Return the possible effects of a node as bits; cached by the identity of the node."""
    kind = node.__class__
    if kind is tuple:
        found = 0
        for part in node:
            found |= _facts(part)
        return found
    known = _known.get(id(node))
    if known is not None:
        return known[1]
    if kind in stmt.STATEMENTS:
        return _kept(node, _of_form(node))
    own, take = _rules(kind)
    found = 0 if own is None else own(node)
    return found if take is None else _kept(node, found | _inner(take(node)))


def _inner(parts: Any) -> int:
    """Return the possible effects of the parts of a node; parts may be None."""
    found = 0
    for part in parts:
        if part is not None:
            found |= _facts(part)
    return found


def _kept(node: object, facts: int) -> int:
    if len(_known) >= MOST:
        _known.clear()
    _known[id(node)] = node, facts
    return facts


@by_form
def _of_form(node: Any) -> int:
    """Return the possible effects of a statement or guard, which depend on its form only."""
    own, take = _rules(node.__class__)
    return (0 if own is None else own(node)) | (0 if take is None else _inner(take(node)))


@cache
def _rules(kind: Any) -> tuple[Callable[[Any], int] | None, Callable[[Any], Any] | None]:
    """Return the function for the own effects of a class of nodes, and its getter of children."""
    return OWN.get(kind), child_getter(kind) if can_have_children(kind) else None


def _of_binary(part: lang.Binary) -> int:
    divides = part.op in (lang.BinaryOp.DIV, lang.BinaryOp.REM) and not isinstance(
        part.type, lang.FloatType
    )
    return FAILS if divides and not is_never_zero(part.right) else 0


def _of_element(part: lang.Element) -> int:
    assert isinstance(part.array.type, lang.ArrayType)  # noqa: S101  (typed so)
    return 0 if is_inside(part.index, part.array.type.length) else FAILS


def _of_convert(part: lang.Convert) -> int:
    type_ = part.type
    if isinstance(type_, lang.IntType) and type_.overflow is lang.Overflow.FAULT:
        return FAILS | FAULTS
    is_saturating = isinstance(type_, lang.IntType) and type_.overflow is lang.Overflow.SATURATE
    return SATURATES if is_saturating or isinstance(type_, lang.DurationType) else 0


def _of_checked(part: lang.Checked) -> int:
    if part.otherwise is not None:
        return 0
    if not isinstance(part.type, lang.EnumType):
        return FAILS
    known, members = integer_bounds(part.operand.type), part.type.numbers
    if known is None or known[1] - known[0] >= len(members):
        return FAILS
    return 0 if all(n in members for n in range(known[0], known[1] + 1)) else FAILS


def _of_transition(part: Transition) -> int:
    return 0 if part.guard is None else _kept(part.guard, _of_form(part.guard))


def _of_function(part: lang.CallFunction) -> int:
    return _facts(part.function.body) & (FAILS | FAULTS | SATURATES)


OWN: Mapping[type, Callable[[Any], int]] = {
    Transition: _of_transition,
    lang.Binary: _of_binary,
    lang.Element: _of_element,
    lang.Convert: _of_convert,
    lang.Checked: _of_checked,
    lang.CallFunction: _of_function,
    lang.Invalid: lambda _: FAILS,
    lang.CoveredCondition: lambda _: COUNTS,
    lang.CoveredGuard: lambda _: COUNTS,
    lang.Call: lambda _: CALLS | OBSERVES,
    lang.InState: lambda _: OBSERVES | TESTS_STATE,
    lang.EventField: lambda _: READS_EVENT,
    lang.EventName: lambda _: READS_NAME,
    lang.EventType: lambda _: READS_NAME,
    stmt.CallOperation: lambda _: OBSERVES,
    stmt.Log: lambda _: OBSERVES,
    stmt.Send: lambda part: (
        (OBSERVES if part.destination is stmt.Destination.PORT else 0) | (ENDS if ends(part) else 0)
    ),
    stmt.Fail: lambda _: ENDS,
}
"""By class of a node, its possible effects without those of its parts."""


# --- reading and writing --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Effects:
    """The effects of an execution. ``is_visible``: the host or a queue can observe its time."""

    reads: frozenset[str] = frozenset()
    writes: frozenset[str] = frozenset()
    is_visible: bool = False

    def __or__(self, other: Effects) -> Effects:
        return Effects(
            self.reads | other.reads,
            self.writes | other.writes,
            self.is_visible or other.is_visible,
        )

    def commutes(self, other: Effects) -> bool:
        """Whether nobody can notice which of the two comes first."""
        return not (
            (self.is_visible and other.is_visible)
            or self.writes & (other.reads | other.writes)
            or other.writes & self.reads
        )


def union(effects: Iterable[Effects]) -> Effects:
    """Return the effects of several pieces together."""
    found = Effects()
    for one in effects:
        found |= one
    return found


def of_blocks(blocks: Iterable[stmt.Block]) -> Effects:
    """Return the effects of handlers."""
    return union(_of_statement(s) for block in blocks for s in statements(block))


def of_guard(transition: Transition) -> Effects:
    """Return the effects of evaluating a guard; a call of an operation is visible."""
    return _of_values((transition.guard,))


def of_entry(chart: Chart, state: State) -> Effects:
    """Return the effects of entering a state, with the `done.state` event of its parent."""
    own = of_blocks(state.on_entry)
    return own if done_event(chart, state) is None else own | Effects(is_visible=True)


def done_event(chart: Chart, state: State) -> int | None:
    """Return the event that entering a final state raises (SCXML 3.7), if the chart has it."""
    if state.kind is not Kind.FINAL or not state.parent:
        return None
    return chart.event_index.get("done.state." + chart.states[state.parent].id)


def _of_statement(statement: stmt.Statement) -> Effects:
    is_visible = isinstance(statement, stmt.Raise | stmt.Send | stmt.Log | stmt.CallOperation)
    writes = frozenset(root(place).name for place in written(statement))
    return _of_values(values(statement)) | Effects(writes=writes, is_visible=is_visible)


def _of_values(expressions: tuple[lang.Expr | None, ...]) -> Effects:
    return Effects(variables(expressions), is_visible=bool(_facts(expressions) & (CALLS | COUNTS)))
