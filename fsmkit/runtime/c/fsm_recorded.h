/* fsm_recorded.h: the code around the source of a machine that records its steps.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * X_records.c includes it before the source of each machine, and once more as the last, with
 *
 *   FSM_RECORDED         X, the prefix of the machine
 *   FSM_RECORDED_FIRST   the number of its first transition
 *   FSM_RECORDED_START   the number of its start
 *   FSM_RECORDED_NOW(m)  the time of its step
 *   FSM_RECORDED_BUSY(m) whether it is within a step
 *   FSM_RECORDED_STOPPED(m) whether it does not run
 *   FSM_RECORDED_HOSTED  defined: a host runs it; it is in no slot
 *   FSM_RECORDED_RUNS    defined: it has a function X_run
 *   FSM_RECORDED_SAVED   defined: it can be saved
 *   FSM_RECORDED_SYNC    ticks from one whole state to the next
 *   FSM_RECORDED_CALLS   defined: what its host calls is to be defined here
 *
 * Another observer may be called after each record: FSM_RECORDED_AND, defined, says that the
 * macros FSM_RECORDED_AND_BEGIN ... do so, which have the arguments of FSM_HOOK_BEGIN ... */
#ifndef FSM_RECORDED_AND
#define FSM_RECORDED_AND
#define FSM_RECORDED_AND_BEGIN(m, cause, index) ((void)(m))
#define FSM_RECORDED_AND_TAKE(m, transition) ((void)(m))
#define FSM_RECORDED_AND_EVENT(m, what, e) ((void)(m), (void)(e))
#define FSM_RECORDED_AND_LEFT(m, type, number, peer) ((void)(m))
#define FSM_RECORDED_AND_TEXT(m, what, text, number) ((void)(m), (void)(text), (void)(number))
#endif
#ifndef FSM_RECORDED_JOIN
#define FSM_RECORDED_JOIN(a, b) a##b
#define FSM_RECORDED_PASTE(a, b) FSM_RECORDED_JOIN(a, b)
#define FSM_RECORDED_NAME(name) FSM_RECORDED_PASTE(FSM_RECORDED, name)
#define FSM_RECORDED_OWN(name) FSM_RECORDED_PASTE(FSM_RECORDED_PASTE(fsm_, FSM_RECORDED), name)
#endif

#ifndef FSM_RECORDED_CALLS
#undef FSM_HOOK_BEGIN
#undef FSM_HOOK_EVENT
#undef FSM_HOOK_LEFT
#undef FSM_HOOK_TEXT
#undef FSM_HOOK_TAKE
#undef FSM_HOOK_POST
#define FSM_RECORDED_PUT(now, number) FSM_RECORDS_NUMBER(now, number, FSM_RECORDS_INSTANCE)
#if FSM_TRACE_LEVEL >= 2
#define FSM_RECORDED_TOUCH() (fsm_records.call.is_open = true)
#define FSM_HOOK_TAKE(m, transition)                                                               \
    do {                                                                                           \
        FSM_RECORDED_TOUCH();                                                                      \
        FSM_RECORDED_PUT(fsm_records.call.now, FSM_RECORDED_FIRST + (uint32_t)(transition));       \
        FSM_RECORDED_AND_TAKE(m, transition);                                                      \
    } while (0)
/* Trying eventless transitions is nothing yet: it happens at every call. */
#define FSM_HOOK_BEGIN(m, cause, index)                                                            \
    do {                                                                                           \
        (void)(m);                                                                                 \
        if ((cause) != FSM_EVENTLESS)                                                              \
            FSM_RECORDED_TOUCH();                                                                  \
        if ((cause) == FSM_START)                                                                  \
            FSM_RECORDED_PUT(fsm_records.call.now, FSM_RECORDED_START);                            \
        FSM_RECORDED_AND_BEGIN(m, cause, index);                                                   \
    } while (0)
#define FSM_HOOK_LEFT(m, type, number, peer)                                                       \
    do {                                                                                           \
        FSM_RECORDED_TOUCH();                                                                      \
        FSM_RECORDED_AND_LEFT(m, type, number, peer);                                              \
    } while (0)
#define FSM_HOOK_TEXT(m, what, text, number)                                                       \
    (FSM_RECORDED_TOUCH(), FSM_RECORDED_AND_TEXT(m, what, text, number))
#ifdef FSM_RECORDED_HOSTED
#define FSM_HOOK_EVENT(m, what, e)                                                                 \
    do {                                                                                           \
        FSM_UNUSED_2(m, e);                                                                        \
        FSM_RECORDED_TOUCH();                                                                      \
        if ((what) == FSM_TAKEN && fsm_records.call.is_dispatched)                                 \
            FSM_RECORDED_OWN(_came)(m, e, true);                                                   \
        FSM_RECORDED_AND_EVENT(m, what, e);                                                        \
    } while (0)
