"""Run a generated Python machine by a script, for the differential test."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from fsmkit.chart.chart import Chart, Operation
from fsmkit.codegen.python.family import Member, family_of
from fsmkit.codegen.python.loading import load_machine
from fsmkit.codegen.python.template import arithmetic
from fsmkit.diagnostics import Text
from fsmkit.language import SymbolType
from fsmkit.runtime.interpreter.snapshot import Posted
from fsmkit.runtime.interpreter.trace import effect_line
from fsmkit.runtime.script import PostDuringCall, SeededHost, read_line, script_texts, wrong_line


def _value_formatter() -> Callable[[object], str]:
    """Return the function of generated modules that formats values as traces do."""
    space: dict[str, Any] = {}
    exec("\n".join(piece.text for piece in arithmetic(["shown"])), space)  # noqa: S102  (the text is our own)
    found: Callable[[object], str] = space["shown"]
    return found


shown = _value_formatter()


class MethodHost(SeededHost):
    """Operations, as methods, that return pseudo-random values; events sent out are only traced."""

    def __init__(self, family: Member) -> None:
        """Provide every method that the machines of a module can call."""
        super().__init__(family.chart)
        self.machine: Any = None
        self.told: list[str] | None = None
        """The trace, if the machine has one."""
        for member in family.everyone:
            for operation in member.chart.operations:
                method: Callable[..., Any] = partial(self.answer, operation)
                setattr(self, member.names.operations[operation.name], method)
            for event in member.names.events:
                setattr(self, f"send_{event}", lambda *_: None)

    def answer(self, operation: Operation, *_: object) -> Any:
        """Return the result of a call, in which the host may post an event."""
        if self.within.count_call():
            occurrence = self.within.occurrence
            event = self._chart.events[occurrence.event]
            fits = self.machine.post(event.name, *occurrence.payload)
            if self.told is not None:
                line = effect_line(self._chart, Posted(occurrence, fits))
                self.told.append(str(line))
        return self.result(operation.name)


def run_many(jobs: Sequence[tuple[Chart, Sequence[str]]]) -> list[list[str]]:
    """Run each generated machine by its script and return the traces."""
    return [run(chart, script) for chart, script in jobs]


def run(chart: Chart, script_lines: Sequence[str]) -> list[str]:
    """Run a generated machine by a script and return its trace.

    A machine without a trace runs beside it; a difference is added to the trace. Raises
    `FsmkitError` for an invalid line.
    """
    driven = [
        HarnessMachine(chart, load_machine(chart, traced=traced), traced=traced)
        for traced in (True, False)
    ]
    for line in script_texts(script_lines):
        is_same(driven, line)
    return driven[0].told


def is_same(driven: Sequence[HarnessMachine], line: Text) -> bool:
    """Execute a line on two machines; return whether both behave equally.

    If not, the trace of the first one says so.
    """
    seen = [each.obey(line) for each in driven]
    if seen[0] != seen[1]:
        driven[0].told.append(f"without a trace after `{line}`: {seen[1]}, not {seen[0]}")
    return bool(seen[0] == seen[1])


class HarnessMachine:
    """A machine with its host, under a script."""

    def __init__(
        self,
        chart: Chart,
        machine_class: type[Any],
        *,
        traced: bool,
        host: Callable[[Member], MethodHost] = MethodHost,
    ) -> None:
        """Create a machine with its own host; a ``traced`` one appends to `told`."""
        self._chart = chart
        self.family = family_of(chart)
        self._host = host(self.family)
        self._class = machine_class
        self._is_traced = traced
        self._saved = b""
        self.told: list[str] = []
        self._machine = self._new_machine()

    def _new_machine(self) -> Any:
        self._host.machine = machine = self._class(self._host)
        if self._is_traced:
            machine.trace = self.told.append
            self._host.told = self.told
        return machine

    def _answer(self, event: int, is_handled: object) -> str:
        """Return the outcome of a dispatched event, and the value of a reply or 0."""
        answer = ["answer", "handled" if is_handled else "ignored"]
        type_ = self._chart.events[event].reply
        if type_ is not None:
            nothing = "" if isinstance(type_, SymbolType) else 0
            reply = self._machine.reply
            answer.append(shown(nothing if reply is None else reply))
        return " ".join(answer)

    def coverage(self) -> bytes:
        """Return the coverage of all machines of the class, if it counts."""
        return bytes(self._machine.coverage())

    def dump(self) -> None:
        """Add the data to the trace."""
        self.told += self.data()

    def data(self) -> list[str]:
        """Return the data, a line each."""
        return list(dump_lines(self.family, self._machine))

    def obey(self, line: Text) -> object:
        """Execute a line; return the observable state of the machine."""
        machine, chart = self._machine, self._chart
        read = read_line(chart, line)
        event = chart.events[read.event.event].name, *read.event.payload
        result: object = None
        match read.verb:
            case "start" | "run":
                result = getattr(machine, read.verb)(read.number)
            case "post":
                result = machine.post(*event)
                if not result:
                    self.told.append("full queue")
            case "dispatch":
                result = machine.dispatch(*event)
            case "ask":
                is_running = machine.running
                result = machine.dispatch(*event)
                told = self._answer(read.event.event, result) if is_running else "answer stopped"
                self.told.append(told)
            case "input":
                name = self.family.names.variables[chart.inputs[read.number].name]
                setattr(machine, name, read.value)
            case "within":
                self._host.within = PostDuringCall(read.number, read.event)
            case "returns":
                self._host.given = {**self._host.given, read.name: read.results}
            case "seed":
                self._host.state = read.number
            case "dump":
                self.dump()
            case "save":
                self._saved = machine.save()
                self.told.append(f"saved {self._saved.hex()}")
            case "restore":
                self._machine = machine = self._new_machine()
                self._saved = read.data or self._saved
                try:
                    machine.restore(self._saved, read.number)
                except ValueError:
                    self.told.append("not restored")
            case _:
                raise wrong_line(line, f"a generated machine has no line `{read.verb}`")
        status = (machine.running, machine.finished, machine.fault, machine.next_deadline())
        return result, machine.active(), status, machine.reply, self._host.state, self.data()


def dump_lines(member: Member, machine: Any, before: str = "") -> Iterator[str]:
    """Yield the values of data and outputs, then those of the running invoked machines."""
    for variable in (*member.chart.data, *member.chart.outputs):
        value = getattr(machine, member.names.variables[variable.name])
        yield f"{before}d {variable.name} {shown(value)}"
    if member.invoked:
        children = machine._children  # noqa: SLF001  (a host has no need to see them)
        slots = zip(member.chart.invocations, member.invoked, children, strict=True)
        for invocation, invoked, child in slots:
            if child.running:
                yield from dump_lines(invoked, child, f"{before}{invocation.id}: ")
