/* evaluation.h: evaluates properties on a set of states. The set is projected on the machines that a property reads, and the
 * compiled condition evaluates each remaining combination. */
#ifndef FSM_EVALUATION_H
#define FSM_EVALUATION_H

#include "symbolic/symbolic.h"

typedef struct {
    bool known;            /* else there were too many combinations, or memory ran out */
    bool found;            /* some state is marked */
    uint64_t combinations; /* evaluated */
    uint32_t marked;       /* the set of marked states, if requested */
} fsm_evaluated;

/* Computes the states of a set that a property marks. `wants_set`: also build `marked`. */
fsm_evaluated fsm_evaluate(fsm_symbolic *self, uint32_t set, uint32_t property, bool wants_set);

/* The deadlocks of a set: nothing can ever happen again, and some machine is not at rest. */
uint32_t fsm_dead_states(fsm_symbolic *self, uint32_t set);

/* Whether a state, by machine, is in a set. */
bool fsm_symbolic_has(fsm_symbolic *self, uint32_t set, const uint32_t *locals);

/* Some state of a set, by machine; false if it is empty. */
bool fsm_symbolic_pick(fsm_symbolic *self, uint32_t set, uint32_t *locals);

/* The set of one state of a set; 0 if memory ran out. */
uint32_t fsm_symbolic_single(fsm_symbolic *self, uint32_t set, const uint32_t *locals);

#endif
