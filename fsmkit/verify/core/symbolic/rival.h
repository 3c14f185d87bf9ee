/* rival.h: a diagram beside a search that keeps each state. Once that has many, both go on in turns, by the work that they do, until
 * one of them has the answer. */
#ifndef FSM_RIVAL_H
#define FSM_RIVAL_H

#include "symbolic/diagram.h"

typedef struct fsm_rival fsm_rival;

/* Lets a search take turns with a diagram from some number of states on. NULL if memory ran out. There is one at a time. */
fsm_rival *fsm_rival_join(fsm_search *search, fsm_composition *composition, const fsm_diagram_options *options, uint64_t from);

/* Once the search has ended: whether the diagram is what has the answer. Then the result is printed, and nothing is left of
 * the search but what fsm_search_free frees. Else the search is as it ended. */
bool fsm_rival_wins(fsm_rival *self, double begin);
void fsm_rival_free(fsm_rival *self);

#endif
