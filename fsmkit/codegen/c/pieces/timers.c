/* Timers of states, and delayed events. */

static void self_arm(self *m, uint16_t transition, uint32_t delay)
{
    const fsm_timer timer = {m->fsm.now + delay, transition, 0u};
    if (m->fsm.timer_count < SELF_TIMERS) { /* always: room for each that is armed at once */
        (void)fsm_timers_insert(m->fsm.timers, &m->fsm.timer_count, timer);
    }
}

static void self_disarm(self *m, uint16_t transition)
{
    fsm_timers_disarm(m->fsm.timers, &m->fsm.timer_count, transition);
}

#if DELAYS
/* Delayed events are in the order of their timers, so equal states have equal bytes. */
static void self_delay(self *m, const self_event *e, uint32_t delay, uint16_t mark, uint16_t route,
                    uint16_t peer)
{
    FSM_HOOK_EVENT(m, FSM_DELAYED, e);
    FSM_HOOK_TEXT(m, FSM_DELAYED, "", delay);
    if (m->fsm.delayed_count >= SELF_DELAYED || m->fsm.timer_count >= SELF_TIMERS) {
#if COUNTED
        fsm_count(&m->fsm.rejected);
#endif
        FSM_HOOK_TEXT(m, FSM_FULL, "delayed", 0);
        return;
    }
    const fsm_timer timer = {m->fsm.now + delay, FSM_TIMER_SEND, mark};
    uint8_t place = fsm_timers_insert(m->fsm.timers, &m->fsm.timer_count, timer);
    uint8_t rank = 0u;
    for (uint8_t i = 0u; i < place && rank + 1u < SELF_DELAYED; i++) {
        rank = (uint8_t)(rank + (m->fsm.timers[i].what == FSM_TIMER_SEND ? 1u : 0u));
    }
    for (uint8_t i = SELF_DELAYED - 1u; i > rank; i--) {
        m->fsm.delayed[i] = m->fsm.delayed[i - 1u];
    }
    m->fsm.delayed_count++;
    m->fsm.delayed[rank].e = *e;
    m->fsm.delayed[rank].peer = peer;
    m->fsm.delayed[rank].route = route;
}

static self_delayed self_undelay(self *m, uint8_t rank)
{
    static const self_delayed none = {SELF_NO_EVENT, 0u, 0u};
    self_delayed found = m->fsm.delayed[rank];
    m->fsm.delayed_count--;
    for (; rank + 1u < SELF_DELAYED && rank < m->fsm.delayed_count; rank++) {
        m->fsm.delayed[rank] = m->fsm.delayed[rank + 1u];
    }
    m->fsm.delayed[rank] = none;
    return found;
}

/* Cancel the pending delayed sends with an id. */
static void self_cancel(self *m, uint16_t mark)
{
    uint8_t rank = 0u;
    uint8_t place = 0u;
    while (place < m->fsm.timer_count && rank < SELF_DELAYED) {
        if (m->fsm.timers[place].what != FSM_TIMER_SEND) {
            place++;
        } else if (m->fsm.timers[place].mark == mark) {
            fsm_timers_remove(m->fsm.timers, &m->fsm.timer_count, place);
            (void)self_undelay(m, rank);
        } else {
            place++;
            rank++;
        }
    }
}

#else
/* The machine has no delayed events, so there is nothing to cancel. */
static void self_cancel(self *m, uint16_t mark)
{
    (void)m;
    (void)mark;
}
#endif
