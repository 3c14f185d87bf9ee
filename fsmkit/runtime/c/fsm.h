/* fsm.h: the definitions common to all generated machines. C99, freestanding, no allocation.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#ifndef FSM_H
#define FSM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- configuration ----------------------------------------------------------------------------
 * FSM_HOOKS       a header that defines some of the hooks below, e.g. -DFSM_HOOKS='"my_hooks.h"'
 * FSM_NO_NAMES    omit the tables of names
 * FSM_CHECKED     reject events that are unknown, or carry values outside their types
 * You usually need not change anything below this line. */

#ifdef FSM_HOOKS
#include FSM_HOOKS
#endif

/* Hooks: called in the order of execution; compiled out unless defined. `m` is the machine. A hook
 * must not call the machine; FSM_MICROSTEPS_LEFT(m) is the number of microsteps it may still take.
 * If a hook ignores an argument, it casts it to void, as some arguments are for hooks only. */
#define FSM_UNUSED_2(a, b)                                                                         \
    do {                                                                                           \
        (void)(a);                                                                                 \
        (void)(b);                                                                                 \
    } while (0)
#define FSM_UNUSED_3(a, b, c)                                                                      \
    do {                                                                                           \
        (void)(a);                                                                                 \
        (void)(b);                                                                                 \
        (void)(c);                                                                                 \
    } while (0)
#ifndef FSM_HOOK_BEGIN /* a macrostep starts; cause: an event, a timeout of transition `index` ... */
#define FSM_HOOK_BEGIN(m, cause, index) ((void)(m))
#endif
#ifndef FSM_HOOK_END /* the macrostep ended */
#define FSM_HOOK_END(m) ((void)(m))
#endif
#ifndef FSM_HOOK_EXIT /* a state is being left, before its exit handlers */
#define FSM_HOOK_EXIT(m, state) FSM_UNUSED_2(m, state)
#endif
#ifndef FSM_HOOK_TAKE /* a transition is taken, before its content */
#define FSM_HOOK_TAKE(m, transition) FSM_UNUSED_2(m, transition)
#endif
#ifndef FSM_HOOK_ENTER /* a state is being entered, before its entry handlers */
#define FSM_HOOK_ENTER(m, state) FSM_UNUSED_2(m, state)
#endif
#ifndef FSM_HOOK_EVENT /* what: fsm_note; e: the event with its payload */
#define FSM_HOOK_EVENT(m, what, e) FSM_UNUSED_2(m, e)
#ifndef FSM_HOOK_LEFT /* an event without a payload leaves the machine; by default the hook gets no event */
#define FSM_HOOK_LEFT(m, type, number, peer) ((void)(m))
#endif
#endif
#define FSM_NOTE_LEFT(m, type, number, peer)                                                       \
    do {                                                                                           \
        type left_;                                                                                \
        fsm_clear(&left_, sizeof left_);                                                           \
        left_.event = number;                                                                      \
        FSM_HOOK_EVENT(m, FSM_LEFT, &left_);                                                       \
        FSM_HOOK_TEXT(m, FSM_LEFT, "", peer);                                                      \
    } while (0)
#ifndef FSM_HOOK_LEFT
#define FSM_HOOK_LEFT FSM_NOTE_LEFT
#endif
#ifndef FSM_HOOK_POST /* the host posted an event; fits: whether the queue had room */
#define FSM_HOOK_POST(m, e, fits) FSM_UNUSED_2(m, e)
#endif
#ifndef FSM_HOOK_TEXT /* what: fsm_note; text: a label or a name; number: its argument */
#define FSM_HOOK_TEXT(m, what, text, number) FSM_UNUSED_3(m, text, number)
#endif
#ifndef FSM_HOOK_VALUE_I /* values of `log` and `reply`, and the end of their line */
#define FSM_HOOK_VALUE_I(m, value) FSM_UNUSED_2(m, value)
#endif
#ifndef FSM_HOOK_VALUE_F
#define FSM_HOOK_VALUE_F(m, value) FSM_UNUSED_2(m, value)
#endif
#ifndef FSM_HOOK_VALUE_S
#define FSM_HOOK_VALUE_S(m, value) FSM_UNUSED_2(m, value)
#endif
#ifndef FSM_HOOK_LINE
#define FSM_HOOK_LINE(m) ((void)(m))
#endif

typedef enum {
    FSM_START,
    FSM_EVENT,
    FSM_TIMEOUT,
    FSM_EVENTLESS
} fsm_cause;

typedef enum {
    FSM_RAISED,    /* into the internal queue */
    FSM_SENT,      /* into the own external queue */
    FSM_DELAYED,   /* to be sent later */
    FSM_LEFT,      /* out of the machine */
    FSM_UNHANDLED, /* enabled no transition */
    FSM_ERROR,     /* error.* raised by the machine */
    FSM_FULL,      /* a queue had no room: "queue", "internal", "delayed" */
    FSM_FAULT,     /* the machine stops: why */
    FSM_CANCELLED, /* a delayed send, by its id */
    FSM_LOG,       /* label; values follow, then FSM_HOOK_LINE */
    FSM_REPLY,     /* the value follows, then FSM_HOOK_LINE */
    FSM_TAKEN      /* removed from its queue: its macrostep has just started */
} fsm_note;

