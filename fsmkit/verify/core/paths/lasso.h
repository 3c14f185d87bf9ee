/* lasso.h: a fair run without an answer, found within the sets that show that there is one (liveness/fair_sets.h). */
#ifndef FSM_LASSO_H
#define FSM_LASSO_H

#include "liveness/fair_sets.h"
#include "paths/symbolic_paths.h"

/* On from the end of a path, which leads to a state that need not be answered, and round; no cycle: the run ends. False if memory or
 * time ran out; then the path may be longer than it was. */
bool fsm_cycle_in_sets(const fsm_path_context *self, const fsm_fair_sets *sets, fsm_path *path, fsm_path *cycle);

#endif
