/* cycles.h: searches in the complete graph. Steps are enumerated again rather than kept: that
 * costs time once, not memory always. States are named by their places in the set. */
#ifndef FSM_CYCLES_H
#define FSM_CYCLES_H

#include "search/search.h"

/* A cycle: a state on it, and the ordinals of the steps round it. */
typedef struct {
    fsm_state state; /* FSM_NO_STATE: no cycle */
    uint32_t length;
    uint32_t *steps; /* the caller frees it */
} fsm_cycle;

/* Looks for a cycle of internal steps. False if memory ran out or the search was stopped. */
bool fsm_find_livelock(fsm_search *search, fsm_cycle *found);

/* Calls `report` with the states of each trap, up to a number of them: a set of states that no step
 * leaves, that all show one configuration, and that are not at rest. False as above. */
typedef void fsm_report_trap(void *context, const fsm_state *states, size_t count);
bool fsm_find_traps(fsm_search *search, fsm_report_trap *report, void *context);

#endif
