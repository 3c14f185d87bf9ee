"""What content reads, writes and tells: whether two pieces of it can change places."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.content import statements, subexpressions, values
from fsmkit.chart.statements import Assign, Block, CallOperation, ForEach, Log, Raise, Send
from fsmkit.document.document import Kind
from fsmkit.language import Call, Element, Expr, Location, Member, Variable


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


NONE = Effects()
TOLD = Effects(told=True)


def union(effects: Iterable[Effects]) -> Effects:
    """Return the effects of several pieces together."""
    found = NONE
    for one in effects:
        found |= one
    return found


def of_blocks(blocks: Iterable[Block]) -> Effects:
    """Return the effects of handlers."""
    return union(Effects(*each) for block in blocks for each in _of_block(block))


def of_guard(transition: Transition) -> Effects:
    """Return the effects of evaluating a guard: it tells where it calls an operation."""
    return NONE if transition.guard is None else _of_expression(transition.guard)


def of_entry(chart: Chart, state: State) -> Effects:
    """Return the effects of entering a state, with the event that tells of its parent's end."""
    own = of_blocks(state.on_entry)
    return own if done_event(chart, state) is None else own | TOLD


def done_event(chart: Chart, state: State) -> int | None:
    """Return the event that entering a final state raises (SCXML 3.7), if the chart knows it."""
    if state.kind is not Kind.FINAL or not state.parent:
        return None
    return chart.event_index.get("done.state." + chart.states[state.parent].id)


def _of_block(block: Block) -> Iterator[tuple[frozenset[str], frozenset[str], bool]]:
    for statement in statements(block):
        read = union(_of_expression(value) for value in values(statement))
        written: list[str] = []
        told = isinstance(statement, Raise | Send | Log | CallOperation)
        match statement:
            case Assign(location):
                written.append(_root(location))
            case ForEach(_, item, index):
                written += [item.name, *([] if index is None else [index.name])]
            case _:
                pass
        yield read.reads, frozenset(written), told or read.told


def _of_expression(expr: Expr) -> Effects:
    parts = tuple(subexpressions(expr))
    reads = frozenset(part.name for part in parts if isinstance(part, Variable))
    return Effects(reads, frozenset(), any(isinstance(part, Call) for part in parts))


def _root(location: Location | Expr) -> str:
    match location:
        case Variable(name):
            return name
        case Element(array):
            return array.name
        case Member(record):
            return _root(record)
        case _:
            raise AssertionError(location)