typedef enum {
    FSM_IGNORED, /* no transition was enabled */
    FSM_HANDLED,
    FSM_BUSY,    /* called from within a step of the same machine */
    FSM_STOPPED, /* not started, finished, or in a fault */
    FSM_REFUSED  /* unknown, or with a payload that its declaration does not allow; with FSM_CHECKED */
} fsm_result;

/* The result of restoring saved bytes. */
typedef enum {
    FSM_RESTORED,
    FSM_DAMAGED, /* not all there, or changed */
    FSM_FOREIGN, /* of another chart */
    FSM_IN_STEP  /* called from within a step of the same machine */
} fsm_restored;

/* Why a machine stopped. */
typedef enum {
    FSM_NO_FAULT,
    FSM_FAULT_MICROSTEPS,      /* a macrostep without end */
    FSM_FAULT_INTERNAL,        /* the internal queue was full */
    FSM_FAULT_RANGE,           /* a value outside a range of kind `fault` */
    FSM_FAULT_UNHANDLED_ERROR, /* an unhandled error.* event */
    FSM_FAULT_INVOKED          /* a machine that it invoked stopped with a fault */
} fsm_fault;

/* Why a block of content ended early. */
enum { FSM_FINE, FSM_CONTENT_ERROR, FSM_RANGE_FAULT, FSM_TOLD };

/* Return the number of an event as 16 bits. A number beyond 16 bits becomes 0, which is no event,
 * instead of the event with its lower bits. */
static inline uint16_t fsm_event_number(uint64_t event)
{
    return event > 0xFFFFu ? (uint16_t)0u : (uint16_t)event;
}

/* Increment a counter that saturates at its maximum. */
static inline void fsm_count(uint16_t *counter)
{
    if (*counter < 65535u) {
        (*counter)++;
    }
}

/* Set bytes to zero. Freestanding C has no memset. */
static inline void fsm_clear(void *memory, size_t size)
{
    unsigned char *bytes = (unsigned char *)memory;
    for (size_t i = 0u; i < size; i++) {
        bytes[i] = 0u;
    }
}

/* ---- timers -----------------------------------------------------------------------------------
 * A list sorted by deadline, equal deadlines in the order in which they were armed. Times are ticks
 * modulo 2^32; no two deadlines are 2^31 or more apart. Unused entries are zero. */

#define FSM_TIMER_SEND 0x8000u

typedef struct {
    uint32_t deadline;
    uint16_t what; /* index of a transition, or FSM_TIMER_SEND */
    uint16_t mark; /* of a delayed send: number of its id, 0 for none */
} fsm_timer;

/* Return whether time `a` is `b` or later. */
static inline bool fsm_reached(uint32_t a, uint32_t b)
{
    return (uint32_t)(a - b) < 0x80000000u;
}

/* Insert a timer after those with an earlier or equal deadline; return its index. There must be room. */
uint8_t fsm_timers_insert(fsm_timer *timers, uint8_t *count, fsm_timer timer);

/* Remove the timer at an index. */
void fsm_timers_remove(fsm_timer *timers, uint8_t *count, uint8_t place);

/* Remove the timeout of a transition, if it is armed. */
void fsm_timers_disarm(fsm_timer *timers, uint8_t *count, uint16_t what);

/* Store the first deadline; return false if no timer is armed. */
static inline bool fsm_timers_first(const fsm_timer *timers, uint8_t count, uint32_t *deadline)
{
    if (count == 0u) {
        return false;
    }
    *deadline = timers[0].deadline;
    return true;
}

/* ---- arithmetic -------------------------------------------------------------------------------
 * Division truncates toward zero; division by zero is an error of content. A failure sets `*failed`,
 * and the rest of the block is skipped. */

#define FSM_DEFINE_DIVISION(suffix, type)                                                          \
    static inline type fsm_div_##suffix(uint8_t *failed, type a, type b)                           \
    {                                                                                              \
        if (b == 0) {                                                                              \
            if (*failed == FSM_FINE)                                                               \
                *failed = FSM_CONTENT_ERROR;                                                       \
            return 0;                                                                              \
        }                                                                                          \
        return (type)(a / b);                                                                      \
    }                                                                                              \
    static inline type fsm_rem_##suffix(uint8_t *failed, type a, type b)                           \
    {                                                                                              \
        if (b == 0) {                                                                              \
            if (*failed == FSM_FINE)                                                               \
                *failed = FSM_CONTENT_ERROR;                                                       \
            return 0;                                                                              \
        }                                                                                          \
        return (type)(a % b);                                                                      \
    }

FSM_DEFINE_DIVISION(u32, uint32_t)
FSM_DEFINE_DIVISION(u64, uint64_t)

