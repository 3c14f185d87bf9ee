/* arena.h: memory that is allocated piece by piece and freed as a whole. */
#ifndef FSM_ARENA_H
#define FSM_ARENA_H

#include <stddef.h>

typedef struct fsm_arena_block fsm_arena_block;

typedef struct {
    fsm_arena_block *blocks;
    size_t taken; /* bytes of the first one */
} fsm_arena;

/* Memory for anything; NULL if it ran out. `*used` grows by the bytes that it takes. */
void *fsm_arena_take(fsm_arena *self, size_t bytes, size_t *used);
void fsm_arena_free(fsm_arena *self);

#endif
