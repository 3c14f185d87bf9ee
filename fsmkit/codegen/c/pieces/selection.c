/* Transitions that may preempt each other, and taking transitions by number. */

#if !SINGLE
typedef struct {
    self_taken at[SELF_REGIONS];
    self_region count;
    bool defers;
} self_selection;

static void self_add(self_selection *found, self_taken taken)
{
    if (taken == SELF_DEFER) {
        found->defers = true;
    }
    if (taken == 0u || taken == SELF_DEFER) {
        return;
    }
    for (self_region i = 0u; i < found->count; i++) {
        if (found->at[i] == taken) {
            return;
        }
    }
    if (found->count < SELF_REGIONS) { /* always: at most one for each region */
        found->at[found->count] = taken;
        found->count++;
    }
}

/* Return whether the exit sets of two transitions intersect. */
static bool self_conflict(uint16_t d1, uint16_t d2)
{
    if (d1 == 0u || d2 == 0u) {
        return false;
    }
    return (d1 <= d2 && d2 <= self_last_below[d1 - 1u]) || (d2 <= d1 && d1 <= self_last_below[d2 - 1u]);
}

/* Appendix D, removeConflictingTransitions. */
static void self_remove_conflicts(const self *m, self_selection *found)
{
    self_selection kept = {{0}, 0, false};
    for (self_region i = 0u; i < found->count; i++) {
        self_taken t1 = found->at[i];
        uint16_t d1 = self_domain(m, t1);
        bool preempted = false;
        self_selection rest = {{0}, 0, false};
        for (self_region j = 0u; j < kept.count; j++) {
            self_taken t2 = kept.at[j];
            bool wins = false;
            if (!preempted && self_conflict(d1, self_domain(m, t2))) {
                uint16_t s1 = self_source_of[t1];
                uint16_t s2 = self_source_of[t2];
                wins = s1 > s2 && s1 < self_last_below[s2];
                preempted = !wins;
            }
            if (!wins && rest.count < SELF_REGIONS) {
                rest.at[rest.count] = t2;
                rest.count++;
            }
        }
        if (!preempted && rest.count < SELF_REGIONS) {
            kept = rest;
            kept.at[kept.count] = t1;
            kept.count++;
        }
    }
    kept.defers = found->defers;
    *found = kept;
}

/* Exit, act, enter (Appendix D, microstep). The order of the atomic states that selected is also the
 * order of the domains, none of which contains another. */
static void self_microstep(self *m, const self_selection *found)
{
    uint16_t domains[SELF_REGIONS] = {0u};
    for (self_region i = 0u; i < found->count; i++) {
        domains[i] = self_domain(m, found->at[i]);
    }
#if HISTORIES
    for (self_region i = 0u; i < found->count; i++) {
        self_record(m, domains[i]);
    }
#endif
    for (self_region i = found->count; i > 0u; i--) {
        self_leave(m, domains[i - 1u]);
    }
    for (self_region i = 0u; i < found->count; i++) {
        self_act(m, found->at[i]);
    }
    for (self_region i = 0u; i < found->count; i++) {
        self_enter(m, found->at[i]);
    }
}

/* Return whether a transition of a state or of its descendants was selected. */
static bool self_is_answered(const self_selection *found, uint16_t state)
{
    for (uint16_t i = 0u; i < found->count; i++) {
        const uint16_t source = self_source_of[found->at[i]];
        if (source >= state && source < self_last_below[state]) {
            return true;
        }
    }
    return false;
}

