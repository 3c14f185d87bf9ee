/* store.h: an open-addressing set of fixed-size states that numbers what it holds in the order of
 * insertion. Exact: states are compared, not only their hashes. They never move, so one thread at a
 * time may insert some while others read those they know the numbers of. */
#ifndef FSM_STORE_H
#define FSM_STORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "store/segmented_array.h"
#include "model.h"

typedef struct {
    size_t state_size;
    uint32_t count;
    uint64_t room;     /* states that fit before there must be another chunk */
    uint32_t capacity; /* slots, a power of two, at least twice `count` */
    uint32_t *slots;   /* number of a state plus one; 0 is empty */
    fsm_segmented_array states;
} fsm_store;

bool fsm_store_init(fsm_store *self, size_t state_size);
void fsm_store_free(fsm_store *self);

/* Number of the state, which is added if it is new (`*added`, which may be NULL). FSM_NONE if memory
 * ran out or the store would pass `limit` bytes; the store stays as it was. */
uint32_t fsm_store_insert(fsm_store *self, const void *state, size_t limit, bool *added);

/* Number of the state, or FSM_NONE. */
uint32_t fsm_store_find(const fsm_store *self, const void *state);

size_t fsm_store_bytes(const fsm_store *self);

static inline const void *fsm_store_at(const fsm_store *self, uint32_t number)
{
    return fsm_segmented_array_at(&self->states, number, self->state_size);
}

#endif
