"""The declarations that all machines of a network share: constants, queues, inputs, shared data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count

import fsmkit.language as lang
from fsmkit.chart.statements import Destination, Send
from fsmkit.diagnostics import Span
from fsmkit.export.identifiers import Names
from fsmkit.export.uppaal.names import FLAT, RESERVED
from fsmkit.export.uppaal.network import Declarations, Declared, Function, Sort
from fsmkit.export.uppaal.pace import Pace
from fsmkit.export.uppaal.queues import Queue
from fsmkit.export.uppaal.terms import range_of_type, unsupported
from fsmkit.language.walk import nodes
from fsmkit.system.properties.kinds.monitor import sampling_event
from fsmkit.verify.statespace.closed_system import MAX_PENDING_BEFORE_INPUT, ClosedSystem

MOST_SYMBOLS = 2**15


def leaves(
    name: str, type_: lang.Type, value: lang.Value | None = None
) -> Iterator[tuple[str, lang.Type, lang.Value | None]]:
    """Yield the scalar variables of a variable: for a record one for each field, with dots."""
    if not isinstance(type_, lang.RecordType):
        yield name, type_, value
        return
    for place, part in enumerate(type_.fields):
        inner = value[place] if isinstance(value, tuple) else None
        yield from leaves(f"{name}.{part.name}", part.type, inner)


@dataclass(slots=True)
class Space:
    """The declarations beside the templates."""

    closed: ClosedSystem
    flat: bool
    paced: bool = False
    """Whether a template of its own lets time pass (`pace`), in place of an urgent channel."""
    names: Names = field(default_factory=lambda: Names(RESERVED))
    instances: list[str] = field(default_factory=list)
    templates: list[str] = field(default_factory=list)
    shared: dict[str, str] = field(default_factory=dict)
    """By path: the variables that several machines have."""
    inputs: dict[tuple[int, str], str] = field(default_factory=dict)
    """By machine and path: the inputs that a wire drives."""
    queues: dict[int, Queue] = field(default_factory=dict)
    declared: list[Declared | Function] = field(default_factory=list)
    _constants: dict[tuple[lang.EnumType, int], str] = field(default_factory=dict)
    _symbols: dict[str, int] = field(default_factory=dict)
    _ids: Iterator[int] = field(default_factory=count)
    hurry: str = ""
    stable: str = ""
    boot: str = ""
    waits: str = ""
    watches: str = ""
    max_pending: str = ""
    pace: Pace | None = None

    def __post_init__(self) -> None:
        """Choose the names that do not depend on the machines' behaviour."""
        if self.flat:
            self.names = Names(FLAT)
        self.hurry = "" if self.paced else self.names.take("hurry")
        self.stable = self.names.take("stable")
        self.boot = self.names.take("started")
        self.waits = self.names.take("environment_waits")
        self.watches = self.names.take("monitors_wait")
        self.max_pending = self.names.take("patient")
        machines = self.closed.system.machines
        self.instances = [self.names.take(machine.name) for machine in machines]
        for instance in self.instances:
            base = instance[0].upper() + instance[1:]
            self.templates.append(self.names.take(base if base != instance else f"T_{base}"))
        if self.paced:
            self.pace = Pace(
                moves=self.names.take("moves"),
                calm=self.names.take("calm"),
                instance=self.names.take("time"),
                template=self.names.take("Time"),
            )
        for machine in machines:
            for chart in (machine.chart,):
                for type_ in chart.types:
                    if isinstance(type_, lang.EnumType):
                        self._enumerate(type_)
        self._declare_shared()
        self._declare_inputs()

    def _enumerate(self, type_: lang.EnumType) -> None:
        for member, number in zip(type_.members, type_.numbers, strict=True):
            if (type_, number) not in self._constants:
                self._constants[type_, number] = self.names.take(f"{type_.name}_{member}")

    def id(self) -> str:
        """Return an id for a location, unique in the file."""
        return f"id{next(self._ids)}"

    @property
    def urgently(self) -> str:
        """The synchronisation of an edge before which no time passes."""
        return f"{self.hurry}!" if self.hurry else ""

    # --- constants -------------------------------------------------------------------------------

    def constant(self, type_: lang.EnumType, number: int) -> str:
        """Return the constant of a member."""
        self._enumerate(type_)
        return self._constants[type_, number]

    def symbol(self, text: str) -> int:
        """Return the number of a string; the empty one is 0."""
        if not self._symbols:
            self._symbols[""] = 0
        return self._symbols.setdefault(text, len(self._symbols))

    def constants(self) -> Iterator[Declared]:
        """Yield the constants of enumerations."""
        for (_, number), name in self._constants.items():
            yield Declared(name, Sort.INT, number, number, init=(number,), constant=True)

    # --- variables -------------------------------------------------------------------------------

    def variable(
        self, name: str, type_: lang.Type, init: lang.Value | None, span: Span | None
    ) -> Declared:
        """Return the declaration of a variable."""
        scalar = type_.element if isinstance(type_, lang.ArrayType) else type_
        length = type_.length if isinstance(type_, lang.ArrayType) else 0
        values = init if isinstance(init, tuple) else (init,)
        start = tuple(self.number(value) for value in values)
        if isinstance(scalar, lang.BoolType):
            return Declared(name, Sort.BOOL, length=length, init=start)
        if isinstance(scalar, lang.SymbolType):
            return Declared(name, Sort.INT, 0, MOST_SYMBOLS - 1, length, start)
        lo, hi = range_of_type(scalar, span)
        return Declared(name, Sort.INT, lo, hi, length, start)

    def number(self, value: lang.Value | None) -> int:
        """Return a value as a number; each string has its own."""
        if isinstance(value, str):
            return self.symbol(value)
        return int(value) if isinstance(value, int) else 0

    def _declare_shared(self) -> None:
        for machine in self.closed.system.machines:
            for slot in machine.shared:
                data = machine.chart.data[slot.data]
                for path, type_, value in leaves(data.name, data.type, data.init.value):
                    if path not in self.shared:
                        self.shared[path] = self.names.take(path)
                        self.declared.append(
                            self.variable(self.shared[path], type_, value, data.span)
                        )

    def _declare_inputs(self) -> None:
        machines = self.closed.system.machines
        for link in self.closed.system.input_links:
            target = machines[link.target]
            if link.input >= len(target.chart.inputs):
                continue
            declared = target.chart.inputs[link.input]
            init = self.source_of(link.source, link.output)[2]
            for path, type_, value in leaves(declared.name, declared.type, init):
                if (link.target, path) not in self.inputs:
                    name = self.names.take(f"{self.instances[link.target]}_{path}")
                    self.inputs[link.target, path] = name
                    self.declared.append(self.variable(name, type_, value, declared.span))

    def source_of(self, machine: int, number: int) -> tuple[str, lang.Type, lang.Value]:
        """Return the name of a wire's source, counted as by `system.shared.written_value`."""
        chart, shared = self.closed.charts[machine], self.closed.system.machines[machine].shared
        if number < len(chart.outputs):
            found = chart.outputs[number]
            return found.name, found.type, found.init.value
        number -= len(chart.outputs)
        if number < len(shared):
            slot = shared[number]
            data = chart.data[slot.data]
            if slot.element is not None:
                raise unsupported(
                    "a monitor that watches an element of an array is not translated",
                    data.span,
                    "watch an output",
                )
            return data.name, data.type, data.init.value
        data = chart.data[number - len(shared)]
        return data.name, data.type, data.init.value

    def known_inputs(self, machine: int) -> dict[str, lang.Literal]:
        """Return the inputs that never change."""
        free = {free.input for free in self.closed.free_inputs} if self.closed.is_open else set()
        driven = {name.split(".")[0] for m, name in self.inputs if m == machine}
        return {
            declared.name: declared.init
            for n, declared in enumerate(self.closed.charts[machine].inputs)
            if n not in free and declared.name not in driven
        }

    # --- queues ----------------------------------------------------------------------------------

    def queueable(self, machine: int) -> frozenset[int]:
        """Return the events that the queue of a machine may hold."""
        chart = self.closed.charts[machine]
        found = {link.event for link in self.closed.system.event_links if link.target == machine}
        found |= {
            node.event
            for node in nodes((chart.states, chart.transitions, chart.script))
            if isinstance(node, Send) and node.destination is Destination.SELF
        }
        look = sampling_event(chart) if self.closed.system.machines[machine].is_monitor else None
        return frozenset(found if look is None else {*found, look})

    def declare_queues(self, stopping: set[int]) -> None:
        """Give names to the queues; ``stopping``: the machines that may stop."""
        for machine, chart in enumerate(self.closed.charts):
            events = sorted(self.queueable(machine))
            if not events:
                continue
            own = self.instances[machine]
            take = self.names.take
            numbers = {event: take(f"{own}_{chart.events[event].name}") for event in events}
            is_monitor = self.closed.system.machines[machine].is_monitor
            look = sampling_event(chart) if is_monitor else None
            self.queues[machine] = Queue(
                own,
                take(f"{own}_length"),
                take(f"{own}_events"),
                self._lanes(own, machine, events),
                take(f"{own}_overflow"),
                chart.capacities.queue,
                numbers,
                take(f"{own}_push"),
                take(f"{own}_pop"),
                take(f"{own}_look"),
                take(f"{own}_stopped") if machine in stopping else "",
                "" if look is None else numbers[look],
            )

    def _lanes(self, own: str, machine: int, events: list[int]) -> tuple[tuple[str, int, int], ...]:
        chart = self.closed.charts[machine]
        found: list[tuple[int, int]] = []
        for event in events:
            for place, part in enumerate(chart.events[event].fields):
                if isinstance(part.type, lang.ArrayType | lang.RecordType):
                    raise unsupported(
                        f"`{chart.events[event].name}` carries `{part.type}`",
                        chart.events[event].span,
                        "let it carry numbers, truth values and enumerations",
                    )
                lo, hi = range_of_type(part.type, chart.events[event].span)
                if isinstance(part.type, lang.SymbolType):
                    hi = MOST_SYMBOLS - 1
                if place == len(found):
                    found.append((lo, hi))
                else:
                    found[place] = min(lo, found[place][0]), max(hi, found[place][1])
        return tuple(
            (self.names.take(f"{own}_value_{n}"), lo, hi) for n, (lo, hi) in enumerate(found, 1)
        )

    # --- priorities ------------------------------------------------------------------------------

    def _answering(self, *, environment: bool) -> list[str]:
        """Return the lengths of the queues of monitors, and of the ``environment``."""
        machines = self.closed.system.machines
        return [
            queue.length
            for number, queue in self.queues.items()
            if machines[number].is_monitor or (machines[number].environment and environment)
        ]

    def no_priority_events(self, *, environment: bool = True) -> list[str]:
        """Return that no monitor, nor a machine of the ``environment``, has queued events."""
        lengths = self._answering(environment=environment)
        if len(lengths) > 1 and not self.flat:
            return [f"!{self.waits if environment else self.watches}()"]
        return [f"{length} == 0" for length in lengths]

    def has_few_events(self) -> list[str]:
        """Return that few enough events wait for another external one."""
        if len(self.queues) > 1 and not self.flat:
            return [f"{self.max_pending}()"]
        return [self._few()] if self.queues else []

    def _few(self) -> str:
        lengths = " + ".join(queue.length for queue in self.queues.values())
        return f"{lengths} <= {MAX_PENDING_BEFORE_INPUT}"

    def functions(self) -> Iterator[Function]:
        """Yield the functions of the readable form."""
        for queue in self.queues.values():
            yield from queue.functions()
        conditions = {}
        for name, environment in ((self.waits, True), (self.watches, False)):
            lengths = self._answering(environment=environment)
            if len(lengths) > 1:
                conditions[name] = " || ".join(f"{length} > 0" for length in lengths)
        if len(self.queues) > 1:
            conditions[self.max_pending] = self._few()
        for name, text in conditions.items():
            yield Function(name, f"bool {name}() {{\n  return {text};\n}}")

    def declarations(self, starting: int) -> Declarations:
        """Return all declarations; ``starting``: the machines that start by steps."""
        found: list[Declared | Function] = []
        if self.hurry:
            found.append(Declared(self.hurry, Sort.URGENT_BROADCAST))
        elif self.pace is not None:
            found += self.pace.declared()
        found.append(Declared(self.stable, Sort.BOOL, init=(0 if starting else 1,)))
        if starting > 1:
            found.append(Declared(self.boot, Sort.INT, 0, starting, init=(0,)))
        found += self.constants()
        found += self.declared
        for queue in self.queues.values():
            found += queue.declared()
        return (*found, *(() if self.flat else self.functions()))
