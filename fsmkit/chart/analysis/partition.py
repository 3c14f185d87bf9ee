"""The values to try for external values: inputs, payloads, results of operations.

Where such a value goes only into comparisons with constants, also on its way through variables,
events, levels and connections, one value of each interval between these constants is enough. What
is computed with, or compared with what is no constant, is sampled if its range is large, and no
verdict that rests on samples is HOLDS.

**Places.** Values are held by places: variables (data, inputs, outputs), fields of events,
parameters and results of operations; an array or a record is one place for all its parts. An edge
``p -> q`` says that ``q`` is given the value of ``p`` unchanged, or brought monotonically into
bounds: ``q = p``, ``send e(q = p)``, a wire, a conditional, ``min``, ``max``, storing with
saturation. ``cuts(p)`` are the comparisons with constants at ``p`` and at all places that ``p``
leads to. A place is *kept* if it, or one that it leads to, is used in another way.

**Why one value for each interval is enough.** Call two values of a place that is not kept equal if
all comparisons of ``cuts(p)`` have the same truth for both; two of a kept place, if they are the
same value. Call two states equal if they agree in configuration, timers, lengths and events of all
queues, and hold equal values at each place. From equal states the same steps lead to equal states:

* An expression reads a place that is not kept only in comparisons of ``cuts(p)``, so guards,
  branches, indices, delays and computed values come out the same.
* A copy along ``p -> q`` makes equal values of equal ones, since ``cuts(q)`` is part of
  ``cuts(p)``. ``x`` brought into ``lo..hi`` is at least ``c`` if ``x`` is, for ``lo < c <= hi``,
  and for other ``c`` whatever ``x`` is. That ``x`` is outside of the bounds raises
  ``error.range``, or is a fault, so the bounds are cuts of ``x`` themselves. ``min(x, y)`` is at
  least ``c`` if both are, ``max(x, y)`` if one is. A type that wraps, and rounding, keep a place.
* A choice of an external value is matched by the value that represents its interval.
* Conditions of properties are cuts (or keep a place) like any guard.

So both state spaces are bisimilar: they have the same verdicts, and reach the same states up to
indistinguishable values. A step that only exchanges equivalent values would lead from a state to
itself, and is omitted. A monitor evaluates its guards when its inputs change, so it evaluates them
once less. That evaluation does nothing if its eventless guards read the same values as before:
no field of the current event, and nothing that fails. Otherwise the inputs of the monitor are kept.
One exception remains: an evaluation occupies an entry in the queue of the monitor. An overflow of a
queue that one step fills exactly is therefore found for the tried values only.

**Small types.** If a place with at most `ENUMERATED` values is used in another way, each value is
a cut. So it need not be kept, nor need the places that it comes from.
"""

from __future__ import annotations

import math
import struct
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple, assert_never

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.analysis.effects import can_fail, reads_event
from fsmkit.chart.analysis.ranges import range_of, within
from fsmkit.chart.chart import Chart
from fsmkit.chart.content import values as values_of
from fsmkit.chart.walk import charts_within
from fsmkit.diagnostics import Span
from fsmkit.document.document import Trigger
from fsmkit.language.conversion import integer_bounds
from fsmkit.language.statements.tree import bodies
from fsmkit.language.walk import nodes, parts, root, subexpressions

ENUMERATED = 32
"""A range of at most so many values is enumerated, whatever is done with it."""
COMBINED = 4096
"""At most so many combinations are tried at one step."""

EXACT = {32: 1 << 24, 64: 1 << 53}
"""The integers up to which each is a value of the floating-point type of so many bits."""

MIRRORED = {
    lang.BinaryOp.EQ: lang.BinaryOp.EQ,
    lang.BinaryOp.NE: lang.BinaryOp.NE,
    lang.BinaryOp.LT: lang.BinaryOp.GT,
    lang.BinaryOp.LE: lang.BinaryOp.GE,
    lang.BinaryOp.GT: lang.BinaryOp.LT,
    lang.BinaryOp.GE: lang.BinaryOp.LE,
}
"""The comparisons, each with the equivalent one for exchanged operands."""


