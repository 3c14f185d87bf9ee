"""What every generated machine holds, or whoever calls it: queues, errors, ranges, timers.

It is C with the prefix filled in: ``@`` stands for it in lower case, ``%`` in upper case.
"""

from __future__ import annotations

from fsmkit.codegen.c.names import Names
from fsmkit.emit import Emitter

QUEUES = """
static const @_event @_no_event = %_NO_EVENT;

static void @_stop(@ *m, fsm_fault fault, const char *why)
{
    (void)why;
    if (m->fsm.fault == FSM_NO_FAULT) {
        m->fsm.fault = (uint8_t)fault;
        FSM_HOOK_TEXT(m, FSM_FAULT, why, 0);
    }
}

/* Take an event out of a queue; what it frees is zero, so that equal queues are equal bytes. */
static @_event @_take_out(@_event *queue, uint8_t *count, uint8_t room, uint8_t place)
{
    @_event e = queue[place];
    (*count)--;
    for (; place < room - 1u && place < *count; place++) {
        queue[place] = queue[place + 1u];
    }
    queue[place] = @_no_event;
    return e;
}

static bool @_has_room(const @ *m)
{
    return m->fsm.queue_count$DEFERRED_COUNT < %_QUEUE;
}

/* Put an event into the queue; one that finds it full is counted. */
static bool @_enqueue(@ *m, const @_event *e)
{
    if (m->fsm.queue_count$DEFERRED_COUNT >= %_QUEUE) {
[counted]        fsm_count(&m->fsm.rejected);
        return false;
    }
    m->fsm.queue[m->fsm.queue_count] = *e;
    m->fsm.queue_count++;
    return true;
}

"""

HELPERS = {
    "raise": """
static void @_raise(@ *m, const @_event *e, bool tell)
{
    if (tell) {
        FSM_HOOK_EVENT(m, FSM_RAISED, e);
    }
    if (m->fsm.internal_count < %_INTERNAL) {
        m->fsm.internal[m->fsm.internal_count] = *e;
        m->fsm.internal_count++;
    } else {
        FSM_HOOK_TEXT(m, FSM_FULL, "internal", 0);
        @_stop(m, FSM_FAULT_INTERNAL, "internal");
    }
}
""",
    "raise_plain": """
/* Raise an event without a payload. */
static void @_raise_plain(@ *m, @_event_name event)
{
    @_event e = @_no_event;
    e.event = ($EVENT)event;
    @_raise(m, &e, true);
}
""",
    "error": """
static void @_error(@ *m, uint16_t event, const char *name)
{
    (void)name;
    FSM_HOOK_TEXT(m, FSM_ERROR, name, 0);
    @_event e = @_no_event;
    e.event = ($EVENT)event;
    @_raise(m, &e, false);
}
""",
    "end_block": """
static void @_end_block(@ *m)
{
    uint8_t failed = m->fsm.failed;
    m->fsm.failed = FSM_FINE;
    if (failed == FSM_CONTENT_ERROR) {
        @_error(m, %_EVENT_ERROR_EXECUTION, "error.execution");
    } else if (failed == FSM_RANGE_FAULT) {
        @_stop(m, FSM_FAULT_RANGE, "range");
    }
}
""",
    "send": """
static void @_send(@ *m, const @_event *e)
{
    FSM_HOOK_EVENT(m, FSM_SENT, e);
    if (!@_enqueue(m, e)) {
        FSM_HOOK_TEXT(m, FSM_FULL, "queue", 0);
    }
}
""",
    "holds": """
/* A condition that cannot be evaluated is false (SCXML 5.9.1). */
static bool @_holds(@ *m, bool holds)
{
    if (m->fsm.failed == FSM_CONTENT_ERROR) {
        @_end_block(m);
        return false;
    }
    return holds && m->fsm.failed == FSM_FINE;
}
""",
    "guard_holds": """
/* A guard that cannot be evaluated is false (SCXML 5.9.1). */
static bool @_guard_holds(@ *m, bool holds)
{
    bool is_sound = m->fsm.failed == FSM_FINE;
    if (!is_sound) {
        @_end_block(m);
    }
    return is_sound && holds;
}
""",
    "clamp": """
/* The nearest bound of a range, and `error.range` for a value outside it. */
static int64_t @_clamp(@ *m, int64_t value, int64_t lo, int64_t hi)
{
    if (m->fsm.failed != FSM_FINE || (value >= lo && value <= hi)) {
        return value < lo ? lo : value > hi ? hi : value;
    }
    @_error(m, %_EVENT_ERROR_RANGE, "error.range");
    return value < lo ? lo : hi;
}
""",
    "clamp_u": """
static uint64_t @_clamp_u(@ *m, bool below, uint64_t value, uint64_t lo, uint64_t hi)
{
    if (m->fsm.failed != FSM_FINE || (!below && value >= lo && value <= hi)) {
        return below || value < lo ? lo : value > hi ? hi : value;
    }
    @_error(m, %_EVENT_ERROR_RANGE, "error.range");
    return below || value < lo ? lo : hi;
}
""",
    "clamp_f": """
static int64_t @_clamp_f(@ *m, double value, int64_t lo, int64_t hi)
{
    bool outside = false;
    int64_t whole = fsm_truncate(value, lo, hi, &outside);
    if (outside && m->fsm.failed == FSM_FINE) {
        @_error(m, %_EVENT_ERROR_RANGE, "error.range");
    }
    return whole;
}
""",
    "arm": """
static void @_arm(@ *m, uint16_t transition, uint32_t delay)
{
    const fsm_timer timer = {m->fsm.now + delay, transition, 0u};
    if (m->fsm.timer_count < %_TIMERS) { /* always: room for each that is armed at once */
        (void)fsm_timers_insert(m->fsm.timers, &m->fsm.timer_count, timer);
    }
}
""",
    "disarm": """
static void @_disarm(@ *m, uint16_t transition)
{
    fsm_timers_disarm(m->fsm.timers, &m->fsm.timer_count, transition);
}
""",
    "delay": """
/* Delayed events stand in the order of their timers, so that equal states are equal bytes. */
static void @_delay(@ *m, const @_event *e, uint32_t delay, uint16_t mark, uint16_t route,
                    uint16_t peer)
{
    FSM_HOOK_EVENT(m, FSM_DELAYED, e);
    FSM_HOOK_TEXT(m, FSM_DELAYED, "", delay);
    if (m->fsm.delayed_count >= %_DELAYED || m->fsm.timer_count >= %_TIMERS) {
[counted]        fsm_count(&m->fsm.rejected);
        FSM_HOOK_TEXT(m, FSM_FULL, "delayed", 0);
        return;
    }
    const fsm_timer timer = {m->fsm.now + delay, FSM_TIMER_SEND, mark};
    uint8_t place = fsm_timers_insert(m->fsm.timers, &m->fsm.timer_count, timer);
    uint8_t rank = 0u;
    for (uint8_t i = 0u; i < place && rank + 1u < %_DELAYED; i++) {
        rank = (uint8_t)(rank + (m->fsm.timers[i].what == FSM_TIMER_SEND ? 1u : 0u));
    }
    for (uint8_t i = %_DELAYED - 1u; i > rank; i--) {
        m->fsm.delayed[i] = m->fsm.delayed[i - 1u];
    }
    m->fsm.delayed_count++;
    m->fsm.delayed[rank].e = *e;
    m->fsm.delayed[rank].peer = peer;
    m->fsm.delayed[rank].route = route;
}

static @_delayed @_undelay(@ *m, uint8_t rank)
{
    static const @_delayed none = {%_NO_EVENT, 0u, 0u};
    @_delayed found = m->fsm.delayed[rank];
    m->fsm.delayed_count--;
    for (; rank + 1u < %_DELAYED && rank < m->fsm.delayed_count; rank++) {
        m->fsm.delayed[rank] = m->fsm.delayed[rank + 1u];
    }
    m->fsm.delayed[rank] = none;
    return found;
}
""",
    "cancel": """
/* Drop the pending delayed sends of an id. */
static void @_cancel(@ *m, uint16_t mark)
{
    uint8_t rank = 0u;
    uint8_t place = 0u;
    while (place < m->fsm.timer_count && rank < %_DELAYED) {
        if (m->fsm.timers[place].what != FSM_TIMER_SEND) {
            place++;
        } else if (m->fsm.timers[place].mark == mark) {
            fsm_timers_remove(m->fsm.timers, &m->fsm.timer_count, place);
            (void)@_undelay(m, rank);
        } else {
            place++;
            rank++;
        }
    }
}
""",
    "cancel_nothing": """
static void @_cancel(@ *m, uint16_t mark)
{
    (void)m;
    (void)mark;
}
""",
}

