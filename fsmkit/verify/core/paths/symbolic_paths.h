/* symbolic_paths.h: paths to what a symbolic search has found. First a search that keeps each state looks for them, which finds shortest
 * ones; beyond what that may use, sets are made of all states at each distance from the goal, back to the initial states. */
#ifndef FSM_PATHS_H
#define FSM_PATHS_H

#include "search/path.h"
#include "symbolic/livelock.h"
#include "symbolic/relation.h"
#include "paths/limits.h"

/* Paths to the requested marks, into `paths`, by mark; those that are not found are left empty. */
void fsm_paths_to_marks(const fsm_path_context *self, const bool *requested, fsm_path *paths);

/* The paths known to a search that has ended. Everything else is freed. */
void fsm_paths_of_search(fsm_search *search, const bool *requested, fsm_path *paths);

/* A shortest way to some state of a set, by distances. False if memory or time ran out. */
bool fsm_path_by_distances(const fsm_path_context *self, uint32_t set, fsm_path *path);

/* A shortest way to some state of a set, by a search that keeps each state. False if that ended before. */
bool fsm_path_to_set(const fsm_path_context *self, uint32_t set, fsm_path *path);

/* Extends a path from a state to the nearest one of a set, which may be itself, within a bound, by a backward relation. Returns
 * false if there is no path, or memory or time ran out. */
bool fsm_walk_within(const fsm_path_context *self, fsm_relation *back, uint32_t set, uint32_t bound, fsm_state *at, fsm_path *path);

/* A way to a cycle, and its steps. False if memory or time ran out. */
bool fsm_path_to_cycle(const fsm_path_context *self, const fsm_busy_cycle *cycle, fsm_path *path, fsm_path *steps);

#endif
