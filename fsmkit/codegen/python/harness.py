"""A generated machine under a script: what the differential test compares."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.family import Member, family_of
from fsmkit.codegen.python.generate import module_text
from fsmkit.codegen.python.template import arithmetic
from fsmkit.diagnostics import fail
from fsmkit.language import (
    ArrayType,
    BoolType,
    DurationType,
    EnumType,
    FloatType,
    IntType,
    RecordType,
    SymbolType,
    Type,
)

WORDS = re.compile(r'"[^"]*"|[^\s\[\],"]+')
"""Of a line: brackets tell nothing that the types do not."""
LARGEST_RANGE = 2**22
"""Wider ranges are sampled from this many of their least values."""


def _spelling() -> Callable[[object], str]:
    """Return the function of generated modules that spells values as traces do."""
    space: dict[str, Any] = {}
    exec(arithmetic("shown()"), space)  # noqa: S102  (the text is our own)
    found: Callable[[object], str] = space["shown"]
    return found


shown = _spelling()


class SeededHost:
    """Operations that return pseudo-random values; events sent out are only traced."""

    def __init__(self, family: Member) -> None:
        """Provide every method that the machines of a module can ask for."""
        self.state = 1
        for member in family.everyone:
            for operation in member.chart.operations:
                method: Callable[..., Any] = partial(self._answer, operation.result)
                setattr(self, member.names.operations[operation.name], method)
            for event in member.names.events:
                setattr(self, f"send_{event}", lambda *_: None)

    def _answer(self, result: Type | None, *_: object) -> Any:
        return None if result is None else self._value(result)

    def _value(self, type_: Type) -> Any:
        match type_:
            case ArrayType(element, length):
                return tuple([self._value(element) for _ in range(length)])
            case RecordType(_, fields):
                return tuple([self._value(part.type) for part in fields])
            case _:
                pass
        self.state = x = (1103515245 * self.state + 12345) % 2**31
        match type_:
            case BoolType():
                return bool(x >> 16 & 1)
            case IntType(lo, hi):
                return lo + (x >> 8) % min(hi - lo + 1, LARGEST_RANGE)
            case EnumType(_, members):
                return (x >> 8) % len(members)
            case DurationType():
                return (x >> 8) % 1001
            case FloatType():
                return ((x >> 8) % 2001 - 1000) / 8
            case _:
                return ""


def load_machine(chart: Chart, *, traced: bool = False) -> type[Any]:
    """Return the generated class of a chart."""
    machine = family_of(chart).names.machine
    space: dict[str, Any] = {"__name__": f"fsmkit_generated_{machine}"}
    text = module_text(chart, traced=traced, saved=True)
    code = compile(text, f"<{chart.name}.py>", "exec", dont_inherit=True)
    exec(code, space)  # noqa: S102  (the text is our own)
    found: type[Any] = space[machine]
    return found


def run(chart: Chart, script_lines: Sequence[str]) -> list[str]:
    """Run a generated machine by a script and return its trace; `FsmkitError` for a wrong line.

    A machine made without a trace runs beside it; where it does anything else the trace tells so.
    """
    driven = [
        Driven(chart, load_machine(chart, traced=traced), traced=traced) for traced in (True, False)
    ]
    for line in script_lines:
        is_same(driven, line)
    return driven[0].told


def is_same(driven: Sequence[Driven], line: str) -> bool:
    """Let machines do what a line of a script says; whether the second does as the first.

    If not, the trace of the first tells so.
    """
    verb, *words = WORDS.findall(line)
    try:
        seen = [each.obey(verb, words) for each in driven]
    except (ValueError, KeyError, IndexError, TypeError, StopIteration) as error:
        raise fail("wrong-script-line", f"`{line}`: {error}") from error
    if seen[0] != seen[1]:
        driven[0].told.append(f"without a trace after `{line}`: {seen[1]}, not {seen[0]}")
    return bool(seen[0] == seen[1])


class Driven:
    """A machine with its host, under a script."""

    def __init__(self, chart: Chart, machine_class: type[Any], *, traced: bool) -> None:
        """Make a machine with a host of its own; one that is ``traced`` fills `told`."""
        self._chart = chart
        self.family = family_of(chart)
        self._host = SeededHost(self.family)
        self._class = machine_class
        self._is_traced = traced
        self._saved = b""
        self.told: list[str] = []
        self._machine = self._made()

    def _made(self) -> Any:
        machine = self._class(self._host)
        if self._is_traced:
            machine.trace = self.told.append
        return machine

    def _answer(self, event: str, is_handled: object) -> str:
        """Return what came of an event that was dispatched, and the value of a reply or 0."""
        answer = ["answer", "handled" if is_handled else "ignored"]
        type_ = self._chart.events[self._chart.event_index[event]].reply
        if type_ is not None:
            nothing = "" if isinstance(type_, SymbolType) else 0
            reply = self._machine.reply
            answer.append(shown(nothing if reply is None else reply))
        return " ".join(answer)

    def dump(self) -> None:
        """Add the data to the trace."""
        self.told += self.data()

    def data(self) -> list[str]:
        """Return the data, a line each."""
        return list(dump_lines(self.family, self._machine))

    def obey(self, verb: str, words: list[str]) -> object:
        """Do what a line says; return what can be seen of the machine then."""
        machine, chart = self._machine, self._chart
        result: object = None
        match verb:
            case "start" | "run":
                result = getattr(machine, verb)(int(words[0]))
            case "post":
                result = machine.post(words[0], *_payload(chart, words))
                if not result:
                    self.told.append("full queue")
            case "dispatch":
                result = machine.dispatch(words[0], *_payload(chart, words))
            case "ask":
                is_running = machine.running
                result = machine.dispatch(words[0], *_payload(chart, words))
                self.told.append(self._answer(words[0], result) if is_running else "answer stopped")
            case "input":
                (variable,) = [v for v in chart.inputs if v.name == words[0]]
                value = _read(iter(words[1:]), variable.type)
                setattr(machine, self.family.names.variables[words[0]], value)
            case "seed":
                self._host.state = int(words[0])
            case "dump":
                self.dump()
            case "save":
                self._saved = machine.save()
                self.told.append(f"saved {self._saved.hex()}")
            case "restore":
                self._machine = machine = self._made()
                machine.restore(self._saved, int(words[0]))
            case _:
                raise ValueError(f"there is no script line `{verb}`")
        status = (machine.running, machine.finished, machine.fault, machine.next_deadline())
        return result, machine.active(), status, machine.reply, self._host.state, self.data()


def dump_lines(member: Member, machine: Any, before: str = "") -> Iterator[str]:
    """Yield the values of data and outputs, then those of the invoked machines that run."""
    for variable in (*member.chart.data, *member.chart.outputs):
        value = getattr(machine, member.names.variables[variable.name])
        yield f"{before}d {variable.name} {shown(value)}"
    if member.invoked:
        children = machine._children  # noqa: SLF001  (a host has no need to see them)
        slots = zip(member.chart.invocations, member.invoked, children, strict=True)
        for invocation, invoked, child in slots:
            if child.running:
                yield from dump_lines(invoked, child, f"{before}{invocation.id}: ")


def _payload(chart: Chart, words: Sequence[str]) -> list[Any]:
    fields = chart.events[chart.event_index[words[0]]].fields
    rest = iter(words[1:])
    return [_read(rest, part.type) for part in fields]


def _read(words: Iterator[str], type_: Type) -> Any:
    match type_:
        case BoolType():
            return next(words) in {"1", "true"}
        case FloatType():
            return float(next(words))
        case SymbolType():
            return next(words).strip('"')
        case EnumType(_, members):
            word = next(words).rpartition(".")[2]
            return members.index(word) if word in members else int(word)
        case ArrayType(element, length):
            return tuple([_read(words, element) for _ in range(length)])
        case RecordType(_, fields):
            return tuple([_read(words, part.type) for part in fields])
        case IntType() | DurationType():
            return int(next(words))
