/* flat.h: states of the system as a local state for each machine: initial states, and
 * evaluation. */
#ifndef FSM_FLAT_H
#define FSM_FLAT_H

#include "system/composition.h"

typedef struct {
    const uint32_t *locals; /* by machine */
    const uint32_t *marks;
    uint32_t mark_count;
    const fsm_description *what; /* how the machines started, in that order; valid during the call */
} fsm_start;

typedef bool fsm_visit_start(void *context, const fsm_start *start);

/* Starts all machines, those of the environment first, in every way their choices allow, and calls
 * `visit` for each. False if `visit` did, or it failed. */
bool fsm_start_all(fsm_composition *self, fsm_visit_start *visit, void *context);

/* Writes the marks that hold, deadlock included, to `found`, and returns how many. */
uint32_t fsm_flat_marks(fsm_composition *self, const uint32_t *locals, uint32_t *found);

/* Whether a property is to be marked. */
bool fsm_flat_evaluate(const fsm_composition *self, const uint32_t *locals, uint32_t property);

/* For traps: a number for the visible configuration, and whether the machine may rest there. */
uint32_t fsm_flat_configuration(const fsm_composition *self, const uint32_t *locals);
bool fsm_flat_at_rest(const fsm_composition *self, const uint32_t *locals);

#endif
