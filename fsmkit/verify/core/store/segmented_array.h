/* segmented_array.h: arrays that grow and never move, so that elements can be read while others are added.
 * Each chunk is twice as large as the previous one, and starts at a cache line. */
#ifndef FSM_SEGMENTED_ARRAY_H
#define FSM_SEGMENTED_ARRAY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include "store/region.h"

enum {
    FSM_FIRST_CHUNK_BITS = 6,
    FSM_CHUNKS = 33 - FSM_FIRST_CHUNK_BITS,
    FSM_CACHE_LINE = 64
};

typedef struct {
    void *chunks[FSM_CHUNKS];
    void *blocks[FSM_CHUNKS]; /* of memory, that they are in */
} fsm_segmented_array;

static inline unsigned fsm_chunk_of(uint32_t number)
{
    uint64_t at = (uint64_t)number + (1u << FSM_FIRST_CHUNK_BITS);
    return 63u - FSM_FIRST_CHUNK_BITS - (unsigned)__builtin_clzll(at);
}

static inline void *fsm_segmented_array_at(const fsm_segmented_array *self, uint32_t number, size_t size)
{
    unsigned chunk = fsm_chunk_of(number);
    uint64_t first = UINT64_C(1) << (chunk + FSM_FIRST_CHUNK_BITS);
    uint64_t at = (uint64_t)number + (1u << FSM_FIRST_CHUNK_BITS) - first;
    return (char *)self->chunks[chunk] + at * size;
}

/* Returns the capacity of an array that is grown to contain this index. */
static inline uint64_t fsm_segmented_array_room(uint32_t number)
{
    return (UINT64_C(2) << (fsm_chunk_of(number) + FSM_FIRST_CHUNK_BITS)) - (1u << FSM_FIRST_CHUNK_BITS);
}

/* Makes room for an element; those before it have theirs. False if memory ran out. */
static inline bool fsm_segmented_array_make_room(fsm_segmented_array *self, uint32_t number, size_t size)
{
    unsigned chunk = fsm_chunk_of(number);
    if (self->chunks[chunk] != NULL)
        return true;
    size_t bytes = (size << (chunk + FSM_FIRST_CHUNK_BITS)) + FSM_CACHE_LINE;
    char *block = malloc(bytes);
    if (block == NULL)
        return false;
    fsm_region_advise(block, bytes);
    self->blocks[chunk] = block;
    self->chunks[chunk] = block + (FSM_CACHE_LINE - (uintptr_t)block % FSM_CACHE_LINE);
    return true;
}

static inline void fsm_segmented_array_free(fsm_segmented_array *self)
{
    for (unsigned i = 0; i < FSM_CHUNKS; i++)
        free(self->blocks[i]);
    *self = (fsm_segmented_array){{NULL}, {NULL}};
}

#endif
