/* search.h: breadth-first exploration of a model, layer by layer.
 *
 * Only the set of states passed and two layers are kept, and a few layers as checkpoints: each state
 * of a layer knows from which state of the checkpoint before it came. Paths are found again between
 * checkpoints (path.h). */
#ifndef FSM_SEARCH_H
#define FSM_SEARCH_H

#include "search/layer.h"

bool fsm_search_init(fsm_search *self, const fsm_model *model, size_t memory_limit);

/* Stores states lossily (hash_compaction.h), in a table of so many bytes: then some may be
 * missed, and properties of the whole graph cannot be decided. To be called before the search.
 * False if there is no memory for it. */
bool fsm_search_make_lossy(fsm_search *self, fsm_storage storage, size_t bytes);
void fsm_search_free(fsm_search *self);

/* Explores until everything is known or a limit is met; says so in `outcome`. */
void fsm_search_run(fsm_search *self);

/* Explores again until the nearest state of each group is found; `search` then holds what their paths are
 * built from, and nothing else. `targets` are sorted by state. */
void fsm_search_locate(fsm_search *self, const fsm_target *targets, size_t count, fsm_found *groups,
                       uint32_t group_count);

/* Frees all but what paths are built from. */
void fsm_search_forget(fsm_search *self);

size_t fsm_search_bytes(const fsm_search *self);

#endif
