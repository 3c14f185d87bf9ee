/* limits.h: what a search for paths works on, and how much it may use. */
#ifndef FSM_WAY_LIMITS_H
#define FSM_WAY_LIMITS_H

#include "report.h"
#include "symbolic/symbolic.h"

/* The diagram in which a path is sought, and what the search may use. */
typedef struct {
    fsm_symbolic *symbolic;
    fsm_pace *pace;
    size_t memory;   /* bytes for a search that keeps each state */
    uint64_t states; /* that it may keep */
    bool sleepless;  /* see fsm_search */
} fsm_ways;

/* So many states of a search that keeps each, or nodes of distances; fewer of wide systems, each of which is dearer. */
uint64_t fsm_as_many(uint64_t states);
uint64_t fsm_most_states_of_ways(void);
uint64_t fsm_most_nodes_of_ways(void);

#endif
