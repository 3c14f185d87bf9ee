"""The line-by-line work of ``fsmkit run``: events, time, inputs, and questions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from rich.text import Text as Styled

from fsmkit.chart.chart import Chart, Event
from fsmkit.cli.common.console import result
from fsmkit.diagnostics import FsmkitError, Source, Span, Text
from fsmkit.language import CLOCK_MARGIN
from fsmkit.language.values import show, tokens
from fsmkit.runtime.interpreter import Macrostep, Snapshot
from fsmkit.runtime.interpreter.trace import active_leaves, trace_lines, value_text
from fsmkit.runtime.script import (
    Player,
    SeededHost,
    is_received,
    is_returns,
    read_event,
    read_input,
    read_results,
    read_wait,
    script_texts,
    wrong_line,
)
from fsmkit.runtime.session import values_by_name, variables
from fsmkit.runtime.system_session import SystemPlayer
from fsmkit.runtime.trace_text import Printer, pretty
from fsmkit.system.system import System

HELP = """\
  {event} a=1 b=2      post an event and run; `post {event}` posts one of any name
  wait 500ms         let time pass{set}
  {operation} returns 1, 2    the operation's next results, one per call
  state              the active states
  data               values of data, inputs and outputs
  events             the events; * marks those that active states handle
  quit               leave"""
MOST_PASSED = CLOCK_MARGIN
"""Ticks between two readings of a 32-bit clock, so that every deadline is within its range."""
WORDS = ("wait", "set", "post")
"""First words of lines that are not events."""


class OneMachine:
    """A chart alone, under a script; its name among machines is empty."""

    at_start = ("start 0", "run 0")
    """Events that the machine sent to itself at its start are taken before time passes."""
    help = HELP.format(
        event="EVENT", operation="OPERATION", set="\n  set INPUT VALUE    change an input and run"
    )

    def __init__(self, chart: Chart, seed: int) -> None:
        """Create the machine without starting it."""
        self.charts = {"": chart}
        self._player = Player(chart, SeededHost(chart, seed))

    def snapshot(self, machine: str) -> Snapshot:
        """Return the machine as it is."""
        del machine
        return self._player.snapshot

    def play(self, line: Text) -> Iterator[tuple[str, Macrostep | str]]:
        """Execute a script line."""
        return (("", done) for done in self._player.play(line))

    def steps(self, line: Text) -> tuple[str, ...]:
        """Return the script lines of a typed line."""
        return steps_of(self.charts[""], line)

    def document(self, steps: list[dict[str, Any]]) -> dict[str, Any]:
        """Return the run as data for JSON."""
        chart, snapshot = self.charts[""], self._player.snapshot
        return {
            "chart": chart.name,
            "steps": steps,
            "active": active_leaves(chart, snapshot),
            "data": values_by_name(chart, snapshot),
            "finished": snapshot.finished,
            "fault": snapshot.fault,
        }


class SystemMachines(SystemPlayer):
    """The machines of a system; events are ``machine.event``."""

    at_start = ("start",)
    help = HELP.format(event="MACHINE.EVENT", operation="MACHINE.OPERATION", set="")

    def steps(self, line: Text) -> tuple[str, ...]:
        """Return the script lines of a typed line."""
        word, _, rest = line.value.partition(" ")
        if not word:
            return ()
        if word == "wait":
            return (f"wait {read_wait(rest, line, self.tick)}", "run {now}")
        if is_returns(tokens(line.value)) and word not in WORDS:
            return (f"returns {word}{rest.removeprefix('returns')}",)
        return (line.value if word == "post" else f"post {line.value}", "run {now}")

    def document(self, steps: list[dict[str, Any]]) -> dict[str, Any]:
        """Return the run as data for JSON."""
        machines = {name: (chart, self.snapshot(name)) for name, chart in self.charts.items()}
        return {
            "system": self.system.name,
            "now": self.now,
            "steps": steps,
            "active": {name: active_leaves(*machine) for name, machine in machines.items()},
            "data": {name: values_by_name(*machine) for name, machine in machines.items()},
            "faults": {n: s.fault for n, (_, s) in machines.items() if s.fault is not None},
        }


Machines = OneMachine | SystemMachines


def machines_of(model: Chart | System, seed: int) -> Machines:
    """Return the machines of a chart or system; operations return pseudo-random values."""
    return OneMachine(model, seed) if isinstance(model, Chart) else SystemMachines(model, seed)


class Stepper:
    """Machines under the simulated clock of the command line."""

    def __init__(self, machines: Machines, *, lines_only: bool, is_quiet: bool) -> None:
        self.machines = machines
        self._now = 0
        self._lines_only = lines_only
        self._is_quiet = is_quiet
        self._steps: list[tuple[str, Macrostep]] = []
        self._width = max(map(len, machines.charts)) + 1

    @property
    def faults(self) -> dict[str, str]:
        """Why machines stopped, for those that stopped by a fault."""
        faults = {name: self.machines.snapshot(name).fault for name in self.machines.charts}
        return {name: fault for name, fault in faults.items() if fault is not None}

    def start(self) -> None:
        """Start at time 0."""
        for line in self.machines.at_start:
            self._play(with_location(line))

    def do(self, item: str) -> None:
        """Do one thing: an event, ``wait``, ``set``; an empty one is nothing."""
        line = with_location(item.strip())
        for step in self.machines.steps(line):
            if step.startswith("wait "):
                self._now += int(step.removeprefix("wait "))
            else:
                self._play(Text(step.replace("{now}", str(self._now)), line.span))

    def do_script(self, lines: Sequence[str]) -> None:
        """Play the lines of a script."""
        for line in script_texts(lines):
            self._play(line)

    def answer(self, question: str) -> bool:
        """Execute a query of the user; return False if the line is not a query."""
        if question not in ("state", "data", "events"):
            return False
        for name, chart in self.machines.charts.items():
            snapshot = self.machines.snapshot(name)
            prefix = f"{name}." if name else ""
            match question:
                case "state":
                    active = Printer(chart).active(snapshot)
                    text = f"{name}: {active.removeprefix('= ')}" if name else active
                    result.print(text, style="green")
                case "data":
                    for one, value in variables(chart, snapshot):
                        text = show(value, one.type, chart.capacities.tick)
                        result.print(f"  {prefix}{one.name} = {text}", markup=False)
                case _:
                    _print_events(chart, snapshot, prefix)
        return True

    def document(self) -> dict[str, Any]:
        """Return the run as data for JSON."""
        charts = self.machines.charts
        return self.machines.document(
            [
                {**({"machine": name} if name else {}), **document}
                for name, step in self._steps
                if (document := macrostep_document(charts[name], step))
            ]
        )

    def _play(self, line: Text) -> None:
        for name, done in self.machines.play(line):
            if isinstance(done, Macrostep):
                self._steps.append((name, done))
            if self._is_quiet:
                continue
            chart = self.machines.charts[name]
            if isinstance(done, Macrostep) and not self._lines_only:
                margin = f"{name:<{self._width}}" if name else ""
                for styled in pretty(chart, done):
                    result.print(Styled.assemble((margin, "blue"), styled))
                continue
            for text in (done,) if isinstance(done, str) else trace_lines(chart, (done,)):
                result.print(f"{name}: {text}" if name else text, markup=False)


def _print_events(chart: Chart, snapshot: Snapshot, prefix: str) -> None:
    active = [chart.states[state] for state in snapshot.configuration]
    transitions = [chart.transitions[t] for state in active for t in state.transitions]
    wanted = {event for transition in transitions for event in transition.events}
    for event in filter(is_received, chart.events):
        mark = "*" if event.index in wanted else " "
        result.print(f"  {mark} {prefix}{event_text(event)}", markup=False)


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


def event_text(event: Event) -> str:
    """Return an event with the types of its fields."""
    fields = ", ".join(f"{field.name} {field.type}" for field in event.fields)
    return f"{event.name}({fields})" if fields else event.name


def script_lines(chart: Chart, events: str | None, script: list[str] | None) -> list[str]:
    """Return the script of ``--events`` (which starts at 0), or the given one."""
    if script is not None:
        return script
    lines, now = [*OneMachine.at_start], 0
    for item in (events or "").replace("\n", ";").split(";"):
        for step in steps_of(chart, with_location(item.strip())):
            if step.startswith("wait "):
                now += int(step.removeprefix("wait "))
            else:
                lines.append(step.replace("{now}", str(now)))
    return lines


def steps_of(chart: Chart, line: Text) -> tuple[str, ...]:
    """Return the script lines of a line; ``{now}`` is the time, ``wait`` takes ticks."""
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


def _waits(ticks: int) -> Iterator[str]:
    """Yield the script lines of a wait: `run` takes the reading of a 32-bit clock.

    One reading can be only half a turn of the clock later than the one before.
    """
    while True:
        passed = min(ticks, MOST_PASSED)
        yield from (f"wait {passed}", "run {now}")
        ticks -= passed
        if not ticks:
            return


def _steps(chart: Chart, word: str, rest: str, line: Text) -> tuple[str, ...]:
    if word == "wait":
        return tuple(_waits(read_wait(rest, line, chart.capacities.tick)))
    every = tokens(line.value)
    words = iter(every)
    if is_returns(every) and word not in WORDS and word not in chart.event_index:
        name, results = read_results(chart, iter((word, *every[2:])), line)
        return (" ".join(("returns", name, *map(value_text, results))),)
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


def with_location(text: str) -> Text:
    """Return a string of the command line with a location."""
    return Text(text, Span(Source("<events>", text), 0, len(text)))
