/* graph.h: the local states and local steps of each machine in an exploration. */
#ifndef FSM_GRAPH_H
#define FSM_GRAPH_H

#include "search/search.h"
#include "system/system.h"

/* Prints, as a member of a JSON object: for each initial state the local states; for each machine
 * and local state its own steps, its external events (null where they were not requested) and itself after a
 * unit of time; and which messages came to which local states. A message is a number. */
void fsm_print_graph(fsm_composition *self);

#endif
