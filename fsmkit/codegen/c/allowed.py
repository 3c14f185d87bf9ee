"""What a build with FSM_CHECKED asks of an event before it takes it."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.codegen.c.expressions.types import integer_storage, interval
from fsmkit.codegen.c.names import Names
from fsmkit.emit import Emitter
from fsmkit.language import ArrayType, BoolType, FloatType, RecordType, SymbolType, Type


def print_allowed(out: Emitter, names: Names) -> None:
    """Print the test whether an event is known, and what it carries in its declared ranges."""
    p = names.prefix
    out.line("#ifdef FSM_CHECKED")
    out.line("/* Whether an event is known, and each value that it carries one of its type. */")
    out.line(f"static bool {p}_is_allowed(const {p}_event *e)")
    with out.block("{"):
        tests = {
            event.index: [
                line
                for part in event.fields
                for line in _tests(
                    names,
                    part.type,
                    f"e->of.{names.payloads[event.index]}.{names.field(part.name)}",
                    0,
                )
            ]
            for event in names.chart.events
        }
        if any(tests.values()):
            with out.block("switch (e->event) {"):
                for index, lines in tests.items():
                    if lines:
                        out.line(f"case {names.events[index]}:")
                        with out.indented():
                            out.lines(lines)
                            out.line("break;")
                out.line("default:")
                with out.indented():
                    out.line("break;")
        out.line(f"return e->event > 0u && e->event < {names.upper}_EVENTS;")
    out.lines(["#endif", ""])


def _tests(names: Names, type_: Type, place: str, depth: int) -> Iterator[str]:
    """Yield the lines that return where a value is none of its type."""
    match type_:
        case ArrayType(element, length):
            at = f"i{depth}"
            inner = list(_tests(names, element, f"{place}[{at}]", depth + 1))
            if inner:
                yield f"for (uint32_t {at} = 0u; {at} < {length}u; {at}++) {{"
                yield from (f"    {line}" for line in inner)
                yield "}"
        case RecordType(_, fields):
            for part in fields:
                yield from _tests(names, part.type, f"{place}.{names.field(part.name)}", depth)
        case FloatType() | SymbolType():
            pass
        case BoolType():
            yield f"if (*(const unsigned char *)&{place} > 1u)"
            yield "    return false;"
        case _:
            bounds = interval(type_)
            ctype, size = integer_storage(bounds.lo, bounds.hi)
            lowest = 0 if ctype.startswith("u") else -(2 ** (8 * size - 1))
            highest = lowest + 2 ** (8 * size) - 1
            mark = "u" if ctype.startswith("u") else ""
            outside = [f"{place} < {bounds.lo}{mark}"] if bounds.lo > lowest else []
            outside += [f"{place} > {bounds.hi}{mark}"] if bounds.hi < highest else []
            if outside:
                yield f"if ({' || '.join(outside)})"
                yield "    return false;"
