/* The steps of a machine: the loop of Appendix D, and the functions for hosts. */

static fsm_result self_unhandled(self *m, const self_event *e)
{
#if COUNTED
    fsm_count(&m->fsm.unhandled);
#endif
    FSM_HOOK_EVENT(m, FSM_UNHANDLED, e);
    SELF_STRICT;
    return FSM_IGNORED;
}

#if LOOPS
/* Run microsteps until the configuration is stable: Appendix D, inner loop of mainEventLoop. */
#endif
#if SETTLES && INVOKING
static bool self_complete(self *m)
#elif SETTLES
static bool self_settle(self *m)
#endif
#if SETTLES
{
#if LOOPS
    bool acted = false;
    while (m->fsm.running && m->fsm.fault == FSM_NO_FAULT) {
#if EVENTLESS
        if (self_take_eventless(m)) {
            acted = true;
            continue;
        }
#endif
#if RAISES
        if (m->fsm.internal_count == 0u || !self_may_go_on(m)) {
            break;
        }
        acted = true;
        self_event e = self_take_out(m->fsm.internal, &m->fsm.internal_count, SELF_INTERNAL, 0u);
        (void)self_react(m, &e SELF_NEVER);
#else
        break;
#endif
    }
#endif
#if INVOKING
    return acted;
}

/* Complete a macrostep of mainEventLoop: entered states invoke, and invoked machines run until quiet. */
static bool self_settle(self *m)
{
    bool acted = self_complete(m);
    while (SELF_WAITING && m->fsm.running && m->fsm.fault == FSM_NO_FAULT) {
        self_invoke(m);
        if (m->fsm.internal_count > 0u) {
            (void)self_complete(m);
        }
    }
#if SLOTS
    if (m->fsm.running && m->fsm.fault == FSM_NO_FAULT && self_run_invoked(m)) {
        acted = true;
    }
#endif
#endif
#if STOPS
    if (m->fsm.fault != FSM_NO_FAULT) {
        m->fsm.running = false;
#if ENDS
        m->fsm.finished = false;
#endif
#if RAISES
        while (m->fsm.internal_count > 0u) {
            (void)self_take_out(m->fsm.internal, &m->fsm.internal_count, SELF_INTERNAL, 0u);
        }
#endif
#if INVOKING
        fsm_clear(m->fsm.to_invoke_, sizeof m->fsm.to_invoke_);
#endif
#if ENDS
        return SELF_ACTED;
#endif
    }
#endif
#if ENDS
    if (!m->fsm.running) {
        SELF_LEAVE_MACHINE;
#if RAISES
        while (m->fsm.internal_count > 0u) {
            (void)self_take_out(m->fsm.internal, &m->fsm.internal_count, SELF_INTERNAL, 0u);
        }
#endif
#if QUEUED
        while (m->fsm.queue_count > 0u) {
            (void)self_take_out(m->fsm.queue, &m->fsm.queue_count, SELF_QUEUE, 0u);
        }
#endif
#if DEFERS
        while (m->fsm.deferred_count > 0u) {
            (void)self_take_out(m->fsm.deferred, &m->fsm.deferred_count, SELF_QUEUE, 0u);
        }
#endif
#if DELAYS
        while (m->fsm.delayed_count > 0u) {
            (void)self_undelay(m, 0u);
        }
#endif
#if TIMED
        while (m->fsm.timer_count > 0u) {
            fsm_timers_remove(m->fsm.timers, &m->fsm.timer_count, 0u);
        }
#endif
#if TELLS_END
        self_tell_end(m);
        while (m->fsm.internal_count > 0u) {
            (void)self_take_out(m->fsm.internal, &m->fsm.internal_count, SELF_INTERNAL, 0u);
        }
#endif
    }
#endif
    return SELF_ACTED;
}
#endif

#if RESTS
/* Clear the temporary data of a macrostep, so equal states have equal bytes. */
static void self_rest(self *m)
{
#if EVENT
    m->fsm.event = self_no_event;
#endif
#if LOOPS
    m->fsm.budget = 0u;
#endif
#if GUARDED
    m->fsm.busy = false;
#endif
}
#endif

#if BEGINS
static void self_begin(self *m)
{
#if GUARDED
    m->fsm.busy = true;
#endif
#if LOOPS
    m->fsm.budget = SELF_MICROSTEPS;
#endif
}
#endif

