"""Visit the content of a Chart: blocks, statements, expressions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

from fsmkit.chart.chart import Chart
from fsmkit.chart.forms import form
from fsmkit.chart.statements import Assign, Block, ForEach, If, Local, Statement
from fsmkit.document.document import Trigger
from fsmkit.language import CallFunction, Element, Expr, Location, Numbers, Storage, Variable
from fsmkit.language.statements.tree import statements
from fsmkit.language.walk import nodes, parts, root, subexpressions

Node = TypeVar("Node", Statement, Expr)


def distinct(nodes: Iterable[Node]) -> Iterable[Node]:
    """Return one node of each form, in the order in which these first occur."""
    found: dict[int, Node] = {}
    for node in nodes:
        found.setdefault(form(node), node)
    return found.values()


def blocks(chart: Chart) -> Iterator[Block]:
    """Return every handler: of the script, the states, the transitions, the events."""
    yield chart.script
    for state in chart.states:
        yield from state.on_entry
        yield from state.on_exit
        yield from state.invokes
    for event in chart.events:
        if event.finalize:
            yield event.finalize
    for transition in chart.transitions:
        yield transition.content


def all_statements(chart: Chart) -> Iterator[Statement]:
    """Return every statement of a chart."""
    for block in blocks(chart):
        yield from statements(block)


def conditions(chart: Chart) -> Iterator[Expr]:
    """Return every expression outside of content: guards and invariants."""
    for transition in chart.transitions:
        if transition.guard is not None:
            yield transition.guard
    for state in chart.states:
        if state.invariant is not None:
            yield state.invariant


def values(statement: Statement) -> tuple[Expr, ...]:
    """Return the expressions a statement evaluates itself, its bodies left aside.

    The places that it writes are not among them, but the indices in these are.
    """
    match statement:
        case Assign(location, value):
            return (value, *_indices(location))
        case If(branches):
            return tuple(b.condition for b in branches if b.condition is not None)
        case ForEach(array=array):
            return () if isinstance(array, Numbers) else (array,)
        case Local(value=value):
            return () if value is None else (value,)
        case _:
            return parts(statement)


def written(statement: Statement) -> tuple[Location, ...]:
    """Return the places a statement writes itself."""
    match statement:
        case Assign(location):
            return (location,)
        case ForEach(_, item, index):
            return (item,) if index is None else (item, index)
        case Local(place):
            return (place,)
        case _:
            return ()


def _indices(location: Expr) -> tuple[Expr, ...]:
    return tuple(part.index for part in subexpressions(location) if isinstance(part, Element))


def variables(node: object) -> frozenset[str]:
    """Return all variables that occur in a node of a chart."""
    return frozenset(part.name for part in nodes(node) if isinstance(part, Variable))


def local_names(chart: Chart) -> tuple[str, ...]:
    """Return the names of all local variables in handlers, each once, in order."""
    found = (v.name for s in all_statements(chart) for v in map(root, written(s)) if is_local(v))
    return tuple(dict.fromkeys(found))


def is_local(variable: Variable) -> bool:
    """Whether a variable lives in its block only."""
    return variable.storage is Storage.LOCAL


def functions_called(chart: Chart) -> frozenset[str]:
    """Return the functions that a chart calls, itself or by others."""
    found: set[str] = set()
    if not chart.functions:
        return frozenset()
    own = (*blocks(chart), *conditions(chart), *(state.done_data for state in chart.states))
    left = [part.function for part in nodes(own) if isinstance(part, CallFunction)]
    while left:
        function = left.pop()
        if function.name not in found:
            found.add(function.name)
            inner = (part for part in nodes(function.body) if isinstance(part, CallFunction))
            left += [part.function for part in inner]
    return frozenset(found)


def inputs_read(node: object) -> frozenset[str]:
    """Return the names of the inputs that occur in a node of a chart."""
    return frozenset(
        n.name for n in nodes(node) if isinstance(n, Variable) and n.storage is Storage.INPUT
    )


def reads_input(node: object) -> bool:
    """Whether an input occurs anywhere in a node of a chart."""
    return any(isinstance(n, Variable) and n.storage is Storage.INPUT for n in nodes(node))


def samples_inputs(chart: Chart) -> bool:
    """Whether the guard of an eventless transition reads an input."""
    eventless = (each for each in chart.transitions if each.trigger is Trigger.EVENTLESS)
    return any(reads_input(transition.guard) for transition in eventless)
