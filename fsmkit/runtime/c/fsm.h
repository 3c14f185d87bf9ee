/* fsm.h: what every generated machine shares. C99, freestanding, no allocation.
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
 * FSM_NO_NAMES    leave out the tables of names
 * FSM_CHECKED     refuse events that are unknown, or carry values that are none of their type
 * You usually need not change anything below this line. */

#ifdef FSM_HOOKS
#include FSM_HOOKS
#endif

/* Hooks: called in the order of execution; compiled out unless defined. `m` is the machine. A hook
 * must not call the machine; FSM_MICROSTEPS_LEFT(m) tells how many microsteps it may still take.
 * A function may use an argument for its hook alone: one that does not need it casts it to void. */
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
#ifndef FSM_HOOK_BEGIN /* a macrostep begins; cause: an event, a timeout of transition `index` ... */
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
#ifndef FSM_HOOK_LEFT /* an event without a payload leaves the machine: by default no event is made for the hook */
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
#ifndef FSM_HOOK_POST /* the host posted an event; fits: whether it was taken into the queue */
#define FSM_HOOK_POST(m, e, fits) FSM_UNUSED_2(m, e)
#endif
#ifndef FSM_HOOK_TEXT /* what: fsm_note; text: a label or a name; number: what goes with it */
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
    FSM_TAKEN      /* out of its queue: a macrostep for it has just begun */
} fsm_note;

typedef enum {
    FSM_IGNORED, /* no transition was enabled */
    FSM_HANDLED,
    FSM_BUSY,    /* called from within a step of the same machine */
    FSM_STOPPED, /* not started, finished, or in a fault */
    FSM_REFUSED  /* unknown, or carries what its declaration does not allow; with FSM_CHECKED */
} fsm_result;

/* What became of saved bytes. */
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
    FSM_FAULT_UNHANDLED_ERROR, /* nobody handled an error.* event */
    FSM_FAULT_INVOKED          /* a machine that it invoked stopped with a fault */
} fsm_fault;

/* Why a block of content ended early. */
enum { FSM_FINE, FSM_CONTENT_ERROR, FSM_RANGE_FAULT, FSM_TOLD };

/* The number of an event for functions that select by 16 bits, however wide it is in the event: a
 * number beyond them is none, not the event that its lower bits are. */
static inline uint16_t fsm_event_number(uint64_t event)
{
    return event > 0xFFFFu ? (uint16_t)0u : (uint16_t)event;
}

/* A counter that stands at its greatest value once it is there. */
static inline void fsm_count(uint16_t *counter)
{
    if (*counter < 65535u) {
        (*counter)++;
    }
}

/* Make bytes zero. Freestanding C has no memset. */
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

/* Whether time `a` is `b` or later. */
static inline bool fsm_reached(uint32_t a, uint32_t b)
{
    return (uint32_t)(a - b) < 0x80000000u;
}

/* Put in order, after those of the same deadline; returns its place. There must be room. */
uint8_t fsm_timers_insert(fsm_timer *timers, uint8_t *count, fsm_timer timer);

/* Take out the timer at a place. */
void fsm_timers_remove(fsm_timer *timers, uint8_t *count, uint8_t place);

/* Take out the timeout of a transition, if it is armed. */
void fsm_timers_disarm(fsm_timer *timers, uint8_t *count, uint16_t what);

/* The first deadline; false where nothing is armed. */
static inline bool fsm_timers_first(const fsm_timer *timers, uint8_t count, uint32_t *deadline)
{
    if (count == 0u) {
        return false;
    }
    *deadline = timers[0].deadline;
    return true;
}

/* ---- arithmetic -------------------------------------------------------------------------------
 * Division truncates toward zero; by zero it is an error of content. What fails leaves a note in
 * `*failed`; what follows in the same block is skipped. */

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

/* The least value divided by -1 wraps around to itself. */
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

/* Shift right, keeping the sign, which C99 6.5.7 leaves to the compiler. */
static inline int32_t fsm_asr_i32(int32_t a, uint32_t n)
{
    return a < 0 ? ~(~a >> n) : a >> n;
}

static inline int64_t fsm_asr_i64(int64_t a, uint32_t n)
{
    return a < 0 ? ~(~a >> n) : a >> n;
}

/* Note an error of content and return `place` brought into an array of that length. */
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

/* A value modulo the size of lo..hi. */
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

/* The nearest number of lo..hi. */
static inline int64_t fsm_nearest(int64_t value, int64_t lo, int64_t hi)
{
    return value < lo ? lo : value > hi ? hi : value;
}

/* The same in 64 bits without a sign; below: the value is negative. */
static inline uint64_t fsm_nearest_u(bool below, uint64_t value, uint64_t lo, uint64_t hi)
{
    return below || value < lo ? lo : value > hi ? hi : value;
}

/* The whole part of a floating-point number, brought into lo..hi; NaN gives 0, brought into it. */
int64_t fsm_truncate(double value, int64_t lo, int64_t hi, bool *outside);

/* The same where it does not matter whether the number was outside. */
static inline int64_t fsm_whole(double value, int64_t lo, int64_t hi)
{
    bool outside = false;
    return fsm_truncate(value, lo, hi, &outside);
}

/* The whole part of a floating-point number; without one of 64 bits it fails. */
static inline int64_t fsm_integer(uint8_t *failed, double value)
{
    bool outside = false;
    int64_t whole = fsm_truncate(value, INT64_MIN, INT64_MAX, &outside);
    if ((outside || value != value) && *failed == FSM_FINE) {
        *failed = FSM_CONTENT_ERROR;
    }
    return whole;
}

/* A value of a range of kind `fault`: one outside lo..hi leaves FSM_RANGE_FAULT in `*failed`. */
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

/* The same for a floating-point number, which is brought into lo..hi. */
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
