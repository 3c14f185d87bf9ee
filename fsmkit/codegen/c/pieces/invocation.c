/* Machines in the slots of another, and the events between them (SCXML 6.4, 6.5). */

/* Send an event to the invoker; it is dropped while the invoker cancels this machine. */
static void self_to_invoker(self *m, const self_event *e)
{
    FSM_HOOK_EVENT(m, FSM_LEFT, e);
    FSM_HOOK_TEXT(m, FSM_LEFT, "", SELF_INVOKER);
    if (!m->fsm.running && !m->fsm.finished) {
        return;
    }
#if INVOKED
    if (self_return(m, e)) {
        return;
    }
#else
    fsm_count(&m->fsm.rejected);
#endif
    FSM_HOOK_TEXT(m, FSM_FULL, "queue", 0);
}

#if SLOTS
/* Clear the slot `SLOT_ID` after its machine has ended; its fault stops this machine. */
static void self_absorb_N(self *m)
{
    if (m->SLOT.fsm.running) {
        return;
    }
    if (m->SLOT.fsm.fault != FSM_NO_FAULT) {
        self_stop(m, FSM_FAULT_INVOKED, "invoked");
    } else {
        inside_init(&m->SLOT);
    }
}

/* End the machine when its state is exited (SCXML 6.4.3). */
static void self_end_N(self *m)
{
    if (!m->SLOT.fsm.running) {
        return;
    }
    inside_abandon(&m->SLOT, m->fsm.now);
    self_absorb_N(m);
}

/* Return the machine whose slot `SLOT_ID` contains a machine. */
static self *self_holder_of_N(inside *m)
{
    return (self *)(void *)((unsigned char *)m - offsetof(self, SLOT));
}

/* Process one event of each invoked machine, in document order, until all are quiet. The events left
 * after the maximum of rounds wait for the next step. */
static bool self_run_invoked(self *m)
{
    bool acted = false;
    for (uint32_t round = 0u; round < SELF_MICROSTEPS; round++) {
        bool is_quiet = true;
        SELF_STEP_SLOTS;
        if (is_quiet) {
            break;
        }
        acted = true;
        if (m->fsm.fault != FSM_NO_FAULT) {
            break;
        }
    }
    return acted;
}

/* The step of this machine is complete: run the invoked machines. */
static bool self_go_on(self *m)
{
    m->fsm.busy = true;
    bool acted = m->fsm.fault == FSM_NO_FAULT && self_run_invoked(m);
    if (m->fsm.fault != FSM_NO_FAULT) {
        m->fsm.running = false;
        m->fsm.finished = false;
    }
    m->fsm.busy = false;
    return acted;
}

/* Fire the first timer of an invoked machine. */
static void self_step_timer_within(self *m, uint32_t deadline)
{
    uint32_t due = 0u;
    m->fsm.now = deadline;
    m->fsm.busy = true;
    SELF_STEP_TIMERS;
    (void)self_go_on(m);
}
#endif

#if INVOKED
void self_abandon(self *m, uint32_t now)
{
    m->fsm.now = now;
    m->fsm.running = false;
    SELF_LEAVE_MACHINE;
}
#endif