/* The minimum divided by -1 wraps around to itself. */
#define FSM_DEFINE_SIGNED_DIVISION(suffix, type, least)                                            \
    static inline type fsm_div_##suffix(uint8_t *failed, type a, type b)                           \
    {                                                                                              \
        if (b == 0) {                                                                              \
            if (*failed == FSM_FINE)                                                               \
                *failed = FSM_CONTENT_ERROR;                                                       \
            return 0;                                                                              \
        }                                                                                          \
        return b == -1 && a == (least) ? a : (type)(a / b);                                        \
    }                                                                                              \
    static inline type fsm_rem_##suffix(uint8_t *failed, type a, type b)                           \
    {                                                                                              \
        if (b == 0) {                                                                              \
            if (*failed == FSM_FINE)                                                               \
                *failed = FSM_CONTENT_ERROR;                                                       \
            return 0;                                                                              \
        }                                                                                          \
        return b == -1 ? 0 : (type)(a % b);                                                        \
    }

FSM_DEFINE_SIGNED_DIVISION(i32, int32_t, INT32_MIN)
FSM_DEFINE_SIGNED_DIVISION(i64, int64_t, INT64_MIN)

/* Shift right arithmetically, which C99 6.5.7 leaves to the compiler. */
static inline int32_t fsm_asr_i32(int32_t a, uint32_t n)
{
    return a < 0 ? ~(~a >> n) : a >> n;
}

static inline int64_t fsm_asr_i64(int64_t a, uint32_t n)
{
    return a < 0 ? ~(~a >> n) : a >> n;
}

/* Return `place` if it is an index of an array; otherwise set an error of content and return 0. */
static inline uint32_t fsm_place(uint8_t *failed, int64_t place, uint32_t length)
{
    if (place < 0 || place >= (int64_t)length) {
        if (*failed == FSM_FINE) {
            *failed = FSM_CONTENT_ERROR;
        }
        return 0u;
    }
    return (uint32_t)place;
}

static inline bool fsm_fails(uint8_t *failed)
{
    if (*failed == FSM_FINE) {
        *failed = FSM_CONTENT_ERROR;
    }
    return false;
}

/* Wrap a value into lo..hi. */
static inline int64_t fsm_wrap(int64_t value, int64_t lo, int64_t hi)
{
    uint64_t size = (uint64_t)hi - (uint64_t)lo + 1u;
    if (size == 0u) {
        return value;
    }
    if (value >= lo) {
        return (int64_t)((uint64_t)lo + ((uint64_t)value - (uint64_t)lo) % size);
    }
    uint64_t below = ((uint64_t)lo - (uint64_t)value - 1u) % size;
    return (int64_t)((uint64_t)hi - below);
}

/* Return the nearest number of lo..hi. */
static inline int64_t fsm_nearest(int64_t value, int64_t lo, int64_t hi)
{
    return value < lo ? lo : value > hi ? hi : value;
}

/* The same in 64 bits without a sign; below: the value is negative. */
static inline uint64_t fsm_nearest_u(bool below, uint64_t value, uint64_t lo, uint64_t hi)
{
    return below || value < lo ? lo : value > hi ? hi : value;
}

/* Truncate a floating-point number and clamp it to lo..hi; NaN counts as 0. */
int64_t fsm_truncate(double value, int64_t lo, int64_t hi, bool *outside);

/* The same without reporting whether the number was outside. */
static inline int64_t fsm_whole(double value, int64_t lo, int64_t hi)
{
    bool outside = false;
    return fsm_truncate(value, lo, hi, &outside);
}

/* Truncate a floating-point number; fails if the result exceeds 64 bits. */
static inline int64_t fsm_integer(uint8_t *failed, double value)
{
    bool outside = false;
    int64_t whole = fsm_truncate(value, INT64_MIN, INT64_MAX, &outside);
    if ((outside || value != value) && *failed == FSM_FINE) {
        *failed = FSM_CONTENT_ERROR;
    }
    return whole;
}

/* Check a value of a range of kind `fault`: outside lo..hi, set FSM_RANGE_FAULT in `*failed`. */
static inline int64_t fsm_within(uint8_t *failed, int64_t value, int64_t lo, int64_t hi)
{
    if (value >= lo && value <= hi) {
        return value;
    }
    if (*failed == FSM_FINE) {
        *failed = FSM_RANGE_FAULT;
    }
    return lo;
}

/* The same in 64 bits without a sign; below: the value is negative. */
static inline uint64_t fsm_within_u(uint8_t *failed, bool below, uint64_t value, uint64_t lo,
                                    uint64_t hi)
{
    if (!below && value >= lo && value <= hi) {
        return value;
    }
    if (*failed == FSM_FINE) {
        *failed = FSM_RANGE_FAULT;
    }
    return lo;
}

/* The same for a floating-point number, which is clamped to lo..hi. */
static inline int64_t fsm_within_f(uint8_t *failed, double value, int64_t lo, int64_t hi)
{
    bool outside = false;
    int64_t whole = fsm_truncate(value, lo, hi, &outside);
    if (outside && *failed == FSM_FINE) {
        *failed = FSM_RANGE_FAULT;
    }
    return whole;
}

#ifdef __cplusplus
}
#endif

#endif
