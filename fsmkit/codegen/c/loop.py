"""The steps of a generated machine, as C with the prefix and optional parts filled in.

``@`` stands for the prefix in lower case, ``%`` for that in upper case (see `fill`).
"""

REACT = """
static bool @_react(@ *m, const @_event *e)
{
[event]    m->event = *e;
    bool handled = @_respond(m, e);
    if (!handled)
        @_unhandled(m, e);
    return handled;
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
[loops]/* Until the configuration is stable: Appendix D, mainEventLoop, its inner loop. */
[settles]static bool @_$LOOP(@ *m)
[settles]{
[loops]    bool acted = false;
[loops]    while (m->running && m->fault == FSM_NO_FAULT) {
[eventless]        if (@_take_eventless(m)) {
[eventless]            acted = true;
[eventless]            continue;
[eventless]        }
[raises]        if (m->internal_count == 0u)
[raises]            break;
[raises]        acted = true;
[raises]        if (m->budget == 0u) {
[raises]            @_stop(m, FSM_FAULT_MICROSTEPS, "microsteps");
[raises]            break;
[raises]        }
[raises]        m->budget--;
[raises]        @_event e = @_take_out(m->internal, &m->internal_count, %_INTERNAL, 0u);
[raises]        (void)@_react(m, &e$NEVER);
[!raises][loops]        break;
[loops]    }
$INVOKE
[stops]    if (m->fault != FSM_NO_FAULT) {
[stops]        m->running = false;
[ends]        m->finished = false;
[raises]        while (m->internal_count > 0u)
[raises]            (void)@_take_out(m->internal, &m->internal_count, %_INTERNAL, 0u);
$FORGET
[stops][ends]        return $ACTED;
[stops]    }
[ends]    if (!m->running) {
[ends]        @_leave_0(m, 0u, true);
[ends][raises]        while (m->internal_count > 0u)
[ends][raises]            (void)@_take_out(m->internal, &m->internal_count, %_INTERNAL, 0u);
[ends]        while (m->queue_count > 0u)
[ends]            (void)@_take_out(m->queue, &m->queue_count, %_QUEUE, 0u);
$CLEAR
[ends]    }
[settles]    return $ACTED;
[settles]}

[rests]/* What is left of a macrostep is nothing, so that equal states are equal bytes. */
[rests]static void @_rest(@ *m)
[rests]{
[event]    m->event = @_no_event;
[loops]    m->budget = 0u;
[guarded]    m->busy = false;
[rests]}

[begins]static void @_begin(@ *m)
[begins]{
[guarded]    m->busy = true;
[loops]    m->budget = %_MICROSTEPS;
[begins]}

/* One macrostep for an event that is out of its queue; whether a transition was taken. */
static bool @_macrostep(@ *m, const @_event *e$MAY_DEFER$IS_EXTERNAL)
{
    bool handled;
[begins]    @_begin(m);
[external]    m->event = *e;
    FSM_HOOK_BEGIN(m, FSM_EVENT, 0);
    FSM_HOOK_EVENT(m, FSM_TAKEN, e);
$BEFORE
[loops]    m->budget--;
    handled = @_react(m, e$DEFER);
[settles]    (void)@_settle(m);
[rests]    @_rest(m);
    FSM_HOOK_END(m);
    return handled;
}

bool @_step_event(@ *m)
{
    if ($STOPPED)
        return false;
$RECALL
    if (m->queue_count == 0u)
        return $IDLE;
    @_event e = @_take_out(m->queue, &m->queue_count, %_QUEUE, 0u);
    (void)@_macrostep(m, &e$ALWAYS$EXTERNAL);
    return true;
}
"""

HOST = """
bool @_step_eventless(@ *m)
{
[!loops]    (void)m;
[!loops]    return false;
[loops]    if ($STOPPED)
[loops]        return false;
[loops]    @_begin(m);
[loops]    FSM_HOOK_BEGIN(m, FSM_EVENTLESS, 0);
[loops]    bool acted = @_settle(m);
[loops]    @_rest(m);
[loops]    FSM_HOOK_END(m);
[loops]    return acted;
}

void @_run(@ *m, uint32_t now)
{
    uint32_t allowance = (uint32_t)m->queue_count + %_MICROSTEPS$DEFERRED_PLUS;
[now]    m->now = now;
[!now]    (void)now;
$TRY_EVENTLESS
    while ($RUNNING) {
        if (allowance > 0u && @_step_event(m)) {
            allowance--;
            continue;
        }
$TIMER_DUE
        break;
    }
[now]    m->now = now;
}

fsm_result @_dispatch(@ *m, const @_event *e, uint32_t now)
{
[guarded]    if (m->busy)
[guarded]        return FSM_BUSY;
    if ($STOPPED)
        return FSM_STOPPED;
[now]    m->now = now;
[!now]    (void)now;
    return @_macrostep(m, e$NEVER$EXTERNAL) ? FSM_HANDLED : FSM_IGNORED;
}
"""

POST = """
bool @_post(@ *m, const @_event *e)
{
    if ($STOPPED || !@_has_room(m)) {
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
