/* memo.h: a map from 64-bit keys to 64-bit values that only grows. */
#ifndef FSM_MEMO_H
#define FSM_MEMO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint64_t key; /* plus one; 0 is empty */
    uint64_t value;
} fsm_memo_slot;

typedef struct {
    fsm_memo_slot *slots;
    size_t count, capacity;
} fsm_memo;

void fsm_memo_free(fsm_memo *self);

/* The value of a key (not UINT64_MAX), or NULL. */
const uint64_t *fsm_memo_find(const fsm_memo *self, uint64_t key);

/* Adds a key that is not there. False if memory ran out. */
bool fsm_memo_add(fsm_memo *self, uint64_t key, uint64_t value);

static inline size_t fsm_memo_bytes(const fsm_memo *self)
{
    return self->capacity * sizeof *self->slots;
}

#endif
