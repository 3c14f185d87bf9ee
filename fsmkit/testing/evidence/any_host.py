"""A host that does anything its contract allows, as C; proofs and random runs share it.

It posts, dispatches, runs and queries in any order. It passes any value of a type, and any number
as an event. Choices come from `any_integer` and `any_real`: of Frama-C, or of a random generator.
"""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.analysis.host_events import posted_events, sent_events
from fsmkit.codegen.c.expressions.types import interval
from fsmkit.codegen.c.generate import Machine
from fsmkit.codegen.c.header import declaration, parameters
from fsmkit.codegen.c.layout import timers_needed
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.language import ArrayType, Field, FloatType, RecordType, Type

CHOICES = """\
#ifndef ANY_H
#define ANY_H
#include <stdbool.h>
#include <stdint.h>
int64_t any_integer(int64_t lo, int64_t hi);
uint64_t any_unsigned(uint64_t hi);
uint32_t any_time(void);
uint32_t any_origin(void);
double any_real(void);
float any_short_real(void);
#endif
"""

PROVED = """\
#include "any.h"
#include <__fc_builtin.h>
#include <float.h>
int64_t any_integer(int64_t lo, int64_t hi) { return Frama_C_long_long_interval(lo, hi); }
uint64_t any_unsigned(uint64_t hi) { return Frama_C_unsigned_long_long_interval(0u, hi); }
uint32_t any_time(void) { return (uint32_t)any_unsigned(UINT32_MAX); }
uint32_t any_origin(void) { return any_time(); }
double any_real(void) { return Frama_C_double_interval(-DBL_MAX, DBL_MAX); }
float any_short_real(void) { return Frama_C_float_interval(-FLT_MAX, FLT_MAX); }
"""

TRIED = """\
#include "any.h"
#include <math.h>
static uint64_t seed = 88172645463325252u; /* xorshift64, G. Marsaglia 2003 */
static uint64_t next(void)
{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    return seed ^= seed << 17;
}
uint64_t any_unsigned(uint64_t hi)
{
    uint64_t kind = next() % 8u;
    if (kind == 0u)
        return hi;
    if (kind == 1u)
        return 0u;
    return hi == UINT64_MAX ? next() : next() % (hi + 1u);
}
int64_t any_integer(int64_t lo, int64_t hi)
{
    return (int64_t)((uint64_t)lo + any_unsigned((uint64_t)hi - (uint64_t)lo));
}
static uint32_t now = UINT32_MAX - 1000u;
uint32_t any_time(void) /* goes on by little, lest a period that is missed comes a million times */
{
    return now += (uint32_t)any_unsigned(200u);
}
uint32_t any_origin(void) /* what is now becomes 0 */
{
    const uint32_t then = now;
    now = 0u;
    return then;
}
double any_real(void)
{
    static const double odd[] = {0.0, -1.0, 1e300, -1e300, 0.5, INFINITY, -INFINITY, NAN};
    return next() % 2u ? odd[next() % 8u] : (double)any_integer(-1000000, 1000000) / 1000.0;
}
float any_short_real(void)
{
    static const float odd[] = {0.0f, -1.0f, 1e38f, -1e38f, 0.5f, INFINITY, -INFINITY, NAN};
    return next() % 2u ? odd[next() % 8u] : (float)any_integer(-1000000, 1000000) / 1000.0f;
}
"""


def any_host(machine: Machine, rounds: int | None = None) -> str:
    """Return a main program around a machine; it goes on for ever, or for so many rounds."""
    names = machine.names
    p = names.prefix
    lines = [f'#include "{p}.h"', '#include "any.h"', "", f"static {p} machine;", ""]
    for each in _with_invoked(names):
        lines += _provided(each)
    lines += _event(names)
    lines += [
        f"void host_{p}(void);",
        f"void host_{p}(void)",
        "{",
        *_hints(names),
        f"    {p}_init(&machine);",
        *_inputs(names),
        f"    {p}_start(&machine, any_time());",
        "    for (;;) {" if rounds is None else f"    for (uint32_t k = 0u; k < {rounds}u; k++) {{",
        *(f"    {line}" for line in _inputs(names)),
        *_calls(names),
        "    }",
        "}",
        "int main(void)",
        "{",
        f"    host_{p}();",
        "    return 0;",
        "}",
    ]
    return "\n".join(lines) + "\n"


