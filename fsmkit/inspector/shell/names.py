"""Names as they are typed: in a system behind the machine and a dot."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from fsmkit.chart.chart import Chart, result_types
from fsmkit.diagnostics import Source, Span, Text
from fsmkit.runtime.script import is_received, unknown_name, wrong_line
from fsmkit.system.system import System

Kind = Callable[[Chart], Sequence[str]]


class Names:
    """The names of a system; those of its only machine also without prefix."""

    def __init__(self, system: System) -> None:
        self.machines = {each.name: each.chart for each in system.machines}
        self._alone = next(iter(self.machines)) if len(self.machines) == 1 else ""

    def names_of_kind(self, kind: Kind) -> Iterator[tuple[str, str, Chart]]:
        """Yield each name of a kind as it is typed, its machine, and the chart of that."""
        for machine, chart in self.machines.items():
            for name in kind(chart):
                yield (name if self._alone else f"{machine}.{name}"), machine, chart

    def find(self, word: str, what: str, kind: Kind, line: Text) -> tuple[str, Chart, str]:
        """Return the machine, its chart and the name; `FsmkitError` for a name there is not."""
        if self._alone:
            chart = self.machines[self._alone]
            name = word
            if word not in kind(chart):
                name = word.removeprefix(f"{self._alone}.")
        else:
            machine, dot, name = word.partition(".")
            if not dot or machine not in self.machines:
                known = [typed for typed, _, _ in self.names_of_kind(kind)]
                raise unknown_name(line, what, word, known if dot else [*self.machines, *known])
            chart = self.machines[machine]
        if name not in kind(chart):
            raise unknown_name(
                line, what, word, [typed for typed, _, _ in self.names_of_kind(kind)]
            )
        return self._alone or word.partition(".")[0], chart, name


def events(chart: Chart) -> list[str]:
    """Return the events that a chart receives."""
    return [event.name for event in chart.events if is_received(event)]


def every_event(chart: Chart) -> list[str]:
    """Return all events of a chart, including those it sends and platform events."""
    return [event.name for event in chart.events]


def states(chart: Chart) -> list[str]:
    """Return the states of a chart without the root."""
    return [state.id for state in chart.states[1:]]


def inputs(chart: Chart) -> list[str]:
    """Return the inputs of a chart."""
    return [each.name for each in chart.inputs]


def operations(chart: Chart) -> list[str]:
    """Return the operations with a result, for a chart and the charts that it invokes."""
    return list(result_types(chart))


def typed(text: str) -> Text:
    """Return a line that was typed, with a place."""
    return Text(text, Span(Source("<line>", text), 0, len(text)))


def reject_extra_words(rest: Sequence[str], line: Text, usage: str) -> None:
    """Reject extra words at the end of a line; raises `FsmkitError` (``wrong-script-line``)."""
    if rest:
        raise wrong_line(line, f"`{rest[0]}` is one word too many", f"write `{usage}`")
