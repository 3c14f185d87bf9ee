"""The source that is compiled instead of a machine's own to have a trace and a log of it.

It includes the machine's source under hooks and other names for what the host calls, so that the
machine itself holds nothing of all that.
"""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.codegen.c.expressions.types import storage
from fsmkit.codegen.c.header import NOTICE, parameters
from fsmkit.codegen.c.helpers import fill
from fsmkit.codegen.c.layout import Member
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.recording.saving import symbol_table
from fsmkit.codegen.c.recording.values import Values
from fsmkit.emit import Emitter
from fsmkit.language import Field
from fsmkit.plan.image import Image, codes, head, image_of, size_of
from fsmkit.texts.c import comment

HOOKS = """
#undef FSM_HOOK_BEGIN
#undef FSM_HOOK_EVENT
#undef FSM_HOOK_TAKE
#undef FSM_HOOK_POST
#define FSM_HOOK_BEGIN(m, cause, index) \\
    fsm_trace_cause((cause) == FSM_TIMEOUT ? (uint16_t)FSM_TRACE_TIMEOUT : (uint16_t)0u)
#define FSM_HOOK_EVENT(m, what, e) \\
    ((what) == FSM_TAKEN ? fsm_trace_cause((uint16_t)(e)->event) : (void)0)
#define FSM_HOOK_TAKE(m, transition) \\
    fsm_trace_take((uint16_t)FSM_INSTANCE(m), $NUMBERu, $NOW, (uint16_t)(transition))
"""

POST = """
#define FSM_HOOK_POST(m, e, fits) fsm_@_log_post(m, e, fits)
static void fsm_@_log_post(const @ *m, const @_event *e, bool fits)
{
    uint8_t bytes[5u + $EVENTu];
    fsm_writer w = {bytes};
    (void)m;
    fsm_put(&w, FSM_INSTANCE(m), 2u);
    fsm_put(&w, fits ? 1u : 0u, 1u);
    fsm_@_log_event(&w, e);
    fsm_log_record(FSM_LOG_POST, bytes, (size_t)(w.at - bytes));
}
"""

NO_POST = """
#define FSM_HOOK_POST(m, e, fits) ((void)0)
"""

CALLS = """
/* What the host calls, as it is in the machine's own source. */
static void fsm_@_plain_start(@ *m, uint32_t now);
[runs]static void fsm_@_plain_run(@ *m, uint32_t now);
static fsm_result fsm_@_plain_dispatch(@ *m, const @_event *e, uint32_t now);
#define @_start fsm_@_plain_start
[runs]#define @_run fsm_@_plain_run
#define @_dispatch fsm_@_plain_dispatch
#include "@.c"
#undef @_start
#undef @_run
#undef @_dispatch

static void fsm_@_log_call(fsm_log_kind kind, const @ *m, const @_event *e, uint32_t now)
{
    static const uint8_t hash[8] = {$HASH};
    uint8_t bytes[18u + $INPUTSu + $EVENTu];
    fsm_writer to = {bytes};
    fsm_writer *w = &to;
    fsm_trace_at(now);
    (void)m;
    fsm_put(w, FSM_INSTANCE(m), 2u);
    fsm_put(w, now, 4u);
$PUT
    if (kind == FSM_LOG_START)
        for (unsigned i = 0u; i < 8u; i++)
            *w->at++ = hash[i];
    if (e != NULL)
        fsm_@_log_event(w, e);
    fsm_log_record(kind, bytes, (size_t)(w->at - bytes));
}

/* Within a step they do nothing, and nothing is to be done again. */
void @_start(@ *m, uint32_t now)
{
[guarded]    if (m->busy)
[guarded]        return;
    fsm_@_log_call(FSM_LOG_START, m, NULL, now);
    fsm_@_plain_start(m, now);
    fsm_log_record(FSM_LOG_END, NULL, 0u);
}

[runs]void @_run(@ *m, uint32_t now)
[runs]{
[runs][guarded]    if (m->busy)
[runs][guarded]        return;
[runs]    const bool is_idle = $IDLE;
[runs]    if (!is_idle)
[runs]        fsm_@_log_call(FSM_LOG_RUN, m, NULL, now);
[runs]    fsm_@_plain_run(m, now);
[runs]    if (!is_idle)
[runs]        fsm_log_record(FSM_LOG_END, NULL, 0u);
[runs]}

fsm_result @_dispatch(@ *m, const @_event *e, uint32_t now)
{
    fsm_result result;
[guarded]    if (m->busy)
[guarded]        return FSM_BUSY;
    fsm_@_log_call(FSM_LOG_DISPATCH, m, e, now);
    result = fsm_@_plain_dispatch(m, e, now);
    fsm_log_record(FSM_LOG_END, NULL, 0u);
    return result;
}
"""


