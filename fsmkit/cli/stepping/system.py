"""What ``fsmkit run`` does with a system: events as ``machine.event``, and time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from rich.text import Text as Styled

from fsmkit.chart.chart import Chart
from fsmkit.cli.console import result
from fsmkit.cli.stepping.chart import (
    at_line,
    data_document,
    event_text,
    macrostep_document,
    print_data,
    read_wait,
)
from fsmkit.diagnostics import Text
from fsmkit.language import Value
from fsmkit.language.values import to_python, tokens
from fsmkit.runtime.interpreter.trace import trace_lines
from fsmkit.runtime.pretty import pretty
from fsmkit.runtime.script import SeededHost, read_event, script_texts, unknown_name, wrong_line
from fsmkit.runtime.session import is_received
from fsmkit.runtime.system_session import Answer, Happening, SystemSession
from fsmkit.system.schedule import unit_of
from fsmkit.system.system import System

HELP = """\
  MACHINE.EVENT a=1 b=2   post an event and run, as does `post MACHINE.EVENT`
  wait 500ms              let time pass
  state                   what is active
  data                    values of data, inputs and outputs
  events                  the events there are
  quit                    leave"""
KNOWN = "use `start`, `post MACHINE.EVENT` or `run NOW`"


class SystemStepper:
    """A system under the simulated clock of the command line."""

    help = HELP

    def __init__(self, system: System, seed: int, *, lines_only: bool, is_quiet: bool) -> None:
        """Stand before the start; operations that return something are answered by chance."""
        unit_of(system)  # all count time alike, or it says that they do not
        self.system = system
        self._charts = {machine.name: machine.chart for machine in system.machines}
        self._session = SystemSession(system, _answers(self._charts, seed))
        self._lines_only = lines_only
        self._is_quiet = is_quiet
        self._done: list[Happening] = []
        self._width = max(map(len, self._charts)) + 1
        self._tick = system.machines[0].chart.capacities.tick

    @property
    def faults(self) -> dict[str, str]:
        """Why machines stopped, for those that stopped by a fault."""
        last = {happening.machine: happening.macrostep.after.fault for happening in self._done}
        return {machine: fault for machine, fault in last.items() if fault is not None}

    def start(self) -> None:
        """Start all machines at time 0."""
        self._tell(self._session.start())

    def do(self, item: str) -> None:
        """Do one thing: an event or ``wait``; an empty line is nothing."""
        line = at_line(item.strip())
        word, _, rest = line.value.partition(" ")
        if not word:
            return
        if word == "wait":
            self._run(self._session.now + read_wait(rest, line, self._tick))
        else:
            words = iter(tokens(line.value))
            if word == "post":
                next(words)
            self._post(words, line)
            self._run(self._session.now)

    def do_script(self, lines: Sequence[str]) -> None:
        """Play the lines of a script: ``start``, ``post MACHINE.EVENT``, ``run NOW``."""
        for line in script_texts(lines):
            words = iter(tokens(line.value))
            match next(words, ""):
                case "start":
                    if self._done:
                        raise wrong_line(line, "a system is started once", "remove the line")
                    if next(words, "0") != "0":
                        raise wrong_line(line, "the time of a system begins at 0", "write `start`")
                    self.start()
                case "post":
                    self._post(words, line)
                case "run":
                    self._run_to(next(words, ""), line)
                case verb:
                    raise wrong_line(line, f"there is no script line `{verb}` of a system", KNOWN)
            if next(words, None) is not None:
                raise wrong_line(line, "there are words left at the end of the line", KNOWN)

    def answer(self, question: str) -> bool:
        """Answer a question of whoever looks on; False if it is none."""
        match question:
            case "state":
                for name in self._charts:
                    result.print(f"{name}: {', '.join(self._session.active(name))}", style="green")
            case "data":
                for machine, chart in self._charts.items():
                    print_data(chart, self._session.snapshot(machine), f"{machine}.")
            case "events":
                for machine, chart in self._charts.items():
                    for event in filter(is_received, chart.events):
                        result.print(f"  {machine}.{event_text(event)}", markup=False)
            case _:
                return False
        return True

    def document(self) -> dict[str, Any]:
        """Return the run as data for JSON."""
        return {
            "system": self.system.name,
            "now": self._session.now,
            "steps": [
                {"machine": done.machine, **document}
                for done in self._done
                if (document := macrostep_document(self._charts[done.machine], done.macrostep))
            ],
            "active": {name: list(self._session.active(name)) for name in self._charts},
            "data": {
                name: data_document(chart, self._session.snapshot(name))
                for name, chart in self._charts.items()
            },
            "faults": self.faults,
        }

    # --- inside --------------------------------------------------------------------------------

    def _post(self, words: Iterator[str], line: Text) -> None:
        whole = next(words, "")
        machine, dot, event = whole.partition(".")
        if not dot:
            help_ = f"write `machine.event`; the machines are {', '.join(self._charts)}"
            raise wrong_line(line, f"`{whole}` names no event of a machine", help_)
        if machine not in self._charts:
            raise unknown_name(line, "machine", machine, list(self._charts))
        chart = self._charts[machine]
        known = [event.name for event in chart.events if is_received(event)]
        if event not in known:
            raise unknown_name(line, f"event of `{machine}`", event, known)
        occurrence = read_event(chart, iter((event, *words)), line)
        fields = zip(chart.events[occurrence.event].fields, occurrence.payload, strict=True)
        payload = {field.name: to_python(value, field.type) for field, value in fields}
        if not self._session.post(machine, event, **payload):
            self._print((f"{machine}: full queue",))

    def _run_to(self, word: str, line: Text) -> None:
        if not word.isdecimal():
            raise wrong_line(line, f"`{word}` is no number", KNOWN)
        if int(word) < self._session.now:
            raise wrong_line(line, f"it is {self._session.now} already", "let time go on")
        self._run(int(word))

    def _run(self, until: int) -> None:
        self._tell(self._session.run(until))

    def _tell(self, happened: Sequence[Happening]) -> None:
        self._done += happened
        for done in happened if not self._is_quiet else ():
            chart = self._charts[done.machine]
            if self._lines_only:
                lines = trace_lines(chart, (done.macrostep,))
                self._print(f"{done.machine}: {line}" for line in lines)
            else:
                for line in pretty(chart, done.macrostep):
                    name = f"{done.machine:<{self._width}}"
                    result.print(Styled.assemble((name, "blue"), line))

    def _print(self, lines: Iterable[str]) -> None:
        for line in lines if not self._is_quiet else ():
            result.print(line, markup=False)


def _answers(charts: Mapping[str, Chart], seed: int) -> dict[str, dict[str, Answer]]:
    """Return pseudo-random answers of all operations; each machine has a host of its own."""
    found: dict[str, dict[str, Answer]] = {}
    for machine, chart in charts.items():
        host = SeededHost(chart, seed)
        names = [o.name for o in chart.operations if o.result is not None]
        found[machine] = {name: partial(_answer, host, name) for name in names}
    return found


def _answer(host: SeededHost, operation: str, arguments: tuple[Value, ...]) -> Value:
    value = host.call(operation, arguments)
    assert value is not None  # noqa: S101  (it has a result)
    return value
