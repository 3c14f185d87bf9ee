/* slot_figures.h: how many local states a machine has whose queue is levels. */
#ifndef FSM_SLOT_FIGURES_H
#define FSM_SLOT_FIGURES_H

#include "symbolic/symbolic.h"

/* As decimal digits, to be freed; NULL if memory ran out. */
char *fsm_count_locals(fsm_symbolic *symbolic, uint32_t machine);

#endif
