/* timed_temporal.h: temporal properties where time is dense, decided over the states of timed_model.h. */
#ifndef FSM_TIMED_TEMPORAL_H
#define FSM_TIMED_TEMPORAL_H

#include "liveness/liveness.h"
#include "zones/timed_model.h"

/* In the path of an answer, before a step or at the end, n times 2 below this: when that comes the timer n is due; one
 * less: it is not. Timers of a machine are counted from FSM_MOST_CLOCKS times the number of the machine on. */
#define FSM_TIMED_DUE ((uint32_t)-2)

typedef struct {
    bool known;
    const char *why; /* it is not; "": memory ran out, or the search was stopped */
    fsm_lasso lasso; /* its steps as fsm_timed_successors counts them from zone to zone, and what is true when they come */
} fsm_timed_answer;

/* `recoverable` (see liveness.h): of every point. A state from which the mark can be reached by some points only leaves
 * it undecided. */
fsm_timed_answer fsm_timed_recoverable(fsm_timed_model *self, fsm_search *search, uint32_t mark);

/* `leads_to`. */
fsm_timed_answer fsm_timed_leads_to(fsm_timed_model *self, fsm_search *search, uint32_t asked, uint32_t answer,
                                    bool timeless);

#endif
