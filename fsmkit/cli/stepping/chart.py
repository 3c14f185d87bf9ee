"""What ``fsmkit run`` does line by line: events, time, inputs, and questions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from fsmkit.chart.chart import Chart, Data, Event
from fsmkit.cli.console import result
from fsmkit.diagnostics import FsmkitError, Source, Span, Text
from fsmkit.language import Value
from fsmkit.language.units import read_microseconds
from fsmkit.language.values import show, to_python, tokens
from fsmkit.runtime.interpreter import Macrostep, Snapshot
from fsmkit.runtime.interpreter.trace import active_leaves, trace_lines, value_text
from fsmkit.runtime.pretty import Printer, pretty
from fsmkit.runtime.script import Player, read_event, read_input, script_texts, wrong_line
from fsmkit.runtime.session import is_received

HELP = """\
  EVENT a=1 b=2      post an event and run; `post EVENT` posts one of any name
  wait 500ms         let time pass
  set INPUT VALUE    change an input and run
  state              what is active
  data               values of data, inputs and outputs
  events             the events there are; * marks those that something active looks at
  quit               leave"""

AT_START = ("start 0", "run 0")
"""What the machine sent to itself at its start is taken before any time passes."""


WORDS = ("wait", "set", "post")
"""Words a line can begin with that are no event."""


class Stepper:
    """A chart under the simulated clock of the command line."""

    help = HELP

    def __init__(self, chart: Chart, seed: int, *, lines_only: bool, is_quiet: bool) -> None:
        self.chart = chart
        self._player = Player(chart, seed)
        self._now = 0
        self._lines_only = lines_only
        self._is_quiet = is_quiet
        self._steps: list[Macrostep] = []

    @property
    def snapshot(self) -> Snapshot:
        """The machine as it is."""
        return self._player.snapshot

    def start(self) -> None:
        """Start the machine at time 0."""
        for line in AT_START:
            self._play(at_line(line))

    def do(self, item: str) -> None:
        """Do one thing: an event, ``wait``, ``set``; an empty one is nothing."""
        line = at_line(item.strip())
        for step in steps_of(self.chart, line):
            if step.startswith("wait "):
                self._now += int(step.removeprefix("wait "))
            else:
                self._play(Text(step.replace("{now}", str(self._now)), line.span))

    def do_script(self, lines: Sequence[str]) -> None:
        """Play the lines of a script."""
        for line in script_texts(lines):
            self._play(line)

    def answer(self, question: str) -> bool:
        """Answer a question of whoever looks on; False if it is none."""
        match question:
            case "state":
                result.print(Printer(self.chart).active(self.snapshot), style="green")
            case "data":
                print_data(self.chart, self.snapshot)
            case "events":
                self._print_events()
            case _:
                return False
        return True

    def document(self) -> dict[str, Any]:
        """Return the run as data for JSON."""
        return {
            "chart": self.chart.name,
            "steps": [d for step in self._steps if (d := macrostep_document(self.chart, step))],
            "active": active_leaves(self.chart, self.snapshot),
            "data": data_document(self.chart, self.snapshot),
            "finished": self.snapshot.finished,
            "fault": self.snapshot.fault,
        }

    def _play(self, line: Text) -> None:
        for told in self._player.play(line):
            if isinstance(told, Macrostep):
                self._steps.append(told)
            if self._is_quiet:
                continue
            if isinstance(told, str):
                result.print(told, markup=False)
            elif self._lines_only:
                for text in trace_lines(self.chart, (told,)):
                    result.print(text, markup=False)
            else:
                for styled in pretty(self.chart, told):
                    result.print(styled)

    def _print_events(self) -> None:
        active = [self.chart.states[state] for state in self.snapshot.configuration]
        transitions = [self.chart.transitions[t] for state in active for t in state.transitions]
        wanted = {event for transition in transitions for event in transition.events}
        for event in self.chart.events:
            if is_received(event):
                mark = "*" if event.index in wanted else " "
                result.print(f"  {mark} {event_text(event)}", markup=False)


def macrostep_document(chart: Chart, step: Macrostep) -> dict[str, Any]:
    """Return a macrostep as data for JSON; nothing for an event that only changes its queue."""
    states, trace = chart.states, list(trace_lines(chart, (step,)))
    if not trace:
        return {}
    return {
        "at": step.at,
        "cause": Printer(chart).cause(step),
        "microsteps": [
            {
                "transitions": list(small.transitions),
                "exited": [states[state].id for state in small.exited],
                "entered": [states[state].id for state in small.entered],
            }
            for small in step.microsteps
        ],
        "trace": trace,
        "active": active_leaves(chart, step.after),
    }


def variables(chart: Chart, snapshot: Snapshot) -> Iterator[tuple[Data, Value]]:
    """Yield data, outputs and inputs with their values."""
    declared = (*chart.data, *chart.outputs, *chart.inputs)
    return zip(declared, (*snapshot.data, *snapshot.inputs), strict=True)


def data_document(chart: Chart, snapshot: Snapshot) -> dict[str, object]:
    """Return the values of data, outputs and inputs by name, for JSON."""
    return {one.name: to_python(value, one.type) for one, value in variables(chart, snapshot)}


def print_data(chart: Chart, snapshot: Snapshot, prefix: str = "") -> None:
    """Print a line for each of data, outputs and inputs."""
    for one, value in variables(chart, snapshot):
        text = show(value, one.type, chart.capacities.tick)
        result.print(f"  {prefix}{one.name} = {text}", markup=False)


def event_text(event: Event) -> str:
    """Return an event with the types of its fields."""
    fields = ", ".join(f"{field.name} {field.type}" for field in event.fields)
    return f"{event.name}({fields})" if fields else event.name


def read_wait(text: str, line: Text, tick: int) -> int:
    """Return for how many ticks to wait."""
    try:
        return read_microseconds(text) // tick
    except ValueError as error:
        raise wrong_line(line, f"the time to wait {error}", "write `wait 500ms`") from error


def script_lines(chart: Chart, events: str | None, script: list[str] | None) -> list[str]:
    """Return the script of ``--events`` (which starts at 0), or the one that was given."""
    if script is not None:
        return script
    lines, now = [*AT_START], 0
    for item in (events or "").replace("\n", ";").split(";"):
        for step in steps_of(chart, at_line(item.strip())):
            if step.startswith("wait "):
                now += int(step.removeprefix("wait "))
            else:
                lines.append(step.replace("{now}", str(now)))
    return lines


def steps_of(chart: Chart, line: Text) -> tuple[str, ...]:
    """Return the script lines that do what a line says; ``{now}`` is the time, ``wait`` ticks."""
    word, _, rest = line.value.partition(" ")
    if not word:
        return ()
    try:
        return _steps(chart, word, rest, line)
    except FsmkitError as error:
        if word not in WORDS or word not in chart.event_index or rest.startswith(f"{word} "):
            raise
        message = error.diagnostics[0].message
        raise wrong_line(line, message, f"to post the event: `post {line.value}`") from error


def _steps(chart: Chart, word: str, rest: str, line: Text) -> tuple[str, ...]:
    if word == "wait":
        return (f"wait {read_wait(rest, line, chart.capacities.tick)}", "run {now}")
    words = iter(tokens(line.value))
    if word == "set":
        next(words)
        place, value = read_input(chart, words, line)
        step = f"input {chart.inputs[place].name} {value_text(value)}"
    else:
        if word == "post":
            next(words)
        occurrence = read_event(chart, words, line)
        values = map(value_text, occurrence.payload)
        step = " ".join(("post", chart.events[occurrence.event].name, *values))
    if next(words, None) is not None:
        raise wrong_line(line, "there are words left at the end of the line")
    return (step, "run {now}")


def at_line(text: str) -> Text:
    """Return what was given on the command line, with a place."""
    return Text(text, Span(Source("<events>", text), 0, len(text)))
