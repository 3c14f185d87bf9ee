#include "memo.h"

#include <stdlib.h>

void fsm_memo_free(fsm_memo *self)
{
    free(self->keys);
    free(self->values);
    *self = (fsm_memo){0};
}

static size_t find_slot(const fsm_memo *self, uint64_t key)
{
    uint64_t h = (key ^ (key >> 32)) * 0xd6e8feb86659fd93u;
    size_t slot = (size_t)(h ^ (h >> 32)) & (self->capacity - 1);
    while (self->keys[slot] != 0 && self->keys[slot] != key + 1)
        slot = (slot + 1) & (self->capacity - 1);
    return slot;
}

const uint64_t *fsm_memo_find(const fsm_memo *self, uint64_t key)
{
    if (self->capacity == 0)
        return NULL;
    size_t slot = find_slot(self, key);
    return self->keys[slot] == 0 ? NULL : &self->values[slot];
}

static bool grow(fsm_memo *self)
{
    size_t capacity = self->capacity == 0 ? 1024 : self->capacity * 2;
    fsm_memo bigger = {.capacity = capacity};
    bigger.keys = calloc(capacity, sizeof *bigger.keys);
    bigger.values = malloc(capacity * sizeof *bigger.values);
    if (bigger.keys == NULL || bigger.values == NULL) {
        fsm_memo_free(&bigger);
        return false;
    }
    for (size_t i = 0; i < self->capacity; i++) {
        if (self->keys[i] == 0)
            continue;
        size_t slot = find_slot(&bigger, self->keys[i] - 1);
        bigger.keys[slot] = self->keys[i];
        bigger.values[slot] = self->values[i];
    }
    bigger.count = self->count;
    fsm_memo_free(self);
    *self = bigger;
    return true;
}

bool fsm_memo_add(fsm_memo *self, uint64_t key, uint64_t value)
{
    if (2 * (self->count + 1) > self->capacity && !grow(self))
        return false;
    size_t slot = find_slot(self, key);
    self->keys[slot] = key + 1;
    self->values[slot] = value;
    self->count++;
    return true;
}
