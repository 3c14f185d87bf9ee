"""The machines of one extension module, with their names in C and in Python."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.chart.chart import Chart, Event
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Log, Reply, Statement
from fsmkit.codegen.c.generate import Machine, generate_machine
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.options import read_options
from fsmkit.codegen.python.coverage import require_names
from fsmkit.codegen.python.family import Member, family_of
from fsmkit.codegen.python.generate import module_text
from fsmkit.codegen.python.names import distinct, file_name, identifier
from fsmkit.codegen.python.sending import has_peer
from fsmkit.document.document import Direction
from fsmkit.emit import snake
from fsmkit.language import Field, Type


@dataclass(frozen=True, slots=True)
class Method:
    """A method of the host: an operation, or the receiver of an outgoing event."""

    name: str
    """The method's name in Python."""
    function: str
    """The function's name in the generated C."""
    shown: str
    """The name in the chart."""
    parameters: tuple[Field, ...]
    result: Type | None
    is_event: bool
    has_peer: bool = False
    """Whether the method takes the target of the event as an argument."""


@dataclass(frozen=True, slots=True)
class Bound:
    """A machine: the class of the module, or one in a slot of another machine."""

    names: Names
    member: Member
    first_call: int
    """The number of the first of `calls` in the numbering of the module."""
    calls: tuple[Method, ...]
    invoked: tuple[Bound, ...]

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.names.chart

    @property
    def emitted(self) -> frozenset[int]:
        """The events that the host receives."""
        given = {method.name for method in self.calls if method.is_event}
        events = enumerate(self.member.names.events)
        return frozenset(index for index, name in events if f"send_{name}" in given)

    @property
    def everyone(self) -> Iterator[Bound]:
        """All machines of the module, invoked ones before their invokers."""
        for inside in self.invoked:
            yield from inside.everyone
        yield self


@dataclass(frozen=True, slots=True)
class Module:
    """An extension module."""

    name: str
    machine: Machine
    bound: Bound
    traced: bool
    saved: bool
    """Whether a machine can be saved and restored."""
    recorded: bool = False
    """Whether a machine writes records."""
    covered: bool = False
    """Whether coverage is counted."""

    @property
    def chart(self) -> Chart:
        """The chart of the class."""
        return self.bound.chart

    @property
    def wrapper(self) -> str:
        """The prefix of the wrapper's functions."""
        return f"py_{self.name}"

    @property
    def calls(self) -> tuple[Method, ...]:
        """The methods of the host for all machines, by number."""
        return tuple(method for bound in self.bound.everyone for method in bound.calls)

    @property
    def is_calling(self) -> bool:
        """Whether a step can call Python code, which may raise or call the machine."""
        return self.traced or bool(self.calls) or self._has(Log) or self.is_replying

    @property
    def is_replying(self) -> bool:
        """Whether a step can produce a reply."""
        return self._has(Reply)

    def _has(self, kind: type[Statement]) -> bool:
        charts = (bound.chart for bound in self.bound.everyone)
        return any(isinstance(s, kind) for chart in charts for s in all_statements(chart))


def module_of(
    chart: Chart,
    prefix: str | None = None,
    *,
    traced: bool = False,
    saved: bool = False,
    recorded: bool = False,
    covered: bool = False,
    optimize: str = "",
) -> Module:
    """Return the module of a chart; ``prefix`` names module and class instead of the chart.

    C names have the prefix ``<module>_machine``, which no header of Python uses.
    """
    name = file_name(chart, prefix).removesuffix(".py")
    extras = {"save" if saved else "info"}
    extras |= {"records"} if recorded else set()
    extras |= {"coverage"} if covered else set()
    aim = {"optimize": optimize} if optimize else {}
    options = read_options({"with": ",".join(extras), **aim})
    machine = generate_machine(chart, f"{snake(prefix or chart.name)}_machine", options)
    numbers = _Numbers()
    family = family_of(chart, prefix)
    if covered:
        require_names(family)
    bound = _bind(machine.names, family, provided(chart, prefix), numbers)
    return Module(name, machine, bound, traced, saved, recorded, covered)


def fields_of(fields: tuple[Field, ...]) -> tuple[str, ...]:
    """Return names of fields that are valid arguments, equal to those of the Python target."""
    return distinct([identifier(part.name) for part in fields], {"self", "peer"})


def posted(chart: Chart) -> tuple[Event, ...]:
    """Return the events that have methods of their own."""
    return tuple(e for e in chart.events if Direction.IN in e.directions and e.invocation is None)


def provided(chart: Chart, prefix: str | None) -> dict[str, tuple[str, ...]]:
    """Return the methods that hosts of the Python target provide, by class, in its order.

    That target omits the methods of transitions that are never taken.
    """
    found = {}
    for class_ in ast.parse(module_text(chart, prefix=prefix)).body:
        if isinstance(class_, ast.ClassDef):
            for node in class_.body:
                match node:
                    case ast.AnnAssign(target=ast.Name("OPERATIONS"), value=ast.Tuple() as names):
                        found[class_.name] = ast.literal_eval(names)
                    case _:
                        pass
    return found


@dataclass
class _Numbers:
    """Assigns numbers to the methods of the host."""

    given: int = 0

    def take(self, count: int) -> int:
        """Return the first of some consecutive numbers."""
        self.given += count
        return self.given - count


def _bind(
    names: Names, member: Member, methods: Mapping[str, tuple[str, ...]], numbers: _Numbers
) -> Bound:
    pairs = zip(names.invoked, member.invoked, strict=True)
    invoked = tuple(_bind(inside, child, methods, numbers) for inside, child in pairs)
    wanted = methods[member.names.machine]
    every = (*_operations(names, member), *_event_methods(names, member))
    calls = tuple(method for method in every if method.name in wanted)
    return Bound(names, member, numbers.take(len(calls)), calls, invoked)


def _operations(names: Names, member: Member) -> Iterator[Method]:
    for operation in names.chart.operations:
        yield Method(
            member.names.operations[operation.name],
            f"{names.prefix}_{names.operations[operation.name]}",
            operation.name,
            operation.parameters,
            operation.result,
            is_event=False,
        )


def _event_methods(names: Names, member: Member) -> Iterator[Method]:
    """Yield a method of the host for each event that the machine sends."""
    for index in sent_events(names.chart):
        event = names.chart.events[index]
        yield Method(
            f"send_{member.names.events[index]}",
            f"{names.prefix}_send_{names.event_names[index]}",
            event.name,
            event.fields,
            None,
            is_event=True,
            has_peer=has_peer(names.chart, index),
        )
