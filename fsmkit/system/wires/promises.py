"""How often wires change, at most: a proof of the machines behind them may rest on it.

A board reads its wires once a period, so an input changes at most once in it; a debounced bit
changes at most once in its debounce; a value has the range of its expression. Of an event that
stands on an edge, two come as far apart as two such edges.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace

from fsmkit.diagnostics import fail
from fsmkit.language import IntType, Unary, UnaryOp, Variable
from fsmkit.language.units import duration_text
from fsmkit.system.system import FreeInput, Possible, System
from fsmkit.system.wires.board import Board, BoundEvent, Edge, Formula, Origin, Wire


def with_wires(system: System, boards: Iterable[Board]) -> System:
    """Return a system whose free inputs and events come as the wires of boards let them come.

    Raises `FsmkitError` (``unfit-wire``) where a board is of another system.
    """
    inputs: dict[tuple[str, int], tuple[int, IntType | None]] = {}
    events: dict[tuple[str, int], int] = {}
    for board in boards:
        machines = board.deployment.system.machines
        _require_machines(system, board)
        for bound in board.inputs:
            key = (machines[bound.machine].name, bound.input)
            inputs[key] = (_cycles(board, bound.origin) * board.period, _range(bound.origin))
        count = Counter((each.machine, each.event) for each in board.events)
        for event in board.events:
            if count[event.machine, event.event] == 1:  # of several, two may come in one cycle
                cycles = _cycles_of_event(board, event)
                events[machines[event.machine].name, event.event] = cycles * board.period
    names = [machine.name for machine in system.machines]
    narrowed = replace(
        system,
        free_inputs=tuple(
            _narrowed(system, free, *inputs.get((names[free.machine], free.input), (0, None)))
            if free.values
            else free
            for free in system.free_inputs
        ),
        possible=tuple(
            _apart(system, each, events.get((names[each.machine], each.event), 0))
            for each in system.possible
        ),
    )
    return replace(narrowed, assumed=(*system.assumed, *_promises(narrowed)))


def _require_machines(system: System, board: Board) -> None:
    charts = {machine.name: machine.chart.name for machine in system.machines}
    placed = zip(board.deployment.system.machines, board.deployment.placed, strict=True)
    for machine, node in placed:
        if node == board.node and charts.get(machine.name) != machine.chart.name:
            raise fail(
                "unfit-wire",
                f"the board `{board.name}` has a machine `{machine.name}` that "
                f"`{system.name}` has not, or of another chart",
                machine.span,
                help="check the system of the deployment that the board names",
            )


def _narrowed(system: System, free: FreeInput, period: int, range_: IntType | None) -> FreeInput:
    """Return an input that changes so seldom, in microseconds, within a range."""
    values = tuple(
        value
        for value in free.values
        if range_ is None or not isinstance(value, int) or range_.lo <= value <= range_.hi
    )
    return replace(free, apart=_ticks(system, period), values=values or free.values)


def _apart(system: System, possible: Possible, period: int) -> Possible:
    if possible.fair or possible.spontaneous:
        return possible
    return replace(possible, apart=_ticks(system, period))


def _ticks(system: System, period: int) -> int:
    """Return whole ticks, rounded down: to come sooner is the more cautious assumption."""
    return period // system.machines[0].chart.capacities.tick if system.machines else 0


def _cycles(board: Board, origin: Origin) -> int:
    """Return how many cycles lie between two changes of a value, at least."""
    wire = _wire(origin)
    return 1 if wire is None else max(1, board.signals[wire].debounce)


def _cycles_of_event(board: Board, event: BoundEvent) -> int:
    """Return how many cycles lie between two events, at least."""
    match event.edge:
        case Edge.RISING | Edge.FALLING:
            return 2 * _cycles(board, event.watched)
        case Edge.CHANGED:
            return _cycles(board, event.watched)
        case Edge.ALWAYS:
            return 1


def _wire(origin: Origin) -> int | None:
    """Return the debounced bit that a value is, or whose contrary it is; None for all else."""
    if not isinstance(origin, Formula):
        return None
    expression = origin.expression
    if isinstance(expression, Unary) and expression.op is UnaryOp.NOT:
        expression = expression.operand
    if not isinstance(expression, Variable):
        return None
    meaning = origin.meanings.get(expression.name)
    return meaning.signal if isinstance(meaning, Wire) else None


def _range(origin: Origin) -> IntType | None:
    """Return the range of whole numbers that an origin can give."""
    if isinstance(origin, Formula) and isinstance(origin.expression.type, IntType):
        return origin.expression.type
    return None


def _promises(system: System) -> Iterator[str]:
    """Yield what the wires promise, in words."""
    tick = system.machines[0].chart.capacities.tick if system.machines else 1000
    for free in system.free_inputs:
        machine = system.machines[free.machine]
        if free.apart:
            name = machine.chart.inputs[free.input].name
            yield _promise(f"the input `{machine.name}.{name}` changes", free.apart * tick)
    for each in dict.fromkeys((p.machine, p.event, p.apart) for p in system.possible if p.apart):
        machine = system.machines[each[0]]
        event = machine.chart.events[each[1]].name
        yield _promise(f"the event `{machine.name}.{event}` comes", each[2] * tick)


def _promise(what: str, microseconds: int) -> str:
    return f"{what} at most once in {duration_text(microseconds)}"
