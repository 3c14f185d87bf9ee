"""Checks of an event in a build with FSM_CHECKED, before the machine accepts it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fsmkit.codegen.c.expressions.types import interval
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import integer_storage
from fsmkit.language import ArrayType, BoolType, EnumType, FloatType, RecordType, SymbolType, Type


def print_allowed(out: Unit, names: Names) -> None:
    """Print the test that an event is known and that its payload is within the declared ranges."""
    p = names.own
    out.define("is_allowed")
    out.line("#ifdef FSM_CHECKED")
    out.line("/* Whether an event is known and its payload is within the declared types. */")
    out.line(f"static bool {p}_is_allowed(const {p}_event *e)")
    known = f"return e->event > 0u && e->event < {names.own_upper}_EVENTS;"
    tested = []
    for event in names.chart.events:
        place = f"e->of.{names.payloads[event.index]}"
        loops, tests = _tests(names, RecordType("", event.fields), place, 0)
        if loops or tests:
            tested.append(
                (f"case {names.events[event.index]}:", [*loops, f"return {_all(tests)};"])
            )
    with out.block("{"):
        if tested:
            with out.block("switch (e->event) {"):
                for label, lines in [*tested, ("default:", [known])]:
                    out.line(label)
                    with out.indented():
                        out.lines(lines)
        else:
            out.line(known)
    out.lines(["#endif", ""])


def _all(tests: Sequence[str]) -> str:
    """Return the conjunction of tests."""
    return " && ".join(tests) or "true"


def _any(tests: Iterable[str]) -> str:
    """Return the disjunction of tests."""
    return f"({' || '.join(tests)})"


def _tests(names: Names, type_: Type, place: str, depth: int) -> tuple[list[str], list[str]]:
    """Return the tests that a value is within its type: loops that return false, and conditions."""
    match type_:
        case ArrayType(element, length):
            at = f"i{depth}"
            loops, tests = _tests(names, element, f"{place}[{at}]", depth + 1)
            if tests:
                loops = [*loops, f"if (!({_all(tests)})) {{", "    return false;", "}"]
            if not loops:
                return [], []
            head = f"for (uint32_t {at} = 0u; {at} < {length}u; {at}++) {{"
            return [head, *(f"    {line}" for line in loops), "}"], []
        case RecordType(_, fields):
            found = [
                _tests(names, part.type, f"{place}.{names.field(part.name)}", depth)
                for part in fields
            ]
            return [line for loops, _ in found for line in loops], [
                t for _, ts in found for t in ts
            ]
        case FloatType() | SymbolType():
            return [], []
        case BoolType():
            return [], [f"*(const unsigned char *)&{place} <= 1u"]
        case EnumType(numbers=numbers) if not type_.is_counted:
            return [], [_any(f"{place} == {number}" for number in numbers)]
        case _:
            bounds = interval(type_)
            ctype, size = integer_storage(bounds.lo, bounds.hi)
            lowest = 0 if ctype.startswith("u") else -(2 ** (8 * size - 1))
            highest = lowest + 2 ** (8 * size) - 1
            mark = "u" if ctype.startswith("u") else ""
            inside = [f"{place} >= {bounds.lo}{mark}"] if bounds.lo > lowest else []
            inside += [f"{place} <= {bounds.hi}{mark}"] if bounds.hi < highest else []
            return [], inside
