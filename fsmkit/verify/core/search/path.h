/* path.h: shortest paths, built again from the checkpoints of a search. */
#ifndef FSM_PATH_H
#define FSM_PATH_H

#include "search/search.h"

/* Ordinals of steps, that of the initial state first. */
typedef struct fsm_path {
    uint32_t *steps;
    size_t count, room;
} fsm_path;

/* Makes the path to a state that was found. False if the memory ran out that the search may use. */
bool fsm_path_to(const fsm_search *search, const fsm_found *found, fsm_path *path);

/* Whether a shortest path may take a step, and whether it ends with it. */
typedef enum { FSM_OFF_PATH, FSM_GOES_ON, FSM_ARRIVES } fsm_path_step;
typedef fsm_path_step fsm_classify_step(void *context, const fsm_steps *steps, size_t step, fsm_state from);

/* Adds a shortest path from a state, of at least one step. Returns the state it leads to; FSM_NO_STATE if there is
 * none or the memory ran out that the search may use. */
fsm_state fsm_path_from(const fsm_search *search, fsm_state from, fsm_classify_step *way, void *context, fsm_path *path);

bool fsm_path_add(fsm_path *self, uint32_t step);

/* Reverses the steps from `first` on, which were found from the last one to the first. */
void fsm_path_reverse(fsm_path *self, size_t first);

#endif
