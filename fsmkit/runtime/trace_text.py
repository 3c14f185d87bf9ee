"""Format macrosteps for people: time, cause, exited and entered states, and source lines."""

from __future__ import annotations

from collections.abc import Iterator
from typing import assert_never

from rich.text import Text

from fsmkit.chart.chart import Chart, Transition
from fsmkit.diagnostics import Span
from fsmkit.document.document import Trigger
from fsmkit.language import Field, Type, Value
from fsmkit.language.units import duration_text
from fsmkit.language.values import show
from fsmkit.runtime.endless_steps import cycle_text, transition_numbers
from fsmkit.runtime.interpreter import snapshot as effects
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.trace import active_leaves

INDENT = " " * 10


def pretty(chart: Chart, macrostep: snap.Macrostep) -> Iterator[Text]:
    """Yield a macrostep as styled lines; the last one shows the active states.

    A delayed event that only moves into the queue has no line; one that leaves the machine has a
    line with its time. Lines of an invoked machine start with the id of its invocation.
    """
    printer = Printer(chart)
    done = macrostep.effects
    is_whole = not isinstance(macrostep.event, snap.Delayed | snap.InvokedRun | snap.Cancellation)
    if is_whole or (isinstance(macrostep.event, snap.Delayed) and done):
        time = duration_text(macrostep.at * chart.capacities.tick)
        yield Text.assemble((f"{time:>8}  ", "cyan"), (printer.cause(macrostep), "bold"))
    for effect in done:
        if isinstance(effect, effects.InvokedMacrostep):
            invocation = chart.invocations[effect.invocation]
            for within in pretty(invocation.chart, effect.macrostep):
                yield Text.assemble((f"{INDENT}{invocation.id}: ", "blue"), within)
        else:
            yield Text(INDENT).append(*printer.effect(effect))
        if effect == effects.Faulted("microsteps") and (
            cycle := cycle_text(chart, transition_numbers(macrostep))
        ):
            yield Text(f"{INDENT}round and round: {cycle}", "bold red")
    if is_whole:
        yield Text.assemble(INDENT, (printer.active(macrostep.after), "green"))


