/* fsm_mailbox.h: events for a machine from an interrupt or another thread, without locks.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * X_post belongs to the context that runs the machine. Any other context gets a mailbox of its own,
 * a ring that it alone fills and the machine's context alone empties:
 *
 *   FSM_MAILBOX(feeder, FEEDER_QUEUE, 16)           once, after feeder.h: the type feeder_mailbox
 *   static feeder_mailbox from_isr;                 one for each producer; zero is empty
 *
 *   feeder_mailbox_put(&from_isr, &event);          the producer; false if there was no room
 *   feeder_mailbox_run(&from_isr, &machine, now);   the machine's context, instead of feeder_run
 *
 * An event leaves the mailbox when the machine has taken it, so events are lost at a full mailbox
 * only: feeder_mailbox_put returns false, and feeder_mailbox_lost counts them.
 *
 * Several producers may share a mailbox where none can interrupt another, or where these guard them;
 * define both, or none, before this header:
 *
 *   FSM_ENTER_CRITICAL()   from here on no other producer runs; it may declare a variable, e.g. one
 *                          for the mask of interrupts as it was
 *   FSM_EXIT_CRITICAL()    as before; in the same block
 *
 * What is between them is a few loads and stores and a copy of the event. The machine's context
 * enters neither. Undefined, they are nothing. */
#ifndef FSM_MAILBOX_H
#define FSM_MAILBOX_H

#include "fsm_shared.h"

#include <stdbool.h>

#if defined(FSM_ENTER_CRITICAL) != defined(FSM_EXIT_CRITICAL)
#error "define both FSM_ENTER_CRITICAL() and FSM_EXIT_CRITICAL(), or none: they guard a mailbox"
#endif
#ifndef FSM_ENTER_CRITICAL
#define FSM_ENTER_CRITICAL() ((void)0)
#define FSM_EXIT_CRITICAL() ((void)0)
#endif

/* clang warns of an inline function that a .c file does not use */
#if defined(__GNUC__)
#define FSM_MAY_BE_UNUSED __attribute__((unused))
#else
#define FSM_MAY_BE_UNUSED
#endif

/* A ring without its slots. Counts are modulo the range of FSM_INDEX, of which the number of slots
 * is a divisor, so `count % slots` is a place. */
typedef struct {
    fsm_shared put;  /* filled so far; the producer writes it */
    fsm_shared got;  /* emptied so far; the consumer writes it */
    fsm_shared lost; /* found no room; the producer writes it; stops at the largest value */
} fsm_ring;

/* Return the number of filled slots for the consumer; producers may have added more. */
static inline FSM_INDEX fsm_ring_count(const fsm_ring *ring)
{
    return (FSM_INDEX)(fsm_shared_read(&ring->put) - fsm_shared_own(&ring->got));
}

/* Producer: find a free slot among `slots`, a power of two; fill it, then publish it. */
static inline bool fsm_ring_claim(fsm_ring *ring, FSM_INDEX slots, FSM_INDEX *place)
{
    FSM_INDEX put = fsm_shared_own(&ring->put);
    FSM_INDEX lost;
    if ((FSM_INDEX)(put - fsm_shared_read(&ring->got)) < slots) {
        *place = (FSM_INDEX)(put % slots);
        return true;
    }
    lost = fsm_shared_own(&ring->lost);
    if (lost != (FSM_INDEX)-1) {
        fsm_shared_write(&ring->lost, (FSM_INDEX)(lost + 1u));
    }
    return false;
}

static inline void fsm_ring_publish(fsm_ring *ring)
{
    fsm_shared_write(&ring->put, (FSM_INDEX)(fsm_shared_own(&ring->put) + 1u));
}

/* Consumer: find the oldest filled slot; read it, then release it. */
static inline bool fsm_ring_front(const fsm_ring *ring, FSM_INDEX slots, FSM_INDEX *place)
{
    if (fsm_ring_count(ring) == 0u) {
        return false;
    }
    *place = (FSM_INDEX)(fsm_shared_own(&ring->got) % slots);
    return true;
}

static inline void fsm_ring_release(fsm_ring *ring)
{
    fsm_shared_write(&ring->got, (FSM_INDEX)(fsm_shared_own(&ring->got) + 1u));
}

