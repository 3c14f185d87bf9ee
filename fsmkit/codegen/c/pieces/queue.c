/* The queue of events, and the fault that stops a machine. */

static const self_event self_no_event = SELF_NO_EVENT;

static void self_stop(self *m, fsm_fault fault, const char *why)
{
    if (m->fsm.fault == FSM_NO_FAULT) {
        m->fsm.fault = (uint8_t)fault;
        FSM_HOOK_TEXT(m, FSM_FAULT, why, 0);
    }
}

/* Take an event out of a queue; its bytes become zero, so equal queues have equal bytes. */
static self_event self_take_out(self_event *queue, uint8_t *count, uint8_t room, uint8_t place)
{
    self_event e = queue[place];
    (*count)--;
    for (; place < room - 1u && place < *count; place++) {
        queue[place] = queue[place + 1u];
    }
    queue[place] = self_no_event;
    return e;
}

static bool self_has_room(const self *m)
{
#if DEFERS
    return m->fsm.queue_count + m->fsm.deferred_count < SELF_QUEUE;
#else
    return m->fsm.queue_count < SELF_QUEUE;
#endif
}

/* Put an event into the queue; count it if the queue is full. */
static bool self_enqueue(self *m, const self_event *e)
{
#if DEFERS
    if (m->fsm.queue_count + m->fsm.deferred_count >= SELF_QUEUE) {
#else
    if (m->fsm.queue_count >= SELF_QUEUE) {
#endif
#if COUNTED
        fsm_count(&m->fsm.rejected);
#endif
        return false;
    }
    m->fsm.queue[m->fsm.queue_count] = *e;
    m->fsm.queue_count++;
    return true;
}

#if QUEUED
bool self_post(self *m, const self_event *e)
{
#ifdef FSM_CHECKED
    if (!self_is_allowed(e)) {
#if COUNTED
        fsm_count(&m->fsm.rejected);
#endif
        return false;
    }
#endif
    if (SELF_REJECTS_POSTS) {
#if COUNTED
        fsm_count(&m->fsm.rejected);
#endif
        FSM_HOOK_POST(m, e, false);
        return false;
    }
    const bool fits = self_enqueue(m, e);
    FSM_HOOK_POST(m, e, fits);
    return fits;
}

bool self_post_by_name(self *m, self_event_name event)
{
    self_event e = self_no_event;
    e.event = (self_event_number)event;
    return self_post(m, &e);
}
#endif
