#include "store/lists.h"

#include <string.h>

static fsm_list **place_of(const fsm_lists *self, uint32_t number)
{
    return fsm_segmented_array_at(&self->all, number, sizeof(fsm_list *));
}

static bool add(fsm_lists *self, const uint32_t *items, uint32_t count)
{
    size_t bytes = sizeof(fsm_list) + count * sizeof *items;
    fsm_list *list = malloc(bytes);
    if (list == NULL || !fsm_segmented_array_make_room(&self->all, self->count, sizeof list)) {
        free(list);
        return false;
    }
    list->count = count;
    if (count > 0)
        memcpy(list->items, items, count * sizeof *items);
    *place_of(self, self->count++) = list;
    self->bytes += bytes + sizeof list;
    return true;
}

bool fsm_lists_init(fsm_lists *self)
{
    *self = (fsm_lists){.capacity = 128};
    self->slots = calloc(self->capacity, sizeof *self->slots);
    return self->slots != NULL && add(self, NULL, 0);
}

void fsm_lists_free(fsm_lists *self)
{
    for (uint32_t number = 0; number < self->count; number++)
        free(*place_of(self, number));
    fsm_segmented_array_free(&self->all);
    free(self->slots);
    *self = (fsm_lists){0};
}

size_t fsm_lists_bytes(const fsm_lists *self)
{
    return self->bytes + self->capacity * sizeof *self->slots;
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

static bool make_room(fsm_lists *self)
{
    if (2 * self->count < self->capacity)
        return true;
    uint32_t *slots = self->capacity > UINT32_MAX / 8 ? NULL : calloc(2 * (size_t)self->capacity, sizeof *slots);
    if (slots == NULL)
        return false;
    free(self->slots);
    self->slots = slots;
    self->capacity *= 2;
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
    if (!make_room(self) || !add(self, items, count))
        return UINT32_MAX;
    *slot_of(self, items, count) = self->count - 1;
    return self->count - 1;
}
