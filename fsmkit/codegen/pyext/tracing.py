"""The hooks of generated C: what the host is told of a step."""

from __future__ import annotations

from fsmkit.codegen.pyext.members import Bound, Module
from fsmkit.emit import Emitter
from fsmkit.texts.c import quoted

ALWAYS = """
#undef FSM_HOOK_TEXT
#undef FSM_HOOK_VALUE_I
#undef FSM_HOOK_VALUE_F
#undef FSM_HOOK_VALUE_S
#undef FSM_HOOK_LINE
static void @_text_$P($P *m, int what, const char *text, unsigned long number);
static void @_integer_$P($P *m, char kind, uint64_t value);
static void @_float_$P($P *m, double value);
static void @_string_$P($P *m, long value);
static void @_line_$P($P *m);
#define FSM_HOOK_TEXT(m, what, text, number) @_text_$P(m, what, text, number)
#define FSM_HOOK_VALUE_I(m, value) \\
    @_integer_$P(m, _Generic((value), bool: 'b', uint64_t: 'u', default: 'i'), (uint64_t)(value))
#define FSM_HOOK_VALUE_F(m, value) @_float_$P(m, (double)(value))
#define FSM_HOOK_VALUE_S(m, value) @_string_$P(m, (long)(value))
#define FSM_HOOK_LINE(m) @_line_$P(m)
"""

KEEPING = """
#undef FSM_HOOK_END
static void @_end_$P($P *m);
#define FSM_HOOK_END(m) @_end_$P(m)
"""

TRACING = """
#undef FSM_HOOK_BEGIN
#undef FSM_HOOK_END
#undef FSM_HOOK_EXIT
#undef FSM_HOOK_TAKE
#undef FSM_HOOK_ENTER
#undef FSM_HOOK_EVENT
static void @_begin_$P($P *m, int cause, unsigned index);
static void @_end_$P($P *m);
static void @_event_$P($P *m, int what, const $P_event *e);
static void @_state_$P($P *m, const char *verb, $P_state state);
static void @_take_$P($P *m, unsigned transition);
#define FSM_HOOK_BEGIN(m, cause, index) @_begin_$P(m, cause, index)
#define FSM_HOOK_END(m) @_end_$P(m)
#define FSM_HOOK_EXIT(m, state) @_state_$P(m, "- ", state)
#define FSM_HOOK_TAKE(m, transition) @_take_$P(m, (unsigned)(transition))
#define FSM_HOOK_ENTER(m, state) @_state_$P(m, "+ ", state)
#define FSM_HOOK_EVENT(m, what, e) @_event_$P(m, what, e)
"""

TELLING = """
FSM_PY_MAYBE void @_text_$P($P *m, int what, const char *text, unsigned long number)
{
    fsm_object *o = @_of_$P(m);
    (void)number;
[outer]    if (what == FSM_FAULT)
[outer]        o->fault = text;
    if (what == FSM_LEFT)
        o->peer = (uint16_t)number;
[traced]    @_told_$P(o, what, text, number);
    if (what == FSM_LOG)
        fsm_py_begin(o, text);
    else if (what == FSM_REPLY)
        fsm_py_begin(o, NULL);
}

FSM_PY_MAYBE void @_integer_$P($P *m, char kind, uint64_t value)
{
    fsm_object *o = @_of_$P(m);
    bool is_negative = kind == 'i' && (int64_t)value < 0;
[traced]    fsm_py_show_integer(o, is_negative, value);
    if (o->parts == NULL)
        return;
    if (kind == 'b')
        fsm_py_add(o, fsm_py_bool_of(value != 0u));
    else if (is_negative)
        fsm_py_add(o, PyLong_FromLongLong((int64_t)value));
    else
        fsm_py_add(o, PyLong_FromUnsignedLongLong(value));
}

FSM_PY_MAYBE void @_float_$P($P *m, double value)
{
    fsm_object *o = @_of_$P(m);
[traced]    fsm_py_show_float(o, value);
    if (o->parts != NULL)
        fsm_py_add(o, PyFloat_FromDouble(value));
}

FSM_PY_MAYBE void @_string_$P($P *m, long value)
{
    fsm_object *o = @_of_$P(m);
[traced]    if (value < 0)
[traced]        fsm_py_show_bracket(o, value == FSM_PY_OPEN);
[traced]    else
[traced]        fsm_py_show_string(o, (uint16_t)value, true);
    if (o->parts == NULL)
        return;
    if (value < 0)
        fsm_py_bracket(o, value == FSM_PY_OPEN);
    else
        fsm_py_add(o, fsm_py_string(o, (uint16_t)value));
}

FSM_PY_MAYBE void @_line_$P($P *m)
{
    fsm_object *o = @_of_$P(m);
[traced]    fsm_py_line(o);
    fsm_py_finish(o);
}
"""

KEPT = """
/* What was done stays, whatever the host does in the next step. */
static void @_end_$P($P *m)
{
    @_object *self = (@_object *)(void *)@_of_$P(m);
    self->saved = self->m;
}
"""

