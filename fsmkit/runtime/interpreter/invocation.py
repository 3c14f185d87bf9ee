"""Invoked machines (SCXML 6.4, 6.5): they live in slots of the machine that invoked them."""

from __future__ import annotations

from fsmkit.chart.chart import Invocation
from fsmkit.language import Value, default_value
from fsmkit.runtime import interpreter
from fsmkit.runtime.interpreter.globals import Globals, Receiver
from fsmkit.runtime.interpreter.snapshot import InvokedMacrostep, Macrostep, Occurrence, Overflowed


def start_invoked(g: Globals, slot: int, given: tuple[Value, ...]) -> None:
    """Start a machine with the given data and run its first macrostep."""
    invocation = g.chart.invocations[slot]
    data = dict(zip(invocation.given, given, strict=True))
    own = receiver(g, invocation)
    done = interpreter.start(invocation.chart, g.now, g.host, given=data, invoker=own)
    absorb(g, invocation, done)


def cancel_invoked(g: Globals, slot: int) -> None:
    """Cancel an invoked machine: it exits its states; its events are dropped (SCXML 6.4.3)."""
    child = g.invoked[slot]
    if child is None:
        return
    g.invoked[slot] = None
    chart = g.chart.invocations[slot].chart
    done = interpreter.cancel(chart, child, g.now, g.host)
    g.effects.append(InvokedMacrostep(slot, done))
    if done.after.fault is not None:
        g.stop("invoked")


def absorb(g: Globals, invocation: Invocation, done: Macrostep) -> None:
    """Store the new state of an invoked machine; its fault is a fault here."""
    g.effects.append(InvokedMacrostep(invocation.index, done))
    g.invoked[invocation.index] = done.after if done.after.running else None
    if done.after.fault is not None:
        g.stop("invoked")


def receiver(g: Globals, invocation: Invocation) -> Receiver:
    """Return what puts an event of an invoked machine into the queue at once, as `post` does.

    An event that this machine does not know is dropped and takes no entry of the queue.
    """

    def receive(occurrence: Occurrence) -> bool:
        fits, event = g.has_room, invocation.returns[occurrence.event]
        if fits and event is not None:
            g.queue.append(Occurrence(event, occurrence.payload))
        return fits

    return receive


def pass_on(g: Globals, slots: tuple[int, ...], occurrence: Occurrence) -> bool:
    """Put an event into the queue of the first machine that is running; False if none is."""
    for slot in slots:
        child = g.invoked[slot]
        if child is None:
            continue
        invocation = g.chart.invocations[slot]
        passage = invocation.passages[occurrence.event]
        if passage is not None:
            fields = invocation.chart.events[passage.event].fields
            payload = tuple(
                default_value(part.type) if place is None else occurrence.payload[place]
                for part, place in zip(fields, passage.fields, strict=True)
            )
            posted = interpreter.post(invocation.chart, child, Occurrence(passage.event, payload))
            if posted is None:
                g.effects.append(Overflowed("queue"))
            else:
                g.invoked[slot] = posted
        return True
    return False


def forward(g: Globals, occurrence: Occurrence) -> None:
    """Give an external event to every running machine with ``autoforward`` (6.4.1)."""
    for invocation in g.chart.invocations:
        if invocation.autoforward:
            pass_on(g, (invocation.index,), occurrence)


def settle(g: Globals) -> None:
    """Let each invoked machine take one external event in turn, in document order, until quiet.

    This repeats at most ``capacities.microsteps`` times. The rest waits for the next step.
    """
    for _ in range(g.chart.capacities.microsteps):
        is_quiet = True
        for invocation in g.chart.invocations:
            child = g.invoked[invocation.index]
            if child is None or g.fault is not None:
                continue
            now = interpreter.at_time(child, g.now)
            own = receiver(g, invocation)
            done = interpreter.step_event(invocation.chart, now, g.host, invoker=own)
            if done is not None:
                is_quiet = False
                absorb(g, invocation, done)
        if is_quiet or g.fault is not None:
            return
