/* report.h: the words of the program's answers, the same for all searches. */
#ifndef FSM_REPORT_H
#define FSM_REPORT_H

#include "search.h"
#include "system.h"

#include <time.h>

extern const fsm_system fsm_the_system;

const char *fsm_outcome_name(fsm_outcome outcome);
const char *fsm_action_name(fsm_action action);

/* What ends a search before its end, and whether it tells how far it has come. */
typedef struct {
    bool (*interrupted)(void);
    double timeout; /* seconds; 0: none */
    bool progress;  /* once a second */
    time_t started, last_shown;
} fsm_pace;

typedef struct {
    uint64_t states, expanded, transitions;
    uint32_t depth;
    size_t bytes;
} fsm_progress;

/* Asked now and then: shows how far it is, and returns why to stop, or FSM_COMPLETE. */
fsm_outcome fsm_pace_ask(fsm_pace *self, fsm_progress progress);

/* For `keep_on` of a search whose context is a pace. */
bool fsm_keep_pace(fsm_search *search);

/* Prints the member "machines" of the result: local states, bounds used, coverage. */
void fsm_print_machines(const fsm_composition *composition);

#endif
