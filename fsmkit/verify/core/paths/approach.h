/* approach.h: a path into a set that need not be a shortest one, where the states on the path are too many to be kept, and
 * the distances too far.
 *
 * One state of the set is chosen, near the start by what single levels would need to get there. Then a search goes on from
 * the state that is nearest to it by that measure (greedy best-first search: Doran, Michie 1966). */
#ifndef FSM_APPROACH_H
#define FSM_APPROACH_H

#include "search/path.h"
#include "symbolic/relation.h"
#include "paths/limits.h"

/* False if it is not found with the steps, time and memory that there are. */
bool fsm_path_by_approach(const fsm_path_context *self, uint32_t set, fsm_path *path);

/* The same on from a state, which is not in the set, by steps that stay within a bound; they are added to a path. `back`: a relation
 * backwards. What does not lead there soon is left to sets at each distance: then it is false, too. */
bool fsm_approach_within(const fsm_path_context *self, const fsm_relation *back, uint32_t set, uint32_t bound, fsm_state *at,
                         fsm_path *path);

#endif