class Place(NamedTuple):
    """A holder of a value; ``part`` numbers fields and parameters.

    ``kind`` and ``name``: ``variable`` and its name, ``field`` and the number of the event,
    ``parameter`` or ``result`` and the name of the operation, ``local`` or ``returned`` with that
    of a function (empty: of none) and of the variable. ``chart``: the machine's own is 0,
    those that it invokes follow; operations are those of the machine.
    """

    machine: int
    kind: str
    name: str | int
    part: int = 0
    chart: int = 0


class Cut(NamedTuple):
    """Where a range is cut: before a number, or right after it; a string is cut from all others."""

    at: int | float | str
    after: bool = False


@dataclass(frozen=True, slots=True)
class Use:
    """The use of a value that prevents intervals, and its location."""

    text: str
    span: Span | None = None


@dataclass(frozen=True, slots=True)
class Values:
    """Values to try. ``kept``: why others could make a difference; None: they could not."""

    values: tuple[lang.Value, ...]
    kept: Use | None = None


class Condition(NamedTuple):
    """A condition over several machines, and the places of its variables."""

    expression: lang.Expr
    places: Mapping[str, Place]


class Partition:
    """The partition of the external values into intervals."""

    def __init__(
        self,
        charts: Sequence[Chart],
        copies: Iterable[tuple[Place, Place]] = (),
        conditions: Iterable[Condition] = (),
        *,
        observed: bool = False,
        looking: Iterable[int] = (),
        enumerated: int = 0,
    ) -> None:
        """Follow the values through the charts of machines, and along the copies between them.

        ``observed``: someone sees the values that leave the machines, not only their states.
        ``looking``: the machines that get an event when their inputs change. ``enumerated``: a
        range of at most so many values is tried whole (0: `ENUMERATED`).
        """
        flows = _Flows(observed=observed, enumerated=enumerated or ENUMERATED)
        for machine, chart in enumerate(charts):
            flows.machine(machine, chart)
        for source, target in copies:
            flows.copies[source].add(target)
        for condition in conditions:
            flows.condition(condition)
        for machine in looking:
            flows.look(machine, charts[machine])
        self._flows = flows

    def values(self, type_: lang.Type, place: Place) -> Values:
        """Return the values to try at a place that receives external values."""
        return self._flows.values(type_, self._flows.ahead(place))

    def alike(self, type_: lang.Type, place: Place, value: lang.Value) -> tuple[int, int] | None:
        """Return the bounds of the values that are equivalent to ``value`` at a place.

        None for a type that does not count: a float, a string, an array, a record.
        """
        if not isinstance(type_, lang.BoolType | lang.EnumType | lang.IntType | lang.DurationType):
            return None
        assert isinstance(value, int)  # noqa: S101  (of such a type)
        ahead = self._flows.ahead(place)
        if ahead.kept is not None or (isinstance(type_, lang.EnumType) and not type_.is_counted):
            return value, value
        lo, hi = _limits(type_)
        return next((b, e) for b, e in _intervals(lo, hi, ahead) if b <= value <= e)

    def payloads(self, types: Sequence[tuple[lang.Type, Place]]) -> Values:
        """Return the combinations of values to try at places that are given one together."""
        return combined([self.values(type_, place) for type_, place in types])


def combined(parts_: Sequence[Values]) -> Values:
    """Return the combinations of values; beyond `COMBINED` only some of them."""
    kept = next((part.kept for part in parts_ if part.kept is not None), None)
    if math.prod(len(part.values) for part in parts_) > COMBINED:
        # samples: all at their first value, and each of the others in turn
        first = tuple(part.values[0] for part in parts_)
        found = [first]
        for number, part in enumerate(parts_):
            found += [(*first[:number], v, *first[number + 1 :]) for v in part.values[1:]]
        return Values(tuple(found[:COMBINED]), kept or Use(f"makes more than {COMBINED:,} choices"))
    return Values(tuple(product(*(part.values for part in parts_))), kept)


