/* Events that content raises and sends, errors, and values outside of their ranges. */

static void self_raise(self *m, const self_event *e, bool tell)
{
    if (tell) {
        FSM_HOOK_EVENT(m, FSM_RAISED, e);
    }
    if (m->fsm.internal_count < SELF_INTERNAL) {
        m->fsm.internal[m->fsm.internal_count] = *e;
        m->fsm.internal_count++;
    } else {
        FSM_HOOK_TEXT(m, FSM_FULL, "internal", 0);
        self_stop(m, FSM_FAULT_INTERNAL, "internal");
    }
}

/* Raise an event without a payload. */
static void self_raise_plain(self *m, self_event_name event)
{
    self_event e = self_no_event;
    e.event = (self_event_number)event;
    self_raise(m, &e, true);
}

static void self_error(self *m, uint16_t event, const char *name)
{
    FSM_HOOK_TEXT(m, FSM_ERROR, name, 0);
    self_event e = self_no_event;
    e.event = (self_event_number)event;
    self_raise(m, &e, false);
}

static void self_end_block(self *m)
{
    uint8_t failed = m->fsm.failed;
    m->fsm.failed = FSM_FINE;
    if (failed == FSM_CONTENT_ERROR) {
        self_error(m, SELF_EVENT_ERROR_EXECUTION, "error.execution");
    } else if (failed == FSM_RANGE_FAULT) {
        self_stop(m, FSM_FAULT_RANGE, "range");
    }
}

static void self_send(self *m, const self_event *e)
{
    FSM_HOOK_EVENT(m, FSM_SENT, e);
    if (!self_enqueue(m, e)) {
        FSM_HOOK_TEXT(m, FSM_FULL, "queue", 0);
    }
}

/* The nearest bound of a range, and `error.range` for a value outside it. */
static int64_t self_clamp(self *m, int64_t value, int64_t lo, int64_t hi)
{
    if (m->fsm.failed != FSM_FINE || (value >= lo && value <= hi)) {
        return value < lo ? lo : value > hi ? hi : value;
    }
    self_error(m, SELF_EVENT_ERROR_RANGE, "error.range");
    return value < lo ? lo : hi;
}

static uint64_t self_clamp_u(self *m, bool below, uint64_t value, uint64_t lo, uint64_t hi)
{
    if (m->fsm.failed != FSM_FINE || (!below && value >= lo && value <= hi)) {
        return below || value < lo ? lo : value > hi ? hi : value;
    }
    self_error(m, SELF_EVENT_ERROR_RANGE, "error.range");
    return below || value < lo ? lo : hi;
}

static int64_t self_clamp_f(self *m, double value, int64_t lo, int64_t hi)
{
    bool outside = false;
    int64_t whole = fsm_truncate(value, lo, hi, &outside);
    if (outside && m->fsm.failed == FSM_FINE) {
        self_error(m, SELF_EVENT_ERROR_RANGE, "error.range");
    }
    return whole;
}

/* A condition that cannot be evaluated is false (SCXML 5.9.1). */
static bool self_holds(self *m, bool holds)
{
    if (m->fsm.failed == FSM_CONTENT_ERROR) {
        self_end_block(m);
        return false;
    }
    return holds && m->fsm.failed == FSM_FINE;
}

/* A guard that cannot be evaluated is false (SCXML 5.9.1). */
static bool self_guard_holds(self *m, bool holds)
{
    bool is_sound = m->fsm.failed == FSM_FINE;
    if (!is_sound) {
        self_end_block(m);
    }
    return is_sound && holds;
}
