/* path.h: shortest paths, built again from the checkpoints of a search. */
#ifndef FSM_PATH_H
#define FSM_PATH_H

#include "search.h"

/* Ordinals of steps, that of the initial state first. */
typedef struct {
    uint32_t *steps;
    size_t count, room;
} fsm_path;

/* Makes the path to a state that was found. False if memory ran out. */
bool fsm_path_to(const fsm_search *search, const fsm_found *found, fsm_path *path);

bool fsm_path_add(fsm_path *self, uint32_t step);

#endif
