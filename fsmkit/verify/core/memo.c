#include "memo.h"

#include <stdlib.h>

void fsm_memo_free(fsm_memo *self)
{
    free(self->slots);
    *self = (fsm_memo){0};
}

static size_t find_slot(const fsm_memo *self, uint64_t key)
{
    uint64_t h = (key ^ (key >> 32)) * 0xd6e8feb86659fd93u;
    size_t slot = (size_t)(h ^ (h >> 32)) & (self->capacity - 1);
    while (self->slots[slot].key != 0 && self->slots[slot].key != key + 1)
        slot = (slot + 1) & (self->capacity - 1);
    return slot;
}

const uint64_t *fsm_memo_find(const fsm_memo *self, uint64_t key)
{
    if (self->capacity == 0)
        return NULL;
    size_t slot = find_slot(self, key);
    return self->slots[slot].key == 0 ? NULL : &self->slots[slot].value;
}

static bool grow(fsm_memo *self)
{
    size_t capacity = self->capacity == 0 ? 1024 : self->capacity * 2;
    fsm_memo bigger = {.capacity = capacity};
    bigger.slots = calloc(capacity, sizeof *bigger.slots);
    if (bigger.slots == NULL)
        return false;
    for (size_t i = 0; i < self->capacity; i++)
        if (self->slots[i].key != 0)
            bigger.slots[find_slot(&bigger, self->slots[i].key - 1)] = self->slots[i];
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
    self->slots[slot] = (fsm_memo_slot){key + 1, value};
    self->count++;
    return true;
}