class Printer:
    """Formats the items of a chart."""

    def __init__(self, chart: Chart) -> None:
        self.chart = chart

    def cause(self, macrostep: snap.Macrostep) -> str:
        """Format the cause of a macrostep."""
        match macrostep.event:
            case snap.Start():
                return "start"
            case snap.Occurrence() as occurrence:
                return self.event(occurrence)
            case snap.Delayed(occurrence):
                return f"{self.event(occurrence)} after its delay"
            case snap.Timeout(transition):
                return self.trigger(self.chart.transitions[transition])
            case None:
                return "inputs"
            case snap.InvokedRun() | snap.Cancellation():
                return "invoked machines"
            case _:
                assert_never(macrostep.event)

    def active(self, snapshot: snap.Snapshot) -> str:
        """Format the active states, and whether the machine has stopped."""
        names = ", ".join(active_leaves(self.chart, snapshot))
        if snapshot.fault is not None:
            return f"= {names}  (stopped: {snapshot.fault})"
        return f"= {names}{'  (finished)' if snapshot.finished else ''}"

    def effect(self, effect: snap.Effect) -> tuple[str, str]:  # one arm an effect
        """Return the line of an effect, and its style."""
        states, events = self.chart.states, self.chart.events
        match effect:
            case effects.Exited(state):
                return f"- {states[state].id}", "dim"
            case effects.Entered(state):
                return f"+ {states[state].id}", ""
            case effects.Taken(transition):
                return self.transition(self.chart.transitions[transition]), ""
            case effects.Posted(occurrence, fits):
                where = "" if fits else ", which is rejected"
                return f"an operation posts {self.event(occurrence)}{where}", "magenta"
            case effects.Called(operation, arguments, result):
                return self._call(operation, arguments, result), "magenta"
            case effects.Emitted(occurrence, peer):
                to = "" if peer is None else f" to {peer}"
                return f"out {self.event(occurrence)}{to}", "magenta"
            case effects.Raised(occurrence):
                return f"raise {self.event(occurrence)}", "dim"
            case effects.Sent(occurrence):
                return f"send {self.event(occurrence)}", "dim"
            case effects.Postponed(what, delay):
                after = duration_text(delay * self.chart.capacities.tick)
                return f"send {self.event(what.occurrence)} after {after}", "dim"
            case effects.Cancelled(name):
                return f"cancel {name}", "dim"
            case effects.Logged(label, values):
                return " ".join(("log", label, *map(str, values))), "yellow"
            case effects.Replied(value):
                return f"reply {value}", "magenta"
            case effects.RaisedError(name, reason):
                return f"{name}: {reason}", "red"
            case effects.Unhandled(event):
                return f"nothing reacts to {events[event].name}", "yellow"
            case effects.Deferred(event):
                return f"{events[event].name} is deferred", "yellow"
            case effects.SpentTimeout(transition):
                trigger = self.trigger(self.chart.transitions[transition])
                return f"{trigger}: spent, its guard is false", "yellow"
            case effects.Overflowed(queue):
                return f"the {QUEUES[queue]} is full: an event is lost", "red"
            case effects.Faulted(reason):
                return f"the machine stops: {reason}", "bold red"
            case effects.InvokedMacrostep():
                return "", ""
            case _:
                assert_never(effect)

    def event(self, occurrence: snap.Occurrence) -> str:
        """Format an event with its payload by name."""
        event = self.chart.events[occurrence.event]
        values = zip(event.fields, occurrence.payload, strict=True)
        return " ".join((event.name, *(f"{f.name}={self._value(v, f.type)}" for f, v in values)))

    def transition(self, transition: Transition) -> str:
        """Format a transition with its place."""
        source = self.chart.states[transition.source].id
        targets = ", ".join(self.chart.states[target].id for target in transition.targets)
        arrow = f" -> {targets}" if targets else ""
        if transition.trigger is Trigger.INITIAL:
            return f"initially{arrow}   {place(transition.span)}"
        return f"{source}{arrow} on {self.trigger(transition)}   {place(transition.span)}"

    def trigger(self, transition: Transition) -> str:
        """Format the trigger of a transition."""
        match transition.trigger:
            case Trigger.EVENT:
                return " ".join(transition.descriptors)
            case Trigger.EVENTLESS:
                return "no event"
            case Trigger.AFTER | Trigger.EVERY:
                tick = self.chart.capacities.tick
                delay = duration_text(transition.delay * tick)
                if transition.is_open_ended:
                    delay = ""
                if transition.least is not None:
                    delay = f"{duration_text(transition.least * tick)}..{delay}"
                return f"{transition.trigger.value} {delay}"
            case Trigger.SOMETIMES:
                return "sometimes"
            case Trigger.INITIAL:
                return "initial"
            case _:
                assert_never(transition.trigger)

    def _call(self, operation: str, arguments: tuple[Value, ...], result: Value | None) -> str:
        declared = next(one for one in self.chart.operations if one.name == operation)
        given = ", ".join(self._parts(arguments, declared.parameters))
        if result is None or declared.result is None:
            return f"{operation}({given})"
        return f"{operation}({given}) = {self._value(result, declared.result)}"

    def _parts(self, values: tuple[Value, ...], fields: tuple[Field, ...]) -> Iterator[str]:
        for value, field in zip(values, fields, strict=True):
            yield self._value(value, field.type)

    def _value(self, value: Value, type_: Type) -> str:
        return show(value, type_, self.chart.capacities.tick)


QUEUES = {
    "queue": "external queue",
    "internal": "internal queue",
    "delayed": "list of delayed events",
}


def place(span: Span) -> str:
    """Return ``file:line`` of a place."""
    line, _ = span.source.position(span.start)
    return f"{span.source.name}:{line}"