@dataclass(frozen=True, slots=True)
class _At:
    """Where an expression stands: in a chart, by number among those of the machine.

    ``events`` may be current. ``places``: those of a condition over several machines.
    """

    machine: int
    charts: tuple[Chart, ...]
    number: int
    events: tuple[int, ...]
    places: Mapping[str, Place] | None = None
    function: str = ""
    """In the body of which function of the chart."""

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.charts[self.number]

    def within(self, chart: Chart) -> _At:
        """Return the location in an invoked chart; its first occurrence represents all of them."""
        number = next(number for number, one in enumerate(self.charts) if one is chart)
        return replace(self, number=number, events=())

    def variable(self, name: str) -> Place:
        """Return the place of a variable."""
        if self.places is not None:
            return self.places[name]
        return Place(self.machine, "variable", name, chart=self.number)

    def place_of(self, variable: lang.Expr) -> Place:
        """Return the place of a variable, local ones included."""
        assert isinstance(variable, lang.Variable)  # noqa: S101
        if variable.storage is not lang.Storage.LOCAL:
            return self.variable(variable.name)
        name = f"{self.function}/{variable.name}"
        return Place(self.machine, "local", name, chart=self.number)

    def returned(self, function: str = "") -> Place:
        """Return the place of the result of a function."""
        return Place(self.machine, "returned", function or self.function, chart=self.number)

    def field(self, event: int, part: int) -> Place:
        """Return the place of a field of an event."""
        return Place(self.machine, "field", event, part, self.number)


@dataclass(slots=True)
class _Ahead:
    """The uses of a value at a location, and at all locations that it flows to."""

    cuts: set[Cut]
    known: set[lang.Value]
    kept: Use | None


