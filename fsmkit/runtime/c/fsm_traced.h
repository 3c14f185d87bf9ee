/* fsm_traced.h: the code around the source of a machine that traces and logs its steps.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * X_trace.c includes it before the source of each machine, and once more as the last, with
 *
 *   FSM_TRACED         X, the prefix of the machine
 *   FSM_TRACED_NUMBER  its number among those of the chart: 0, or that of one in a slot
 *   FSM_TRACED_BYTES   an array with room for the longest record
 *   FSM_TRACED_NOW(m)  its time
 *   FSM_TRACED_BUSY(m) whether it is within a step
 *   FSM_TRACED_POSTS   defined: what its host posts is logged
 *   FSM_TRACED_RUNS    defined: it has a function X_run
 *   FSM_TRACED_CALLS   defined: what its host calls is to be defined here */
#ifndef FSM_TRACED_JOIN
#define FSM_TRACED_JOIN(a, b) a##b
#define FSM_TRACED_PASTE(a, b) FSM_TRACED_JOIN(a, b)
#define FSM_TRACED_NAME(name) FSM_TRACED_PASTE(FSM_TRACED, name)
#define FSM_TRACED_OWN(name) FSM_TRACED_PASTE(FSM_TRACED_PASTE(fsm_, FSM_TRACED), name)
#endif

#ifndef FSM_TRACED_CALLS
#undef FSM_HOOK_BEGIN
#undef FSM_HOOK_EVENT
#undef FSM_HOOK_TAKE
#undef FSM_HOOK_POST
#undef FSM_TRACED_RESULT
#define FSM_HOOK_BEGIN(m, cause, index)                                                            \
    ((void)(m),                                                                                    \
     fsm_trace_cause((cause) == FSM_TIMEOUT ? (uint16_t)FSM_TRACE_TIMEOUT : (uint16_t)0u))
#define FSM_HOOK_EVENT(m, what, e)                                                                 \
    ((void)(m), (void)(e),                                                                         \
     (what) == FSM_TAKEN ? fsm_trace_cause(fsm_event_number((e)->event)) : (void)0)
#define FSM_HOOK_TAKE(m, transition)                                                               \
    ((void)(m), fsm_trace_take((uint16_t)FSM_INSTANCE(m), FSM_TRACED_NUMBER, FSM_TRACED_NOW(m),    \
                               (uint16_t)(transition)))
#if defined FSM_TRACED_POSTS && defined FSM_LOGGED
#define FSM_HOOK_POST(m, e, fits)                                                                  \
    fsm_log_post(&FSM_TRACED_NAME(_info), (uint16_t)FSM_INSTANCE(m), e, fits,                      \
                 FSM_TRACED_BYTES)
#else
#define FSM_HOOK_POST(m, e, fits) FSM_UNUSED_2(m, e)
#endif
#ifdef FSM_LOGGED
#define FSM_TRACED_RESULT(operation, result)                                                       \
    fsm_log_called(&FSM_TRACED_NAME(_info), FSM_TRACED_NUMBER, operation, result,                  \
                   FSM_TRACED_BYTES)
#else
#define FSM_TRACED_RESULT(operation, result) ((void)(result))
#endif
#else

static void FSM_TRACED_OWN(_log_call)(fsm_log_kind kind, const FSM_TRACED *m,
                                      const FSM_TRACED_NAME(_event) *e, uint32_t now)
{
    fsm_trace_at(now);
#ifdef FSM_LOGGED
    fsm_log_call(kind, &FSM_TRACED_NAME(_info), (uint16_t)FSM_INSTANCE(m), m, e, now,
                 FSM_TRACED_BYTES);
#else
    (void)kind;
    (void)m;
    (void)e;
#endif
}

/* Within a step they do nothing, and nothing is to be done again. */
void FSM_TRACED_NAME(_start)(FSM_TRACED *m, uint32_t now)
{
    if (FSM_TRACED_BUSY(m)) {
        return;
    }
    FSM_TRACED_OWN(_log_call)(FSM_LOG_START, m, NULL, now);
    FSM_TRACED_OWN(_plain_start)(m, now);
    fsm_log_record(FSM_LOG_END, NULL, 0u);
}

#ifdef FSM_TRACED_RUNS
void FSM_TRACED_NAME(_run)(FSM_TRACED *m, uint32_t now)
{
    if (FSM_TRACED_BUSY(m)) {
        return;
    }
#ifdef FSM_LOGGED
    const bool is_idle = fsm_is_idle(&FSM_TRACED_NAME(_info), m, now);
#else
    const bool is_idle = false;
#endif
    if (!is_idle) {
        FSM_TRACED_OWN(_log_call)(FSM_LOG_RUN, m, NULL, now);
    }
    FSM_TRACED_OWN(_plain_run)(m, now);
    if (!is_idle) {
        fsm_log_record(FSM_LOG_END, NULL, 0u);
    }
}
#endif

fsm_result FSM_TRACED_NAME(_dispatch)(FSM_TRACED *m, const FSM_TRACED_NAME(_event) *e, uint32_t now)
{
    fsm_result result;
    if (FSM_TRACED_BUSY(m)) {
        return FSM_BUSY;
    }
    FSM_TRACED_OWN(_log_call)(FSM_LOG_DISPATCH, m, e, now);
    result = FSM_TRACED_OWN(_plain_dispatch)(m, e, now);
    fsm_log_record(FSM_LOG_END, NULL, 0u);
    return result;
}
#endif
