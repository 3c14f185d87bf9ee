/* liveness.h: temporal properties, decided over the graph once every state is known. Conditions are marks
 * of states. Each function returns false if memory ran out, or the search was stopped. */
#ifndef FSM_LIVENESS_H
#define FSM_LIVENESS_H

#include "liveness/counterexample.h"

/* `recoverable`: whether a state with the mark can be reached from every state. The path leads to the
 * nearest one from which it cannot. */
bool fsm_find_unrecoverable(fsm_search *search, uint32_t mark, fsm_lasso *found);

/* `leads_to`: whether each fair run leads from a state with the mark `request` to one with `response`, that
 * state included.
 *
 * A state is stable if no machine has anything left to do. A run is fair if it ends only in a stable state where nothing fair is
 * possible (fsm_model.fair), and else comes to stable states again and again, and nothing fair is possible at each of
 * them from some time on and never happens. `timeless`: no time passes in this system; then runs that come to no stable state any more count
 * too, if nothing fair is possible for ever and never happens.
 *
 * The path leads to the nearest request that may stay without a response, and from there on to a cycle, if
 * the run does not end. */
bool fsm_find_violations(fsm_search *search, uint32_t request, uint32_t answer, bool timeless, fsm_lasso *found);

#endif
