"""Execute content: SCXML 4 and 6, and the extensions of the action language."""

from __future__ import annotations

from collections.abc import Iterable
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.chart import Transition
from fsmkit.language.evaluation import iterate
from fsmkit.language.walk import root
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter import timers
from fsmkit.runtime.interpreter.globals import Globals
from fsmkit.runtime.interpreter.invocation import pass_on, start_invoked


def execute_transition_content(g: Globals, enabled: Iterable[Transition]) -> None:
    """Run the content of transitions in the order in which they were selected.

    This follows Appendix D, executeTransitionContent, which is normative: document order of the
    atomic states that selected the transitions. SCXML 3.13 says document order of the transitions.
    The two differ only if the source of one transition contains the source of another.
    """
    for transition in enabled:
        g.effects.append(snap.Taken(transition.index))
        execute_block(g, transition.content)


def execute_content(g: Globals, transition: Transition) -> None:
    """Run the content of an initial or default transition, if it has any."""
    if transition.content:
        g.effects.append(snap.Taken(transition.index))
        execute_block(g, transition.content)


def execute_block(g: Globals, block: stmt.Block) -> None:
    """Run one block (Appendix D, executeContent); an error skips the rest of it (SCXML 4.1)."""
    try:
        for statement in block:
            execute(g, statement)
    except lang.RangeFault:
        g.stop("range")
    except _BlockError:
        pass
    except lang.ContentError as error:
        g.error("error.execution", str(error))


class _BlockError(Exception):
    """Skips the rest of a block whose error event was already raised."""


def execute(g: Globals, statement: stmt.Statement) -> None:
    """Run one statement; `ContentError` and `RangeFault` where it cannot be."""
    match statement:
        case stmt.Assign(location, value):
            assign(g, location, lang.evaluate(value, g))
        case stmt.Raise(event, arguments):
            occurrence = snap.Occurrence(event, _values(g, arguments))
            g.effects.append(snap.Raised(occurrence))
            g.enqueue_internal(occurrence)
        case stmt.Send():
            send(g, statement)
        case stmt.Cancel(name):
            g.effects.append(snap.Cancelled(name))
            timers.cancel(g, name)
        case stmt.Log(label, values):
            g.effects.append(snap.Logged(label, _values(g, values)))
        case stmt.If(branches):
            for branch in branches:
                if branch.condition is None or _holds(g, branch.condition):
                    for inner in branch.body:
                        execute(g, inner)
                    break
        case stmt.ForEach():
            _foreach(g, statement)
        case stmt.Local(place, value) if value is not None:
            g.locals[place.name] = lang.evaluate(value, g)
        case stmt.Local() | stmt.Return():
            raise AssertionError(statement)  # the one has a value, the other is of functions alone
        case stmt.Reply(value):
            g.effects.append(snap.Replied(lang.evaluate(value, g)))
        case stmt.CallOperation(call):
            g.call(call.operation, _values(g, call.arguments))
        case stmt.Invoke(slot, arguments):
            start_invoked(g, slot, _values(g, arguments))
        case stmt.Fail(reason, is_raised=is_raised):
            raise _BlockError if is_raised else lang.ContentError(reason)
        case _:
            assert_never(statement)


def _values(g: Globals, expressions: tuple[lang.Expr, ...]) -> tuple[lang.Value, ...]:
    return tuple([lang.evaluate(expression, g) for expression in expressions])


def _holds(g: Globals, condition: lang.Expr) -> bool:
    """Evaluate a condition. A failing one is false and raises ``error.execution`` (SCXML 5.9.1)."""
    try:
        return bool(lang.evaluate(condition, g))
    except lang.ContentError as error:
        g.error("error.execution", str(error))
        return False


def assign(g: Globals, location: lang.Location, value: lang.Value) -> None:
    """Store a value (SCXML 5.4); the location's own indices are evaluated after it."""
    name = root(location).name
    if name not in g.index.slots:
        g.locals[name] = lang.store(g.locals.get(name, value), location, value, g)
        return
    if isinstance(location, lang.Variable):
        g.data[g.index.slots[location.name]] = value
        return
    slot = g.index.slots[name]
    g.data[slot] = lang.store(g.data[slot], location, value, g)


def send(g: Globals, statement: stmt.Send) -> None:
    """Send an event (SCXML 6.2): into a queue, out by the port, or later."""
    occurrence = snap.Occurrence(statement.event, _values(g, statement.arguments))
    if statement.delay is None:
        deliver(g, occurrence, statement)
        return
    delay = lang.evaluate(statement.delay, g)
    if not isinstance(delay, int) or delay < 0:
        raise lang.ContentError("a delay cannot be negative")
    what = snap.Delayed(
        occurrence,
        statement.destination,
        statement.id,
        statement.peer,
        statement.invocations,
    )
    g.effects.append(snap.Postponed(what, delay))
    if timers.pending_sends(g) < g.chart.capacities.delayed:
        g.insert_timer(snap.Timer(g.now + delay, what))
    else:
        g.effects.append(snap.Overflowed("delayed"))


def deliver(g: Globals, occurrence: snap.Occurrence, how: stmt.Send | snap.Delayed) -> None:
    """Deliver an event to its destination immediately."""
    match how.destination:
        case stmt.Destination.SELF:
            g.effects.append(snap.Sent(occurrence))
            g.enqueue_external(occurrence)
        case stmt.Destination.INTERNAL:
            g.effects.append(snap.Raised(occurrence))
            g.enqueue_internal(occurrence)
        case stmt.Destination.PORT:
            g.emit(occurrence, how.peer)
        case stmt.Destination.INVOKER:
            g.enqueue_at_invoker(occurrence)
        case stmt.Destination.INVOKED:
            g.effects.append(snap.Emitted(occurrence, how.peer))
            if not pass_on(g, how.invocations, occurrence):
                g.error("error.communication", f"no machine runs under `{how.peer}`")
        case _:
            assert_never(how.destination)


def _foreach(
    g: Globals, statement: stmt.ForEach[lang.Iterated, lang.Variable, stmt.Statement]
) -> None:
    """Iterate over a copy of the array (SCXML 4.6); an error ends the block."""
    for element, place in iterate(statement, g):
        assign(g, statement.item, element)
        if statement.index is not None:
            assign(g, statement.index, place)
        for inner in statement.body:
            execute(g, inner)
