"""The names in a body that is that of several copies: what differs is computed from ``copy``.

A printer that is given these names (its ``under``) prints the tree of the first copy; each name or
number in which the copies differ (`small.differences`) is an expression of the number of the copy.
Numbers in equal distances are a sum, others a table; data are reached by the index of the copy or
by a function that returns their address; functions of the host by one that calls that of the copy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy as copy_of

from fsmkit.codegen.c.copies import Step, member_path
from fsmkit.codegen.c.expressions.fragments import AND, Fragment
from fsmkit.codegen.c.expressions.types import parameter_type
from fsmkit.codegen.c.header import parameters
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.layout import narrowest
from fsmkit.codegen.c.names import NARROW, Names
from fsmkit.codegen.c.small.differences import Differences, Leaf, NotMergeable, Values
from fsmkit.codegen.c.storage import storage
from fsmkit.emit.identifiers import legal
from fsmkit.language import ArrayType, FunctionBody

COPY = "copy"
"""The variable with the number of a copy in a body that several copies share."""
Defined = dict[tuple[object, ...], str]
"""Names of the functions and tables that bodies share, by what they are for."""


class CopyNames(Names):
    """Names that are computed from the number of the copy."""

    copy_argument = f", {COPY}"
    copy_parameter = f", uint8_t {COPY}"

    @classmethod
    def create(cls, names: Names, found: Differences, out: Unit, defined: Defined) -> CopyNames:
        """Return the names for a body; functions and tables that it needs go to ``out``."""
        base = copy_of(names)
        own = cls.__new__(cls)
        own.__dict__.update(base.__dict__)
        own.base, own.out, own.defined = names, out, defined
        own.varying, own.of_numbers = found.varying, found.numbers
        own.varied = frozenset(key for leaf, key in own.varying if leaf is Leaf.STATE)  # type: ignore[misc]
        own.reads, own.cost = False, 0
        return own

    base: Names
    out: Unit
    defined: Defined
    varying: Mapping[tuple[Leaf, object], Values]
    of_numbers: Mapping[str, Values]
    reads: bool
    """Whether any printed text depends on the copy."""
    cost: int
    """Calls and cases that the body of a single copy does not have."""

    # --- numbers --------------------------------------------------------------------------

    def event(self, index: int) -> str:
        """Return the number of the event of the copy."""
        values = self._varying(Leaf.EVENT, index)
        if values is None:
            return self.base.event(index)
        return self._number([event + 1 for event in values], self.events[index])

    def event_constant(self, index: int) -> str:
        """Return the event of the copy as what hosts call it."""
        text = self.event(index)
        is_fixed = (Leaf.EVENT, index) not in self.varying
        return text if is_fixed else f"({self.own}_event_name){text}"

    def timer(self, transition: int) -> str:
        """Return the number of the timer of the copy."""
        values = self._varying(Leaf.TIMER, transition)
        if values is None:
            return self.base.timer(transition)
        return self._number(values, self.timers[transition])

    def marked(self, name: str | None) -> str:
        """Return the number of the id of a delayed send of the copy."""
        values = self._varying(Leaf.MARK, name)
        if values is None:
            return self.base.marked(name)
        return self._number([self.mark(each) for each in values])

    def stand_in(self, name: str) -> str:
        """Return an integer that differs between the copies."""
        self.reads = True
        return self._number(self.of_numbers[name])

    def in_state(self, machine: str, state: int) -> Fragment:
        """Return the test whether the state of the copy is active."""
        values = self._varying(Leaf.STATE, state)
        if values is None:
            return self.base.in_state(machine, state)
        plan = self.plan
        regions = [plan.region_of[each] for each in values]
        variable = f"{machine}->{self.regions[regions[0]]}"
        if len(set(regions)) > 1:
            variable = f"*{self.own}_region_at({machine}, {self._number(regions)})"
        ends = [plan.last_below[each] for each in values]
        inside = [plan.regions[region].states for region in regions]
        first = self._number(values, self.states[state])
        if all(end == each for end, each in zip(ends, values, strict=True)):
            test = f"{variable} == {first}"
        elif all(end == states[-1] for end, states in zip(ends, inside, strict=True)):
            test = f"{variable} >= {first}"
        else:
            last = self._number(ends, self.states[ends[0]])
            test = f"{variable} >= {first} && {variable} <= {last}"
        return Fragment(test, "bool", AND)

    def taken_by(self, transition: int, number: Callable[[int], int]) -> str:
        """Return the number by which the transition of the copy is taken."""
        values = self._varying(Leaf.TAKEN, transition)
        if values is None:
            return f"{number(transition)}u"
        return self._number([number(each) for each in values])

    def _varying(self, leaf: Leaf, key: object) -> Values | None:
        values = self.varying.get((leaf, key))
        self.reads |= values is not None
        return values

    def _number(self, values: Sequence[int], first: str = "") -> str:
        """Return a number of each copy; ``first``: the constant for that of the first."""
        step = values[1] - values[0]
        most = max(values)
        if step > 0 and all(value == values[0] + n * step for n, value in enumerate(values)):
            text = _sum(step, first or (f"{values[0]}u" if values[0] else ""))
            ctype = "uint8_t" if most <= NARROW else "uint16_t" if most < 1 << 16 else "uint32_t"
            return COPY if text == COPY else f"({ctype})({text})"
        key = ("numbers", *values)
        if key not in self.defined:
            name = self.defined[key] = f"{self.own}_numbers_{len(self.defined)}"
            self.out.define(name)
            items = ", ".join(f"{value}u" for value in values)
            self.out.line(f"static const {narrowest(most)} {name}[{len(values)}] = {{{items}}};")
            self.out.line()
            self.out.define()
        return f"{self.defined[key]}[{COPY}]"

    # --- data -----------------------------------------------------------------------------

    def input_number(self, name: str) -> str:
        """Return the number of the input of the copy."""
        values = self._varying(Leaf.VARIABLE, name)
        if values is None:
            return self.base.input_number(name)
        inputs = [declared.name for declared in self.chart.inputs]
        return self._number([inputs.index(each) for each in values])

    def variable(self, name: str, machine: str) -> str:
        """Return the variable of the copy as an lvalue."""
        values = self._varying(Leaf.VARIABLE, name)
        if values is None:
            return self.base.variable(name, machine)
        paths = [
            () if self.structs is None else self.structs.paths.get(each, ()) for each in values
        ]
        length = len(paths[0])
        if not all(paths) or any(len(path) != length for path in paths):
            return self._alone(values, machine)
        apart = [n for n in range(length) if any(path[n] != paths[0][n] for path in paths)]
        index = _index([path[apart[-1]] for path in paths])
        before, behind = paths[0][: apart[-1]], member_path(paths[0][apart[-1] + 1 :])
        if len(apart) == 1 and index is not None:
            return f"{machine}->{member_path(before)}.{index}.{behind}"
        assert self.structs is not None  # noqa: S101  (it has their paths)
        heads = [path[: apart[-1] + 1] for path in paths]
        types = {self.structs.struct_at(path) for path in heads}
        if len(types) > 1 or None in types:
            return self._alone(values, machine)
        found = self._address(f"{types.pop()} *", paths[0][0][0], list(map(member_path, heads)))
        return f"{found}({machine}, {COPY})->{behind}"

    def _alone(self, names: Values, machine: str) -> str:
        """Return a variable that is not at an index of the copy."""
        chart = self.chart
        declared = {d.name: d for d in (*chart.data, *chart.inputs, *chart.outputs)}
        type_ = declared[names[0]].type
        ctype = storage(type_, self.records).text
        places = [self.variables[name] for name in names]
        if not isinstance(type_, ArrayType):
            return f"(*{self._address(f'{ctype} *', 'value', places)}({machine}, {COPY}))"
        if isinstance(type_.element, ArrayType):
            raise NotMergeable
        places = [f"{place}[0]" for place in places]
        return f"{self._address(f'{ctype} *', 'value', places)}({machine}, {COPY})"

    def _address(self, ctype: str, what: str, places: Sequence[str]) -> str:
        """Return the function that returns the address of an item of each copy."""
        self.cost += 1
        head = f"static {ctype}{{name}}({self.own} *m, uint8_t {COPY})"
        lines = [f"return &m->{place};" for place in places]
        return self._function(f"{what}_at", head, lines)

    # --- functions ------------------------------------------------------------------------

    def sending(self, event: int, arguments: Sequence[str]) -> str:
        """Return the call by which the host delivers the event of the copy."""
        values = self._varying(Leaf.SENT, event)
        if values is None:
            return self.base.sending(event, arguments)
        fields = self.chart.events[event].fields
        passed = [self.field(part.name) for part in fields]
        calls = [self.base.sending(each, passed) for each in values]
        return self._dispatched("send_at", "void", parameters(fields, self), calls, "m", arguments)

    def calling(self, verb: str, operation: str, arguments: Sequence[str], machine: str) -> str:
        """Return the call of the operation of the copy."""
        values = self._varying(Leaf.OPERATION, operation)
        if values is None:
            return self.base.calling(verb, operation, arguments, machine)
        declared = [self.operation(each) for each in values]
        shapes = [([p.type for p in o.parameters], o.result) for o in declared]
        if any(shape != shapes[0] for shape in shapes):
            raise NotMergeable
        fields, result = declared[0].parameters, declared[0].result
        passed = [self.field(part.name) for part in fields]
        calls = [self.base.calling(verb, each, passed, "m") for each in values]
        ctype = "void" if result is None else parameter_type(result, self)
        taken = parameters(fields, self)
        return self._dispatched(f"{verb or 'do_'}at", ctype, taken, calls, machine, arguments)

    def computing(self, function: FunctionBody, arguments: Sequence[str], machine: str) -> str:
        """Return the call of the function of the copy."""
        values = self._varying(Leaf.FUNCTION, function.name)
        if values is None:
            return self.base.computing(function, arguments, machine)
        names, taken = [], ""
        for number, part in enumerate(function.parameters):
            names.append(f"of_{number}_{legal(part.name)}")
            ctype = storage(part.type, self.records).text
            star = "*" if isinstance(part.type, ArrayType) else ""
            taken += f", {'const ' if star else ''}{ctype} {star}{names[-1]}"
        known = {each.name: each for each in self.chart.functions}
        calls = [self.base.computing(known[each], names, "m") for each in values]
        result = storage(function.result, self.records).text
        return self._dispatched("fn_at", result, taken, calls, machine, arguments)

    def _dispatched(
        self,
        what: str,
        result: str,
        taken: str,
        calls: Iterable[str],
        machine: str,
        arguments: Sequence[str],
    ) -> str:
        """Return the call of the function that dispatches to the call of the copy."""
        head = f"static {result} {{name}}({self.own} *m, uint8_t {COPY}{taken})"
        lines = [f"{call};" if result == "void" else f"return {call};" for call in calls]
        name = self._function(what, head, lines, is_returning=result != "void")
        return f"{name}({', '.join((machine, COPY, *arguments))})"

    def _function(
        self, what: str, head: str, lines: Sequence[str], *, is_returning: bool = True
    ) -> str:
        """Return the name of a function with one case for each copy."""
        key = (head, *lines)
        if key not in self.defined:
            self.cost += len(lines)
            name = self.defined[key] = f"{self.own}_{what}_{len(self.defined)}"
            self.out.define(name)
            self.out.line(head.format(name=name))
            with self.out.block("{"):
                self.out.lines(_switch(lines, is_returning=is_returning))
            self.out.line()
            self.out.define()
        return self.defined[key]

    def of_text(self, text: str, line: Callable[[str], str]) -> list[str]:
        """Return the statement that sends the string of the copy to a trace."""
        values = self._varying(Leaf.TEXT, text)
        if values is None:
            return self.base.of_text(text, line)
        return [*_switch([line(each) for each in values], is_returning=False)]


def _index(steps: Sequence[Step]) -> str | None:
    """Return an array with the index of the copy, or None if the steps have no such form."""
    indexes = [index for _, index in steps if index is not None]
    if len(indexes) < len(steps) or len({name for name, _ in steps}) > 1:
        return None
    step = indexes[1] - indexes[0]
    if step <= 0 or any(each != indexes[0] + n * step for n, each in enumerate(indexes)):
        return None
    return f"{steps[0][0]}[{_sum(step, f'{indexes[0]}u' if indexes[0] else '')}]"


def _sum(step: int, first: str) -> str:
    text = COPY if step == 1 else f"{step}u * {COPY}"
    return f"{first} + {text}" if first else text


def _switch(lines: Sequence[str], *, is_returning: bool) -> list[str]:
    """Return a switch with the statement of each copy."""
    found = [f"switch ({COPY}) {{"]
    for number, line in enumerate(lines):
        found.append("    default:" if number == len(lines) - 1 else f"    case {number}u:")
        found += [f"        {line}", *([] if is_returning else ["        break;"])]
    return [*found, "}"]
