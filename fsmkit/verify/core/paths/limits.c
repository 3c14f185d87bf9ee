#include "paths/limits.h"

/* Limits of searches for paths: states of the explicit search, after distances are tried; and nodes of distances. */
enum { MOST_STATES = 50000000, MOST_NODES = 20000000, WIDE = 32 };

uint64_t fsm_as_many(uint64_t states)
{
    uint64_t machines = fsm_the_system.machine_count;
    return machines <= WIDE ? states : states * WIDE / machines * WIDE / machines * WIDE / machines + 1;
}

uint64_t fsm_max_states_of_paths(void)
{
    return fsm_the_system.machine_count <= WIDE ? MOST_STATES : 0;
}

uint64_t fsm_max_nodes_of_paths(void)
{
    return fsm_as_many(MOST_NODES);
}