def _with_invoked(names: Names) -> Iterator[Names]:
    yield names
    for inner in names.invoked:
        yield from _with_invoked(inner)


def _hints(names: Names) -> list[str]:
    """Return how far counters go: an analysis tries these bounds before it gives up one."""
    lines = []
    for each in _with_invoked(names):
        place = ".".join(["machine", *_slots(names, each)])
        capacities = each.chart.capacities
        bounds = {
            "timer_count": timers_needed(each),
            "queue_count": capacities.queue if each.does.queued else 0,
            "deferred_count": capacities.queue if each.does.defers else 0,
            "internal_count": capacities.internal if each.does.raises else 0,
            "delayed_count": capacities.delayed if each.does.delays else 0,
        }
        lines += [
            f"    //@ widen_hints global:{place}.fsm.{name}, {bound - 1}, {bound};"
            for name, bound in bounds.items()
            if bound
        ]
    return lines


def _slots(names: Names, target: Names) -> list[str]:
    """Return the members that lead to an invoked machine."""
    found: list[str] = []
    while names is not target:
        number = next(i for i, n in enumerate(names.invoked) if target in _with_invoked(n))
        found.append(names.slots[number])
        names = names.invoked[number]
    return found


def _calls(names: Names) -> list[str]:
    """Return the possible calls of a host in one round."""
    p, does = names.prefix, names.does
    time = "any_time()"
    told = f"{p}_state active[4];"
    calls = [
        "break;",
        f"{p}_event e = any_event(); (void){p}_dispatch(&machine, &e, {time}); break;",
        f"{told} (void){p}_active(&machine, active, 4u); break;",
        f"(void){p}_in(&machine, ({p}_state)any_unsigned({names.upper}_STATES)); break;",
        f"uint32_t due; (void){p}_next_deadline(&machine, &due); break;",
        f"(void){p}_finished(&machine); (void){p}_fault(&machine); break;",
        f"{p}_rebase(&machine, any_origin()); break;",
        f"(void){p}_step_timer(&machine); break;",
        f"{p}_start(&machine, {time}); break;",
        f"(void){p}_state_name(({p}_state)any_unsigned({names.upper}_STATES)); break;",
        f"(void){p}_event_text((uint32_t)any_unsigned(UINT32_MAX)); break;",
        f"(void){p}_symbol((uint32_t)any_unsigned(UINT32_MAX)); break;",
    ]
    if does.queued:
        calls += [
            f"{p}_event e = any_event(); (void){p}_post(&machine, &e); break;",
            f"(void){p}_step_event(&machine); break;",
        ]
        for event in posted_events(names.chart):
            fields = names.chart.events[event].fields
            declared, passed = _declared_values(names, fields)
            call = f"(void){p}_post_{names.event_names[event]}(&machine{passed}); break;"
            calls.append(" ".join([*declared, call]))
    if does.runs:
        calls.append(f"{p}_run(&machine, {time}); break;")
    if does.polls:
        calls.append(f"(void){p}_step_eventless(&machine); break;")
    lines = [f"        switch (any_integer(0, {len(calls) - 1})) {{"]
    for number, call in enumerate(calls):
        label = "default:" if number == 0 else f"case {number}:"
        lines.append(f"        {label} {{ {call} }}")
    return [*lines, "        }"]


def _inputs(names: Names) -> list[str]:
    lines: list[str] = []
    for variable in names.chart.inputs:
        lines += _assigned(names, f"machine.{names.variables[variable.name]}", variable.type)
    return [f"    {line}" for line in lines]


