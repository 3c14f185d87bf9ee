"""Transitions that may preempt each other, and how any are taken: C with the prefix filled in.

``@`` stands for the prefix in lower case, ``%`` for that in upper case, ``$TAKEN`` and ``$REGION``
for the types that hold the numbers of all transitions and of all regions (see `fill`).
"""

SELECTION = """
typedef struct {
    $TAKEN at[%_REGIONS];
    $REGION count;
    bool defers;
} @_selection;
"""

ADD = """
static void @_add(@_selection *found, $TAKEN taken)
{
    if (taken == %_DEFER) {
        found->defers = true;
    }
    if (taken == 0u || taken == %_DEFER) {
        return;
    }
    for ($REGION i = 0u; i < found->count; i++) {
        if (found->at[i] == taken) {
            return;
        }
    }
    if (found->count < %_REGIONS) { /* always: at most one for each region */
        found->at[found->count] = taken;
        found->count++;
    }
}
"""

CONFLICTS = """
/* Whether what one transition leaves and what the other leaves have states in common. */
static bool @_conflict(uint16_t d1, uint16_t d2)
{
    if (d1 == 0u || d2 == 0u) {
        return false;
    }
    return (d1 <= d2 && d2 <= @_last_below[d1 - 1u]) || (d2 <= d1 && d1 <= @_last_below[d2 - 1u]);
}

/* Appendix D, removeConflictingTransitions. */
static void @_remove_conflicts(const @ *m, @_selection *found)
{
    @_selection kept = {{0}, 0, false};
    for ($REGION i = 0u; i < found->count; i++) {
        $TAKEN t1 = found->at[i];
        uint16_t d1 = @_domain(m, t1);
        bool preempted = false;
        @_selection rest = {{0}, 0, false};
        for ($REGION j = 0u; j < kept.count; j++) {
            $TAKEN t2 = kept.at[j];
            bool wins = false;
            if (!preempted && @_conflict(d1, @_domain(m, t2))) {
                uint16_t s1 = @_source_of[t1];
                uint16_t s2 = @_source_of[t2];
                wins = s1 > s2 && s1 < @_last_below[s2];
                preempted = !wins;
            }
            if (!wins && rest.count < %_REGIONS) {
                rest.at[rest.count] = t2;
                rest.count++;
            }
        }
        if (!preempted && rest.count < %_REGIONS) {
            kept = rest;
            kept.at[kept.count] = t1;
            kept.count++;
        }
    }
    kept.defers = found->defers;
    *found = kept;
}

/* Leave, act, enter (Appendix D, microstep), in the order of the atomic states that selected what
   is found: that is the order of the domains, too, none of which is in another. */
static void @_microstep(@ *m, const @_selection *found)
{
    uint16_t domains[%_REGIONS] = {0u};
    for ($REGION i = 0u; i < found->count; i++) {
        domains[i] = @_domain(m, found->at[i]);
    }
$RECORD_ALL
    for ($REGION i = found->count; i > 0u; i--) {
        @_leave(m, domains[i - 1u]);
    }
    for ($REGION i = 0u; i < found->count; i++) {
        @_act(m, found->at[i]);
    }
    for ($REGION i = 0u; i < found->count; i++) {
        @_enter(m, found->at[i]);
    }
}
"""

TAKE_SINGLE = """
static void @_take(@ *m, $TAKEN taken)
{
    if (taken == 0u$FAULTY) {
        return;
    }
    uint16_t domain = @_domain(m, taken);
    $RECORD
    @_leave(m, domain);
    @_act(m, taken);
    @_enter(m, taken);
}
"""

TAKE_MANY = """
static void @_take(@ *m, const @_selection *found)
{
    if (found->count != 0u$SOUND) {
        @_microstep(m, found);
    }
}
"""

TAKE_ONE = """
static void @_take_one(@ *m, $TAKEN taken)
{
    const @_selection found = {{taken}, 1u, false};
    @_take(m, &found);
}
"""

RESPOND_SINGLE = """
static fsm_result @_respond_any(@ *m, const @_event *e)
{
    $TAKEN taken = @_select_event(m, fsm_event_number(e->event));
    if (taken == 0u) {
        return @_unhandled(m, e);
    }
    @_take(m, taken);
    return FSM_HANDLED;
}
"""

RESPOND_ANY = """
/* What is left of the events: transitions that may preempt each other. */
static fsm_result @_respond_any(@ *m, const @_event *e)
{
    @_selection found = {{0}, 0, false};
    @_select_event_0(m, fsm_event_number(e->event), &found);
    $FORGET
    $PREEMPT
    if (found.count == 0u) {
        return @_unhandled(m, e);
    }
    @_take(m, &found);
    return FSM_HANDLED;
}
"""

RESPOND = """
static fsm_result @_respond(@ *m, const @_event *e)
{
    return @_$ANSWER(m, e);
}
"""

REACT_SINGLE = """
static fsm_result @_react(@ *m, const @_event *e, bool may_defer)
{
[event]    m->fsm.event = *e;
$STRAIGHT
    $TAKEN taken = @_select_event(m, fsm_event_number(e->event));
    bool is_deferred = taken == %_DEFER;
    if (is_deferred) {
        taken = 0u;
    }
    if (is_deferred && may_defer && m->fsm.deferred_count < %_QUEUE) {
        m->fsm.deferred[m->fsm.deferred_count] = *e;
        m->fsm.deferred_count++;
        return FSM_IGNORED;
    }
    if (taken == 0u) {
        return @_unhandled(m, e);
    }
    @_take(m, taken);
    return FSM_HANDLED;
}
"""

REACT_MANY = """
static fsm_result @_react(@ *m, const @_event *e, bool may_defer)
{
    @_selection found = {{0}, 0, false};
[event]    m->fsm.event = *e;
$STRAIGHT
    @_select_event_0(m, fsm_event_number(e->event), &found);
    $FORGET
    const bool is_deferred = $KEPT;
    if (is_deferred && may_defer && m->fsm.deferred_count < %_QUEUE) {
        m->fsm.deferred[m->fsm.deferred_count] = *e;
        m->fsm.deferred_count++;
        return FSM_IGNORED;
    }
    $PREEMPT
    if (is_deferred || found.count == 0u) {
        return @_unhandled(m, e);
    }
    @_take(m, &found);
    return FSM_HANDLED;
}
"""

MAY_GO_ON = """
/* Whether there may be another microstep: not one too many, and not after a fault. */
static bool @_may_go_on(@ *m)
{
    if (m->fsm.budget == 0u) {
        @_stop(m, FSM_FAULT_MICROSTEPS, "microsteps");
        return false;
    }
    m->fsm.budget--;
    return m->fsm.fault == FSM_NO_FAULT;
}
"""

EVENTLESS_SINGLE = """
static bool @_take_eventless(@ *m)
{
    $TAKEN taken = @_select_eventless(m);
    if (taken == 0u) {
        return false;
    }
    if (@_may_go_on(m)) {
        @_take(m, taken);
    }
    return true;
}
"""

EVENTLESS_MANY = """
static bool @_take_eventless(@ *m)
{
    @_selection found = {{0}, 0, false};
    @_select_eventless_0(m, &found);
    $FORGET
    $PREEMPT
    if (found.count == 0u) {
        return false;
    }
    if (@_may_go_on(m)) {
        @_take(m, &found);
    }
    return true;
}
"""
