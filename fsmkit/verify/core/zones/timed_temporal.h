/* timed_temporal.h: temporal properties where time is dense, decided over the states of timed_model.h. */
#ifndef FSM_TIMED_TEMPORAL_H
#define FSM_TIMED_TEMPORAL_H

#include "liveness/liveness.h"
#include "zones/timed_model.h"

/* In the path of an answer, before a step or at the end, n times 2 below this: then the timer n has expired; one
 * less: it has not. Timers of a machine are counted from FSM_MOST_CLOCKS times the number of the machine on. */
#define FSM_TIMED_DUE ((uint32_t)-2)

typedef struct {
    bool known;
    const char *why; /* it is not; "": another cover of states may decide it, memory ran out, or the search was stopped */
    fsm_lasso lasso; /* its steps as fsm_timed_successors counts them from zone to zone, and what is true when they come */
} fsm_timed_answer;

/* Both decide a property over the graph that `search` has explored, as far as its cover allows (fsm_timed_cover):
 *
 *               all states of the graph satisfy it     some state violates it
 * recoverable   holds: EQUAL, SUBSET, HULL             violated: EQUAL, SUBSET, SIMULATED; HULL, see below
 * leads_to      holds: each cover but POINTS           violated: if the run is one of points, see below
 *
 * Each point that is reached is in a state of the graph, and each of its runs is one of the graph. A point that simulates
 * another one may reach more than that does, so FSM_COVER_SIMULATED shows no `recoverable` to hold, if timers have choices. States of FSM_COVER_HULL may
 * have points that are not reached, so a path to one shows a violation only if exact zones take it. Those of FSM_COVER_POINTS are few of the points that are reached. */

/* `recoverable` (see liveness.h): of every point (timed_backward.h). A state from which the mark can be reached by some points
 * only leaves it undecided. */
fsm_timed_answer fsm_timed_recoverable(fsm_timed_model *self, fsm_search *search, uint32_t mark);

/* `leads_to`. A cycle of the graph is followed from exact zone to exact zone until one of these comes again. If it does not, the
 * property stays undecided (Herbreteau, Srivathsan, Tran, Walukiewicz 2016, "Why liveness for timed automata is hard, and what
 * we can do about it"). */
fsm_timed_answer fsm_timed_leads_to(fsm_timed_model *self, fsm_search *search, uint32_t request, uint32_t answer,
                                    bool timeless);

/* For `trace` of the search: the path by which the first such state was found, from zone to zone. */
fsm_state fsm_timed_trace(const fsm_search *search, const unsigned char *flags, unsigned char wanted, fsm_path *path);

#endif
