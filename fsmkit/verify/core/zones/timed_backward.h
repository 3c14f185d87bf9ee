/* timed_backward.h: backward reachability over a graph of zones, point by point. */
#ifndef FSM_TIMED_BACKWARD_H
#define FSM_TIMED_BACKWARD_H

#include "zones/timed_model.h"

/* Whether each point of each zone that no other covers reaches a zone that is sure, `*all`. A zone is sure if all its points
 * are known to reach the goal: `sure`, by its place in what `search` passed. Points of a zone that reach it are kept as zones, and are
 * found from those of its successors; a union of zones that holds the whole zone makes it sure. So the result is exact up to
 * MOST_SPLITS in one comparison, beyond which `*all` is false. The zones of the graph must hold all points that their
 * predecessors lead to: FSM_COVER_EQUAL, _SUBSET and _HULL. False if memory ran out, or the search was stopped. */
bool fsm_timed_reach_sure(fsm_timed_model *model, fsm_search *search, const unsigned char *sure, bool *all);

#endif
