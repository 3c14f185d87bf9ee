/* livelock.h: whether machines can be busy for ever without time passing. */
#ifndef FSM_LIVELOCK_H
#define FSM_LIVELOCK_H

#include "symbolic/symbolic.h"

typedef struct {
    bool known, found;
    bool needs_copies; /* it can be found only where shared variables are no levels */
    uint32_t *states; /* one after the other, each by machine: a cycle of internal steps; to be freed */
    uint32_t length;
} fsm_busy_cycle;

/* Looks for a cycle of internal steps in the states that were found. */
fsm_busy_cycle fsm_find_busy_cycle(fsm_symbolic *self);

#endif
