/* saved_locals.h: the local states of a machine as saved machines, in hexadecimal. */
#ifndef FSM_SAVED_LOCALS_H
#define FSM_SAVED_LOCALS_H

#include "system/system.h"

/* The machines whose local states are printed: their numbers, with commas; NULL: none. */
void fsm_show_locals(const char *machines);

/* Prints those of a machine, each as fsm_save writes it at time 0, as a member of a JSON object; nothing if they are
 * not to be shown, or if memory ran out. */
void fsm_print_saved_locals(const fsm_composition *composition, uint32_t machine);

#endif
