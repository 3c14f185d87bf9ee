/* report.h: the words of the program's answers, the same for all searches. */
#ifndef FSM_REPORT_H
#define FSM_REPORT_H

#include "search.h"
#include "system.h"

extern const fsm_system fsm_the_system;

const char *fsm_outcome_name(fsm_outcome outcome);
const char *fsm_action_name(fsm_action action);

/* Prints the member "machines" of the result: local states, bounds used, coverage. */
void fsm_print_machines(const fsm_composition *composition);

#endif
