/* timed_graph.h: searches in the complete graph of pairs. */
#ifndef FSM_TIMED_GRAPH_H
#define FSM_TIMED_GRAPH_H

#include "zones/timed.h"

/* A cycle of internal steps in which no time passes: from a pair, without the passing of time, by the
 * steps of `path` to where the first `lead` end, and by the others round for ever. */
typedef struct {
    uint32_t pair; /* FSM_NONE: no pair */
    uint32_t *path, length, lead;
} fsm_timed_cycle;

/* Looks for a livelock. False if that cannot be decided: memory ran out, the search was stopped, or the
 * cycle found depends on clocks in a way that is not followed up. The caller frees the path. */
bool fsm_timed_livelock(fsm_timed *self, fsm_timed_cycle *found);

/* For one open chart: calls `report` for each pair from which only one configuration is ever shown and
 * that is not at rest. `*doubt`: some pair may hold such points beside others. False if memory ran out
 * or the search was stopped. */
bool fsm_timed_traps(fsm_timed *self, void (*report)(void *context, uint32_t pair), void *context, bool *doubt);

#endif
