"""What evaluating and executing may do besides their task: fail, change, be noticed.

What is said of a node of a chart holds of all that is below it; a tuple of nodes is one, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from fsmkit.analysis.ranges import within
from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.content import values, variables, written
from fsmkit.chart.statements import (
    Assign,
    Block,
    CallOperation,
    Destination,
    Fail,
    If,
    Log,
    Raise,
    Send,
    Statement,
)
from fsmkit.document.document import Kind
from fsmkit.language import (
    ArrayType,
    Binary,
    BinaryOp,
    Call,
    Convert,
    DurationType,
    Element,
    EventField,
    Expr,
    FloatType,
    InState,
    IntType,
    Invalid,
    Literal,
    Overflow,
)
from fsmkit.language.conversion import of_type
from fsmkit.language.statements.tree import bodies, statements
from fsmkit.language.walk import nodes, root

# --- failing --------------------------------------------------------------------------------------


def is_never_zero(divisor: Expr) -> bool:
    """Whether a divisor is provably not 0."""
    if isinstance(divisor, Literal):
        return divisor.value != 0
    bounds = of_type(divisor.type)
    return bounds is not None and not bounds[0] <= 0 <= bounds[1]


def is_inside(index: Expr, length: int) -> bool:
    """Whether an index provably lies within an array."""
    if isinstance(index, Literal) and isinstance(index.value, int):
        return 0 <= index.value < length
    bounds = of_type(index.type)
    return bounds is not None and within(bounds, (0, length - 1))


def can_fail(node: object) -> bool:
    """Whether evaluating may end in an error of content or in a fault."""
    return any(map(_fails, nodes(node)))


def _fails(part: object) -> bool:
    match part:
        case Binary(BinaryOp.DIV | BinaryOp.REM, _, right, type_):
            return not isinstance(type_, FloatType) and not is_never_zero(right)
        case Element(array, index):
            assert isinstance(array.type, ArrayType)  # noqa: S101  (typed so)
            return not is_inside(index, array.type.length)
        case Convert(type=IntType(overflow=Overflow.FAULT)) | Invalid():
            return True
        case _:
            return False


def can_fault(node: object) -> bool:
    """Whether evaluating can put the machine into a fault."""
    return any(
        isinstance(part, Convert)
        and isinstance(part.type, IntType)
        and part.type.overflow is Overflow.FAULT
        for part in nodes(node)
    )


def can_end(statement: Statement, of_condition: Callable[[Expr], bool] = can_fail) -> bool:
    """Whether a statement can end its block.

    A condition that fails is only false (SCXML 5.9.1); ``of_condition`` says which end a block.
    """
    match statement:
        case Fail():
            return True
        case Send(delay=delay) if delay is not None and not isinstance(delay, Literal):
            return True  # it may be negative
        case If(branches):
            own = any(b.condition is not None and of_condition(b.condition) for b in branches)
        case _:
            own = can_fail((values(statement), written(statement)))
    return own or any(can_end(inner, of_condition) for body in bodies(statement) for inner in body)


# --- noticing -------------------------------------------------------------------------------------


def has_effect(node: object) -> bool:
    """Whether evaluating twice differs from once: it calls the host, or may tell a range error."""
    return any(isinstance(part, Call) or _saturates(part) for part in nodes(node))


def can_stop(node: object) -> bool:
    """Whether evaluating may raise an error event, or stop the machine by a fault."""
    return can_fail(node) or can_saturate(node)


def can_saturate(node: object) -> bool:
    """Whether evaluating may bring a value into its range, and tell a range error."""
    return any(map(_saturates, nodes(node)))


def _saturates(part: object) -> bool:
    if not isinstance(part, Convert):
        return False
    type_ = part.type
    is_saturating = isinstance(type_, IntType) and type_.overflow is Overflow.SATURATE
    return is_saturating or isinstance(type_, DurationType)


def needs_order(left: Expr, right: Expr) -> bool:
    """Whether it can be told in which order two operands are evaluated."""
    one, other = has_effect(left), has_effect(right)
    return (one and (other or can_fail(right))) or (other and (one or can_fail(left)))


def observes(node: object) -> bool:
    """Whether content asks which states are active, or gives the host a chance to."""
    return any(
        isinstance(part, InState | Call | CallOperation | Log)
        or (isinstance(part, Send) and part.destination is Destination.PORT)
        for part in nodes(node)
    )


def is_plain(block: Block) -> bool:
    """Whether a handler only assigns, and nobody can notice what is active meanwhile.

    Nothing in it fails or tells a range error, either.
    """
    return (
        all(isinstance(statement, Assign) for statement in block)
        and not has_effect(block)
        and not can_fail(block)
        and not any(isinstance(part, InState) for part in nodes(block))
    )


def reads_event(node: object) -> bool:
    """Whether a part of the payload at hand occurs anywhere."""
    return any(isinstance(part, EventField) for part in nodes(node))


# --- reading and writing --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Effects:
    """What executing does; ``told``: the host or a queue notices when it happens."""

    reads: frozenset[str] = frozenset()
    writes: frozenset[str] = frozenset()
    told: bool = False

    def __or__(self, other: Effects) -> Effects:
        return Effects(
            self.reads | other.reads, self.writes | other.writes, self.told or other.told
        )

    def commutes(self, other: Effects) -> bool:
        """Whether nobody can notice which of the two comes first."""
        return not (
            (self.told and other.told)
            or self.writes & (other.reads | other.writes)
            or other.writes & self.reads
        )


def union(effects: Iterable[Effects]) -> Effects:
    """Return the effects of several pieces together."""
    found = Effects()
    for one in effects:
        found |= one
    return found


def of_blocks(blocks: Iterable[Block]) -> Effects:
    """Return the effects of handlers."""
    return union(_of_statement(s) for block in blocks for s in statements(block))


def of_guard(transition: Transition) -> Effects:
    """Return the effects of evaluating a guard: it tells where it calls an operation."""
    return _of_values((transition.guard,))


def of_entry(chart: Chart, state: State) -> Effects:
    """Return the effects of entering a state, with the event that tells of its parent's end."""
    own = of_blocks(state.on_entry)
    return own if done_event(chart, state) is None else own | Effects(told=True)


def done_event(chart: Chart, state: State) -> int | None:
    """Return the event that entering a final state raises (SCXML 3.7), if the chart knows it."""
    if state.kind is not Kind.FINAL or not state.parent:
        return None
    return chart.event_index.get("done.state." + chart.states[state.parent].id)


def _of_statement(statement: Statement) -> Effects:
    told = isinstance(statement, Raise | Send | Log | CallOperation)
    writes = frozenset(root(place).name for place in written(statement))
    return _of_values(values(statement)) | Effects(writes=writes, told=told)


def _of_values(expressions: tuple[Expr | None, ...]) -> Effects:
    told = any(isinstance(part, Call) for part in nodes(expressions))
    return Effects(variables(expressions), told=told)
