/* diagram.h: the explorer with states in a diagram: its options, its search with all queries,
 * and its result, which is the same as that of other searches. */
#ifndef FSM_DIAGRAM_H
#define FSM_DIAGRAM_H

#include "report.h"

typedef struct {
    size_t memory;
    fsm_pace *pace;
    bool livelock, traps;
    const char *order; /* machines, the highest first, separated by commas; NULL: one is sought */
    const char *ways;  /* requested marks, for which paths are shown if they are found; NULL:
                        * none */
    bool sleepless;    /* see fsm_search */
    const char *const *temporal; /* options and what follows them, in pairs; all but `--within` are answered */
    uint32_t temporal_count;
    bool timeless; /* see fsm_find_violations */
    /* For tests: */
    bool slots;             /* each queue is levels from the start, if it can be */
    uint32_t cache_bits;    /* see fsm_mdd_init */
    uint32_t collect_every; /* garbage is collected as soon as so many nodes were made; 0: as is best */
    size_t fail_at;         /* see fsm_mdd */
} fsm_diagram_options;

typedef struct fsm_diagram fsm_diagram;

/* Creates a diagram of the system, over a composition of it. `memory`: bytes for nodes. `pause`, which may be NULL, is called now and then while
 * it searches. NULL if memory ran out. */
fsm_diagram *fsm_diagram_make(const fsm_diagram_options *options, fsm_composition *composition, size_t memory,
                              void (*pause)(void *), void *context);
void fsm_diagram_free(fsm_diagram *self);

/* Finds all states and decides all queries, without paths. To be called by fsm_on_stack. */
void fsm_diagram_search(void *self);

/* Its outcome; 0 steps: it has not started. */
fsm_outcome fsm_diagram_outcome(const fsm_diagram *self);
uint64_t fsm_diagram_work(const fsm_diagram *self);
void fsm_diagram_stop(fsm_diagram *self); /* soon, for good */
void fsm_diagram_go_alone(fsm_diagram *self); /* `pause` is called no more */
bool fsm_diagram_is_sound(const fsm_diagram *self); /* there is something to be shown */
bool fsm_diagram_answers_all(const fsm_diagram *self); /* of temporal properties */
void fsm_diagram_set_memory(fsm_diagram *self, size_t memory);

/* The marks that still need a path, and their number. */
uint32_t fsm_diagram_requested(const fsm_diagram *self, bool *requested);

/* Takes paths from a search that has ended, which may be NULL, and looks for the others. To be
 * called by fsm_on_stack. */
typedef struct {
    fsm_diagram *diagram;
    fsm_search *search;
} fsm_diagram_paths;

void fsm_diagram_find_paths(void *ways);

void fsm_diagram_print(const fsm_diagram *self, double begin);

/* The whole exploration, without another search in parallel. */
int fsm_diagram_explore(const fsm_diagram_options *options);

#endif
