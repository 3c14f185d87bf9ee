#include "store/arena.h"

#include "store/region.h"

#include <stdlib.h>

enum { BLOCK = 4 << 20, ALIGNMENT = 16 };

struct fsm_arena_block {
    fsm_arena_block *next;
    size_t size; /* bytes that can be taken */
};

enum { HEAD = (sizeof(fsm_arena_block) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT };

static fsm_arena_block *make_block(size_t size)
{
    fsm_arena_block *block = malloc(HEAD + size);
    if (block == NULL)
        return NULL;
    fsm_region_advise(block, HEAD + size);
    block->size = size;
    return block;
}

void *fsm_arena_take(fsm_arena *self, size_t bytes, size_t *used)
{
    size_t size = (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    if (self->blocks == NULL || self->blocks->size - self->taken < size) {
        fsm_arena_block *block = make_block(size > BLOCK ? size : BLOCK);
        if (block == NULL)
            return NULL;
        block->next = self->blocks;
        *self = (fsm_arena){block, 0};
    }
    void *memory = (char *)self->blocks + HEAD + self->taken;
    self->taken += size;
    *used += size;
    return memory;
}

void fsm_arena_free(fsm_arena *self)
{
    while (self->blocks != NULL) {
        fsm_arena_block *next = self->blocks->next;
        free(self->blocks);
        self->blocks = next;
    }
}