/* Define X_mailbox and its functions for the machine X, whose queue holds `queue` events, with a
 * power of two of slots.
 *
 * X_mailbox_drain posts events until the mailbox is empty, the machine rejects one (which stays),
 * or a queueful was posted; it returns their number. For several mailboxes before one X_run.
 *
 * X_mailbox_run posts what was there when it was called, and runs the machine after each queueful.
 * Bounded by the slots.
 *
 * Names end in `_` here, so that none is that of a machine. */
#define FSM_MAILBOX(X, queue, slots_)                                                              \
    typedef char X##_mailbox_has_a_power_of_two_of_slots                                           \
        [(slots_) > 0 && ((slots_) & ((slots_) - 1)) == 0 ? 1 : -1];                               \
    typedef char X##_mailbox_fits_FSM_INDEX                                                        \
        [(queue) > 0 && (FSM_INDEX)-1 / 2 >= (FSM_INDEX)((slots_) - 1) &&                          \
                 (FSM_INDEX)(slots_) == (slots_) && (FSM_INDEX)(queue) == (queue)                  \
             ? 1                                                                                   \
             : -1];                                                                                \
    typedef struct {                                                                               \
        fsm_ring ring;                                                                             \
        X##_event slots[slots_];                                                                   \
    } X##_mailbox;                                                                                 \
    FSM_MAY_BE_UNUSED static inline bool X##_mailbox_put(X##_mailbox *box_, const X##_event *e_)   \
    {                                                                                              \
        FSM_INDEX place_;                                                                          \
        bool fits_;                                                                                \
        FSM_ENTER_CRITICAL();                                                                      \
        fits_ = fsm_ring_claim(&box_->ring, (slots_), &place_);                                    \
        if (fits_) {                                                                               \
            box_->slots[place_] = *e_;                                                             \
            fsm_ring_publish(&box_->ring);                                                         \
        }                                                                                          \
        FSM_EXIT_CRITICAL();                                                                       \
        return fits_;                                                                              \
    }                                                                                              \
    FSM_MAY_BE_UNUSED static inline FSM_INDEX X##_mailbox_lost(const X##_mailbox *box_)            \
    {                                                                                              \
        return fsm_shared_read(&box_->ring.lost);                                                  \
    }                                                                                              \
    FSM_MAY_BE_UNUSED static inline FSM_INDEX X##_mailbox_post(X##_mailbox *box_, X *m_,           \
                                                               FSM_INDEX most_)                    \
    {                                                                                              \
        FSM_INDEX place_, posted_ = 0;                                                             \
        while (posted_ < most_ && fsm_ring_front(&box_->ring, (slots_), &place_) &&                \
               X##_post(m_, &box_->slots[place_])) {                                               \
            fsm_ring_release(&box_->ring);                                                         \
            posted_++;                                                                             \
        }                                                                                          \
        return posted_;                                                                            \
    }                                                                                              \
    FSM_MAY_BE_UNUSED static inline FSM_INDEX X##_mailbox_drain(X##_mailbox *box_, X *m_)          \
    {                                                                                              \
        return X##_mailbox_post(box_, m_, (FSM_INDEX)(queue));                                     \
    }                                                                                              \
    FSM_MAY_BE_UNUSED static inline void X##_mailbox_run(X##_mailbox *box_, X *m_, uint32_t now_)  \
    {                                                                                              \
        FSM_INDEX left_ = fsm_ring_count(&box_->ring);                                             \
        bool goes_on_ = true; /* the first run has emptied the queue of other events */              \
        bool first_ = true;                                                                        \
        while (goes_on_) {                                                                         \
            FSM_INDEX some_ = (FSM_INDEX)(left_ < (queue) ? left_ : (queue));                      \
            FSM_INDEX posted_ = X##_mailbox_post(box_, m_, some_);                                 \
            X##_run(m_, now_);                                                                     \
            left_ = (FSM_INDEX)(left_ - posted_);                                                  \
            goes_on_ = left_ > 0u && (posted_ > 0u || first_);                                     \
            first_ = false;                                                                        \
        }                                                                                          \
    }

#endif
