/* counterexample.h: the counterexample of a temporal property, and the path to its start. */
#ifndef FSM_COUNTEREXAMPLE_H
#define FSM_COUNTEREXAMPLE_H

#include "search/path.h"

/* A counterexample: a path, and the cycle after it (empty: no further step is required, or none
 * helps). A violated property has an empty path if memory for it ran out. */
typedef struct {
    bool violated;
    fsm_path path, cycle;
} fsm_lasso;

void fsm_lasso_free(fsm_lasso *self);

/* Whether a mark holds at a state; false also where memory ran out (then the model says so). */
bool fsm_is_marked(const fsm_model *model, fsm_state state, uint32_t mark);

/* The path to the nearest of the states whose places have one of some flags. The search stays as it is.
 * Returns that state; FSM_NO_STATE if it was not found for want of memory. */
fsm_state fsm_path_to_flagged(fsm_search *search, const unsigned char *flags, unsigned char requested, fsm_path *path);

#endif
