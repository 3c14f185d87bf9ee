/* limits.h: what a search for paths works on, and how much it may use. */
#ifndef FSM_PATH_LIMITS_H
#define FSM_PATH_LIMITS_H

#include "report.h"
#include "symbolic/symbolic.h"

/* The diagram in which a path is sought, and what the search may use. */
typedef struct {
    fsm_symbolic *symbolic;
    fsm_pace *pace;
    size_t memory;   /* bytes for a search that keeps each state */
    uint64_t states; /* that it may keep */
    bool sleepless;  /* see fsm_search */
} fsm_path_context;

/* The limit of stored states of a search, or of distance nodes; lower for wide systems, whose states are larger. */
uint64_t fsm_as_many(uint64_t states);
uint64_t fsm_max_states_of_paths(void);
uint64_t fsm_max_nodes_of_paths(void);

#endif