#define FSM_HOOK_POST(m, e, fits) FSM_RECORDED_OWN(_came)(m, e, false)
#else
#define FSM_HOOK_EVENT(m, what, e)                                                                 \
    do {                                                                                           \
        FSM_RECORDED_TOUCH();                                                                      \
        FSM_RECORDED_AND_EVENT(m, what, e);                                                        \
    } while (0)
#define FSM_HOOK_POST(m, e, fits) FSM_UNUSED_2(m, e)
#endif
#else
#define FSM_HOOK_TAKE(m, transition)                                                               \
    FSM_RECORDED_PUT(FSM_RECORDED_NOW(m), FSM_RECORDED_FIRST + (uint32_t)(transition))
#define FSM_HOOK_BEGIN(m, cause, index)                                                            \
    ((cause) == FSM_START ? FSM_RECORDED_PUT(FSM_RECORDED_NOW(m), FSM_RECORDED_START) : (void)0)
#define FSM_HOOK_EVENT(m, what, e) FSM_UNUSED_2(m, e)
#define FSM_HOOK_LEFT(m, type, number, peer) ((void)(m))
#define FSM_HOOK_TEXT(m, what, text, number) FSM_UNUSED_3(m, text, number)
#define FSM_HOOK_POST(m, e, fits) FSM_UNUSED_2(m, e)
#endif
#else

/* Within a step these calls have no effect, so they are not recorded. */
void FSM_RECORDED_NAME(_start)(FSM_RECORDED *m, uint32_t now)
{
    if (FSM_RECORDED_BUSY(m)) {
        return;
    }
    const fsm_records_call outer = fsm_records_enter(FSM_INSTANCE_OF(m), now);
    FSM_RECORDED_OWN(_sync)(m, now);
#if FSM_TRACE_LEVEL >= 2
    FSM_RECORDED_OWN(_read)(m, true);
#endif
    FSM_RECORDED_OWN(_plain_start)(m, now);
    fsm_records_leave(outer);
}

/* States; at level 2 all, if it can be saved. */
static void FSM_RECORDED_OWN(_whole)(const FSM_RECORDED *m, uint32_t now)
{
    FSM_RECORDED_OWN(_sync)(m, now);
#if FSM_TRACE_LEVEL >= 2 && defined FSM_RECORDED_SAVED
    FSM_RECORDED_OWN(_snapshot)(m, now);
#endif
}

static void FSM_RECORDED_OWN(_before)(FSM_RECORDED *m, uint32_t now)
{
    if (fsm_records_is_due(m, now, FSM_RECORDED_SYNC)) {
        FSM_RECORDED_OWN(_whole)(m, now);
    }
#if FSM_TRACE_LEVEL >= 2
    FSM_RECORDED_OWN(_read)(m, false);
#endif
}

#ifdef FSM_RECORDED_RUNS
void FSM_RECORDED_NAME(_run)(FSM_RECORDED *m, uint32_t now)
{
    if (FSM_RECORDED_BUSY(m)) {
        return;
    }
    const fsm_records_call outer = fsm_records_enter(FSM_INSTANCE_OF(m), now);
    FSM_RECORDED_OWN(_before)(m, now);
    FSM_RECORDED_OWN(_plain_run)(m, now);
    fsm_records_leave(outer);
}
#endif

fsm_result FSM_RECORDED_NAME(_dispatch)(FSM_RECORDED *m, const FSM_RECORDED_NAME(_event) *e,
                                        uint32_t now)
{
    fsm_result result;
    if (FSM_RECORDED_BUSY(m)) {
        return FSM_BUSY;
    }
#if FSM_TRACE_LEVEL >= 2
    if (FSM_RECORDED_STOPPED(m)) { /* it does nothing */
        return FSM_RECORDED_OWN(_plain_dispatch)(m, e, now);
    }
#endif
    const fsm_records_call outer = fsm_records_enter(FSM_INSTANCE_OF(m), now);
    FSM_RECORDED_OWN(_before)(m, now);
#if FSM_TRACE_LEVEL >= 2
    fsm_records.call.is_dispatched = true;
#endif
    result = FSM_RECORDED_OWN(_plain_dispatch)(m, e, now);
    fsm_records_leave(outer);
    return result;
}

#if defined FSM_RECORDED_SAVED || defined FSM_TRACE_STATE
/* The machine was restored, from bytes or to its previous state. */
void FSM_RECORDED_OWN(_restored)(FSM_RECORDED *m, uint32_t now)
{
    const fsm_records_call outer = fsm_records_enter(FSM_INSTANCE_OF(m), now);
    fsm_records_byte(now, (uint32_t)FSM_RECORD_RESTORE, FSM_RECORDS_INSTANCE);
    FSM_RECORDED_OWN(_whole)(m, now);
    fsm_records_leave(outer);
}
#endif
#endif
