"""The maximum rate at which wires change: an assumption of proofs about the machines behind them.

A board reads its wires once a period, so an input changes at most once in it; a debounced bit
changes at most once in its debounce time; a value has the range of its expression. Two events on an
edge are as far apart as two such edges. A bound input is free, also if the system does not list it
under `may`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace

from fsmkit.carriers.wires.board import Board, BoundEvent, Edge, Formula, Origin, Wire
from fsmkit.chart.analysis.partition import Place
from fsmkit.diagnostics import fail
from fsmkit.language import Field, IntType, Unary, UnaryOp, Variable
from fsmkit.language.units import duration_text
from fsmkit.system.environment import values_within
from fsmkit.system.machine import FreeInput, Possible
from fsmkit.system.partition import partition_of
from fsmkit.system.system import System


def with_wires(system: System, boards: Iterable[Board]) -> System:
    """Return a system whose free inputs and events are restricted by the wires of boards.

    A bound input is free, unless a connection sets it.

    Raises `FsmkitError` (``unfit-wire``) if a board belongs to another system.
    """
    boards = tuple(boards)
    system = _with_bound(system, boards)
    inputs: dict[tuple[str, int], tuple[int, IntType | None]] = {}
    events: dict[tuple[str, int], int] = {}
    for board in boards:
        machines = board.deployment.system.machines
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
            _narrow_input(system, free, *inputs.get((names[free.machine], free.input), (0, None)))
            if free.values
            else free
            for free in system.free_inputs
        ),
        possible=tuple(
            _minimum_separation(system, each, events.get((names[each.machine], each.event), 0))
            for each in system.possible
        ),
    )
    return replace(narrowed, assumed=(*system.assumed, *_promises(narrowed)))


def _with_bound(system: System, boards: Iterable[Board]) -> System:
    """Return a system in which bound inputs are free, unless a connection sets them.

    Its assumptions include the bound events that never occur in it.
    """
    numbers = {machine.name: number for number, machine in enumerate(system.machines)}
    served = {(free.machine, free.input) for free in system.free_inputs if free.values}
    served |= {(link.target, link.input) for link in system.input_links}
    coming = {(each.machine, each.event) for each in system.possible}
    coming |= {(link.target, link.event) for link in system.event_links}
    partition = partition_of(system)
    free, sampled = list(system.free_inputs), dict(system.sampled)
    never: dict[str, None] = {}
    for board in boards:
        _require_machines(system, board)
        machines = board.deployment.system.machines
        for bound in board.inputs:
            machine = machines[bound.machine]
            at = numbers[machine.name], bound.input
            if at in served:
                continue
            declared = machine.chart.inputs[bound.input]
            field = Field(declared.name, declared.type)
            place = Place(at[0], "variable", declared.name)
            values = values_within(partition, field, place, _range(bound.origin))
            if values.kept is not None:
                sampled[f"the input `{machine.name}.{declared.name}`"] = values.kept
            any_start = declared.name in system.machines[at[0]].any_start
            free = [each for each in free if (each.machine, each.input) != at]
            free.append(FreeInput(*at, values.values, any_start=any_start))
        for event in board.events:
            machine = machines[event.machine]
            if (numbers[machine.name], event.event) not in coming:
                name = machine.chart.events[event.event].name
                never[f"the event `{machine.name}.{name}` never comes: list it under `may`"] = None
    return replace(
        system,
        free_inputs=tuple(free),
        sampled=tuple(sampled.items()),
        assumed=(*system.assumed, *never),
    )


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


def _narrow_input(
    system: System, free: FreeInput, period: int, range_: IntType | None
) -> FreeInput:
    """Return an input with a minimum separation of changes, in microseconds, and a range."""
    values = tuple(
        value
        for value in free.values
        if range_ is None or not isinstance(value, int) or range_.lo <= value <= range_.hi
    )
    return replace(free, apart=_ticks(system, period), values=values or free.values)


def _minimum_separation(system: System, possible: Possible, period: int) -> Possible:
    if possible.fair or possible.spontaneous:
        return possible
    return replace(possible, apart=_ticks(system, period))


def _ticks(system: System, period: int) -> int:
    """Return whole ticks, rounded down: a shorter separation is the more cautious assumption."""
    return period // system.machines[0].chart.capacities.tick if system.machines else 0


def _cycles(board: Board, origin: Origin) -> int:
    """Return the minimum number of cycles between two changes of a value."""
    wire = _wire(origin)
    return 1 if wire is None else max(1, board.signals[wire].debounce)


def _cycles_of_event(board: Board, event: BoundEvent) -> int:
    """Return the minimum number of cycles between two events."""
    match event.edge:
        case Edge.RISING | Edge.FALLING:
            return 2 * _cycles(board, event.watched)
        case Edge.CHANGED:
            return _cycles(board, event.watched)
        case Edge.ALWAYS:
            return 1


def _wire(origin: Origin) -> int | None:
    """Return the debounced bit that a value is equal or opposite to; None for others."""
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
    """Return the range of whole numbers of an origin."""
    if isinstance(origin, Formula) and isinstance(origin.expression.type, IntType):
        return origin.expression.type
    return None


def _promises(system: System) -> Iterator[str]:
    """Yield the assumptions about the wires, in words."""
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
