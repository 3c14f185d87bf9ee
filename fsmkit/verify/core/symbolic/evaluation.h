/* evaluation.h: what properties say of a set of states: it is projected on the machines that a property looks at, and each
 * combination that is left is evaluated by the compiled condition. */
#ifndef FSM_EVALUATION_H
#define FSM_EVALUATION_H

#include "symbolic/symbolic.h"

typedef struct {
    bool known;            /* else there were too many combinations, or memory ran out */
    bool found;            /* some state is marked */
    uint64_t combinations; /* evaluated */
    uint32_t marked;       /* the set of marked states, if requested */
} fsm_evaluated;

/* Which states of a set a property marks. `wants_set`: `marked` is made. */
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
