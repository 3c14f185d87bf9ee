"""The steps of a generated machine, as C with the prefix and optional parts filled in.

``@`` stands for the prefix in lower case, ``%`` for that in upper case (see `fill`).
"""

REACT = """
static fsm_result @_react(@ *m, const @_event *e)
{
[event]    m->event = *e;
    return @_respond(m, e);
}
"""

UNHANDLED = """
static fsm_result @_unhandled(@ *m, const @_event *e)
{
[counted]    fsm_count(&m->unhandled);
[!counted]    (void)m; /* for the hook alone */
    FSM_HOOK_EVENT(m, FSM_UNHANDLED, e);
$STRICT
    return FSM_IGNORED;
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
[raises]        if (m->internal_count == 0u || m->fault != FSM_NO_FAULT)
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
[stops][ends]        m->finished = false;
[raises]        while (m->internal_count > 0u)
[raises]            (void)@_take_out(m->internal, &m->internal_count, %_INTERNAL, 0u);
$FORGET
[stops][ends]        return $ACTED;
[stops]    }
[ends]    if (!m->running) {
[ends]        $LEAVE
[ends][raises]        while (m->internal_count > 0u)
[ends][raises]            (void)@_take_out(m->internal, &m->internal_count, %_INTERNAL, 0u);
[ends][queued]        while (m->queue_count > 0u)
[ends][queued]            (void)@_take_out(m->queue, &m->queue_count, %_QUEUE, 0u);
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

/* One macrostep for an event that is out of its queue. */
static fsm_result @_macrostep(@ *m, const @_event *e$MAY_DEFER$IS_EXTERNAL)
{
[begins]    @_begin(m);
[external]    m->event = *e;
    FSM_HOOK_BEGIN(m, FSM_EVENT, 0);
    FSM_HOOK_EVENT(m, FSM_TAKEN, e);
$BEFORE
[loops]    m->budget--;
    fsm_result result = @_react(m, e$DEFER);
[settles]    (void)@_settle(m);
[rests]    @_rest(m);
    FSM_HOOK_END(m);
    return result;
}

[queued]bool @_step_event(@ *m)
[queued]{
[queued][guarded]    if (m->busy)
[queued][guarded]        return false;
[queued]    if ($STOPPED)
[queued]        return false;
$RECALL
[queued]    if (m->queue_count == 0u)
[queued]        return $IDLE;
[queued]    @_event e = @_take_out(m->queue, &m->queue_count, %_QUEUE, 0u);
[queued]    (void)@_macrostep(m, &e$ALWAYS$EXTERNAL);
[queued]    return true;
[queued]}
"""

HOST = """
[polls]bool @_step_eventless(@ *m)
[polls]{
[polls][!loops]    (void)m;
[polls][!loops]    return false;
[polls][loops][guarded]    if (m->busy)
[polls][loops][guarded]        return false;
[polls][loops]    if ($STOPPED)
[polls][loops]        return false;
[polls][loops]    @_begin(m);
[polls][loops]    FSM_HOOK_BEGIN(m, FSM_EVENTLESS, 0);
[polls][loops]    bool acted = @_settle(m);
[polls][loops]    @_rest(m);
[polls][loops]    FSM_HOOK_END(m);
[polls][loops]    return acted;
[polls]}

[runs]void @_run(@ *m, uint32_t now)
[runs]{
[runs][guarded]    if (m->busy)
[runs][guarded]        return;
[runs][queued]    uint32_t allowance = (uint32_t)m->queue_count + %_MICROSTEPS$DEFERRED_PLUS;
[runs][now]    m->now = now;
[runs][!now]    (void)now;
$TRY_EVENTLESS
[runs]    while ($RUNNING) {
[runs][queued]        if (allowance > 0u && @_step_event(m)) {
[runs][queued]            allowance--;
[runs][queued]            continue;
[runs][queued]        }
$TIMER_DUE
[runs]        break;
[runs]    }
[runs][now]    m->now = now;
[runs]}

fsm_result @_dispatch(@ *m, const @_event *e, uint32_t now)
{
[guarded]    if (m->busy)
[guarded]        return FSM_BUSY;
#ifdef FSM_CHECKED
    if (!@_is_allowed(e))
        return FSM_REFUSED;
#endif
[!checked]#ifdef FSM_HOOKS /* which must not be told of it; otherwise it is found out below */
    if ($STOPPED)
        return FSM_STOPPED;
[!checked]#endif
[now]    m->now = now;
[!now]    (void)now;
[replies]    m->reply = 0;
    return @_macrostep(m, e$NEVER$EXTERNAL);
}
"""

POST = """
[queued]bool @_post(@ *m, const @_event *e)
[queued]{
[queued]#ifdef FSM_CHECKED
[queued]    if (!@_is_allowed(e)) {
[queued][counted]        fsm_count(&m->rejected);
[queued]        return false;
[queued]    }
[queued]#endif
[queued]    if ($STOPPED) {
[queued][counted]        fsm_count(&m->rejected);
[queued]        FSM_HOOK_POST(m, e, false);
[queued]        return false;
[queued]    }
[queued]    const bool fits = @_enqueue(m, e);
[queued]    FSM_HOOK_POST(m, e, fits);
[queued]    return fits;
[queued]}
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

FORGET = "        fsm_clear(m->to_invoke_, sizeof m->to_invoke_);"

DUE_WITHIN = """
        uint32_t due = 0u;
        if (@_next_deadline(m, &due) && fsm_reached(now, due)) {
            (void)@_step_timer(m);
[queued]            allowance = %_MICROSTEPS;
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
    $LEAVE
}
"""

DUE = """
        if (m->timer_count > 0u && fsm_reached(now, m->timers[0].deadline)) {
            (void)@_step_timer(m);
[queued]            allowance = %_MICROSTEPS;
            continue;
        }"""
