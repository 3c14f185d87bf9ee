/* approach.h: a way into a set that need not be a shortest one, where the states on the way there are too many to be kept, and
 * the distances too far.
 *
 * One state of the set is chosen, near the start by what single levels would need to get there. Then a search goes on from
 * the state that is nearest to it by that measure (greedy best-first search: Doran, Michie 1966). */
#ifndef FSM_APPROACH_H
#define FSM_APPROACH_H

#include "ways/ways.h"

/* False if it is not found with the steps, time and memory that there are. */
bool fsm_way_by_approach(const fsm_ways *self, uint32_t set, fsm_path *path);

#endif
