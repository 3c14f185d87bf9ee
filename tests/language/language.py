"""A scope to test with, an environment, and random expressions over it."""

from __future__ import annotations

from dataclasses import dataclass, field

from hypothesis import strategies as st

from fsmkit.diagnostics import Diagnostic, Findings, Source, Span, Text
from fsmkit.language import (
    BOOL,
    DURATION,
    FLOAT32,
    FLOAT64,
    INT32,
    INT64,
    LONGEST_DURATION,
    MACHINE_INTEGERS,
    SYMBOL,
    UINT32,
    UINT64,
    ArrayType,
    EnumType,
    Expr,
    Field,
    FloatType,
    IntType,
    Literal,
    Overflow,
    RecordType,
    Scope,
    Signature,
    Storage,
    Type,
    Value,
    type_expression,
)

NOWHERE = Span(Source("<test>", ""), 0, 0)
FAULT = EnumType("Fault", ("none", "lost", "jam"))
POINT = RecordType("Point", (Field("x", IntType(0, 9)), Field("y", FLOAT64)))
UINT8 = MACHINE_INTEGERS["uint8"]
VARIABLES: dict[str, tuple[Type, Storage]] = {
    "a": (IntType(0, 9), Storage.DATA),
    "b": (IntType(-5, 5), Storage.DATA),
    "m": (IntType(-100, 1000, Overflow.WRAP), Storage.DATA),
    "u": (UINT8, Storage.DATA),
    "i": (INT32, Storage.DATA),
    "w": (UINT32, Storage.DATA),
    "l": (INT64, Storage.DATA),
    "q": (UINT64, Storage.DATA),
    "f": (FLOAT64, Storage.DATA),
    "g": (FLOAT32, Storage.OUTPUT),
    "flag": (BOOL, Storage.DATA),
    "code": (FAULT, Storage.DATA),
    "array": (ArrayType(UINT8, 4), Storage.DATA),
    "point": (POINT, Storage.DATA),
    "position": (IntType(0, 4000), Storage.INPUT),
    "delay": (DURATION, Storage.DATA),
    "mode": (SYMBOL, Storage.DATA),
    "log": (IntType(0, 3, Overflow.FAULT), Storage.DATA),
}
SCOPE = Scope(
    variables=VARIABLES,
    constants={
        "PUSHED": Literal(2800, IntType(2800, 2800), NOWHERE),
        "T_PUSH": Literal(1600, DURATION, NOWHERE),
    },
    types={"Fault": FAULT, "Point": POINT},
    operations={
        "goto": Signature((Field("position", IntType(0, 4000)), Field("why", FAULT))),
        "at_limit": Signature((), BOOL),
    },
    states={"idle": 1, "a-b.c": 2, "S.main": 3, "if": 4},
    histories=frozenset({"recent"}),
    event_fields={"code": FAULT, "n": IntType(0, 3)},
)


def text(value: str) -> Text:
    """Return a text that is a file of its own."""
    return Text(value, Span(Source("<test>", value), 0, len(value)))


def typed(value: str, expected: Type | None = None, scope: Scope = SCOPE) -> Expr:
    """Type what must be right."""
    findings = Findings()
    expr = type_expression(text(value), scope, findings, expected)
    assert expr is not None, [d.message for d in findings]
    assert not findings.has_errors, [d.message for d in findings]
    return expr


def refused(value: str, expected: Type | None = None, scope: Scope = SCOPE) -> Diagnostic:
    """Type what must be wrong in one way."""
    findings = Findings()
    type_expression(text(value), scope, findings, expected)
    assert findings.has_errors, value
    (found,) = findings
    return found


@dataclass
class Machine:
    """An environment: variables, and what is asked of the host."""

    values: dict[str, Value] = field(default_factory=dict)
    active: frozenset[int] = frozenset()
    fields: dict[str, Value] = field(default_factory=dict)
    result: Value | None = True
    calls: list[tuple[str, tuple[Value, ...]]] = field(default_factory=list)
    saturated: int = 0

    def variable(self, name: str) -> Value:
        return self.values[name]

    def event_field(self, name: str) -> Value:
        return self.fields[name]

    def event_name(self) -> str:
        return "arrived"

    def event_type(self) -> str:
        return "external"

    def is_in(self, state: int) -> bool:
        return state in self.active

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        self.calls.append((operation, arguments))
        return self.result

    def range_error(self) -> None:
        self.saturated += 1


