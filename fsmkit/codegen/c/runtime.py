"""The part of a generated machine that hardly depends on its chart: queues, timers, the loop.

It is C with the prefix and the presence of optional parts filled in; ``@`` stands for the prefix in
lower case, ``%`` for that in upper case.
"""

from __future__ import annotations

from fsmkit.codegen.c.names import Names
from fsmkit.emit import Emitter

QUEUES = """
static const @_event no_event = %_NO_EVENT;

static void @_count(uint16_t *counter)
{
    if (*counter < 65535u)
        (*counter)++;
}

static void @_stop(@ *m, fsm_fault fault, const char *why)
{
    (void)why;
    if (m->fault == FSM_NO_FAULT) {
        m->fault = (uint8_t)fault;
        FSM_HOOK_TEXT(m, FSM_FAULT, why, 0);
    }
}

/* Take an event out of a queue; what it frees is zero, so that equal queues are equal bytes. */
static @_event @_take_out(@_event *queue, uint8_t *count, uint8_t room, uint8_t place)
{
    @_event e = queue[place];
    (*count)--;
    for (; place + 1u < room && place < *count; place++)
        queue[place] = queue[place + 1u];
    queue[place] = no_event;
    return e;
}

static bool @_has_room(const @ *m)
{
    return m->queue_count$DEFERRED_COUNT < %_QUEUE;
}

"""