class _Flows:
    """The places of machines, the copies between them, and the uses of their values."""

    def __init__(self, *, observed: bool, enumerated: int = ENUMERATED) -> None:
        self.observed = observed
        self.enumerated = enumerated
        self.copies: defaultdict[Place, set[Place]] = defaultdict(set)
        self.cuts: defaultdict[Place, set[Cut]] = defaultdict(set)
        self.known: defaultdict[Place, set[lang.Value]] = defaultdict(set)
        """Constants that a place is given: they are taken for the values of their interval."""
        self.kept: dict[Place, Use] = {}
        self.strings: set[str] = set()

    def ahead(self, place: Place) -> _Ahead:
        """Return the uses of a value at a place and at all places that it is copied to."""
        found, seen, left = _Ahead(set(), set(), None), {place}, [place]
        for at in left:
            found.cuts |= self.cuts.get(at, set())
            found.known |= self.known.get(at, set())
            found.kept = found.kept or self.kept.get(at)
            new = self.copies.get(at, set()) - seen
            seen |= new
            left += sorted(new, key=str)
        return found

    # --- charts --------------------------------------------------------------------------------

    def machine(self, machine: int, chart: Chart) -> None:
        """Read the values and uses of a machine and of the charts that it invokes."""
        charts = tuple(charts_within(chart))
        for number, one in enumerate(charts):
            self._chart(_At(machine, charts, number, tuple(e.index for e in one.events)))
            literals = (n.value for n in nodes(_all_of(one)) if isinstance(n, lang.Literal))
            self.strings |= {value for value in literals if isinstance(value, str)}

    def _chart(self, at: _At) -> None:
        chart = at.chart
        for declared in (*chart.data, *chart.inputs, *chart.outputs):
            self.known[at.variable(declared.name)].add(declared.init.value)
        for transition in chart.transitions:
            of_event = transition.trigger is Trigger.EVENT
            here = replace(at, events=transition.events) if of_event else at
            if transition.guard is not None:
                self._evaluate(transition.guard, here)
            self._block(transition.content, here)
        for state in chart.states:
            for block in (*state.on_entry, *state.on_exit, *state.invokes):
                self._block(block, at)
            for value in state.done_data:
                self._evaluate(value, at, "it is the payload of `done`")
            if state.invariant is not None:
                self._evaluate(state.invariant, at)
        self._block(chart.script, at)
        for function in chart.functions:
            self._block(function.body, replace(at, function=function.name, events=()))
        for event in chart.events:
            self._block(event.finalize, replace(at, events=(event.index,)))
        self._invocations(at)

    def _invocations(self, at: _At) -> None:
        """Copy the fields of events between a chart and those that it invokes."""
        for invocation in at.chart.invocations:
            inner = at.within(invocation.chart)
            for event, passage in enumerate(invocation.passages):
                for part, source in enumerate(() if passage is None else passage.fields):
                    if passage is not None and source is not None:
                        self.copies[at.field(event, source)].add(inner.field(passage.event, part))
            for event, to in enumerate(invocation.returns):
                for part, _ in enumerate(invocation.chart.events[event].fields):
                    if to is not None:
                        self.copies[inner.field(event, part)].add(at.field(to, part))

    def condition(self, condition: Condition) -> None:
        """Read a condition over several machines."""
        self._evaluate(condition.expression, _At(0, (), 0, (), condition.places))

    def look(self, machine: int, chart: Chart) -> None:
        """Keep the inputs of a machine on which one more look at the same could do something."""
        for transition in chart.transitions:
            guard = transition.guard
            if transition.trigger is not Trigger.EVENTLESS or guard is None:
                continue
            names_event = any(isinstance(part, lang.EventName) for part in subexpressions(guard))
            if can_fail(guard) or reads_event(guard) or names_event:
                use = Use("this guard of a monitor sees more than values", transition.span)
                for declared in chart.inputs:
                    self.kept[Place(machine, "variable", declared.name)] = use

    # --- statements ----------------------------------------------------------------------------

    def _block(self, block: stmt.Block, at: _At) -> None:
        for statement in block:
            self._statement(statement, at)

    def _statement(self, statement: stmt.Statement, at: _At) -> None:
        match statement:
            case stmt.Assign(location, value):
                for part in subexpressions(location):
                    if isinstance(part, lang.Element):
                        self._evaluate(part.index, at, "it is an index")
                self._copy(value, at.place_of(root(location)), at)
            case stmt.Raise(event, arguments) | stmt.Send(event, arguments):
                leaves = (
                    isinstance(statement, stmt.Send)
                    and statement.destination is stmt.Destination.PORT
                )
                for number, value in enumerate(arguments):
                    self._copy(value, at.field(event, number), at)
                    if leaves and (self.observed or at.number):
                        self._evaluate(value, at, "it leaves the machine")
                if isinstance(statement, stmt.Send) and statement.delay is not None:
                    self._evaluate(statement.delay, at, "it is a delay")
            case stmt.Log(_, values):
                for value in values:
                    self._leave(value, at)
            case stmt.Reply(value):
                self._leave(value, at)
            case stmt.If(branches):
                for branch in branches:
                    if branch.condition is not None:
                        self._evaluate(branch.condition, at)
                    self._block(branch.body, at)
            case stmt.ForEach(array, item, index, body):
                if isinstance(array, lang.Numbers):
                    self.known[at.place_of(item)] |= set(array.numbers[:ENUMERATED])
                else:
                    self._copy(array, at.place_of(item), at)
                if index is not None:
                    self.known[at.place_of(index)].add(0)
                self._block(body, at)
            case stmt.Local(place, value) if value is not None:
                self._copy(value, at.place_of(place), at)
            case stmt.Local():
                pass
            case stmt.Return(value):
                self._copy(value, at.returned(), at)
            case stmt.CallOperation(call):
                self._arguments(call, at)
            case stmt.Invoke(invocation, arguments):
                invoked = at.chart.invocations[invocation]
                inner = at.within(invoked.chart)
                for data, value in zip(invoked.given, arguments, strict=True):
                    self._copy(value, inner.variable(invoked.chart.data[data].name), at)
            case _:  # any other: every expression in it may matter
                for value in values_of(statement):
                    self._evaluate(value, at)
                for body in bodies(statement):
                    self._block(body, at)

    def _leave(self, value: lang.Expr, at: _At) -> None:
        """Read a value that only someone outside gets to see."""
        if self.observed or not self._is_copy(value):
            self._evaluate(value, at, "it leaves the machine")
        else:
            self._sources(value, at)

    def _arguments(self, call: lang.Call, at: _At) -> None:
        for part, value in enumerate(call.arguments):
            self._copy(value, Place(at.machine, "parameter", call.operation, part), at)
            if self.observed:
                self._evaluate(value, at, "it leaves the machine")

    def _parameters(self, call: lang.CallFunction, at: _At) -> None:
        """Give the parameters of a function their values."""
        inside = replace(at, function=call.function.name, events=())
        for parameter, value in zip(call.function.parameters, call.arguments, strict=True):
            self._copy(value, inside.place_of(parameter), at)

    def _copy(self, value: lang.Expr, target: Place, at: _At) -> None:
        """Store the value of an expression at a place."""
        if not self._is_copy(value):
            self._evaluate(value, at)
            return
        for source in self._sources(value, at):
            self.copies[source].add(target)
        self.known[target] |= {
            p.value for p in subexpressions(value) if isinstance(p, lang.Literal)
        }

    # --- expressions ---------------------------------------------------------------------------

    def _evaluate(self, expr: lang.Expr, at: _At, how: str = "it is used as a value") -> None:
        """Read an expression whose value matters."""
        match expr:
            case lang.Binary(op, left, right) if op in MIRRORED:
                for side, other, seen in ((left, right, op), (right, left, MIRRORED[op])):
                    if _is_cut(side, other) and self._is_copy(side):
                        self._compare(side, seen, other, at)
                        return
                self._evaluate(left, at, "it is compared with what is no constant")
                self._evaluate(right, at, "it is compared with what is no constant")
            case _ if self._is_copy(expr):
                self._use(expr, at, how)
            case lang.Checked(operand, lang.EnumType(numbers=numbers)) if self._is_copy(operand):
                for place in self._sources(operand, at):
                    for number in numbers:
                        self.cuts[place] |= {Cut(number), Cut(number, after=True)}
            case lang.Binary() | lang.Unary() | lang.Apply() | lang.Convert() | lang.Checked():
                for part in parts(expr):
                    self._evaluate(part, at, "it is computed with")
            case lang.Call():
                self._arguments(expr, at)
            case lang.Element(index=index):
                self._evaluate(index, at, "it is an index")
            case _:
                for part in parts(expr):
                    self._evaluate(part, at)

    def _compare(self, side: lang.Expr, op: lang.BinaryOp, constant: lang.Expr, at: _At) -> None:
        assert isinstance(constant, lang.Literal)  # noqa: S101  (`_is_cut`)
        value = constant.value
        assert not isinstance(value, tuple)  # noqa: S101  (`_is_cut`)
        for place in self._sources(side, at):
            self.cuts[place] |= set(_cuts(op, value))

    def _use(self, expr: lang.Expr, at: _At, how: str) -> None:
        """Note that a value is used as such: each of a few makes a difference."""
        few = _few(expr)
        for place in self._sources(expr, at):
            if few is None:
                self.kept.setdefault(place, Use(how, expr.span))
            else:
                for value in few:
                    self.cuts[place] |= {Cut(value), Cut(value, after=True)}

    def _is_copy(self, expr: lang.Expr) -> bool:
        """Whether the value of an expression is that of a place, or a constant, or in bounds."""
        match expr:
            case lang.Literal() | lang.Variable() | lang.EventField():
                return True
            case lang.Call():
                return expr.type is not None
            case lang.CallFunction():
                return True
            case lang.Conditional(_, then, otherwise):
                return self._is_copy(then) and self._is_copy(otherwise)
            case lang.Element(array=array):
                return self._is_copy(array)
            case lang.Member(record=record):
                return self._is_copy(record)
            case lang.Apply(function, arguments) if function is not lang.Function.ABS:
                whole = all(isinstance(argument.type, lang.IntType) for argument in arguments)
                return whole and all(map(self._is_copy, arguments))
            case lang.Convert(operand):
                return _is_monotone(operand, expr.type) and self._is_copy(operand)
            case _:
                return False

    def _sources(self, expr: lang.Expr, at: _At) -> list[Place]:
        """Return the places whose value an expression has that is a copy; read all else in it."""
        match expr:
            case lang.Variable():
                return [at.place_of(expr)]
            case lang.CallFunction():
                self._parameters(expr, at)
                return [at.returned(expr.function.name)]
            case lang.EventField(name):
                return [
                    at.field(event, part)
                    for event in at.events
                    for part, field in enumerate(at.chart.events[event].fields)
                    if field.name == name
                ]
            case lang.Call(operation):
                self._arguments(expr, at)
                return [Place(at.machine, "result", operation)]
            case lang.Conditional(test, then, otherwise):
                self._evaluate(test, at)
                return self._sources(then, at) + self._sources(otherwise, at)
            case lang.Element(array, index):
                self._evaluate(index, at, "it is an index")
                return self._sources(array, at)
            case lang.Member(record=record):
                return self._sources(record, at)
            case lang.Apply(arguments=arguments):
                return [place for one in arguments for place in self._sources(one, at)]
            case lang.Convert(operand):
                found = self._sources(operand, at)
                inner, outer = range_of(operand), integer_bounds(expr.type)
                if inner is not None and outer is not None and not within(inner, outer):
                    for place in found:
                        self.cuts[place] |= {Cut(outer[0]), Cut(outer[1], after=True)}
                return found
            case _:
                return []

    # --- values --------------------------------------------------------------------------------

    def values(self, type_: lang.Type, ahead: _Ahead) -> Values:
        """Return the values to try of a type."""
        match type_:
            case lang.BoolType() | lang.EnumType() | lang.IntType() | lang.DurationType():
                found = _integers(*_limits(type_), ahead, self.enumerated)
                if isinstance(type_, lang.EnumType) and not type_.is_counted:
                    found = Values(tuple(sorted(type_.numbers)), found.kept)
                if isinstance(type_, lang.BoolType):
                    found = Values(tuple(map(bool, found.values)), found.kept)
                return found
            case lang.FloatType():
                return _floats(type_, ahead)
            case lang.SymbolType():
                # one that is kept may be compared with whatever the charts mention
                cut = {cut.at for cut in ahead.cuts if isinstance(cut.at, str)}
                named = cut | self.strings if ahead.kept is not None else cut
                return Values(("", *sorted(named - {""})), ahead.kept)
            case lang.ArrayType(element, length):
                return combined([self.values(element, ahead)] * length)
            case lang.RecordType(_, fields):
                return combined([self.values(field.type, ahead) for field in fields])
            case _:
                assert_never(type_)


