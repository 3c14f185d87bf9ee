"""Expressions in C, with exactly the meaning of the typed tree and no undefined behaviour.

Each fragment knows the C type it has: ``int`` where every value fits in 16 bits, else int32_t,
int64_t, uint32_t or uint64_t, ``double``, ``bool``. Wrapping arithmetic is done unsigned. What can
fail notes so in ``m->failed``; and since C leaves the order of operands open where the language
goes from left to right, operands with effects go through temporaries.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from fsmkit.codegen.c.constancy import joint_outcome, outcome
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.types import (
    COMPUTED,
    SUFFIX,
    UNSIGNED,
    computed,
    integer,
    interval,
    storage,
    wrapping,
)
from fsmkit.expressions import (
    BOOL,
    LONGEST_DURATION,
    Apply,
    ArrayType,
    Binary,
    BinaryOp,
    BoolType,
    Call,
    Conditional,
    Convert,
    DurationType,
    Element,
    EnumType,
    EventField,
    EventName,
    Expr,
    FloatType,
    Function,
    InState,
    IntType,
    Invalid,
    Literal,
    Member,
    Overflow,
    RecordType,
    SymbolType,
    Type,
    Unary,
    UnaryOp,
    Value,
    Variable,
    fold,
)

CHOICE, OR, AND, BITS, COMPARE, SHIFT, SUM, PRODUCT, PREFIX, ATOM = range(1, 11)
COMPARISONS = ("==", "!=", "<", "<=", ">", ">=")
LEVEL = {"+": SUM, "-": SUM, "*": PRODUCT, "/": PRODUCT, "%": PRODUCT}


@dataclass(frozen=True, slots=True)
class Fragment:
    """Printed text, how tightly it binds, its C type."""

    text: str
    ctype: str
    binds: int = ATOM

    def at(self, binds: int) -> str:
        """Return the text, in parentheses unless it binds that tightly."""
        return self.text if self.binds >= binds else f"({self.text})"


@dataclass
class Printer:
    """Prints the expressions of one block; collects the temporaries it needs.

    ``event``: the event at hand if there is just one it can be; ``many``: those it can be.
    """

    names: Names
    events: tuple[int, ...] = ()
    temporaries: list[tuple[str, str]] = field(default_factory=list)

    def value(self, expr: Expr, type_: Type | None = None) -> str:
        """Return an expression ready to be stored in a variable of its type."""
        target = type_ if type_ is not None else expr.type
        assert target is not None  # noqa: S101
        fragment = self.fragment(fold(expr))
        if isinstance(target, ArrayType | RecordType):
            return fragment.text
        stored = storage(target, self.names.records).text
        return self.cast(fragment, stored)

    def condition(self, expr: Expr) -> str:
        """Return an expression as a condition."""
        return self.fragment(fold(expr)).text

    def cast(self, fragment: Fragment, ctype: str) -> str:
        """Return a fragment as another C type; values are known to fit."""
        if fragment.ctype == ctype or ctype == "bool":
            return fragment.text
        if fragment.text.lstrip("-").isdigit() and ctype != "double":
            value = int(fragment.text)
            if ctype in COMPUTED:
                return integer(value, ctype)
            return fragment.text + ("u" if ctype.startswith("u") else "")
        return f"({ctype}){fragment.at(PREFIX)}"

    def fragment(self, expr: Expr) -> Fragment:
        """Return an expression as text that can stand inside more text."""
        match expr:
            case Literal(value):
                return self.literal(value, expr.type)
            case Variable(name, type_):
                return self.loaded(f"m->{self.names.variables[name]}", type_)
            case EventField(name, type_):
                return self.loaded(self._event_field(name), type_)
            case EventName():
                return Fragment(self._event_name(), "int")
            case InState(state):
                return Fragment(self.names.in_state("m", state), "bool", AND)
            case Unary():
                return self._unary(expr)
            case Binary():
                return self._binary(expr)
            case Conditional():
                return self._conditional(expr)
            case Element(_, _, type_):
                return self.loaded(self.place(expr), type_)
            case Member(_, _, type_):
                return self.loaded(self.place(expr), type_)
            case Apply():
                return self._apply(expr)
            case Call():
                return self._call(expr)
            case Convert(operand, type_):
                return self._convert(operand, type_)
            case Invalid():
                return Fragment("fsm_fails(&m->failed)", "bool")
            case _:
                raise AssertionError(expr)

    # --- leaves ---------------------------------------------------------------------------

    def loaded(self, text: str, type_: Type) -> Fragment:
        """Return a stored value as one to compute with."""
        if isinstance(type_, BoolType):
            return Fragment(text, "bool")
        if isinstance(type_, FloatType):
            return (
                Fragment(text, "double")
                if type_.bits == 64
                else Fragment(f"(double){text}", "double", PREFIX)
            )
        if isinstance(type_, ArrayType | RecordType):
            return Fragment(text, "struct")
        ctype = computed(interval(type_))
        assert ctype is not None  # noqa: S101
        if ctype in ("int", storage(type_, self.names.records).text):
            return Fragment(text, ctype)
        return Fragment(f"({ctype}){text}", ctype, PREFIX)

    def literal(self, value: Value, type_: Type) -> Fragment:
        """Spell a constant."""
        match type_:
            case BoolType():
                return Fragment("true" if value else "false", "bool")
            case FloatType():
                return Fragment(floating(float(value)), "double", PREFIX)  # type: ignore[arg-type]
            case SymbolType():
                return Fragment(str(self.names.symbol(str(value))), "int")
            case EnumType(name, _):
                assert isinstance(value, int)  # noqa: S101
                return Fragment(self.names.members[name][value], "int")
            case ArrayType() | RecordType():
                raise AssertionError(type_)
            case _:
                assert isinstance(value, int)  # noqa: S101
                ctype = computed(IntType(value, value))
                assert ctype is not None  # noqa: S101
                return Fragment(integer(value, ctype), ctype, ATOM if value >= 0 else PREFIX)

    def place(self, expr: Expr) -> str:
        """Return a location as an lvalue."""
        match expr:
            case Variable(name):
                return f"m->{self.names.variables[name]}"
            case EventField(name):
                return self._event_field(name)
            case Element(array, index):
                assert isinstance(array.type, ArrayType)  # noqa: S101
                return f"{self.place(array)}[{self.index(index, array.type.length)}]"
            case Member(record, name):
                return f"{self.place(record)}.{self.names.field(name)}"
            case _:
                raise AssertionError(expr)

    def index(self, index: Expr, length: int) -> str:
        """Return an index, checked unless it cannot be outside."""
        fragment = self.fragment(index)
        if interval(index.type).lo >= 0 and interval(index.type).hi < length:
            return fragment.text
        return f"fsm_place(&m->failed, {self.cast(fragment, 'int64_t')}, {length}u)"

    def _event_name(self) -> str:
        """Return the number of the name of the event at hand, 0 where there is none."""
        chart = self.names.chart
        choice = "0"
        for event in reversed(self.events or range(len(chart.events))):
            symbol = self.names.symbol(chart.events[event].name)
            choice = f"m->event.event == {self.names.events[event]} ? {symbol} : {choice}"
        return f"({choice})"

    def _event_field(self, name: str) -> str:
        having = [
            e
            for e in (self.events or range(len(self.names.chart.events)))
            if any(part.name == name for part in self.names.chart.events[e].fields)
        ]
        texts = [f"m->event.of.{self.names.payloads[e]}.{self.names.field(name)}" for e in having]
        if len(set(texts)) <= 1:
            return texts[0]
        # one of several events: their payloads may lie differently
        choice = texts[-1]
        for event, text in zip(having[-2::-1], texts[-2::-1], strict=True):
            choice = f"m->event.event == {self.names.events[event]} ? {text} : {choice}"
        return f"({choice})"

    # --- operators ------------------------------------------------------------------------

    def _unary(self, expr: Unary) -> Fragment:
        operand = self.fragment(expr.operand)
        if expr.op is UnaryOp.NOT:
            return Fragment(f"!{operand.at(PREFIX)}", "bool", PREFIX)
        if isinstance(expr.type, FloatType):
            return Fragment(f"-{_apart(self._double(operand))}", "double", PREFIX)
        assert isinstance(expr.type, IntType)  # noqa: S101
        if expr.type.overflow is Overflow.WRAP:
            ctype = wrapping(expr.type)
            unsigned = UNSIGNED[ctype]
            inner = self._as(operand, unsigned)
            text = f"0u - {inner}" if expr.op is UnaryOp.NEGATE else f"~{inner}"
            return self._reduced(Fragment(text, unsigned, SUM), ctype)
        ctype = self._common(expr.type, interval(expr.operand.type))
        sign = "-" if expr.op is UnaryOp.NEGATE else "~"
        return Fragment(f"{sign}{_apart(self._as(operand, ctype))}", ctype, PREFIX)

    def _binary(self, expr: Binary) -> Fragment:
        op = expr.op
        if op in (BinaryOp.AND, BinaryOp.OR):
            known = joint_outcome(expr)
            if known is not None:
                return self.literal(known, BOOL)
            left, right = self.fragment(expr.left), self.fragment(expr.right)
            if op is BinaryOp.AND and self._is_excluded(expr.right, expr.left):
                right = self.literal(value=False, type_=BOOL)
            binds = AND if op is BinaryOp.AND else OR
            # -Wparentheses wants mixed && and || bracketed
            at = COMPARE
            return Fragment(f"{left.at(at)} {op.value} {right.at(at)}", "bool", binds)
        known = outcome(expr)
        if known is not None and not has_effect(expr) and not can_fail(expr):
            return self.literal(known, BOOL)
        before, left, right = self._pair(expr.left, expr.right)
        result = self._operator(expr, left, right)
        if before:
            return Fragment(f"({before}, {result.text})", result.ctype)
        return result

    def _is_excluded(self, test: Expr, by: Expr) -> bool:
        """Whether ``test`` is `In` of a state that cannot be active where ``by`` holds."""
        match test, by:
            case InState(a), InState(b):
                plan = self.names.plan
                related = a == b or plan.chart.is_descendant(a, b) or plan.chart.is_descendant(b, a)
                return plan.region_of[a] == plan.region_of[b] and not related
            case InState(), Binary(BinaryOp.AND, left, right):
                return self._is_excluded(test, left) or self._is_excluded(test, right)
            case _:
                return False

    def _pair(self, left: Expr, right: Expr) -> tuple[str, Fragment, Fragment]:
        """Print two operands; through temporaries if the order in which they happen matters."""
        first, second = self.fragment(left), self.fragment(right)
        if not needs_order(left, right):
            return "", first, second
        one = self.temporary(first)
        return f"{one.text} = {first.text}", one, second

    def temporary(self, fragment: Fragment) -> Fragment:
        """Return a new variable of the type of a fragment."""
        name = f"t{len(self.temporaries)}"
        self.temporaries.append((fragment.ctype, name))
        return Fragment(name, fragment.ctype)

    def _operator(self, expr: Binary, left: Fragment, right: Fragment) -> Fragment:
        op = expr.op.value
        if isinstance(expr.type, FloatType) or (
            op in COMPARISONS
            and (isinstance(expr.left.type, FloatType) or isinstance(expr.right.type, FloatType))
        ):
            a, b = self._double(left), self._double(right)
            if op in COMPARISONS:
                return Fragment(f"{a} {op} {b}", "bool", COMPARE)
            return Fragment(f"{a} {op} {b}", "double", LEVEL[op])
        if op in COMPARISONS:
            return self._compare(expr, left, right)
        assert isinstance(expr.type, IntType)  # noqa: S101
        if expr.type.overflow is Overflow.WRAP:
            return self._wrapping(expr, left, right, expr.type)
        return self._exact(expr, left, right, expr.type)

    def _compare(self, expr: Binary, left: Fragment, right: Fragment) -> Fragment:
        if isinstance(expr.left.type, BoolType):
            return Fragment(f"{left.at(SHIFT)} {expr.op.value} {right.at(SHIFT)}", "bool", COMPARE)
        spans = interval(expr.left.type), interval(expr.right.type)
        if computed(*spans) is None:
            return self._compare_widest(expr.op, left, right)
        ctype = self._common(*spans)
        a, b = self._as(left, ctype, SHIFT), self._as(right, ctype, SHIFT)
        return Fragment(f"{a} {expr.op.value} {b}", "bool", COMPARE)

    def _compare_widest(self, op: BinaryOp, left: Fragment, right: Fragment) -> Fragment:
        """Compare a uint64_t with what may be negative: by value, as no C type holds both."""
        signed = self.temporary(Fragment("", "int64_t"))
        if left.ctype == "uint64_t":
            before = f"{signed.text} = {self.cast(right, 'int64_t')}"
            is_so = op in (BinaryOp.GT, BinaryOp.GE, BinaryOp.NE)
            test = f"{left.at(SHIFT)} {op.value} (uint64_t){signed.text}"
        else:
            before = f"{signed.text} = {self.cast(left, 'int64_t')}"
            is_so = op in (BinaryOp.LT, BinaryOp.LE, BinaryOp.NE)
            test = f"(uint64_t){signed.text} {op.value} {right.at(SHIFT)}"
        negative = f"{signed.text} < 0 || " if is_so else f"{signed.text} >= 0 && "
        return Fragment(f"({before}, {negative}{test})", "bool")

    def _exact(self, expr: Binary, left: Fragment, right: Fragment, type_: IntType) -> Fragment:
        op = expr.op
        ctype = self._common(type_, interval(expr.left.type), interval(expr.right.type))
        a, b = self._as(left, ctype), self._as(right, ctype)
        if op in (BinaryOp.DIV, BinaryOp.REM):
            if is_never_zero(expr.right):
                return Fragment(f"{a} {op.value} {b}", ctype, PRODUCT)
            name = f"fsm_{'div' if op is BinaryOp.DIV else 'rem'}_{SUFFIX[ctype]}"
            return Fragment(f"{name}(&m->failed, {a}, {b})", _result(ctype))
        if op is BinaryOp.SHIFT_LEFT:
            unsigned = UNSIGNED[ctype]
            shifted = f"({unsigned}){a} << {self._as(right, 'uint32_t')}"
            return Fragment(f"({ctype})({shifted})", ctype, PREFIX)
        if op is BinaryOp.SHIFT_RIGHT:
            return self._shift_right(a, self._as(right, "uint32_t"), ctype)
        if op in (BinaryOp.BIT_AND, BinaryOp.BIT_OR, BinaryOp.BIT_XOR):
            if ctype == "int":
                ctype = "int32_t"  # bits beyond the 16 that every int has
                a, b = self._as(left, ctype), self._as(right, ctype)
            return Fragment(f"{a} {op.value} {b}", ctype, BITS)
        return Fragment(f"{a} {op.value} {b}", ctype, LEVEL[op.value])

    def _wrapping(self, expr: Binary, left: Fragment, right: Fragment, type_: IntType) -> Fragment:
        op = expr.op
        ctype = wrapping(type_)
        unsigned = UNSIGNED[ctype]
        if op in (BinaryOp.DIV, BinaryOp.REM):
            a, b = self._as(left, ctype), self._as(right, ctype)
            name = f"fsm_{'div' if op is BinaryOp.DIV else 'rem'}_{SUFFIX[ctype]}"
            return Fragment(f"{name}(&m->failed, {a}, {b})", _result(ctype))
        if op in (BinaryOp.SHIFT_LEFT, BinaryOp.SHIFT_RIGHT):
            mask = 31 if unsigned == "uint32_t" else 63
            wide = UNSIGNED.get(right.ctype, "uint32_t")
            count = f"((uint32_t){self._as(right, wide)} & {mask}u)"
            if op is BinaryOp.SHIFT_RIGHT:
                return self._shift_right(self._as(left, ctype), count, ctype)
            return self._reduced(
                Fragment(f"{self._as(left, unsigned)} << {count}", unsigned, SHIFT), ctype
            )
        a, b = self._as(left, unsigned), self._as(right, unsigned)
        binds = LEVEL.get(op.value, BITS)
        return self._reduced(Fragment(f"{a} {op.value} {b}", unsigned, binds), ctype)

    def _shift_right(self, a: str, count: str, ctype: str) -> Fragment:
        if ctype.startswith("u"):
            return Fragment(f"{a} >> {count}", ctype, SHIFT)
        return Fragment(f"fsm_asr_{SUFFIX[ctype]}({a}, {count})", _result(ctype))

    def _reduced(self, fragment: Fragment, ctype: str) -> Fragment:
        if fragment.ctype == ctype:
            return fragment
        return Fragment(f"({ctype})({fragment.text})", ctype, PREFIX)

    def _common(self, *types: IntType) -> str:
        return computed(*types) or "int64_t"

    def _as(self, fragment: Fragment, ctype: str, binds: int = PREFIX) -> str:
        if fragment.ctype == ctype:
            return fragment.at(binds)
        text = self.cast(fragment, ctype)
        return text if text.lstrip("(").startswith(ctype) or text[-1:].isalnum() else f"({text})"

    def _double(self, fragment: Fragment) -> str:
        return (
            fragment.at(PREFIX) if fragment.ctype == "double" else f"(double){fragment.at(PREFIX)}"
        )

    def _conditional(self, expr: Conditional) -> Fragment:
        test, then, otherwise = map(self.fragment, (expr.test, expr.then, expr.otherwise))
        if isinstance(expr.type, FloatType):
            ctype = "double"
            a, b = self._double(then), self._double(otherwise)
        elif isinstance(expr.type, BoolType | ArrayType | RecordType):
            ctype = then.ctype
            a, b = then.at(OR), otherwise.at(OR)
        else:
            ctype = self._common(*(interval(e.type) for e in (expr, expr.then, expr.otherwise)))
            a, b = self._as(then, ctype), self._as(otherwise, ctype)
        return Fragment(f"{test.at(OR)} ? {a} : {b}", ctype, CHOICE)

    def _apply(self, expr: Apply) -> Fragment:
        fragments = [self.fragment(argument) for argument in expr.arguments]
        if isinstance(expr.type, FloatType):
            ctype = "double"
            texts = [self._double(fragment) for fragment in fragments]
        else:
            ctype = self._common(
                interval(expr.type), *(interval(argument.type) for argument in expr.arguments)
            )
            texts = [self._as(fragment, ctype) for fragment in fragments]
        steps = []
        current = self.temporary(Fragment("", ctype))
        steps.append(f"{current.text} = {texts[0]}")
        for text in texts[1:]:
            other = self.temporary(Fragment("", ctype))
            steps.append(f"{other.text} = {text}")
            sign = "<" if expr.function is Function.MIN else ">"
            keep = f"{other.text} {sign} {current.text} ? {other.text} : {current.text}"
            steps.append(f"{current.text} = {keep}")
        if expr.function is Function.ABS:
            wraps = isinstance(expr.type, IntType) and expr.type.overflow is Overflow.WRAP
            negated = f"-{current.text}"
            if wraps and ctype in UNSIGNED:
                negated = f"({ctype})(0u - ({UNSIGNED[ctype]}){current.text})"
            steps.append(f"{current.text} < 0 ? {negated} : {current.text}")
        else:
            steps.append(current.text)
        return Fragment(f"({', '.join(steps)})", ctype)

    def _call(self, expr: Call) -> Fragment:
        operation = self.names.operation(expr.operation)
        before, texts = self.arguments(
            expr.arguments, tuple(field.type for field in operation.parameters)
        )
        self.names.used.add(f"call {expr.operation}")
        name = f"{self.names.prefix}_call_{self.names.operations[expr.operation]}"
        text = f"{name}({', '.join(('m', *texts))})"
        loaded = self.loaded(text, expr.type) if expr.type is not None else Fragment(text, "void")
        if before:
            return Fragment(f"({', '.join((*before, loaded.text))})", loaded.ctype)
        return loaded

    def arguments(
        self, arguments: tuple[Expr, ...], types: tuple[Type, ...]
    ) -> tuple[list[str], list[str]]:
        """Print values for parameters: what must be computed before, then the arguments."""
        pieces = [self.value(e, t) for e, t in zip(arguments, types, strict=True)]
        if not any(needs_order(a, b) for i, a in enumerate(arguments) for b in arguments[i + 1 :]):
            return [], pieces
        before, texts = [], []
        for text, type_ in zip(pieces, types, strict=True):
            if isinstance(type_, ArrayType | RecordType):
                texts.append(text)
                continue
            place = self.temporary(Fragment("", storage(type_, self.names.records).text))
            before.append(f"{place.text} = {text}")
            texts.append(place.text)
        return before, texts

    def _convert(self, operand: Expr, type_: Type) -> Fragment:
        fragment = self.fragment(operand)
        match type_:
            case FloatType(bits):
                text = self._double(fragment)
                if bits == 32:
                    return Fragment(f"(double)(float){text}", "double", PREFIX)
                return Fragment(text, "double", PREFIX)
            case IntType(lo, hi, overflow):
                return self._bounded(fragment, operand.type, lo, hi, overflow)
            case DurationType():
                return self._bounded(fragment, operand.type, 0, LONGEST_DURATION, Overflow.SATURATE)
            case _:
                return fragment

    def _bounded(
        self, fragment: Fragment, source: Type | None, lo: int, hi: int, overflow: Overflow
    ) -> Fragment:
        ctype = computed(IntType(lo, hi)) or "int64_t"
        if isinstance(source, FloatType):
            how = "fault" if overflow is Overflow.FAULT else "clamp"
            how = "truncate" if overflow is Overflow.WRAP else how
            low, high = integer(lo, "int64_t"), integer(min(hi, 2**63 - 1), "int64_t")
            text = f"{self.names.prefix}_{how}_f(m, {self._double(fragment)}, {low}, {high})"
            self.names.used.add(f"{how}_f")
            return Fragment(f"({ctype}){text}", ctype, PREFIX)
        if overflow is Overflow.WRAP:
            unsigned = {8: "uint8_t", 16: "uint16_t", 32: "uint32_t", 64: "uint64_t"}
            bits = (hi - lo + 1).bit_length() - 1
            if hi - lo + 1 == 1 << bits and bits in unsigned and lo in (0, -(1 << (bits - 1))):
                narrow = unsigned[bits] if lo == 0 else unsigned[bits][1:]
                # to 64 bits at once: a negative int as uint32_t would lose its sign
                wide = unsigned[64] if bits == 64 else UNSIGNED.get(fragment.ctype, "uint32_t")
                inner = self._as(fragment, wide)
                inner = inner if wide == unsigned[bits] else f"({unsigned[bits]}){inner}"
                text = inner if narrow == unsigned[bits] else f"({narrow}){inner}"
                return self._widened(Fragment(text, narrow, PREFIX), ctype)
            if fragment.ctype == "uint64_t":  # what lies beyond int64_t would change its remainder
                rest = f"{fragment.at(PRODUCT)} % {integer(hi - lo + 1, 'uint64_t')}"
                fragment = Fragment(rest, "uint64_t", PRODUCT)
            text = (
                f"fsm_wrap({self.cast(fragment, 'int64_t')}, "
                f"{integer(lo, 'int64_t')}, {integer(hi, 'int64_t')})"
            )
            return Fragment(f"({ctype}){text}", ctype, PREFIX)
        how = "fault" if overflow is Overflow.FAULT else "clamp"
        if fragment.ctype == "uint64_t" or hi > 2**63 - 1:
            how += "_u"
            unsigned_value = self.cast(fragment, "uint64_t")
            below = f"{fragment.at(COMPARE)} < 0" if fragment.ctype != "uint64_t" else "false"
            text = (
                f"{self.names.prefix}_{how}(m, {below}, {unsigned_value}, "
                f"{integer(max(lo, 0), 'uint64_t')}, {integer(hi, 'uint64_t')})"
            )
            self.names.used.add(how)
            return Fragment(f"({ctype}){text}", ctype, PREFIX)
        self.names.used.add(how)
        name = f"{self.names.prefix}_{how}{'_i' if how == 'fault' else ''}"
        text = (
            f"{name}(m, {self.cast(fragment, 'int64_t')}, "
            f"{integer(lo, 'int64_t')}, {integer(hi, 'int64_t')})"
        )
        return Fragment(f"({ctype}){text}", ctype, PREFIX)

    def _widened(self, fragment: Fragment, ctype: str) -> Fragment:
        if fragment.ctype == ctype:
            return fragment
        return Fragment(f"({ctype}){fragment.at(PREFIX)}", ctype, PREFIX)


def _apart(text: str) -> str:
    """Return an operand that does not melt into a sign before it: ``--x`` counts down."""
    return f"({text})" if text.startswith("-") else text


def _result(ctype: str) -> str:
    return "int32_t" if ctype == "int" else ctype


def floating(value: float) -> str:
    """Spell a double, exactly; infinities and NaN as quotients."""
    if value != value:
        return "(0.0 / 0.0)"
    if value in (float("inf"), float("-inf")):
        return "(1.0 / 0.0)" if value > 0 else "(-1.0 / 0.0)"
    text = repr(value)
    return text if any(char in text for char in ".en") else f"{text}.0"


def is_never_zero(expr: Expr) -> bool:
    """Whether a divisor is provably not 0 and not -1 of a value that could overflow."""
    span = interval(expr.type)
    if isinstance(expr, Literal):
        return expr.value not in (0, -1)
    return not span.lo <= 0 <= span.hi and not span.lo <= -1 <= span.hi


def parts(expr: Expr) -> tuple[Expr, ...]:
    """Return the operands of a node."""
    match expr:
        case Unary(_, operand) | Convert(operand):
            return (operand,)
        case Binary(_, left, right):
            return (left, right)
        case Conditional(test, then, otherwise):
            return (test, then, otherwise)
        case Element(array, index):
            return (array, index)
        case Member(record):
            return (record,)
        case Apply(_, arguments) | Call(_, arguments):
            return arguments
        case _:
            return ()


def can_fail(expr: Expr) -> bool:
    """Whether evaluating may end in an error of content or in a fault."""
    match expr:
        case Binary(BinaryOp.DIV | BinaryOp.REM, _, right, type_):
            own = not isinstance(type_, FloatType) and not is_never_zero(right)
        case Element(array, index):
            assert isinstance(array.type, ArrayType)  # noqa: S101
            span = interval(index.type)
            own = not 0 <= span.lo <= span.hi < array.type.length
        case Convert(type=IntType(overflow=Overflow.FAULT)) | Invalid():
            own = True
        case _:
            own = False
    return own or any(map(can_fail, parts(expr)))


def has_effect(expr: Expr) -> bool:
    """Whether evaluating calls the host or may raise ``error.range``."""
    match expr:
        case Call() | Convert(type=IntType(overflow=Overflow.SATURATE) | DurationType()):
            return True
        case _:
            return any(map(has_effect, parts(expr)))


def needs_order(left: Expr, right: Expr) -> bool:
    """Whether it can be told in which order two operands are evaluated."""

    def matters(expr: Expr) -> bool:
        return has_effect(expr) or can_fail(expr)

    return (has_effect(left) and matters(right)) or (matters(left) and has_effect(right))


def literal_initializer(value: Value, type_: Type, printer: Printer) -> str:
    """Spell a start value, for arrays and records with braces."""
    match type_:
        case ArrayType(element):
            assert isinstance(value, tuple)  # noqa: S101
            return f"{{{', '.join(literal_initializer(v, element, printer) for v in value)}}}"
        case RecordType(_, fields):
            assert isinstance(value, tuple)  # noqa: S101
            texts = (
                literal_initializer(v, part.type, printer)
                for v, part in zip(value, fields, strict=True)
            )
            return f"{{{', '.join(texts)}}}"
        case _:
            fragment = printer.literal(value, type_)
            return printer.cast(fragment, storage(type_, printer.names.records).text)
