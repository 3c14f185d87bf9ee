/* delays.h: the time from one condition until another, where time passes by units. */
#ifndef FSM_DELAYS_H
#define FSM_DELAYS_H

#include "liveness/counterexample.h"

#define FSM_FOREVER UINT32_MAX

typedef struct {
    bool started;        /* the time started somewhere */
    uint32_t greatest; /* units of time, until the end or without it; FSM_FOREVER: no bound */
    fsm_lasso late;    /* a path that exceeds the limit */
} fsm_delay;

/* Measures from states with the mark `begin` that are initial or come after one without it, and
 * that do not have the mark `end`, until a state with `end`. Time without a bound counts as
 * endless: in a stable state in which no timer runs. False if memory ran out or the search was
 * stopped. */
bool fsm_find_delay(fsm_search *search, uint32_t begin, uint32_t end, uint32_t most, fsm_delay *found);

#endif