NEEDS = {
    "raise_plain": ("raise",),
    "error": ("raise",),
    "end_block": ("error",),
    "holds": ("end_block",),
    "guard_holds": ("end_block",),
    "clamp": ("error",),
    "clamp_u": ("error",),
    "clamp_f": ("error",),
}
"""Which helpers call which."""

ORDER = (
    "raise",
    "raise_plain",
    "error",
    "end_block",
    "send",
    "clamp",
    "clamp_u",
    "clamp_f",
    "holds",
    "guard_holds",
    "arm",
    "disarm",
    "delay",
    "cancel",
    "cancel_nothing",
)


def fill(names: Names, text: str, **parts: str) -> list[str]:
    """Return the lines of a piece, with the prefix and the optional parts in."""
    for key, value in {**parts, "TAKEN": names.taken_type, "REGION": names.region_type}.items():
        text = text.replace(f"${key}", value)
    text = text.replace("@", names.prefix).replace("%", names.upper)
    lines = (_suited(names, line) for line in text.strip("\n").split("\n"))
    return [line for line in lines if line.strip() != "~"]


def _suited(names: Names, line: str) -> str:
    """Return a line without the marks that it begins with, ``~`` where one does not hold."""
    while line.startswith("["):
        mark, _, line = line[1:].partition("]")
        if not names.does.has(mark):
            return "~"
    return line


def called(used: set[str]) -> set[str]:
    """Return the helpers that are called, directly or by others."""
    found: set[str] = set()
    waiting = [name for name in used if name in HELPERS]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += NEEDS.get(name, ())
    return found


def helpers(out: Emitter, names: Names, used: set[str], event_type: str) -> None:
    """Print the helper functions that are called, directly or by others."""
    needed = called(used)
    for name in ORDER:
        if name in needed:
            out.lines(fill(names, HELPERS[name], EVENT=event_type))
            out.line()
