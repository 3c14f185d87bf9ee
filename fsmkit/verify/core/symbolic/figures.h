/* figures.h: what is counted of a set of states that was found, in one pass over its nodes. */
#ifndef FSM_FIGURES_H
#define FSM_FIGURES_H

#include "symbolic/symbolic.h"

/* Texts are decimal digits, to be freed. */
typedef struct {
    char *states, *transitions, *deadlocks;
    bool has_deadlock;
    uint32_t nodes;
    fsm_bounds *bounds;           /* by machine */
    uint32_t *locals;             /* by machine: how many it was in */
    char **many_locals;           /* the same as a text where its queue is levels; else NULL */
    unsigned char **states_seen, **transitions_seen; /* by machine, what ran in steps that can be taken */
} fsm_figures;

/* `marks`: those of local steps that can be taken are set. False if memory ran out. */
bool fsm_figures_find(fsm_symbolic *symbolic, fsm_figures *self, bool *marks);
void fsm_figures_free(const fsm_symbolic *symbolic, fsm_figures *self);

/* About the binary logarithm of the number of found states; 0 without states. */
double fsm_log_states(const fsm_symbolic *symbolic);

#endif