def _all_of(chart: Chart) -> tuple[object, ...]:
    """Return the parts of a chart in which something is evaluated."""
    finalized = tuple(event.finalize for event in chart.events)
    return chart.states, chart.transitions, chart.script, finalized


def _is_cut(side: lang.Expr, other: lang.Expr) -> bool:
    """Whether a comparison is one with a constant, exactly."""
    if not isinstance(other, lang.Literal) or isinstance(other.value, tuple):
        return False
    found = range_of(side) if isinstance(other.value, float) else None
    return found is None or within(found, (-EXACT[64], EXACT[64]))


def _cuts(op: lang.BinaryOp, constant: bool | float | str) -> Iterator[Cut]:
    """Yield the cuts that a comparison with a constant makes."""
    if op in (lang.BinaryOp.LT, lang.BinaryOp.GE, lang.BinaryOp.EQ, lang.BinaryOp.NE):
        yield Cut(constant)
    if op in (lang.BinaryOp.LE, lang.BinaryOp.GT, lang.BinaryOp.EQ, lang.BinaryOp.NE):
        yield Cut(constant, after=True)


def _limits(
    type_: lang.BoolType | lang.EnumType | lang.IntType | lang.DurationType,
) -> tuple[int, int]:
    """Return the least and the greatest value of a type."""
    return (0, lang.LONGEST_DURATION) if isinstance(type_, lang.DurationType) else _ends(type_)


