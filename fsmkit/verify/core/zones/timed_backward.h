/* timed_backward.h: backward reachability over a graph of zones, point by point. */
#ifndef FSM_TIMED_BACKWARD_H
#define FSM_TIMED_BACKWARD_H

#include "zones/timed_model.h"

/* Whether each point of each zone that no other covers reaches a zone that is sure, `*all`. A zone is sure if all its points
 * are known to reach the goal: `sure`, by its place in what `search` passed.
 *
 * The points of a zone that reach it are kept as zones, and found from those of its successors. Two of these zones are made one if
 * that adds no point. If together they hold the whole zone, it is sure. So the result is exact, up to MOST_SPLITS. The zones of the
 * graph must hold all points that their predecessors lead to: FSM_COVER_SUBSET and FSM_COVER_HULL, and FSM_COVER_SIMULATED if no
 * timer has a choice. False if memory ran out, the search was stopped, or a hull has too many of these zones. */
bool fsm_timed_reach_sure(fsm_timed_model *model, fsm_search *search, const unsigned char *sure, bool *all);

#endif