TRACED = """
static void @_begin_$P($P *m, int cause, unsigned index)
{
    fsm_object *o = @_of_$P(m);
    char text[48];
    if (cause == FSM_EVENTLESS) {
        (void)PyOS_snprintf(o->pending, sizeof o->pending, "@%lu > eventless", (unsigned long)$NOW);
        return;
    }
    @_begun_$P(o);
    if (cause == FSM_START)
        (void)PyOS_snprintf(text, sizeof text, "@%lu > start", (unsigned long)$NOW);
    else if (cause == FSM_EVENT)
        (void)PyOS_snprintf(text, sizeof text, "@%lu > event ", (unsigned long)$NOW);
    else
        (void)PyOS_snprintf(text, sizeof text, "@%lu > timeout %u", (unsigned long)$NOW, index);
    fsm_py_write(o, text);
    if (cause != FSM_EVENT) /* its line goes on when the event is taken */
        fsm_py_line(o);
}

static void @_end_$P($P *m)
{
    fsm_object *o = @_of_$P(m);
    if (o->pending[0] != 0) {
        o->pending[0] = 0;
    } else {
        $P_state states[$LEAVES];
        uint16_t count = $P_active(m, states, $LEAVES);
        @_begun_$P(o);
        fsm_py_write(o, "=");
        for (uint16_t i = 0u; i < count; i++) {
            fsm_py_write(o, " ");
            fsm_py_write(o, $P_state_name(states[i]));
        }
        if ($P_finished(m))
            fsm_py_write(o, " finished");
        fsm_py_line(o);
    }
[outer]    ((@_object *)(void *)o)->saved = *m;
}

static void @_event_$P($P *m, int what, const $P_event *e)
{
    static const char *const verbs[] = {"raise ", "send ", "delay ", "out ", "unhandled "};
    fsm_object *o = @_of_$P(m);
    if (what != FSM_TAKEN) {
        @_begun_$P(o);
        fsm_py_write(o, verbs[what]);
    }
    if (what == FSM_UNHANDLED)
        fsm_py_write(o, $P_event_text((uint32_t)e->event));
    else
        fsm_py_show_event(o, &$P_info, e);
    if (what != FSM_DELAYED && what != FSM_LEFT) /* these go on with a text */
        fsm_py_line(o);
}

static void @_state_$P($P *m, const char *verb, $P_state state)
{
    fsm_py_whole(@_of_$P(m), $WHERE, verb, $P_state_name(state));
}

FSM_PY_MAYBE void @_take_$P($P *m, unsigned transition)
{
    char text[24];
    (void)PyOS_snprintf(text, sizeof text, "%u", transition);
    fsm_py_whole(@_of_$P(m), $WHERE, "t ", text);
}
"""

TOLD = """
static void @_begun_$P(fsm_object *o)
{
    fsm_py_begun(o, $WHERE);
}

static void @_told_$P(fsm_object *o, int what, const char *text, unsigned long number)
{
    char delay[32];
    switch (what) {
        case FSM_DELAYED:
            (void)PyOS_snprintf(delay, sizeof delay, " in %lu", number);
            fsm_py_write(o, delay);
            fsm_py_line(o);
            break;
        case FSM_LEFT:
            if (number != 0) {
                fsm_py_write(o, " to");
                fsm_py_show_string(o, (uint16_t)number, false);
            }
            fsm_py_line(o);
            break;
        case FSM_ERROR:
            fsm_py_whole(o, $WHERE, "error ", text);
            break;
        case FSM_FULL:
            fsm_py_whole(o, $WHERE, "full ", text);
            break;
        case FSM_FAULT:
            fsm_py_whole(o, $WHERE, "fault ", text);
            break;
        case FSM_CANCELLED:
            fsm_py_whole(o, $WHERE, "cancel ", text);
            break;
        case FSM_LOG:
            @_begun_$P(o);
            fsm_py_write(o, "log ");
            fsm_py_write(o, text);
            break;
        case FSM_REPLY:
            @_begun_$P(o);
            fsm_py_write(o, "reply");
            break;
        default:
            break;
    }
}
"""


def fill(module: Module, bound: Bound, text: str, **parts: str) -> list[str]:
    """Return the lines of a piece of C: ``@`` is the wrapper's prefix, ``$P`` the machine's.

    Lines that begin with a mark are there if it holds.
    """
    is_outer = bound is module.bound
    marks = {"[outer]": is_outer, "[traced]": module.traced, "[calls]": module.is_calling}
    marks |= {"[plain]": not module.is_calling, "[replies]": module.is_replying}
    text = text.replace('"@%', '"\\100%').replace("@", module.wrapper)
    text = text.replace("\\100", "@").replace("$P", bound.names.prefix)
    for key, value in parts.items():
        text = text.replace(f"${key}", value)
    lines = []
    for line in text.strip("\n").split("\n"):
        mark = next((mark for mark in marks if line.startswith(mark)), "")
        if not mark or marks[mark]:
            lines.append(line.removeprefix(mark))
    return lines


def print_hooks(out: Emitter, module: Module, bound: Bound) -> None:
    """Print, before the generated C, which functions its hooks are."""
    out.lines(fill(module, bound, ALWAYS))
    if module.traced:
        out.lines(fill(module, bound, TRACING))
    elif module.is_calling and bound is module.bound:
        out.lines(fill(module, bound, KEEPING))


def print_hook_functions(out: Emitter, module: Module, bound: Bound) -> None:
    """Print these functions."""
    names = bound.names
    path = quoted("".join(slot + ": " for slot in names.path))
    if module.traced:
        out.lines(fill(module, bound, TOLD, WHERE=path))
        out.line()
        now = "m->now" if names.does["now"] else "o->now"
        leaves = str(max(1, sum(state.is_leaf for state in names.chart.states)))
        out.lines(fill(module, bound, TRACED, WHERE=path, NOW=now, LEAVES=leaves))
        out.line()
    elif module.is_calling and bound is module.bound:
        out.lines(fill(module, bound, KEPT))
        out.line()
    out.lines(fill(module, bound, TELLING))
    out.line()