/* Run a macrostep for an event that was taken from its queue. */
static fsm_result self_macrostep(self *m, const self_event *e SELF_MAY_DEFER SELF_IS_EXTERNAL)
{
#if BEGINS
    self_begin(m);
#endif
#if EXTERNAL
    m->fsm.event = *e;
#endif
    FSM_HOOK_BEGIN(m, FSM_EVENT, 0);
    FSM_HOOK_EVENT(m, FSM_TAKEN, e);
#if EXTERNAL
    if (is_external) {
        self_external(m, e);
    }
#endif
#if LOOPS
    m->fsm.budget--;
#endif
    fsm_result result = self_react(m, e SELF_DEFERS);
#if SETTLES
    (void)self_settle(m);
#endif
#if RESTS
    self_rest(m);
#endif
    FSM_HOOK_END(m);
    return result;
}

#if QUEUED
bool self_step_event(self *m)
{
#if SLOTS || DEFERS
    if (SELF_REFUSES) {
        return false;
    }
#else
    if (m->fsm.queue_count == 0u || SELF_REFUSES) {
        return false;
    }
#endif
#if DEFERS
    for (uint8_t i = 0u; i < m->fsm.deferred_count; i++) {
        if (!self_is_deferred(m, (uint16_t)m->fsm.deferred[i].event)) {
            self_event recalled =
                self_take_out(m->fsm.deferred, &m->fsm.deferred_count, SELF_QUEUE, i);
            (void)self_macrostep(m, &recalled SELF_ALWAYS SELF_WITHIN);
            return true;
        }
    }
#endif
#if SLOTS
    if (m->fsm.queue_count == 0u) {
        return self_go_on(m);
    }
#elif DEFERS
    if (m->fsm.queue_count == 0u) {
        return false;
    }
#endif
    self_event e = self_take_out(m->fsm.queue, &m->fsm.queue_count, SELF_QUEUE, 0u);
    (void)self_macrostep(m, &e SELF_ALWAYS SELF_FROM_OUTSIDE);
    return true;
}
#endif

#if POLLS
bool self_step_eventless(self *m)
{
#if LOOPS
    if (SELF_REFUSES) {
        return false;
    }
    self_begin(m);
    FSM_HOOK_BEGIN(m, FSM_EVENTLESS, 0);
    bool acted = self_settle(m);
    self_rest(m);
    FSM_HOOK_END(m);
    return acted;
#else
    (void)m;
    return false;
#endif
}
#endif

#if RUNS
void self_run(self *m, uint32_t now)
{
#if GUARDED
    if (m->fsm.busy) {
        return;
    }
#endif
#if QUEUED && DEFERS
    uint32_t allowance = (uint32_t)m->fsm.queue_count + SELF_MICROSTEPS + m->fsm.deferred_count;
#elif QUEUED
    uint32_t allowance = (uint32_t)m->fsm.queue_count + SELF_MICROSTEPS;
#endif
#if NOW
    m->fsm.now = now;
#else
    (void)now;
#endif
#if SAMPLES
    (void)self_step_eventless(m);
#endif
    while (SELF_RUNNING) {
#if QUEUED
        if (allowance > 0u && self_step_event(m)) {
            allowance--;
            continue;
        }
#endif
#if SLOTS
        uint32_t due = 0u;
        if (self_next_deadline(m, &due) && fsm_reached(now, due)) {
#elif DEADLINES
        if (m->fsm.timer_count > 0u && fsm_reached(now, m->fsm.timers[0].deadline)) {
#endif
#if SLOTS || DEADLINES
            (void)self_step_timer(m);
#if QUEUED
            allowance = SELF_MICROSTEPS;
#endif
            continue;
        }
#endif
        break;
    }
#if NOW
    m->fsm.now = now;
#endif
}
#endif

fsm_result self_dispatch(self *m, const self_event *e, uint32_t now)
{
#if GUARDED
    if (m->fsm.busy) {
        return FSM_BUSY;
    }
#endif
#ifdef FSM_CHECKED
    if (!self_is_allowed(e)) {
        return FSM_REFUSED;
    }
#endif
#if CHECKED
    if (SELF_STOPPED) {
        return FSM_STOPPED;
    }
#else
#ifdef FSM_HOOKS /* which must not see this event; otherwise it is detected below */
    if (SELF_STOPPED) {
        return FSM_STOPPED;
    }
#endif
#endif
#if NOW
    m->fsm.now = now;
#else
    (void)now;
#endif
#if REPLIES
    m->fsm.reply = 0;
#endif
    return self_macrostep(m, e SELF_NEVER SELF_FROM_OUTSIDE);
}

bool self_finished(const self *m)
{
#if ENDS
    return m->fsm.finished;
#else
    (void)m;
    return false;
#endif
}

fsm_fault self_fault(const self *m)
{
#if STOPS
    return (fsm_fault)m->fsm.fault;
#else
    (void)m;
    return FSM_NO_FAULT;
#endif
}
