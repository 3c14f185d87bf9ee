#include "lists.h"

#include <stdlib.h>
#include <string.h>

bool fsm_lists_init(fsm_lists *self)
{
    *self = (fsm_lists){.item_room = 64, .count = 1, .room = 64, .capacity = 128};
    self->items = malloc(self->item_room * sizeof *self->items);
    self->starts = calloc(self->room + 1, sizeof *self->starts);
    self->slots = calloc(self->capacity, sizeof *self->slots);
    return self->items != NULL && self->starts != NULL && self->slots != NULL;
}

void fsm_lists_free(fsm_lists *self)
{
    free(self->items);
    free(self->starts);
    free(self->slots);
    *self = (fsm_lists){0};
}

size_t fsm_lists_bytes(const fsm_lists *self)
{
    return self->item_room * sizeof *self->items + self->room * sizeof *self->starts
        + self->capacity * sizeof *self->slots;
}

static uint32_t *slot_of(const fsm_lists *self, const uint32_t *items, uint32_t count)
{
    uint64_t h = count;
    for (uint32_t i = 0; i < count; i++)
        h = (h ^ items[i]) * 0x9e3779b97f4a7c15u ^ h >> 32;
    uint32_t slot = (uint32_t)(h >> 32) & (self->capacity - 1);
    for (; self->slots[slot] != 0; slot = (slot + 1) & (self->capacity - 1)) {
        uint32_t size;
        const uint32_t *other = fsm_lists_at(self, self->slots[slot], &size);
        if (size == count && memcmp(other, items, count * sizeof *items) == 0)
            break;
    }
    return &self->slots[slot];
}

static bool make_room(fsm_lists *self, uint32_t count)
{
    while (self->item_count + count > self->item_room) {
        uint32_t *items = realloc(self->items, 2 * self->item_room * sizeof *items);
        if (items == NULL)
            return false;
        self->items = items;
        self->item_room *= 2;
    }
    if (self->count < self->room)
        return true;
    uint32_t capacity = 2 * self->capacity;
    size_t *starts = realloc(self->starts, (2 * (size_t)self->room + 1) * sizeof *starts);
    uint32_t *slots = calloc(capacity, sizeof *slots);
    if (starts != NULL)
        self->starts = starts;
    if (starts == NULL || slots == NULL || self->room > UINT32_MAX / 8) {
        free(slots);
        return false;
    }
    free(self->slots);
    self->slots = slots;
    self->room *= 2;
    self->capacity = capacity;
    for (uint32_t number = 1; number < self->count; number++) {
        uint32_t size;
        const uint32_t *items = fsm_lists_at(self, number, &size);
        *slot_of(self, items, size) = number;
    }
    return true;
}

uint32_t fsm_lists_number(fsm_lists *self, const uint32_t *items, uint32_t count)
{
    if (count == 0)
        return 0;
    uint32_t known = *slot_of(self, items, count);
    if (known != 0)
        return known;
    if (!make_room(self, count))
        return UINT32_MAX;
    *slot_of(self, items, count) = self->count;
    memcpy(self->items + self->item_count, items, count * sizeof *items);
    self->item_count += count;
    self->starts[self->count + 1] = self->item_count;
    return self->count++;
}