def tracing_source(machines: Sequence[tuple[Names, list[Member]]]) -> str:
    """Return the text for machines, those in the slots before those that hold them."""
    outer = machines[-1][0]
    out = Emitter()
    what = comment("the machine " + outer.chart.name + ", with a trace and a log")
    out.line(f"/* {outer.prefix}_trace.c: {what}. {NOTICE}")
    out.line(" * Compile it instead of the sources that it includes. */")
    out.lines([f'#include "{outer.prefix}.h"', '#include "fsm_trace.h"', ""])
    numbers = {names.prefix: number for number, names in enumerate(in_order(outer))}
    for names, members in machines:
        _Tracer(names, frozenset(m.name for m in members), numbers[names.prefix]).print(out)
    return out.finish()


def in_order(names: Names) -> list[Names]:
    """Return a machine, then those in its slots, each before those within it."""
    return [names, *(inner for slot in names.invoked for inner in in_order(slot))]


class _Tracer:
    """Prints one machine with what surrounds its source."""

    def __init__(self, names: Names, members: frozenset[str], number: int) -> None:
        self._names = names
        self._members = members
        self._number = number
        self._image: Image = image_of(names.chart)
        texts = f"{names.prefix}_texts, {len(self._image.texts)}u"
        self._values = Values(names, texts)

    def print(self, out: Emitter) -> None:
        names = self._names
        if self._image.stores_symbols:
            symbol_table(out, names, self._image)
        self._operations(out)
        is_outer = not names.is_invoked
        if is_outer:
            self._event(out)
        now = "(m)->now" if "now" in self._members else "fsm_trace_time()"
        out.lines(fill(names, HOOKS, NUMBER=str(self._number), NOW=now))
        event = 2 + self._image.payload
        has_post = is_outer and names.does["queued"]
        out.lines(fill(names, POST if has_post else NO_POST, EVENT=str(event)))
        out.line()
        if is_outer:
            self._calls(out, event)
        else:
            out.line(f'#include "{names.prefix}.c"')
        for operation in self._called():
            out.line(f"#undef {names.prefix}_{names.operations[operation]}")
        out.line()

    def _called(self) -> list[str]:
        operations = self._names.chart.operations
        return [o.name for o in operations if "call " + o.name in self._names.used]

    def _operations(self, out: Emitter) -> None:
        """Print functions that call the operations and tell of it, and let them be called so."""
        names, p = self._names, self._names.prefix
        for number, operation in enumerate(names.chart.operations):
            if operation.name not in self._called():
                continue
            result, name = operation.result, names.operations[operation.name]
            fields = operation.parameters
            ctype = "void" if result is None else storage(result, names.records).text
            logged = f"fsm_{p}_logged_{name}"
            out.line(f"static {ctype} {logged}({p} *m{parameters(fields, names)})")
            with out.block("{"):
                given = (Field("result", result),) if result is not None else ()
                out.line(f"uint8_t bytes[{4 + size_of(codes(given))}];")
                out.lines(["fsm_writer to = {bytes};", "fsm_writer *w = &to;"])
                passed = "".join(f", {names.field(part.name)}" for part in fields)
                call = f"{p}_{name}(m{passed})"
                out.line(f"{call};" if result is None else f"{ctype} result = {call};")
                out.lines([f"fsm_put(w, {self._number}u, 2u);", f"fsm_put(w, {number}u, 2u);"])
                if result is not None:
                    self._values.put(out, result, "result")
                out.line("fsm_log_record(FSM_LOG_CALLED, bytes, sizeof bytes);")
                if result is not None:
                    out.line("return result;")
            out.line(f"#define {p}_{name} {logged}")
            out.line()

    def _event(self, out: Emitter) -> None:
        names, p = self._names, self._names.prefix
        out.line(f"static void fsm_{p}_log_event(fsm_writer *w, const {p}_event *e)")
        with out.block("{"):
            out.line("fsm_put(w, (uint32_t)e->event, 2u);")
            if self._image.payload:
                self._values.payloads(out, names, self._values.put)
        out.line()

    def _calls(self, out: Emitter, event: int) -> None:
        names, inputs = self._names, self._names.chart.inputs
        put = Emitter()
        with put.indented():
            for variable in inputs:
                self._values.put(put, variable.type, f"m->{names.variables[variable.name]}")
        given = tuple(Field(v.name, v.type) for v in inputs)
        out.lines(
            fill(
                names,
                CALLS,
                HASH=", ".join(f"0x{byte:02X}u" for byte in head(names.chart)[4:]),
                INPUTS=str(size_of(codes(given))),
                EVENT=str(event),
                PUT=put.finish().rstrip("\n") if inputs else "~",
                IDLE=self._idle(),
            )
        )

    def _idle(self) -> str:
        """Return the test whether a run will find nothing to do; false where that is unknown."""
        names, has = self._names, self._members
        if names.slots or names.chart.inputs:
            return "false"
        tests = [f"m->{queue}_count == 0u" for queue in ("queue", "deferred") if queue in has]
        if "timers" in has:
            tests.append("(m->timer_count == 0u || !fsm_reached(now, m->timers[0].deadline))")
        return " && ".join(tests) or "true"
