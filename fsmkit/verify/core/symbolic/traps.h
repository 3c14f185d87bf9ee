/* traps.h: of a chart alone, states from which its configuration changes no more, although they are not at rest. */
#ifndef FSM_TRAPS_H
#define FSM_TRAPS_H

#include "symbolic/symbolic.h"

enum { FSM_MOST_TRAPS = 64 };

typedef struct {
    bool known;
    uint32_t count, sets[FSM_MOST_TRAPS]; /* of states, one for each configuration; these are roots, the last ones */
} fsm_traps;

/* Finds the traps of one machine among the found states. */
fsm_traps fsm_find_trap_sets(fsm_symbolic *symbolic);

#endif
