/* spread.h: by which of its parts the local states of a machine differ.
 *
 * A part (a queue, the timers, a variable) multiplies a space as often as there are local states for
 * one of the states without it. The local states found first are inspected: all ancestors of each
 * were found, too, so that states which differ in one part only are there together. */
#ifndef FSM_SPREAD_H
#define FSM_SPREAD_H

#include "system/system.h"

/* Prints it for each part: how many values it has, and how many states there are without it; and how many states were
 * looked at: none if there is no memory for it. */
void fsm_print_spread(const fsm_composition *composition, uint32_t machine);

#endif