HELPERS = {
    "raise": """
static void @_raise(@ *m, const @_event *e, bool tell)
{
    if (tell)
        FSM_HOOK_EVENT(m, FSM_RAISED, e);
    if (m->internal_count < %_INTERNAL) {
        m->internal[m->internal_count] = *e;
        m->internal_count++;
    } else {
        FSM_HOOK_TEXT(m, FSM_FULL, "internal", 0);
        @_stop(m, FSM_FAULT_INTERNAL, "internal");
    }
}
""",
    "error": """
static void @_error(@ *m, uint16_t event, const char *name)
{
    (void)name;
    FSM_HOOK_TEXT(m, FSM_ERROR, name, 0);
    @_event e = no_event;
    e.event = ($EVENT)event;
    @_raise(m, &e, false);
}
""",
    "end_block": """
static void @_end_block(@ *m)
{
    uint8_t failed = m->failed;
    m->failed = FSM_FINE;
    if (failed == FSM_CONTENT_ERROR)
        @_error(m, %_EVENT_ERROR_EXECUTION, "error.execution");
    else if (failed == FSM_RANGE_FAULT)
        @_stop(m, FSM_FAULT_RANGE, "range");
}
""",
    "send": """
static void @_send(@ *m, const @_event *e)
{
    FSM_HOOK_EVENT(m, FSM_SENT, e);
    if (@_has_room(m)) {
        m->queue[m->queue_count] = *e;
        m->queue_count++;
    } else {
        @_count(&m->rejected);
        FSM_HOOK_TEXT(m, FSM_FULL, "queue", 0);
    }
}
""",
    "holds": """
/* A condition that cannot be evaluated is false (SCXML 5.9.1). */
static bool @_holds(@ *m, bool holds)
{
    if (m->failed == FSM_CONTENT_ERROR) {
        @_end_block(m);
        return false;
    }
    return holds && m->failed == FSM_FINE;
}
""",
    "guard_holds": """
/* A guard that cannot be evaluated is false (SCXML 5.9.1). */
static bool @_guard_holds(@ *m, bool holds)
{
    bool is_sound = m->failed == FSM_FINE;
    if (!is_sound)
        @_end_block(m);
    return is_sound && holds;
}
""",
    "clamp": """
/* The nearest bound of a range, and `error.range` for a value outside it. */
static int64_t @_clamp(@ *m, int64_t value, int64_t lo, int64_t hi)
{
    if (m->failed != FSM_FINE || (value >= lo && value <= hi))
        return value < lo ? lo : value > hi ? hi : value;
    @_error(m, %_EVENT_ERROR_RANGE, "error.range");
    return value < lo ? lo : hi;
}
""",
    "clamp_u": """
static uint64_t @_clamp_u(@ *m, bool below, uint64_t value, uint64_t lo, uint64_t hi)
{
    if (m->failed != FSM_FINE || (!below && value >= lo && value <= hi))
        return below || value < lo ? lo : value > hi ? hi : value;
    @_error(m, %_EVENT_ERROR_RANGE, "error.range");
    return below || value < lo ? lo : hi;
}
""",
    "clamp_f": """
static int64_t @_clamp_f(@ *m, double value, int64_t lo, int64_t hi)
{
    bool outside = false;
    int64_t whole = fsm_truncate(value, lo, hi, &outside);
    if (outside && m->failed == FSM_FINE)
        @_error(m, %_EVENT_ERROR_RANGE, "error.range");
    return whole;
}
""",
    "truncate_f": """
static int64_t @_truncate_f(@ *m, double value, int64_t lo, int64_t hi)
{
    bool outside = false;
    (void)m;
    return fsm_truncate(value, lo, hi, &outside);
}
""",
    "fault": """
/* A value of a range of kind `fault`. */
static int64_t @_fault_i(@ *m, int64_t value, int64_t lo, int64_t hi)
{
    if (value >= lo && value <= hi)
        return value;
    if (m->failed == FSM_FINE)
        m->failed = FSM_RANGE_FAULT;
    return lo;
}
""",
    "fault_u": """
static uint64_t @_fault_u(@ *m, bool below, uint64_t value, uint64_t lo, uint64_t hi)
{
    if (!below && value >= lo && value <= hi)
        return value;
    if (m->failed == FSM_FINE)
        m->failed = FSM_RANGE_FAULT;
    return lo;
}
""",
    "fault_f": """
static int64_t @_fault_f(@ *m, double value, int64_t lo, int64_t hi)
{
    bool outside = false;
    int64_t whole = fsm_truncate(value, lo, hi, &outside);
    if (outside && m->failed == FSM_FINE)
        m->failed = FSM_RANGE_FAULT;
    return whole;
}
""",
    "arm": """
static void @_arm(@ *m, uint16_t transition, uint32_t delay)
{
    const fsm_timer timer = {m->now + delay, transition, 0u};
    (void)fsm_timers_insert(m->timers, &m->timer_count, timer);
}
""",
    "delay": """
/* Delayed events stand in the order of their timers, so that equal states are equal bytes. */
static void @_delay(@ *m, const @_event *e, uint32_t delay, uint16_t mark, uint16_t route,
                    uint16_t peer)
{
    FSM_HOOK_EVENT(m, FSM_DELAYED, e);
    FSM_HOOK_TEXT(m, FSM_DELAYED, "", delay);
    if (m->delayed_count >= %_DELAYED) {
        @_count(&m->rejected);
        FSM_HOOK_TEXT(m, FSM_FULL, "delayed", 0);
        return;
    }
    const fsm_timer timer = {m->now + delay, FSM_TIMER_SEND, mark};
    uint8_t place = fsm_timers_insert(m->timers, &m->timer_count, timer);
    uint8_t rank = 0u;
    for (uint8_t i = 0u; i < place; i++)
        rank = (uint8_t)(rank + (m->timers[i].what == FSM_TIMER_SEND ? 1u : 0u));
    for (uint8_t i = %_DELAYED - 1u; i > rank; i--)
        m->delayed[i] = m->delayed[i - 1u];
    m->delayed_count++;
    m->delayed[rank].e = *e;
    m->delayed[rank].peer = peer;
    m->delayed[rank].route = route;
}

static @_delayed @_undelay(@ *m, uint8_t rank)
{
    static const @_delayed none = {%_NO_EVENT, 0u, 0u};
    @_delayed found = m->delayed[rank];
    m->delayed_count--;
    for (; rank + 1u < %_DELAYED && rank < m->delayed_count; rank++)
        m->delayed[rank] = m->delayed[rank + 1u];
    m->delayed[rank] = none;
    return found;
}
""",
    "cancel": """
/* Drop the pending delayed sends of an id. */
static void @_cancel(@ *m, uint16_t mark)
{
    uint8_t rank = 0u;
    uint8_t place = 0u;
    while (place < m->timer_count) {
        if (m->timers[place].what != FSM_TIMER_SEND) {
            place++;
        } else if (m->timers[place].mark == mark) {
            fsm_timers_remove(m->timers, &m->timer_count, place);
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
    "raise error end_block send clamp clamp_u clamp_f truncate_f fault fault_u fault_f "
    "holds guard_holds arm delay cancel cancel_nothing"
).split()

SELECTION = """
typedef struct {
    uint16_t at[%_REGIONS];
    uint8_t count;
    bool defers;
} @_selection;

static void @_add(@_selection *found, uint16_t taken)
{
    if (taken == %_DEFER)
        found->defers = true;
    if (taken == 0u || taken == %_DEFER)
        return;
    for (uint8_t i = 0u; i < found->count; i++)
        if (found->at[i] == taken)
            return;
    found->at[found->count] = taken;
    found->count++;
}
"""

CONFLICTS = """
/* Whether what one transition leaves and what the other leaves have states in common. */
static bool @_conflict(uint16_t d1, uint16_t d2)
{
    if (d1 == 0u || d2 == 0u)
        return false;
    return (d1 <= d2 && d2 <= last_below[d1 - 1u]) || (d2 <= d1 && d1 <= last_below[d2 - 1u]);
}

/* Appendix D, removeConflictingTransitions. */
static void @_remove_conflicts(const @ *m, @_selection *found)
{
    @_selection kept = {{0}, 0, false};
    for (uint8_t i = 0u; i < found->count; i++) {
        uint16_t t1 = found->at[i];
        uint16_t d1 = @_domain(m, t1);
        bool preempted = false;
        @_selection rest = {{0}, 0, false};
        for (uint8_t j = 0u; j < kept.count; j++) {
            uint16_t t2 = kept.at[j];
            bool wins = false;
            if (!preempted && @_conflict(d1, @_domain(m, t2))) {
                uint16_t s1 = source_of[t1 - 1u];
                uint16_t s2 = source_of[t2 - 1u];
                wins = s1 > s2 && s1 < last_below[s2];
                preempted = !wins;
            }
            if (!wins) {
                rest.at[rest.count] = t2;
                rest.count++;
            }
        }
        if (!preempted) {
            kept = rest;
            kept.at[kept.count] = t1;
            kept.count++;
        }
    }
    kept.defers = found->defers;
    *found = kept;
}

/* Leave, act, enter (Appendix D, microstep), in the order of the domains: none is in another. */
static void @_microstep(@ *m, const @_selection *found)
{
    uint16_t domains[%_REGIONS];
    @_selection acting = *found;
    for (uint8_t i = 0u; i < found->count; i++)
        domains[i] = @_domain(m, found->at[i]);
$RECORD_ALL
    for (uint8_t i = found->count; i > 0u; i--)
        @_leave(m, domains[i - 1u]);
    for (uint8_t i = 1u; i < acting.count; i++)
        for (uint8_t j = i; j > 0u && acting.at[j - 1u] > acting.at[j]; j--) {
            uint16_t other = acting.at[j];
            acting.at[j] = acting.at[j - 1u];
            acting.at[j - 1u] = other;
        }
    for (uint8_t i = 0u; i < acting.count; i++)
        @_act(m, acting.at[i]);
    for (uint8_t i = 0u; i < found->count; i++)
        @_enter(m, found->at[i]);
}
"""

LOOP_SINGLE = """
static void @_take(@ *m, uint16_t taken)
{
    m->budget--;
    if (taken == 0u || m->fault != FSM_NO_FAULT)
        return;
    $DOMAIN
    $RECORD
    @_leave(m, domain);
    @_act(m, taken);
    @_enter(m, taken);
}

static bool @_react(@ *m, const @_event *e, bool may_defer)
{
    m->event = *e;
    uint16_t taken = @_select_event(m, (uint16_t)e->event);
$DEFERRING
    if (taken == 0u)
        @_unhandled(m, e);
    @_take(m, taken);
    return taken != 0u;
}

static bool @_take_eventless(@ *m)
{
    uint16_t taken = @_select_eventless(m);
    if (taken == 0u)
        return false;
    if (m->budget == 0u)
        @_stop(m, FSM_FAULT_MICROSTEPS, "microsteps");
    else
        @_take(m, taken);
    return true;
}
"""

LOOP_MANY = """
static void @_take(@ *m, const @_selection *found)
{
    m->budget--;
    if (found->count != 0u && m->fault == FSM_NO_FAULT)
        @_microstep(m, found);
}

static bool @_react(@ *m, const @_event *e, bool may_defer)
{
    @_selection found = {{0}, 0, false};
    m->event = *e;
    @_select_event_0(m, (uint16_t)e->event, &found);
    $FORGET
    @_remove_conflicts(m, &found);
$DEFERRING
    if (found.count == 0u)
        @_unhandled(m, e);
    @_take(m, &found);
    return found.count != 0u;
}

static bool @_take_eventless(@ *m)
{
    @_selection found = {{0}, 0, false};
    @_select_eventless_0(m, &found);
    $FORGET
    @_remove_conflicts(m, &found);
    if (found.count == 0u)
        return false;
    if (m->budget == 0u)
        @_stop(m, FSM_FAULT_MICROSTEPS, "microsteps");
    else
        @_take(m, &found);
    return true;
}
"""

UNHANDLED = """
static void @_unhandled(@ *m, const @_event *e)
{
    @_count(&m->unhandled);
    FSM_HOOK_EVENT(m, FSM_UNHANDLED, e);
$STRICT
}
"""

LOOP_END = """
/* Until the configuration is stable: Appendix D, mainEventLoop, its inner loop. */
static bool @_settle(@ *m)
{
    bool acted = false;
    while (m->running && m->fault == FSM_NO_FAULT) {
        if (@_take_eventless(m)) {
            acted = true;
            continue;
        }
        if (m->internal_count == 0u)
            break;
        acted = true;
        if (m->budget == 0u) {
            @_stop(m, FSM_FAULT_MICROSTEPS, "microsteps");
            break;
        }
        @_event e = @_take_out(m->internal, &m->internal_count, %_INTERNAL, 0u);
        (void)@_react(m, &e, false);
    }
    if (m->fault != FSM_NO_FAULT) {
        m->running = false;
        m->finished = false;
        while (m->internal_count > 0u)
            (void)@_take_out(m->internal, &m->internal_count, %_INTERNAL, 0u);
    } else if (!m->running) {
        @_leave_0(m, 0u, true);
        while (m->internal_count > 0u)
            (void)@_take_out(m->internal, &m->internal_count, %_INTERNAL, 0u);
        while (m->queue_count > 0u)
            (void)@_take_out(m->queue, &m->queue_count, %_QUEUE, 0u);
$CLEAR
    }
    m->event = no_event;
    m->budget = 0u;
    m->busy = false;
    return acted;
}

static void @_begin(@ *m)
{
    m->busy = true;
    m->budget = %_MICROSTEPS;
}

/* One macrostep for an event that is out of its queue; whether a transition was taken. */
static bool @_macrostep(@ *m, const @_event *e, bool may_defer)
{
    bool handled;
    @_begin(m);
    m->event = *e;
    FSM_HOOK_BEGIN(m, FSM_EVENT, 0);
    handled = @_react(m, e, may_defer);
    (void)@_settle(m);
    FSM_HOOK_END(m);
    return handled;
}

bool @_step_event(@ *m)
{
    if (!m->running)
        return false;
$RECALL
    if (m->queue_count == 0u)
        return false;
    @_event e = @_take_out(m->queue, &m->queue_count, %_QUEUE, 0u);
    (void)@_macrostep(m, &e, true);
    return true;
}

bool @_step_eventless(@ *m)
{
    if (!m->running)
        return false;
    @_begin(m);
    FSM_HOOK_BEGIN(m, FSM_EVENTLESS, 0);
    bool acted = @_settle(m);
    FSM_HOOK_END(m);
    return acted;
}

void @_run(@ *m, uint32_t now)
{
    uint32_t allowance = (uint32_t)m->queue_count + %_MICROSTEPS$DEFERRED_PLUS;
    m->now = now;
$TRY_EVENTLESS
    while (m->running) {
        if (allowance > 0u && @_step_event(m)) {
            allowance--;
            continue;
        }
$TIMER_DUE
        break;
    }
    m->now = now;
}

fsm_result @_dispatch(@ *m, const @_event *e, uint32_t now)
{
    if (m->busy)
        return FSM_BUSY;
    if (!m->running)
        return FSM_STOPPED;
    m->now = now;
    return @_macrostep(m, e, false) ? FSM_HANDLED : FSM_IGNORED;
}

bool @_post(@ *m, const @_event *e)
{
    if (!m->running || !@_has_room(m)) {
        @_count(&m->rejected);
        return false;
    }
    m->queue[m->queue_count] = *e;
    m->queue_count++;
    return true;
}
"""

DUE = """
        if (m->timer_count > 0u && fsm_reached(now, m->timers[0].deadline)) {
            (void)@_step_timer(m);
            allowance = %_MICROSTEPS;
            continue;
        }"""


def fill(names: Names, text: str, **parts: str) -> list[str]:
    """Return the lines of a piece, with the prefix and the optional parts in."""
    for key, value in parts.items():
        text = text.replace(f"${key}", value)
    text = text.replace("@", names.prefix).replace("%", names.upper)
    return [line for line in text.strip("\n").split("\n") if line.strip() != "~"]


def helpers(out: Emitter, names: Names, used: set[str], event_type: str) -> None:
    """Print the helper functions that are called, directly or by others."""
    needed: set[str] = set()
    waiting = [name for name in used if name in HELPERS]
    while waiting:
        name = waiting.pop()
        if name not in needed:
            needed.add(name)
            waiting += NEEDS.get(name, ())
    for name in ORDER:
        if name in needed:
            out.lines(fill(names, HELPERS[name], EVENT=event_type))
            out.line()
