/* parallel_search.h: a layer expanded by several threads, with the same result as by one: the found states are put in
 * the order in which one thread would have found them.
 *
 * A layer is taken by blocks, a block in three rounds. First its states are shared out by chunks; their unknown
 * successors are noted, separately for each shard of the set. Then each shard of the set
 * adds the states noted for it, in the order of chunks, and keeps the new ones. Last each chunk
 * appends its new states to the next layer. Within a round nobody reads what another one writes. */
#ifndef FSM_PARALLEL_SEARCH_H
#define FSM_PARALLEL_SEARCH_H

#include "search/layer.h"

enum { FSM_BLOCK_CHUNKS = 128 };

static inline size_t fsm_parallel_search_block(const fsm_search *search)
{
    return (size_t)search->chunk * FSM_BLOCK_CHUNKS;
}

/* Starts threads for a search, as many as it has cores, and divides its set. NULL if that cannot be had. */
fsm_parallel_search *fsm_parallel_search_start(fsm_search *search);
void fsm_parallel_search_stop(fsm_parallel_search *self);
size_t fsm_parallel_search_bytes(const fsm_parallel_search *self);

/* Expands so many states of a layer from the first one on, at most a block. False if the search is over. */
bool fsm_parallel_search_expand(fsm_parallel_search *self, const fsm_layer *layer, size_t first, size_t count, fsm_layer *next);

#endif