def _ends(type_: lang.BoolType | lang.EnumType | lang.IntType) -> tuple[int, int]:
    match type_:
        case lang.BoolType():
            return 0, 1
        case lang.EnumType():
            return type_.bounds
        case lang.IntType(lo, hi):
            return lo, hi
        case _:
            assert_never(type_)


def _few(expr: lang.Expr) -> Sequence[int] | None:
    """Return the values of an expression, if it has but few."""
    match expr.type:
        case lang.BoolType():
            return (0, 1)
        case lang.EnumType(numbers=numbers):
            return numbers
        case lang.IntType():
            found = range_of(expr)
            is_few = found is not None and found[1] - found[0] < ENUMERATED
            return range(found[0], found[1] + 1) if found is not None and is_few else None
        case _:
            return None


def _is_monotone(operand: lang.Expr, type_: lang.Type) -> bool:
    """Whether storing a value in a type changes it not, or brings it into bounds."""
    inner = range_of(operand)
    match operand.type, type_:
        case lang.IntType(), lang.IntType() if inner is not None:
            return within(inner, (type_.lo, type_.hi)) or type_.overflow is not lang.Overflow.WRAP
        case lang.IntType(), lang.FloatType(bits) if inner is not None:
            return within(inner, (-EXACT[bits], EXACT[bits]))
        case lang.FloatType(narrow), lang.FloatType(wide):
            return narrow <= wide
        case _:
            return operand.type == type_


