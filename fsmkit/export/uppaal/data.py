"""The variables of one template: data, histories, clocks, and temporaries of a step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fsmkit.export.identifiers import Names
from fsmkit.export.uppaal.automaton import Automaton
from fsmkit.export.uppaal.entries import AT_HAND, FIRST_SLOT, TimerStart
from fsmkit.export.uppaal.names import RESERVED
from fsmkit.export.uppaal.network import Declared, Sort
from fsmkit.export.uppaal.printing import Printer
from fsmkit.export.uppaal.space import Space, leaves
from fsmkit.language import BoolType, Expr, Fragment, Type, Value, Variable, default_value


@dataclass(slots=True)
class Data:
    """The names of one template, and its declarations."""

    space: Space
    machine: int
    automaton: Automaton
    flags: dict[int, str] = field(default_factory=dict)
    """States that a query tests in many locations: each has a variable for being active."""
    names: Names = field(init=False)
    declared: list[Declared] = field(default_factory=list)
    variables: dict[str, str] = field(default_factory=dict)
    """By path: data and outputs that are not shared, and the inputs of an open chart."""
    histories: dict[int, str] = field(default_factory=dict)
    clocks: dict[object, str] = field(default_factory=dict)
    scratch: dict[str, Declared] = field(default_factory=dict)
    bindings: dict[str, Fragment] = field(default_factory=dict)
    """The terms for parts of the current event, and for inputs, before the first update."""
    bound: set[str] = field(default_factory=set)
    """Paths of those that were printed since `bind`."""
    selects: dict[str, str] = field(default_factory=dict)
    tables: dict[tuple[str, tuple[int, ...]], str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Declare everything that does not depend on the edges."""
        closed = self.space.closed
        chart = closed.charts[self.machine]
        prefix = f"{self.space.instances[self.machine]}_" if self.space.flat else ""
        self.names = Names(RESERVED, self.space.names, prefix)
        for declared in (*chart.data, *chart.outputs):
            for path, type_, value in leaves(declared.name, declared.type, declared.init.value):
                if path not in self.space.shared:
                    self._declare(path, type_, value)
        if closed.is_open:
            for free in closed.free_inputs:
                given = chart.inputs[free.input]
                self._declare(given.name, given.type, given.init.value)
        for state, recorded in self.automaton.recorded.items():
            name = self.names.take(chart.states[state].id)
            self.histories[state] = name
            values = [
                f"{n}: {' '.join(chart.states[s].id for s in sorted(value))}"
                for n, value in enumerate(recorded, 1)
            ]
            note = "0: nothing, " + ", ".join(values)
            self.declared.append(
                Declared(name, Sort.INT, 0, len(recorded), init=(0,), comment=note)
            )
        for state in sorted(self.flags):
            name = self.names.take(f"in_{chart.states[state].id}")
            self.flags[state] = name
            at_once = self.automaton.starts_at_once
            active = at_once and state in self.automaton.start[0].target.configuration
            self.declared.append(Declared(name, Sort.BOOL, init=(int(active),)))
        if not closed.untimed:
            self._colour_clocks()
        space = self.space
        self.printer = Printer(self._access, space.constant, space.symbol, flat=space.flat)

    printer: Printer = field(init=False)

    def _declare(self, path: str, type_: Type, value: Value | None) -> None:
        span = self.space.closed.charts[self.machine].root.span
        self.variables[path] = self.names.take(path)
        self.declared.append(self.space.variable(self.variables[path], type_, value, span))

    def _colour_clocks(self) -> None:
        """Assign the same clock to timers that are never armed together."""
        beside: dict[object, set[object]] = {}
        for key in self.automaton.keys:
            identities = [identity(timer) for timer in key.timers]
            for one in identities:
                beside.setdefault(one, set()).update(o for o in identities if o != one)
        colours: dict[object, int] = {}
        for one, others in beside.items():
            taken = {colours[other] for other in others if other in colours}
            colours[one] = next(n for n in range(len(beside)) if n not in taken)
        count = max(colours.values(), default=-1) + 1
        made = [self.names.take("t" if count == 1 else f"t{n + 1}") for n in range(count)]
        self.declared += [Declared(name, Sort.CLOCK) for name in made]
        self.clocks = {one: made[colour] for one, colour in colours.items()}

    # --- names -----------------------------------------------------------------------------------

    def clock(self, timer: TimerStart) -> str:
        """Return the clock of a timer; none without time."""
        return self.clocks[identity(timer)]

    def bind(self, bindings: Mapping[str, Fragment]) -> None:
        """Replace paths by texts; none of them was printed yet."""
        self.bindings = dict(bindings)
        self.bound = set()

    def _access(self, path: str, variable: Variable) -> Fragment:
        if path in self.bindings:
            self.bound.add(path)
            return self.bindings[path]
        if path.startswith("@"):
            return Fragment(self.kept(path, variable.type))
        return Fragment(self.name(path))

    def name(self, path: str) -> str:
        """Return the name of a variable of the chart."""
        if path in self.variables:
            return self.variables[path]
        if (self.machine, path) in self.space.inputs:
            return self.space.inputs[self.machine, path]
        return self.space.shared[path]

    def kept(self, path: str, type_: Type) -> str:
        """Return the temporary variable for a part of an event."""
        if path not in self.scratch:
            number, _, part = path[1:].partition(".")
            instance = int(number)
            word = f"raised_{instance}" if instance > AT_HAND else "event"
            word = f"sent_{instance - FIRST_SLOT + 1}" if instance >= FIRST_SLOT else word
            name = self.names.take(f"{word}_{part}")
            span = self.space.closed.charts[self.machine].root.span
            made = self.space.variable(name, type_, default_value(type_), span)
            self.scratch[path] = made
            self.declared.append(made)
        return self.scratch[path].name

    def names_of_select(self, word: str) -> str:
        """Return the name under which an external value is selected."""
        if word not in self.selects:
            self.selects[word] = self.names.take(f"any_{word}")
        return self.selects[word]

    def table(self, word: str, numbers: list[int]) -> str:
        """Return a constant array of possible external values."""
        key = word, tuple(numbers)
        if key not in self.tables:
            name = self.tables[key] = self.names.take(f"{word}_values")
            lo, hi = min(numbers), max(numbers)
            values = tuple(numbers)
            self.declared.append(
                Declared(name, Sort.INT, lo, hi, len(values), values, constant=True)
            )
        return self.tables[key]

    def reset(self, path: str) -> str:
        """Return the update that clears a part of an event."""
        made = self.scratch[path]
        return f"{made.name} = {initial_text(made)}"

    def initial(self, path: str) -> str:
        """Return the update that resets a variable to its start value."""
        made = next(d for d in self.declared if d.name == self.variables[path])
        return f"{made.name} = {initial_text(made)}"

    def number(self, expr: Expr) -> str:
        """Return an expression as a number, in the form of a queue."""
        text = self.printer.fragment(expr)
        if isinstance(expr.type, BoolType):
            if text.text in ("true", "false"):
                return "1" if text.text == "true" else "0"
            return f"({text.at_least(2)} ? 1 : 0)"
        return text.at_least(2)

    def history_text(self, state: int, value: frozenset[int] | None) -> str:
        """Return the number of a recorded configuration."""
        known = self.automaton.recorded[state]
        return "0" if value is None else str(1 + known.index(value))


def initial_text(made: Declared) -> str:
    """Return the start value of a scalar."""
    value = made.init[0]
    return ("true" if value else "false") if made.sort is Sort.BOOL else str(value)


def identity(timer: TimerStart) -> object:
    """Return the identity of a timer within a machine: its transition or its slot."""
    return timer.what if timer.slot is None else timer.slot
