/* timed_main.h: the program for exploration in dense time; see main.c for its options. */
#ifndef FSM_TIMED_MAIN_H
#define FSM_TIMED_MAIN_H

#include "report.h"
#include "zones/timed.h"

typedef struct {
    size_t memory;
    fsm_pace *pace;
    bool livelock, traps, list;
    const char *until;
    bool any;          /* the first mark of `until` ends it */
    const char *watch; /* "BEGIN,END,MOST": two properties, and units */
    const char *const *temporal; /* options that name temporal properties, and their arguments, in pairs */
    uint32_t temporal_count;     /* pairs; if there are any, these are decided, and nothing else is */
    bool timeless;               /* see liveness.h */
    const char *cover;           /* the only one that is tried, and after a comma the states that are enough; NULL: all */
} fsm_timed_options;

int fsm_timed_explore(fsm_composition *composition, const fsm_timed_options *options);

/* Decides the temporal properties; timed_decide.c. */
int fsm_timed_decide(fsm_composition *composition, const fsm_timed_options *options);

/* Performs a path; after a `!` no time passes. */
int fsm_timed_replay(fsm_composition *composition, const char *path);

#endif