def _assigned(names: Names, place: str, type_: Type) -> list[str]:
    """Return statements that put any value of a type there."""
    match type_:
        case ArrayType(element, length):
            return [
                line for i in range(length) for line in _assigned(names, f"{place}[{i}]", element)
            ]
        case RecordType(_, fields):
            return [
                line
                for part in fields
                for line in _assigned(names, f"{place}.{names.field(part.name)}", part.type)
            ]
        case FloatType(bits):
            return [f"{place} = {'any_short_real' if bits == 32 else 'any_real'}();"]
        case _:
            return [f"{place} = {_any(names, type_)};"]


def _any(names: Names, type_: Type) -> str:
    lo, hi = (found := interval(type_)).lo, found.hi
    ctype = storage(type_, names.records).text
    if hi > 2**63 - 1:
        return f"any_unsigned(UINT64_C({hi}))"
    low = "INT64_MIN" if lo == -(2**63) else f"INT64_C({lo})"
    return f"({ctype})any_integer({low}, INT64_C({hi}))"


def _declared_values(names: Names, fields: tuple[Field, ...]) -> tuple[list[str], str]:
    """Return declarations of values for parameters, and the text that passes them."""
    lines: list[str] = []
    for number, part in enumerate(fields):
        lines.append(f"{declaration(part.type, f'v{number}', names)};")
        lines += _assigned(names, f"v{number}", part.type)
    return lines, "".join(f", v{number}" for number in range(len(fields)))


def _event(names: Names) -> list[str]:
    """Return a function that creates any event: valid ones for posting, or with any number."""
    p, chart = names.prefix, names.chart
    lines = [f"static {p}_event any_event(void)", "{", f"    {p}_event e = {names.upper}_NO_EVENT;"]
    lines += ["    switch (any_integer(0, %d)) {" % len(posted_events(chart))]  # noqa: UP031
    for number, event in enumerate(posted_events(chart), 1):
        lines += [f"    case {number}:", f"        e.event = {names.events[event]};"]
        for part in chart.events[event].fields:
            place = f"e.of.{names.payloads[event]}.{names.field(part.name)}"
            lines += [f"        {line}" for line in _assigned(names, place, part.type)]
        lines.append("        break;")
    others = [
        *(f"    case {names.events[event]}: break;" for event in posted_events(chart)),
    ]
    lines += [
        "    default: {",
        "        uint8_t number = (uint8_t)any_unsigned(255u);",
        "        switch (number) {",
        *(f"    {line}" for line in others),
        "        default: e.event = number;",
        "        }",
        "    }",
        "    }",
        "    return e;",
        "}",
        "",
    ]
    return lines


def _provided(names: Names) -> list[str]:
    """Return the operations, with arbitrary results, and the receivers of outgoing events."""
    p = names.prefix
    lines: list[str] = []
    for operation in names.chart.operations:
        name = f"{p}_{names.operations[operation.name]}"
        taken = parameters(operation.parameters, names)
        ctype = "void"
        if operation.result is not None:
            ctype = storage(operation.result, names.records).text
        lines += [f"{ctype} {name}({p} *m{taken})", "{", "    (void)m;"]
        lines += _unused(names, operation.parameters)
        if operation.result is not None:
            lines.append(f"    {ctype} result;")
            lines += [f"    {x}" for x in _assigned(names, "result", operation.result)]
            lines.append("    return result;")
        lines += ["}", ""]
    for event in sent_events(names.chart):
        fields = names.chart.events[event].fields
        head = f"void {p}_send_{names.event_names[event]}({p} *m{parameters(fields, names)})"
        lines += [head, "{", "    (void)m;", *_unused(names, fields), "}", ""]
    return lines


def _unused(names: Names, fields: tuple[Field, ...]) -> list[str]:
    return [f"    (void){names.field(part.name)};" for part in fields]
