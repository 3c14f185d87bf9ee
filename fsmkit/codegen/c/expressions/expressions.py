"""Expressions in C, with exactly the meaning of the typed tree and no undefined behaviour.

Each fragment knows the C type it has: ``int`` where every value fits in 16 bits (``uint16_t`` as it
is loaded), else int32_t, int64_t, uint32_t or uint64_t, ``double``, ``bool``. Wrapping arithmetic
is done unsigned. What can fail notes so in ``m->fsm.failed``; and since C leaves the order of
operands open where the language goes from left to right, operands with effects go through
temporaries.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from operator import attrgetter

import fsmkit.language as lang
from fsmkit.chart.analysis.effects import can_fail, has_effect, is_inside, needs_order
from fsmkit.chart.chart import Event
from fsmkit.codegen.c.expressions.fragments import (
    AND,
    ATOM,
    CHOICE,
    COMPARE,
    OR,
    PREFIX,
    SUM,
    Fragment,
    apart,
    floating,
)
from fsmkit.codegen.c.expressions.operators import Operators
from fsmkit.codegen.c.expressions.types import (
    UNSIGNED,
    computed,
    integer,
    interval,
    loaded,
    wrapping,
)
from fsmkit.codegen.c.storage import storage
from fsmkit.plan.values import bounding, known_outcome, lowered


class Printer(Operators, lang.Walk[Fragment]):
    """Prints the expressions of one block; collects the temporaries it needs.

    ``event``: the current event if only one is possible; ``many``: all possible ones.
    """

    def value(self, expr: lang.Expr, type_: lang.Type | None = None) -> str:
        """Return an expression as a value that can be stored in a variable of its type."""
        target = type_ if type_ is not None else expr.type
        assert target is not None  # noqa: S101
        fragment = self.fragment(lowered(expr))
        if isinstance(target, lang.ArrayType | lang.RecordType):
            return fragment.text
        stored = storage(target, self.names.records).text
        return self.cast(fragment, stored)

    def argument(self, expr: lang.Expr, type_: lang.Type) -> str:
        """Return an expression as the argument of a function."""
        if not isinstance(type_, lang.EnumType):
            return self.value(expr, type_)
        folded = lowered(expr)
        fragment = self.fragment(folded)
        if isinstance(folded, lang.Literal):
            return fragment.text
        return loaded(type_, fragment.at(PREFIX), self.names)

    def condition(self, expr: lang.Expr) -> str:
        """Return an expression as a condition."""
        return self.fragment(lowered(expr)).text

    # --- leaves ---------------------------------------------------------------------------

    def literal(self, expr: lang.Literal) -> Fragment:
        """Print a constant, by its macro if it is a named number."""
        found, macro = self.constant(expr.value, expr.type), self.names.constant(expr.name)
        return replace(found, name=macro) if macro and found.number is not None else found

    def variable(self, expr: lang.Variable | lang.Element | lang.Member) -> Fragment:
        """Print the value of a variable, of an element or of a field."""
        return self.loaded(self.place(expr), expr.type)

    element = member = variable

    def event_field(self, expr: lang.EventField) -> Fragment:
        """Print a field of the current event's payload."""
        return self.loaded(self._event_field(expr.name), expr.type)

    def event_name(self, expr: lang.EventName) -> Fragment:
        """Print the number of the current event's name, or of its type."""
        key = "type" if isinstance(expr, lang.EventType) else "name"
        return Fragment(self._of_event(attrgetter(key)), "int")

    def in_state(self, expr: lang.InState) -> Fragment:
        """Print a state test."""
        return self.names.in_state(self.machine, expr.state)

    def invalid(self, expr: lang.Invalid) -> Fragment:  # noqa: ARG002
        """Print the failure of an expression that cannot be evaluated."""
        return Fragment(f"fsm_fails({self.failure()})", "bool")

    def loaded(self, text: str, type_: lang.Type) -> Fragment:
        """Return a stored value in the type of computations."""
        if isinstance(type_, lang.BoolType):
            return Fragment(text, "bool")
        if isinstance(type_, lang.FloatType):
            return (
                Fragment(text, "double")
                if type_.bits == 64
                else Fragment(f"(double){text}", "double", PREFIX)
            )
        if isinstance(type_, lang.ArrayType | lang.RecordType):
            return Fragment(text, "struct")
        ctype = computed(interval(type_))
        assert ctype is not None  # noqa: S101
        stored = storage(type_, self.names.records).text
        if ctype == "int" and stored == "uint16_t":
            return Fragment(text, stored)  # an int of 16 bits would become unsigned beside it
        if ctype in ("int", stored):
            return Fragment(text, ctype)
        return Fragment(f"({ctype}){text}", ctype, PREFIX)

    def constant(self, value: lang.Value, type_: lang.Type) -> Fragment:
        """Return a constant of a type."""
        match type_:
            case lang.BoolType():
                return Fragment("true" if value else "false", "bool")
            case lang.FloatType():
                return Fragment(floating(float(value)), "double", PREFIX)  # type: ignore[arg-type]
            case lang.SymbolType():
                number = self.names.symbol(str(value))
                return Fragment(str(number), "int", number=number)
            case lang.EnumType(name):
                assert isinstance(value, int)  # noqa: S101
                place = type_.numbers.index(value)
                return Fragment(self.names.members[name][place], "int")
            case lang.ArrayType() | lang.RecordType():
                raise AssertionError(type_)
            case _:
                assert isinstance(value, int)  # noqa: S101
                ctype = computed(lang.IntType(value, value))
                assert ctype is not None  # noqa: S101
                text, binds = integer(value, ctype), ATOM if value >= 0 else PREFIX
                is_plain = ctype in ("int", "int32_t") and value != lang.INT32.lo
                return Fragment(text, ctype, binds, number=value if is_plain else None)

    def place(self, expr: lang.Expr) -> str:
        """Return a location as an lvalue."""
        match expr:
            case lang.Variable(name, storage=lang.Storage.LOCAL):
                return self.locals.get(name) or self.names.stand_in(name)
            case lang.Variable(name, storage=lang.Storage.INPUT) if (
                self.names.options.observes_reads
            ):
                number = self.names.input_number(name)
                return self.names.variable(name, f"FSM_HOOK_INPUT({self.machine}, {number})")
            case lang.Variable(name):
                return self.names.variable(name, self.machine)
            case lang.EventField(name):
                return self._event_field(name)
            case lang.Element(array, index):
                assert isinstance(array.type, lang.ArrayType)  # noqa: S101
                return f"{self.place(array)}[{self.index(index, array.type.length)}]"
            case lang.Member(record, name):
                return f"{self.place(record)}.{self.names.field(name)}"
            case _:
                raise AssertionError(expr)

    def index(self, index: lang.Expr, length: int) -> str:
        """Return an index, checked unless it is always within bounds."""
        fragment = self.fragment(index)
        if is_inside(index, length):
            return fragment.text
        return f"fsm_place({self.failure()}, {self.cast(fragment, 'int64_t')}, {length}u)"

    def _of_event(self, text: Callable[[Event], str]) -> str:
        """Return the number of a text of the current event, 0 if it has none."""
        chart = self.names.chart
        choice, machine = "0", self.machine
        for event in reversed(self.events or range(len(chart.events))):
            symbol = self.names.symbol(text(chart.events[event]))
            is_it = f"{machine}->fsm.event.event == {self.names.event(event)}"
            choice = f"{is_it} ? {symbol} : {choice}"
        return f"({choice})"

    def _event_field(self, name: str) -> str:
        current_event = f"{self.machine}->fsm.event"
        having = [
            e
            for e in (self.events or range(len(self.names.chart.events)))
            if any(part.name == name for part in self.names.chart.events[e].fields)
        ]
        texts = [
            f"{current_event}.of.{self.names.payloads[e]}.{self.names.field(name)}" for e in having
        ]
        if len(set(texts)) <= 1:
            return texts[0]
        # one of several events: their payloads may lie differently
        choice = texts[-1]
        for event, text in zip(having[-2::-1], texts[-2::-1], strict=True):
            is_it = f"{current_event}.event == {self.names.event(event)}"
            choice = f"{is_it} ? {text} : {choice}"
        return f"({choice})"

    # --- what is counted ------------------------------------------------------------------

    def watched(self, expr: lang.CoveredCondition | lang.CoveredGuard) -> Fragment:
        """Print a counted condition, or a counted guard."""
        own, failed = self.names.own, "NULL"
        if isinstance(expr, lang.CoveredCondition):
            inner = self.fragment(expr.operand).text
            return Fragment(f"fsm_{own}_note({inner}, {expr.bit}u)", "bool")
        if can_fail(expr.operand):
            failed = self.failure()
        if expr.noted:
            inner = self.fragment(expr.operand).text
            passed = f"{inner}, {failed}, {expr.counter}u, {expr.noted}u"
            return Fragment(f"fsm_{own}_decided_many({passed})", "bool")

        def end(value: str) -> Callable[[int], str]:
            def reached(path_sum: int) -> str:
                if failed != "NULL":
                    return f"fsm_{own}_went({failed}, {expr.counter + path_sum}u, {value})"
                return f"(fsm_{own}_counters[{expr.counter + path_sum}] = 1u, {value})"

            return reached

        return Fragment(self._through(expr.operand, 0, end("true"), end("false")), "bool")

    def _through(
        self,
        part: lang.Expr,
        path_sum: int,
        true: Callable[[int], str],
        false: Callable[[int], str],
    ) -> str:
        """Return a guard as a tree of its conditions, in which each path has its own end.

        ``true`` and ``false`` continue after the part, given the sum along the path.
        """
        match part:
            case lang.CoveredCondition(operand, added):
                test = self.fragment(operand).at(OR)
                return f"({test} ? {true(path_sum)} : {false(path_sum + added)})"
            case lang.Unary(lang.UnaryOp.NOT, operand):
                return self._through(operand, path_sum, false, true)
            case lang.Binary(lang.BinaryOp.AND, left, right):
                return self._through(
                    left, path_sum, lambda at: self._through(right, at, true, false), false
                )
            case lang.Binary(lang.BinaryOp.OR, left, right):
                return self._through(
                    left, path_sum, true, lambda at: self._through(right, at, true, false)
                )
            case _:
                raise AssertionError(part)

    # --- operators ------------------------------------------------------------------------

    def prefixed(self, expr: lang.Unary) -> Fragment:
        """Print an operator of one operand."""
        operand = self.fragment(expr.operand)
        if expr.op is lang.UnaryOp.NOT:
            return Fragment(f"!{operand.at(PREFIX)}", "bool", PREFIX)
        if isinstance(expr.type, lang.FloatType):
            return Fragment(f"-{apart(operand.at(PREFIX))}", "double", PREFIX)
        assert isinstance(expr.type, lang.IntType)  # noqa: S101
        if expr.type.overflow is lang.Overflow.WRAP:
            ctype = wrapping(expr.type)
            inner = self.as_type(operand, UNSIGNED[ctype])
            text = f"0u - {inner}" if expr.op is lang.UnaryOp.NEGATE else f"~{inner}"
            return self.recast(Fragment(text, UNSIGNED[ctype], SUM), ctype)
        ctype = self.common(expr.type, interval(expr.operand.type))
        return Fragment(f"{expr.op.value}{apart(self.as_type(operand, ctype))}", ctype, PREFIX)

    def infix(self, expr: lang.Binary) -> Fragment:
        """Print a binary operator; if its value is constant, only its operands are evaluated."""
        op, known = expr.op, known_outcome(expr)
        if op in (lang.BinaryOp.AND, lang.BinaryOp.OR):
            if known is not None:
                return self.constant(known, lang.BOOL)
            left, right = self.fragment(expr.left), self.fragment(expr.right)
            if op is lang.BinaryOp.AND and self._is_excluded(expr.right, expr.left):
                right = self.constant(value=False, type_=lang.BOOL)
            binds = AND if op is lang.BinaryOp.AND else OR
            # -Wparentheses wants mixed && and || bracketed
            at = COMPARE
            return Fragment(f"{left.at(at)} {op.value} {right.at(at)}", "bool", binds)
        if known is not None:  # compilers warn of such a comparison; its operands may report errors
            sides = (e for e in (expr.left, expr.right) if can_fail(e) or has_effect(e))
            evaluated = [f"(void){self.fragment(side).at(PREFIX)}" for side in sides]
            parts = ", ".join([*evaluated, self.constant(known, lang.BOOL).text])
            return Fragment(f"({parts})" if evaluated else parts, "bool")
        before, left, right = self._pair(expr.left, expr.right)
        result = self.operator(expr, left, right)
        if before:
            return Fragment(f"({before}, {result.text})", result.ctype)
        return result

    def _is_excluded(self, test: lang.Expr, by: lang.Expr) -> bool:
        """Whether ``test`` is `In` of a state that cannot be active where ``by`` holds."""
        match test, by:
            case lang.InState(a), lang.InState(b):
                if a in self.names.varied or b in self.names.varied:
                    return False
                return self.names.plan.are_exclusive(a, b)
            case lang.InState(), lang.Binary(lang.BinaryOp.AND, left, right):
                return self._is_excluded(test, left) or self._is_excluded(test, right)
            case _:
                return False

    def _pair(self, left: lang.Expr, right: lang.Expr) -> tuple[str, Fragment, Fragment]:
        """Print two operands; through temporaries if their order of evaluation matters."""
        first, second = self.fragment(left), self.fragment(right)
        if not needs_order(left, right):
            return "", first, second
        one = self.temporary(first)
        return f"{one.text} = {first.text}", one, second

    def conditional(self, expr: lang.Conditional) -> Fragment:
        """Print a choice of two values, both of one C type."""
        test, then, otherwise = map(self.fragment, (expr.test, expr.then, expr.otherwise))
        if isinstance(expr.type, lang.FloatType):
            ctype, a, b = "double", then.at(PREFIX), otherwise.at(PREFIX)
        elif isinstance(expr.type, lang.BoolType | lang.ArrayType | lang.RecordType):
            ctype = then.ctype
            a, b = then.at(OR), otherwise.at(OR)
        else:
            ctype = self.common(*(interval(e.type) for e in (expr, expr.then, expr.otherwise)))
            a, b = self.as_type(then, ctype), self.as_type(otherwise, ctype)
        return Fragment(f"{test.at(OR)} ? {a} : {b}", ctype, CHOICE)

    def apply(self, expr: lang.Apply) -> Fragment:
        """Print ``min``, ``max`` or ``abs``, each operand evaluated once."""
        fragments = [self.fragment(argument) for argument in expr.arguments]
        if isinstance(expr.type, lang.FloatType):
            ctype = "double"
            texts = [fragment.at(PREFIX) for fragment in fragments]
        else:
            ctype = self.common(
                interval(expr.type), *(interval(argument.type) for argument in expr.arguments)
            )
            texts = [self.as_type(fragment, ctype) for fragment in fragments]
        steps = []
        current = self.temporary(Fragment("", ctype))
        steps.append(f"{current.text} = {texts[0]}")
        for text in texts[1:]:
            other = self.temporary(Fragment("", ctype))
            steps.append(f"{other.text} = {text}")
            sign = "<" if expr.function is lang.Function.MIN else ">"
            keep = f"{other.text} {sign} {current.text} ? {other.text} : {current.text}"
            steps.append(f"{current.text} = {keep}")
        if expr.function is lang.Function.ABS:
            wraps = isinstance(expr.type, lang.IntType) and expr.type.overflow is lang.Overflow.WRAP
            negated = f"-{current.text}"
            if wraps and ctype in UNSIGNED:
                negated = f"({ctype})(0u - ({UNSIGNED[ctype]}){current.text})"
            steps.append(f"{current.text} < 0 ? {negated} : {current.text}")
        else:
            steps.append(current.text)
        return Fragment(f"({', '.join(steps)})", ctype)

    def call(self, expr: lang.Call) -> Fragment:
        """Print a call of an operation."""
        operation = self.names.operation(expr.operation)
        before, texts = self.arguments(
            expr.arguments, tuple(field.type for field in operation.parameters)
        )
        self.names.used.add("call " + expr.operation)
        if not self.is_sound:
            self.names.used.add("guarded " + expr.operation)
        verb = "" if self.is_sound else "call_"
        text = self.names.calling(verb, expr.operation, texts, self.machine)
        loaded = self.loaded(text, expr.type) if expr.type is not None else Fragment(text, "void")
        if before:
            return Fragment(f"({', '.join((*before, loaded.text))})", loaded.ctype)
        return loaded

    def call_function(self, expr: lang.CallFunction) -> Fragment:
        """Print a call of a function of the chart: values are passed as they are stored."""
        names, types = self.names, [p.type for p in expr.function.parameters]
        arguments = expr.arguments
        texts = [self.value(e, t) for e, t in zip(arguments, types, strict=True)]
        before = []
        if any(needs_order(a, b) for i, a in enumerate(arguments) for b in arguments[i + 1 :]):
            for place, type_ in enumerate(types):
                if not isinstance(type_, lang.ArrayType | lang.RecordType):
                    one = self.temporary(Fragment("", storage(type_, names.records).text))
                    before.append(f"{one.text} = {texts[place]}")
                    texts[place] = one.text
        call = names.computing(expr.function, texts, self.machine)
        loaded = self.loaded(call, expr.type)
        if before:
            return Fragment(f"({', '.join((*before, loaded.text))})", loaded.ctype)
        return loaded

    def checked(self, expr: lang.Checked) -> Fragment:
        """Print a number as a value of a type, with the failure outside of its range."""
        fragment = self.fragment(expr.operand)
        if not isinstance(expr.type, lang.EnumType):
            call = f"fsm_integer({self.failure()}, {self.as_double(fragment)})"
            return Fragment(call, "int64_t")
        type_ = expr.type
        ctype = computed(interval(type_)) or "int64_t"
        number = self.temporary(Fragment("", fragment.ctype))
        known = interval(expr.operand.type)
        if type_.bounds[1] - type_.bounds[0] + 1 == len(type_.numbers):
            lo, hi = type_.bounds
            tests = [f"{number.text} >= {self._written(lo, number)}"] if known.lo < lo else []
            tests += [f"{number.text} <= {self._written(hi, number)}"] if known.hi > hi else []
            test = " && ".join(tests)
        else:
            members = [n for n in type_.numbers if n in known]
            test = " || ".join(f"{number.text} == {self._written(n, number)}" for n in members)
            test = test or "false"
        found = self.cast(number, ctype)
        if expr.otherwise is not None:
            other = self.fragment(expr.otherwise).text
        else:
            failed = f"(void)fsm_fails({self.failure()})"
            first = self.fragment(lang.Literal(type_.numbers[0], type_, expr.span)).text
            other = f"({failed}, {first})"
        if not test:
            return Fragment(f"({number.text} = {fragment.text}, {found})", ctype)
        text = f"{number.text} = {fragment.text}, {test} ? {found} : ({ctype}){other}"
        return Fragment(f"({text})", ctype)

    def _written(self, value: int, beside: Fragment) -> str:
        """Return a number in the type of the temporary that it is compared with."""
        if beside.ctype in ("int", "int32_t", "int64_t", "uint32_t", "uint64_t"):
            return integer(value, beside.ctype)
        return f"{value}u" if beside.ctype.startswith("u") and value >= 0 else str(value)

    def arguments(
        self, arguments: tuple[lang.Expr, ...], types: tuple[lang.Type, ...]
    ) -> tuple[list[str], list[str]]:
        """Print the statements that parameters need; return the arguments."""
        pairs = list(zip(arguments, types, strict=True))
        if not any(needs_order(a, b) for i, a in enumerate(arguments) for b in arguments[i + 1 :]):
            return [], [self.argument(e, t) for e, t in pairs]
        pieces = [self.value(e, t) for e, t in pairs]
        before, texts = [], []
        for text, type_ in zip(pieces, types, strict=True):
            if isinstance(type_, lang.ArrayType | lang.RecordType):
                texts.append(text)
                continue
            place = self.temporary(Fragment("", storage(type_, self.names.records).text))
            before.append(f"{place.text} = {text}")
            texts.append(loaded(type_, place.text, self.names))
        return before, texts

    def convert(self, expr: lang.Convert) -> Fragment:
        """Print a value converted to a type."""
        fragment, how = self.fragment(expr.operand), bounding(expr)
        if isinstance(expr.type, lang.FloatType):
            single = "(double)(float)" if expr.type.bits == 32 else ""
            return Fragment(f"{single}{self.as_double(fragment)}", "double", PREFIX)
        return fragment if how is None else self.bounded(fragment, how)


def literal_initializer(value: lang.Value, type_: lang.Type, printer: Printer) -> str:
    """Return a start value, for arrays and records with braces."""
    match type_:
        case lang.ArrayType(element):
            assert isinstance(value, tuple)  # noqa: S101
            return f"{{{', '.join(literal_initializer(v, element, printer) for v in value)}}}"
        case lang.RecordType(_, fields):
            assert isinstance(value, tuple)  # noqa: S101
            texts = (
                literal_initializer(v, part.type, printer)
                for v, part in zip(value, fields, strict=True)
            )
            return f"{{{', '.join(texts)}}}"
        case _:
            fragment = printer.constant(value, type_)
            return printer.cast(fragment, storage(type_, printer.names.records).text)
