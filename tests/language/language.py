"""A scope to test with, an environment, and random expressions over it."""

from __future__ import annotations

from dataclasses import dataclass, field

from hypothesis import strategies as st

import fsmkit.language as lang
from fsmkit.diagnostics import Diagnostic, Findings, Source, Span, Text

NOWHERE = Span(Source("<test>", ""), 0, 0)
FAULT = lang.EnumType("Fault", ("none", "lost", "jam"))
POINT = lang.RecordType(
    "Point", (lang.Field("x", lang.IntType(0, 9)), lang.Field("y", lang.FLOAT64))
)
UINT8 = lang.MACHINE_INTEGERS["uint8"]
VARIABLES: dict[str, tuple[lang.Type, lang.Storage]] = {
    "a": (lang.IntType(0, 9), lang.Storage.DATA),
    "b": (lang.IntType(-5, 5), lang.Storage.DATA),
    "m": (lang.IntType(-100, 1000, lang.Overflow.WRAP), lang.Storage.DATA),
    "u": (UINT8, lang.Storage.DATA),
    "i": (lang.INT32, lang.Storage.DATA),
    "w": (lang.UINT32, lang.Storage.DATA),
    "l": (lang.INT64, lang.Storage.DATA),
    "q": (lang.UINT64, lang.Storage.DATA),
    "f": (lang.FLOAT64, lang.Storage.DATA),
    "g": (lang.FLOAT32, lang.Storage.OUTPUT),
    "flag": (lang.BOOL, lang.Storage.DATA),
    "code": (FAULT, lang.Storage.DATA),
    "array": (lang.ArrayType(UINT8, 4), lang.Storage.DATA),
    "point": (POINT, lang.Storage.DATA),
    "position": (lang.IntType(0, 4000), lang.Storage.INPUT),
    "delay": (lang.DURATION, lang.Storage.DATA),
    "mode": (lang.SYMBOL, lang.Storage.DATA),
    "log": (lang.IntType(0, 3, lang.Overflow.FAULT), lang.Storage.DATA),
}
SCOPE = lang.Scope(
    variables=VARIABLES,
    constants={
        "PUSHED": lang.Literal(2800, lang.IntType(2800, 2800), NOWHERE),
        "T_PUSH": lang.Literal(1600, lang.DURATION, NOWHERE),
    },
    types={"Fault": FAULT, "Point": POINT},
    operations={
        "goto": lang.Signature(
            (lang.Field("position", lang.IntType(0, 4000)), lang.Field("why", FAULT))
        ),
        "at_limit": lang.Signature((), lang.BOOL),
    },
    states={"idle": 1, "a-b.c": 2, "S.main": 3, "if": 4},
    histories=frozenset({"recent"}),
    event_fields={"code": FAULT, "n": lang.IntType(0, 3)},
)


def text(value: str) -> Text:
    """Return a text that is a file of its own."""
    return Text(value, Span(Source("<test>", value), 0, len(value)))


def typed(value: str, expected: lang.Type | None = None, scope: lang.Scope = SCOPE) -> lang.Expr:
    """Type what must be right."""
    findings = Findings()
    expr = lang.type_expression(text(value), scope, findings, expected)
    assert expr is not None, [d.message for d in findings]
    assert not findings.has_errors, [d.message for d in findings]
    return expr


def refused(value: str, expected: lang.Type | None = None, scope: lang.Scope = SCOPE) -> Diagnostic:
    """Type what must be wrong in one way."""
    findings = Findings()
    lang.type_expression(text(value), scope, findings, expected)
    assert findings.has_errors, value
    (found,) = findings
    return found


@dataclass
class Machine:
    """An environment: variables, and what is asked of the host."""

    values: dict[str, lang.Value] = field(default_factory=dict)
    active: frozenset[int] = frozenset()
    fields: dict[str, lang.Value] = field(default_factory=dict)
    result: lang.Value | None = True
    calls: list[tuple[str, tuple[lang.Value, ...]]] = field(default_factory=list)
    saturated: int = 0

    def variable(self, name: str) -> lang.Value:
        return self.values[name]

    def event_field(self, name: str) -> lang.Value:
        return self.fields[name]

    def event_name(self) -> str:
        return "arrived"

    def event_type(self) -> str:
        return "external"

    def is_in(self, state: int) -> bool:
        return state in self.active

    def call(self, operation: str, arguments: tuple[lang.Value, ...]) -> lang.Value | None:
        self.calls.append((operation, arguments))
        return self.result

    def range_error(self) -> None:
        self.saturated += 1


def values_of(type_: lang.Type) -> st.SearchStrategy[lang.Value]:
    """Return random values of a type, its bounds often."""
    match type_:
        case lang.IntType(lo, hi):
            near = [v for v in (lo, lo + 1, -1, 0, 1, hi - 1, hi) if lo <= v <= hi]
            return st.sampled_from(near) | st.integers(lo, hi)
        case lang.FloatType(bits):
            return st.floats(width=32 if bits == 32 else 64)
        case lang.EnumType(_, members):
            return st.integers(0, len(members) - 1)
        case lang.ArrayType(element, length):
            return st.tuples(*[values_of(element)] * length)
        case lang.RecordType(_, fields):
            return st.tuples(*(values_of(f.type) for f in fields))
        case _ if type_ == lang.BOOL:
            return st.booleans()
        case _ if type_ == lang.SYMBOL:
            return st.sampled_from(["", "auto", "manual"])
        case _:
            return st.integers(0, lang.LONGEST_DURATION)


def machines() -> st.SearchStrategy[Machine]:
    """Return environments with random values of every variable."""
    return st.builds(
        Machine,
        st.fixed_dictionaries({name: values_of(t) for name, (t, _) in VARIABLES.items()}),
        st.frozensets(st.sampled_from([1, 2, 3, 4])),
        st.fixed_dictionaries({"code": values_of(FAULT), "n": values_of(lang.IntType(0, 3))}),
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


def attempted(value: str) -> lang.Expr | None:
    """Type what may be wrong."""
    return lang.type_expression(text(value), SCOPE, Findings())