static void self_take(self *m, const self_selection *found)
{
#if FAULTY
    if (found->count != 0u && m->fsm.fault == FSM_NO_FAULT) {
#else
    if (found->count != 0u) {
#endif
        self_microstep(m, found);
    }
}

static void self_take_one(self *m, self_taken taken)
{
    const self_selection found = {{taken}, 1u, false};
    self_take(m, &found);
}

static bool self_take_eventless(self *m)
{
    self_selection found = {{0}, 0, false};
    self_select_eventless_0(m, &found);
    SELF_FORGET_ASKED;
#if PREEMPTS
    self_remove_conflicts(m, &found);
#endif
    if (found.count == 0u) {
        return false;
    }
    if (self_may_go_on(m)) {
        self_take(m, &found);
    }
    return true;
}

/* The other events: their transitions may preempt each other. */
static fsm_result self_respond_any(self *m, const self_event *e)
{
    self_selection found = {{0}, 0, false};
    self_select_event_0(m, fsm_event_number(e->event), &found);
    SELF_FORGET_ASKED;
#if PREEMPTS
    self_remove_conflicts(m, &found);
#endif
    if (found.count == 0u) {
        return self_unhandled(m, e);
    }
    self_take(m, &found);
    return FSM_HANDLED;
}

#if DEFERS
static fsm_result self_react(self *m, const self_event *e, bool may_defer)
{
    self_selection found = {{0}, 0, false};
#if EVENT
    m->fsm.event = *e;
#endif
    SELF_STRAIGHT;
    self_select_event_0(m, fsm_event_number(e->event), &found);
    SELF_FORGET_ASKED;
#if SHARED_DEFERRAL
    const bool is_deferred = found.defers || self_is_kept(m, fsm_event_number(e->event), &found);
#else
    const bool is_deferred = found.defers;
#endif
    if (is_deferred && may_defer && self_has_room(m)) {
        m->fsm.deferred[m->fsm.deferred_count] = *e;
        m->fsm.deferred_count++;
        return FSM_IGNORED;
    }
#if PREEMPTS
    self_remove_conflicts(m, &found);
#endif
    if (is_deferred || found.count == 0u) {
        return self_unhandled(m, e);
    }
    self_take(m, &found);
    return FSM_HANDLED;
}
#endif
#endif

#if SINGLE
static void self_take(self *m, self_taken taken)
{
#if FAULTY
    if (taken == 0u || m->fsm.fault != FSM_NO_FAULT) {
#else
    if (taken == 0u) {
#endif
        return;
    }
    uint16_t domain = self_domain(m, taken);
#if HISTORIES
    self_record(m, domain);
#endif
    self_leave(m, domain);
    self_act(m, taken);
    self_enter(m, taken);
}

static bool self_take_eventless(self *m)
{
    self_taken taken = self_select_eventless(m);
    if (taken == 0u) {
        return false;
    }
    if (self_may_go_on(m)) {
        self_take(m, taken);
    }
    return true;
}

static fsm_result self_respond_any(self *m, const self_event *e)
{
    self_taken taken = self_select_event(m, fsm_event_number(e->event));
    if (taken == 0u) {
        return self_unhandled(m, e);
    }
    self_take(m, taken);
    return FSM_HANDLED;
}

#if DEFERS
static fsm_result self_react(self *m, const self_event *e, bool may_defer)
{
#if EVENT
    m->fsm.event = *e;
#endif
    SELF_STRAIGHT;
    self_taken taken = self_select_event(m, fsm_event_number(e->event));
    bool is_deferred = taken == SELF_DEFER;
    if (is_deferred) {
        taken = 0u;
    }
    if (is_deferred && may_defer && self_has_room(m)) {
        m->fsm.deferred[m->fsm.deferred_count] = *e;
        m->fsm.deferred_count++;
        return FSM_IGNORED;
    }
    if (taken == 0u) {
        return self_unhandled(m, e);
    }
    self_take(m, taken);
    return FSM_HANDLED;
}
#endif
#endif

#if !DEFERS
static fsm_result self_react(self *m, const self_event *e)
{
#if EVENT
    m->fsm.event = *e;
#endif
    return self_respond(m, e);
}
#endif

/* Return whether another microstep may follow: none after the limit or a fault. */
static bool self_may_go_on(self *m)
{
    if (m->fsm.budget == 0u) {
        self_stop(m, FSM_FAULT_MICROSTEPS, "microsteps");
        return false;
    }
    m->fsm.budget--;
    return m->fsm.fault == FSM_NO_FAULT;
}

static fsm_result self_respond(self *m, const self_event *e)
{
    return SELF_ANSWER(m, e);
}
