"""The steps of a generated machine, as C with the prefix and optional parts filled in.

``@`` stands for the prefix in lower case, ``%`` for that in upper case (see `fill`).
"""

SELECTION = """
typedef struct {
    uint16_t at[%_REGIONS];
    uint8_t count;
    bool defers;
} @_selection;
"""

ADD = """
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
    return (d1 <= d2 && d2 <= @_last_below[d1 - 1u]) || (d2 <= d1 && d1 <= @_last_below[d2 - 1u]);
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
                uint16_t s1 = @_source_of[t1 - 1u];
                uint16_t s2 = @_source_of[t2 - 1u];
                wins = s1 > s2 && s1 < @_last_below[s2];
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
static bool @_$LOOP(@ *m)
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
$INVOKE
    if (m->fault != FSM_NO_FAULT) {
        m->running = false;
        m->finished = false;
        while (m->internal_count > 0u)
            (void)@_take_out(m->internal, &m->internal_count, %_INTERNAL, 0u);
$FORGET
    } else if (!m->running) {
        @_leave_0(m, 0u, true);
        while (m->internal_count > 0u)
            (void)@_take_out(m->internal, &m->internal_count, %_INTERNAL, 0u);
        while (m->queue_count > 0u)
            (void)@_take_out(m->queue, &m->queue_count, %_QUEUE, 0u);
$CLEAR
    }
    m->event = @_no_event;
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
static bool @_macrostep(@ *m, const @_event *e, bool may_defer$IS_EXTERNAL)
{
    bool handled;
    @_begin(m);
    m->event = *e;
    FSM_HOOK_BEGIN(m, FSM_EVENT, 0);
$BEFORE
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
        return $IDLE;
    @_event e = @_take_out(m->queue, &m->queue_count, %_QUEUE, 0u);
    (void)@_macrostep(m, &e, true$EXTERNAL);
    return true;
}
"""

HOST = """
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
    return @_macrostep(m, e, false$EXTERNAL) ? FSM_HANDLED : FSM_IGNORED;
}
"""

POST = """
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

INVOKE = """    return acted;
}

/* All of mainEventLoop: what is entered invokes, and what is invoked goes on until it is quiet. */
static bool @_settle(@ *m)
{
    bool acted = @_complete(m);
    while ($WAITING && m->running && m->fault == FSM_NO_FAULT) {
        @_invoke(m);
        if (m->internal_count > 0u)
            (void)@_complete(m);
    }"""

RUN_INVOKED = """
    if (m->running && m->fault == FSM_NO_FAULT && @_run_invoked(m))
        acted = true;"""

FORGET = """        for (uint8_t i = 0u; i < sizeof m->to_invoke_; i++)
            m->to_invoke_[i] = 0u;"""

DUE_WITHIN = """
        uint32_t due = 0u;
        if (@_next_deadline(m, &due) && fsm_reached(now, due)) {
            (void)@_step_timer(m);
            allowance = %_MICROSTEPS;
            continue;
        }"""

TELL_END = """        @_tell_end(m);
        while (m->internal_count > 0u)
            (void)@_take_out(m->internal, &m->internal_count, %_INTERNAL, 0u);"""

ABANDON = """
void @_abandon(@ *m, uint32_t now)
{
    m->now = now;
    m->running = false;
    @_leave_0(m, 0u, true);
}
"""

DUE = """
        if (m->timer_count > 0u && fsm_reached(now, m->timers[0].deadline)) {
            (void)@_step_timer(m);
            allowance = %_MICROSTEPS;
            continue;
        }"""