def _integers(lo: int, hi: int, ahead: _Ahead, enumerated: int) -> Values:
    if ahead.kept is not None:
        if hi - lo < enumerated:
            return Values(tuple(range(lo, hi + 1)))
        near = {c for at, _ in _numbers(ahead) for c in (math.floor(at), math.ceil(at))}
        tried = {lo, hi, _start(lo, hi)} | {v for c in near for v in (c - 1, c, c + 1)}
        return Values(tuple(sorted(v for v in tried if lo <= v <= hi)), ahead.kept)
    known = sorted(v for v in {*_whole(ahead.known), _start(lo, hi)} if lo <= v <= hi)
    found = [
        next((value for value in known if begin <= value <= end), begin)
        for begin, end in _intervals(lo, hi, ahead)
    ]
    return Values(tuple(found))


def _intervals(lo: int, hi: int, ahead: _Ahead) -> list[tuple[int, int]]:
    """Return the intervals between the cuts of a place that is not kept."""
    firsts = {math.floor(at) + 1 if after else math.ceil(at) for at, after in _numbers(ahead)}
    begins = [lo, *sorted(first for first in firsts if lo < first <= hi)]
    ends = [*(begin - 1 for begin in begins[1:]), hi]
    return list(zip(begins, ends, strict=True))


def _numbers(ahead: _Ahead) -> list[tuple[float, bool]]:
    """Return the cuts at numbers."""
    return [
        (at, after) for at, after in ahead.cuts if not isinstance(at, str) and math.isfinite(at)
    ]


def _whole(values: Iterable[lang.Value]) -> Iterator[int]:
    """Yield the whole numbers among values, those in arrays too."""
    for value in values:
        if isinstance(value, tuple):
            yield from _whole(value)
        elif isinstance(value, int):
            yield int(value)


def _start(lo: int, hi: int) -> int:
    return min(max(0, lo), hi)


def _floats(type_: lang.FloatType, ahead: _Ahead) -> Values:
    found = {0.0}
    for at, _ in ahead.cuts:
        if not isinstance(at, str):
            found.update(_around(float(at), type_.bits))
    return Values(tuple(sorted(v for v in found if math.isfinite(v))), ahead.kept)


def _around(value: float, bits: int) -> tuple[float, ...]:
    """Return a value of a type, or the one nearest to it, and its neighbours in that type."""
    if bits == 64 or not math.isfinite(value):
        return value, math.nextafter(value, -math.inf), math.nextafter(value, math.inf)
    try:
        (near,) = struct.unpack("<f", struct.pack("<f", value))
    except OverflowError:
        return ()
    (number,) = struct.unpack("<i", struct.pack("<f", near))
    around = (number - 1, number, number + 1) if near else (-(1 << 31) + 1, 0, 1)
    numbers = (n for n in around if -(1 << 31) <= n < 1 << 31)
    return tuple(struct.unpack("<f", struct.pack("<i", n))[0] for n in numbers)