def values_of(type_: Type) -> st.SearchStrategy[Value]:
    """Return random values of a type, its bounds often."""
    match type_:
        case IntType(lo, hi):
            near = [v for v in (lo, lo + 1, -1, 0, 1, hi - 1, hi) if lo <= v <= hi]
            return st.sampled_from(near) | st.integers(lo, hi)
        case FloatType(bits):
            return st.floats(width=32 if bits == 32 else 64)
        case EnumType(_, members):
            return st.integers(0, len(members) - 1)
        case ArrayType(element, length):
            return st.tuples(*[values_of(element)] * length)
        case RecordType(_, fields):
            return st.tuples(*(values_of(f.type) for f in fields))
        case _ if type_ == BOOL:
            return st.booleans()
        case _ if type_ == SYMBOL:
            return st.sampled_from(["", "auto", "manual"])
        case _:
            return st.integers(0, LONGEST_DURATION)


def machines() -> st.SearchStrategy[Machine]:
    """Return environments with random values of every variable."""
    return st.builds(
        Machine,
        st.fixed_dictionaries({name: values_of(t) for name, (t, _) in VARIABLES.items()}),
        st.frozensets(st.sampled_from([1, 2, 3, 4])),
        st.fixed_dictionaries({"code": values_of(FAULT), "n": values_of(IntType(0, 3))}),
        st.booleans(),
    )


def _numbers(below: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    infix = st.sampled_from("+ - * / % & | ^ << >>".split())  # noqa: SIM905
    return st.one_of(
        st.builds("({} {} {})".format, below, infix, below),
        st.builds("{}({}, {})".format, st.sampled_from(["min", "max"]), below, below),
        st.builds("{}({})".format, st.sampled_from(["-", "~", "abs"]), below),
        st.builds("({} if {} < {} else {})".format, below, below, below, below),
        st.builds("(flag ? {} : {})".format, below, below),
        st.builds("array[{}]".format, below),
    )


LEAVES = st.sampled_from(
    ["a", "b", "m", "u", "i", "w", "l", "q", "log", "position", "event.n", "point.x", "PUSHED"]
) | st.integers(-9, 300).map(str)
INTEGERS = st.recursive(LEAVES, _numbers, max_leaves=6)
FLOATS = st.recursive(
    st.sampled_from(["f", "g", "point.y", "0.5", "a", "l", "2"]),
    lambda below: st.builds("({} {} {})".format, below, st.sampled_from("+-*/"), below),
    max_leaves=5,
)
CONDITIONS = st.recursive(
    st.one_of(
        st.sampled_from(["flag", "true", "In(idle)", "In('a-b.c')", "at_limit()", "not flag"]),
        st.sampled_from(["code == lost", "event.code != Fault.jam", 'mode == "auto"']),
        st.sampled_from(["delay < T_PUSH", "delay + 5ms >= delay * 2", "delay / 1ms > 4"]),
        st.builds("{} {} {}".format, INTEGERS, st.sampled_from(["<", "<=", "==", "!="]), LEAVES),
        st.builds("{} {} {}".format, FLOATS, st.sampled_from([">", ">=", "===", "!=="]), FLOATS),
    ),
    lambda below: st.one_of(
        st.builds("({} {} {})".format, below, st.sampled_from(["and", "or", "&&", "||"]), below),
        st.builds("{}({})".format, st.sampled_from(["!", "not "]), below),
    ),
    max_leaves=5,
)
CONSTANTS = st.recursive(
    st.integers(0, 70).map(str) | st.sampled_from(["0.5", "2.0", "1e300"]),
    lambda below: st.one_of(
        st.builds("({} {} {})".format, below, st.sampled_from(list("+-*/%<|")), below),
        st.builds("-{}".format, below),
    ),
    max_leaves=5,
)
EXPRESSIONS = st.one_of(INTEGERS, FLOATS, CONDITIONS)


def attempted(value: str) -> Expr | None:
    """Type what may be wrong."""
    return type_expression(text(value), SCOPE, Findings())
