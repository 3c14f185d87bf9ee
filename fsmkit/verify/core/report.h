/* report.h: the words of the program's answers, the same for all searches. */
#ifndef FSM_REPORT_H
#define FSM_REPORT_H

#include "search/search.h"
#include "system/system.h"

enum { FSM_NO_MEMORY = 3 }; /* the exit code if there is not enough memory to start */

const char *fsm_outcome_name(fsm_outcome outcome);

/* The first character of each line of the explorer's own; lines of machines cannot contain it. */
#define FSM_MARK 0

const char *fsm_action_name(fsm_action action);

/* The limits of a search, and whether it reports progress. All seconds are of the wall. */
typedef struct {
    bool (*interrupted)(void);
    double timeout;  /* seconds; 0: none */
    double paths;    /* seconds from the start on after which no path is sought any more; 0: none */
    bool progress;   /* once a second */
    double started, last_shown;
    double noticed;  /* when the search for paths noticed an interrupt; 0: not yet */
    long parent;     /* who reads the result: nobody, once this is an orphan */
    const uint32_t *counted; /* the number reported as states, if those of the model are zones;
                              * NULL: those of the model */
} fsm_pace;

void fsm_pace_start(fsm_pace *self);

/* Seconds, since some moment. */
double fsm_seconds(void);

typedef struct {
    uint64_t states, transitions;
    uint32_t depth;
    size_t bytes;
} fsm_progress;

/* Called now and then: shows progress, and returns why to stop, or FSM_COMPLETE. */
fsm_outcome fsm_pace_check(fsm_pace *self, fsm_progress progress);

/* For `keep_on` of a search whose context is a pace. */
bool fsm_keep_pace(fsm_search *search);

/* For `seeks_on` of such a search. */
bool fsm_seek_on(const fsm_search *search);

/* Prints the member "machines" of the result: local states, bounds used, coverage. */
void fsm_print_machines(const fsm_composition *composition, fsm_outcome outcome);

#endif
