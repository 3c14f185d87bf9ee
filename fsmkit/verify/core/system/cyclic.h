/* cyclic.h: the steps of a global state where machines have turns or may be frozen (system.h: `turn`, `freezers`).
 *
 * They are composed of the steps of single machines: which of these can be taken depends on whose
 * turn it is and on who is frozen, so those of groups are of no use. */
#ifndef FSM_CYCLIC_H
#define FSM_CYCLIC_H

#include "system/tree.h"

/* Steps of one machine that can be taken in a state. */
typedef struct {
    uint32_t machine;
    fsm_part part;
} fsm_source;

/* Enumerates all possible steps. */
typedef struct {
    uint32_t locals[FSM_MOST_MACHINES];
    fsm_hold holds[FSM_MOST_MACHINES];
    fsm_source sources[2 * FSM_MOST_MACHINES];
    uint32_t count;
    bool may_pass; /* no machine that may move has anything left to do, and some timer is armed */
} fsm_turn;

bool fsm_turn_find(fsm_composition *self, uint32_t thread, fsm_state state, fsm_turn *found);

/* Fills in for each machine what its node does to it. */
void fsm_turn_holds(const fsm_composition *self, const uint32_t *locals, fsm_hold *holds);

/* Appends the steps; and whether the state is a deadlock. */
bool fsm_turn_steps(fsm_composition *self, const fsm_turn *turn, fsm_steps *steps);

/* Describes the step with this number; the one after the last is the passing of time. */
bool fsm_turn_describe(fsm_composition *self, const fsm_turn *turn, uint32_t ordinal, fsm_description *what);

#endif
