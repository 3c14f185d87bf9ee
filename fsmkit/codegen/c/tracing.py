"""The source that replaces a machine's own in builds with a trace and a log.

It includes the machine's source under hooks and other names for the host's calls. The machine
itself therefore contains no observation code. The chart-independent part is in ``fsm_traced.h``.
"""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.codegen.c.expressions.types import loaded, parameter_type
from fsmkit.codegen.c.header import NOTICE, parameters
from fsmkit.codegen.c.info import Machines, within
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment
from fsmkit.language import EnumType, Field
from fsmkit.plan.image import codes, image_of, size_of

CALL = 18
"""The bytes of a call's record beside inputs and event, at most."""


def tracing_source(machines: Machines) -> str:
    """Return the source for machines; those in slots precede those that hold them."""
    outer = machines[-1][0]
    out = Emitter()
    what = comment("the machine " + outer.chart.name + ", with a trace and a log")
    out.line(f"/* {outer.prefix}_trace.c: {what}. {NOTICE}")
    out.line(" * Compile it instead of the sources that it includes. */")
    out.line(f'#include "{outer.prefix}.h"')
    out.lines(['#include "fsm_info.h"', '#include "fsm_trace.h"', ""])
    room = max(_room(names) for names, _ in machines)
    bytes_ = f"static uint8_t fsm_{outer.prefix}_bytes[{room}]; /* of one record */"
    out.lines(["#ifdef FSM_LOGGED", bytes_, "#endif", ""])
    numbers = {each.prefix: number for number, each in enumerate((outer, *within(outer)))}
    for names, members in machines:
        _print(out, names, members, numbers[names.prefix])
    return out.finish()


def _print(out: Emitter, names: Names, members: frozenset[str], number: int) -> None:
    """Print one machine: the definitions for its source, and the source."""
    p, chart = names.prefix, names.chart
    used = [o for o in chart.operations if "call " + o.name in names.used]
    defined = {
        "": p,
        "_NUMBER": f"{number}u",
        "_BYTES": f"fsm_{names.outermost}_bytes",
        "_NOW(m)": "(m)->fsm.now" if "fsm.now" in members else "fsm_trace_time()",
        "_BUSY(m)": "(m)->fsm.busy" if "fsm.busy" in members else "false",
    }
    if not names.is_invoked and names.does.queued:
        defined["_POSTS"] = ""
    if not names.is_invoked and names.does.runs:
        defined["_RUNS"] = ""
    out.lines(f"#define FSM_TRACED{name} {value}".rstrip() for name, value in defined.items())
    out.lines([f"extern const fsm_machine_info {p}_info;", '#include "fsm_traced.h"', ""])
    for operation in used:
        name = names.operations[operation.name]
        place = chart.operations.index(operation)
        _logged(out, names, name, place)
    if names.is_invoked:
        out.line(f'#include "{p}.c"')
    else:
        print_observed(out, names, "traced")
    out.lines(f"#undef {p}_{names.operations[operation.name]}" for operation in used)
    out.lines(f"#undef FSM_TRACED{name.removesuffix('(m)')}" for name in defined)
    out.line()


def _room(names: Names) -> int:
    """Return the bytes of the longest record."""
    inputs = tuple(Field(v.name, v.type) for v in names.chart.inputs)
    results = (o.result for o in names.chart.operations if o.result is not None)
    called = max((size_of(codes((Field("result", result),))) for result in results), default=0)
    return max(CALL + size_of(codes(inputs)) + image_of(names.chart).payload, 4 + called)


def _logged(out: Emitter, names: Names, name: str, number: int) -> None:
    """Print a function that calls an operation and logs it, and a macro that uses it."""
    operation, p = names.chart.operations[number], names.prefix
    result, fields = operation.result, operation.parameters
    ctype = "void" if result is None else parameter_type(result, names)
    logged = f"fsm_{p}_logged_{name}"
    out.line(f"static {ctype} {logged}({p} *m{parameters(fields, names)})")
    with out.block("{"):
        passed = "".join(f", {names.field(part.name)}" for part in fields)
        call = f"{p}_{name}(m{passed})"
        if result is None:
            out.line(f"{call};")
        else:
            stored = storage(result, names.records).text
            cast = f"({stored})" if isinstance(result, EnumType) else ""
            out.line(f"{stored} result = {cast}{call};")
        out.line(f"FSM_TRACED_RESULT({number}u, {'NULL' if result is None else '&result'});")
        if result is not None:
            out.line(f"return {loaded(result, 'result', names)};")
    out.lines([f"#define {p}_{name} {logged}", ""])


def print_observed(out: Emitter, names: Names, observed: str, more: Iterable[str] = ()) -> None:
    """Print the source with other names for the host's calls, then these functions.

    ``observed``: the name of the observer's header; ``more``: declarations that it needs.
    """
    p, calls = names.prefix, f"FSM_{observed.upper()}_CALLS"
    verbs = ["start", *(["run"] if names.does.runs else []), "dispatch"]
    out.line("/* What the host calls, as it is in the machine's own source. */")
    out.lines(f"static void fsm_{p}_plain_{verb}({p} *m, uint32_t now);" for verb in verbs[:-1])
    taken = f"{p} *m, const {p}_event *e, uint32_t now"
    out.line(f"static fsm_result fsm_{p}_plain_dispatch({taken});")
    out.lines(more)
    out.lines(f"#define {p}_{verb} fsm_{p}_plain_{verb}" for verb in verbs)
    out.line(f'#include "{p}.c"')
    out.lines(f"#undef {p}_{verb}" for verb in verbs)
    out.lines(["", f"#define {calls}", f'#include "fsm_{observed}.h"', f"#undef {calls}"])
