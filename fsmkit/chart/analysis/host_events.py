"""The events that a machine and its host exchange."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Destination, Send
from fsmkit.document.document import Direction


def posted_events(chart: Chart) -> tuple[int, ...]:
    """Return the events that a host may post: those declared ``in``, or all of a lenient chart."""
    return tuple(
        e.index
        for e in chart.events
        if chart.event_index[e.name] == e.index
        and (Direction.IN in e.directions or (chart.lenient and e.directions))
    )


def sent_events(chart: Chart) -> tuple[int, ...]:
    """Return the events that the host takes: those declared ``out``.

    Not those that are only ever sent to the invoker or to a machine in a slot.
    """
    found = {
        is_outside: {
            statement.event
            for statement in all_statements(chart)
            if isinstance(statement, Send)
            and (statement.destination is Destination.PORT) is is_outside
            and statement.destination not in (Destination.SELF, Destination.INTERNAL)
        }
        for is_outside in (True, False)
    }
    inside = found[False] - found[True]
    return tuple(
        e.index for e in chart.events if Direction.OUT in e.directions and e.index not in inside
    )
