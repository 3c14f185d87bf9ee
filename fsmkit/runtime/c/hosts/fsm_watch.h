/* fsm_watch.h: decides from another context whether a control loop still completes its cycles.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * A thread or a timer interrupt that sends cyclic messages, or holds outputs, must not keep a hung
 * loop alive. The loop counts its completed cycles in an fsm_shared. The other context calls
 * fsm_watch_look with that count and its own clock, at least four times in each bound:
 *
 *   if (!fsm_watch_look(&watch, fsm_shared_read(&cycles), now)) ...   silence, or safe outputs
 *
 * A cycle is assumed to have completed just after the look before the one that noticed it. So the
 * result is false as soon as the last cycle completed `bound` ago, and never false while cycles
 * complete at most half of the bound apart. `now` and `bound` have any unit. */
#ifndef FSM_WATCH_H
#define FSM_WATCH_H

#include "fsm_shared.h"

#include <stdbool.h>

#define FSM_WATCH_LOOKS 4u /* in each bound */

typedef struct {
    uint64_t bound;
    uint64_t looked; /* the time of the last look */
    uint64_t since;  /* the earliest time at which the last cycle can have completed */
    FSM_INDEX cycles; /* at the last look */
} fsm_watch;

/* Start to watch at `now`: the loop counts as alive until `now + bound`. */
static inline void fsm_watch_start(fsm_watch *watch, FSM_INDEX cycles, uint64_t bound, uint64_t now)
{
    watch->bound = bound;
    watch->looked = watch->since = now;
    watch->cycles = cycles;
}

/* Return whether the last cycle completed less than the bound ago. */
static inline bool fsm_watch_look(fsm_watch *watch, FSM_INDEX cycles, uint64_t now)
{
    if (cycles != watch->cycles) {
        watch->cycles = cycles;
        watch->since = watch->looked;
    }
    watch->looked = now;
    return now - watch->since < watch->bound;
}

/* Return the longest time from one look to the next; at least 1. */
static inline uint64_t fsm_watch_every(const fsm_watch *watch)
{
    return watch->bound > FSM_WATCH_LOOKS ? watch->bound / FSM_WATCH_LOOKS : 1u;
}

#endif
