"""Executable content (SCXML 4 and 6, and what LANGUAGE adds)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import assert_never

from fsmkit.chart.chart import Transition
from fsmkit.chart.statements import (
    Assign,
    Block,
    CallOperation,
    Cancel,
    Destination,
    Fail,
    ForEach,
    If,
    Invoke,
    Local,
    Log,
    Raise,
    Reply,
    Return,
    Send,
    Statement,
)
from fsmkit.language import (
    ContentError,
    Expr,
    Iterated,
    Location,
    RangeFault,
    Value,
    Variable,
    evaluate,
    store,
)
from fsmkit.language.evaluation import rounds
from fsmkit.language.walk import root
from fsmkit.runtime.interpreter import timers
from fsmkit.runtime.interpreter.globals import Globals
from fsmkit.runtime.interpreter.invocation import pass_on, start_invoked
from fsmkit.runtime.interpreter.snapshot import (
    Cancelled,
    Delayed,
    Emitted,
    Logged,
    Occurrence,
    Overflowed,
    Postponed,
    Raised,
    Replied,
    Sent,
    Taken,
    Timer,
)


def execute_transition_content(g: Globals, enabled: Iterable[Transition]) -> None:
    """Run the content of transitions in the order in which they were selected.

    That is Appendix D, executeTransitionContent: in document order of the atomic states that
    selected them. SCXML 3.13 says "in document order" of the transitions, which differs only where
    the source of one lies above that of another; Appendix D, which is normative, is followed.
    """
    for transition in enabled:
        g.effects.append(Taken(transition.index))
        execute_block(g, transition.content)


def execute_content(g: Globals, transition: Transition) -> None:
    """Run the content of an initial or default transition, if it has any."""
    if transition.content:
        g.effects.append(Taken(transition.index))
        execute_block(g, transition.content)


def execute_block(g: Globals, block: Block) -> None:
    """Run one block (Appendix D, executeContent); an error skips the rest of it (SCXML 4.1)."""
    try:
        for statement in block:
            execute(g, statement)
    except RangeFault:
        g.stop("range")
    except _Told:
        pass
    except ContentError as error:
        g.error("error.execution", str(error))


class _Told(Exception):  # noqa: N818  (what was wrong has been raised as an event)
    """The rest of the block is skipped without another error."""


def execute(g: Globals, statement: Statement) -> None:
    """Run one statement; `ContentError` and `RangeFault` where it cannot be."""
    match statement:
        case Assign(location, value):
            assign(g, location, evaluate(value, g))
        case Raise(event, arguments):
            occurrence = Occurrence(event, _values(g, arguments))
            g.effects.append(Raised(occurrence))
            g.enqueue_internal(occurrence)
        case Send():
            send(g, statement)
        case Cancel(name):
            g.effects.append(Cancelled(name))
            timers.cancel(g, name)
        case Log(label, values):
            g.effects.append(Logged(label, _values(g, values)))
        case If(branches):
            for branch in branches:
                if branch.condition is None or _holds(g, branch.condition):
                    for inner in branch.body:
                        execute(g, inner)
                    break
        case ForEach():
            _for_each(g, statement)
        case Local(place, value) if value is not None:
            g.locals[place.name] = evaluate(value, g)
        case Local() | Return():
            raise AssertionError(statement)  # the one has a value, the other is of functions alone
        case Reply(value):
            g.effects.append(Replied(evaluate(value, g)))
        case CallOperation(call):
            g.call(call.operation, _values(g, call.arguments))
        case Invoke(slot, arguments):
            start_invoked(g, slot, _values(g, arguments))
        case Fail(reason, is_raised=is_raised):
            raise _Told if is_raised else ContentError(reason)
        case _:
            assert_never(statement)


def _values(g: Globals, expressions: tuple[Expr, ...]) -> tuple[Value, ...]:
    return tuple([evaluate(expression, g) for expression in expressions])


def _holds(g: Globals, condition: Expr) -> bool:
    """Evaluate a condition; one that fails is false and raises ``error.execution`` (5.9.1)."""
    try:
        return bool(evaluate(condition, g))
    except ContentError as error:
        g.error("error.execution", str(error))
        return False


def assign(g: Globals, location: Location, value: Value) -> None:
    """Store a value (SCXML 5.4); the location's own indices are evaluated after it."""
    name = root(location).name
    if name not in g.index.slots:
        g.locals[name] = store(g.locals.get(name, value), location, value, g)
        return
    if isinstance(location, Variable):
        g.data[g.index.slots[location.name]] = value
        return
    slot = g.index.slots[name]
    g.data[slot] = store(g.data[slot], location, value, g)


def send(g: Globals, statement: Send) -> None:
    """Send an event (SCXML 6.2): into a queue, out by the port, or later."""
    occurrence = Occurrence(statement.event, _values(g, statement.arguments))
    if statement.delay is None:
        deliver(g, occurrence, statement)
        return
    delay = evaluate(statement.delay, g)
    if not isinstance(delay, int) or delay < 0:
        raise ContentError("a delay cannot be negative")
    what = Delayed(
        occurrence,
        statement.destination,
        statement.id,
        statement.peer,
        statement.invocations,
    )
    g.effects.append(Postponed(what, delay))
    if timers.pending_sends(g) < g.chart.capacities.delayed:
        g.insert_timer(Timer(g.now + delay, what))
    else:
        g.effects.append(Overflowed("delayed"))


def deliver(g: Globals, occurrence: Occurrence, how: Send | Delayed) -> None:
    """Hand an event to its destination, at once."""
    match how.destination:
        case Destination.SELF:
            g.effects.append(Sent(occurrence))
            g.enqueue_external(occurrence)
        case Destination.INTERNAL:
            g.effects.append(Raised(occurrence))
            g.enqueue_internal(occurrence)
        case Destination.PORT:
            g.effects.append(Emitted(occurrence, how.peer))
        case Destination.INVOKER:
            g.enqueue_at_invoker(occurrence)
        case Destination.INVOKED:
            g.effects.append(Emitted(occurrence, how.peer))
            if not pass_on(g, how.invocations, occurrence):
                g.error("error.communication", f"no machine runs under `{how.peer}`")
        case _:
            assert_never(how.destination)


def _for_each(g: Globals, statement: ForEach[Iterated, Variable, Statement]) -> None:
    """Iterate over a copy of the array (SCXML 4.6); an error ends the block."""
    for element, place in rounds(statement, g):
        assign(g, statement.item, element)
        if statement.index is not None:
            assign(g, statement.index, place)
        for inner in statement.body:
            execute(g, inner)
