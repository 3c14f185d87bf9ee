"""The steps of a generated machine, as C with the prefix and optional parts filled in.

``@`` stands for the prefix in lower case, ``%`` for that in upper case (see `fill`).
"""

REACT = """
static fsm_result @_react(@ *m, const @_event *e)
{
[event]    m->fsm.event = *e;
    return @_respond(m, e);
}
"""

UNHANDLED = """
static fsm_result @_unhandled(@ *m, const @_event *e)
{
[counted]    fsm_count(&m->fsm.unhandled);
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
[loops]    while (m->fsm.running && m->fsm.fault == FSM_NO_FAULT) {
[eventless]        if (@_take_eventless(m)) {
[eventless]            acted = true;
[eventless]            continue;
[eventless]        }
[raises]        if (m->fsm.internal_count == 0u || !@_may_go_on(m)) {
[raises]            break;
[raises]        }
[raises]        acted = true;
[raises]        @_event e = @_take_out(m->fsm.internal, &m->fsm.internal_count, %_INTERNAL, 0u);
[raises]        (void)@_react(m, &e$NEVER);
[!raises][loops]        break;
[loops]    }
$INVOKE
[stops]    if (m->fsm.fault != FSM_NO_FAULT) {
[stops]        m->fsm.running = false;
[stops][ends]        m->fsm.finished = false;
[raises]        while (m->fsm.internal_count > 0u) {
[raises]            (void)@_take_out(m->fsm.internal, &m->fsm.internal_count, %_INTERNAL, 0u);
[raises]        }
$FORGET
[stops][ends]        return $ACTED;
[stops]    }
[ends]    if (!m->fsm.running) {
[ends]        $LEAVE
[ends][raises]        while (m->fsm.internal_count > 0u) {
[ends][raises]            (void)@_take_out(m->fsm.internal, &m->fsm.internal_count, %_INTERNAL, 0u);
[ends][raises]        }
[ends][queued]        while (m->fsm.queue_count > 0u) {
[ends][queued]            (void)@_take_out(m->fsm.queue, &m->fsm.queue_count, %_QUEUE, 0u);
[ends][queued]        }
$CLEAR
[ends]    }
[settles]    return $ACTED;
[settles]}

[rests]/* What is left of a macrostep is nothing, so that equal states are equal bytes. */
[rests]static void @_rest(@ *m)
[rests]{
[event]    m->fsm.event = @_no_event;
[loops]    m->fsm.budget = 0u;
[guarded]    m->fsm.busy = false;
[rests]}

[begins]static void @_begin(@ *m)
[begins]{
[guarded]    m->fsm.busy = true;
[loops]    m->fsm.budget = %_MICROSTEPS;
[begins]}

/* One macrostep for an event that is out of its queue. */
static fsm_result @_macrostep(@ *m, const @_event *e$MAY_DEFER$IS_EXTERNAL)
{
[begins]    @_begin(m);
[external]    m->fsm.event = *e;
    FSM_HOOK_BEGIN(m, FSM_EVENT, 0);
    FSM_HOOK_EVENT(m, FSM_TAKEN, e);
$BEFORE
[loops]    m->fsm.budget--;
    fsm_result result = @_react(m, e$DEFER);
[settles]    (void)@_settle(m);
[rests]    @_rest(m);
    FSM_HOOK_END(m);
    return result;
}

[queued]bool @_step_event(@ *m)
[queued]{
[queued]    if ($HAS_NOTHING) {
[queued]        return false;
[queued]    }
$RECALL
[queued]    @_event e = @_take_out(m->fsm.queue, &m->fsm.queue_count, %_QUEUE, 0u);
[queued]    (void)@_macrostep(m, &e$ALWAYS$EXTERNAL);
[queued]    return true;
[queued]}
"""

HOST = """
[polls]bool @_step_eventless(@ *m)
[polls]{
[polls][!loops]    (void)m;
[polls][!loops]    return false;
[polls][loops]    if ($REFUSES) {
[polls][loops]        return false;
[polls][loops]    }
[polls][loops]    @_begin(m);
[polls][loops]    FSM_HOOK_BEGIN(m, FSM_EVENTLESS, 0);
[polls][loops]    bool acted = @_settle(m);
[polls][loops]    @_rest(m);
[polls][loops]    FSM_HOOK_END(m);
[polls][loops]    return acted;
[polls]}

[runs]void @_run(@ *m, uint32_t now)
[runs]{
[runs][guarded]    if (m->fsm.busy) {
[runs][guarded]        return;
[runs][guarded]    }
[runs][queued]    uint32_t allowance = (uint32_t)m->fsm.queue_count + %_MICROSTEPS$DEFERRED_PLUS;
[runs][now]    m->fsm.now = now;
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
[runs][now]    m->fsm.now = now;
[runs]}

fsm_result @_dispatch(@ *m, const @_event *e, uint32_t now)
{
[guarded]    if (m->fsm.busy) {
[guarded]        return FSM_BUSY;
[guarded]    }
#ifdef FSM_CHECKED
    if (!@_is_allowed(e)) {
        return FSM_REFUSED;
    }
#endif
[!checked]#ifdef FSM_HOOKS /* which must not be told of it; otherwise it is found out below */
    if ($STOPPED) {
        return FSM_STOPPED;
    }
[!checked]#endif
[now]    m->fsm.now = now;
[!now]    (void)now;
[replies]    m->fsm.reply = 0;
    return @_macrostep(m, e$NEVER$EXTERNAL);
}
"""

POST = """
[queued]bool @_post(@ *m, const @_event *e)
[queued]{
[queued]#ifdef FSM_CHECKED
[queued]    if (!@_is_allowed(e)) {
[queued][counted]        fsm_count(&m->fsm.rejected);
[queued]        return false;
[queued]    }
[queued]#endif
[queued]    if ($STOPPED) {
[queued][counted]        fsm_count(&m->fsm.rejected);
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
    while ($WAITING && m->fsm.running && m->fsm.fault == FSM_NO_FAULT) {
        @_invoke(m);
        if (m->fsm.internal_count > 0u) {
            (void)@_complete(m);
        }
    }"""

RUN_INVOKED = """
    if (m->fsm.running && m->fsm.fault == FSM_NO_FAULT && @_run_invoked(m)) {
        acted = true;
    }"""

FORGET = "        fsm_clear(m->fsm.to_invoke_, sizeof m->fsm.to_invoke_);"

DUE_WITHIN = """
        uint32_t due = 0u;
        if (@_next_deadline(m, &due) && fsm_reached(now, due)) {
            (void)@_step_timer(m);
[queued]            allowance = %_MICROSTEPS;
            continue;
        }"""

TELL_END = """        @_tell_end(m);
        while (m->fsm.internal_count > 0u) {
            (void)@_take_out(m->fsm.internal, &m->fsm.internal_count, %_INTERNAL, 0u);
        }"""

ABANDON = """
void @_abandon(@ *m, uint32_t now)
{
    m->fsm.now = now;
    m->fsm.running = false;
    $LEAVE
}
"""

DUE = """
        if (m->fsm.timer_count > 0u && fsm_reached(now, m->fsm.timers[0].deadline)) {
            (void)@_step_timer(m);
[queued]            allowance = %_MICROSTEPS;
            continue;
        }"""
