/* chunks.h: arrays that grow and never move, so that what was put there can be read while more is
 * added. Each chunk is twice as large as the one before. */
#ifndef FSM_CHUNKS_H
#define FSM_CHUNKS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

enum {
    FSM_FIRST_CHUNK_BITS = 6,
    FSM_CHUNKS = 33 - FSM_FIRST_CHUNK_BITS
};

typedef struct {
    void *chunks[FSM_CHUNKS];
} fsm_chunks;

static inline unsigned fsm_chunk_of(uint32_t number)
{
    uint64_t at = (uint64_t)number + (1u << FSM_FIRST_CHUNK_BITS);
    return 63u - FSM_FIRST_CHUNK_BITS - (unsigned)__builtin_clzll(at);
}

static inline void *fsm_chunks_at(const fsm_chunks *self, uint32_t number, size_t size)
{
    unsigned chunk = fsm_chunk_of(number);
    uint64_t first = UINT64_C(1) << (chunk + FSM_FIRST_CHUNK_BITS);
    uint64_t at = (uint64_t)number + (1u << FSM_FIRST_CHUNK_BITS) - first;
    return (char *)self->chunks[chunk] + at * size;
}

/* How many elements fit once there is room for one of this number. */
static inline uint64_t fsm_chunks_room(uint32_t number)
{
    return (UINT64_C(2) << (fsm_chunk_of(number) + FSM_FIRST_CHUNK_BITS)) - (1u << FSM_FIRST_CHUNK_BITS);
}

/* Makes room for an element; those before it have theirs. False if memory ran out. */
static inline bool fsm_chunks_make_room(fsm_chunks *self, uint32_t number, size_t size)
{
    unsigned chunk = fsm_chunk_of(number);
    if (self->chunks[chunk] == NULL)
        self->chunks[chunk] = malloc(size << (chunk + FSM_FIRST_CHUNK_BITS));
    return self->chunks[chunk] != NULL;
}

static inline void fsm_chunks_free(fsm_chunks *self)
{
    for (unsigned i = 0; i < FSM_CHUNKS; i++)
        free(self->chunks[i]);
    *self = (fsm_chunks){{NULL}};
}

#endif
