#include "store/store.h"

#include <stdlib.h>
#include <string.h>

enum { FIRST_CAPACITY = 128 };

bool fsm_store_init(fsm_store *self, size_t state_size)
{
    *self = (fsm_store){.state_size = state_size, .capacity = FIRST_CAPACITY};
    self->slots = calloc(self->capacity, sizeof *self->slots);
    if (self->slots != NULL && fsm_segmented_array_make_room(&self->states, 0, state_size)) {
        self->room = fsm_segmented_array_room(0);
        return true;
    }
    fsm_store_free(self);
    return false;
}

void fsm_store_free(fsm_store *self)
{
    free(self->slots);
    fsm_segmented_array_free(&self->states);
    *self = (fsm_store){0};
}

size_t fsm_store_bytes(const fsm_store *self)
{
    return (size_t)self->capacity * sizeof *self->slots + (size_t)self->room * self->state_size;
}

static uint64_t mixed(uint64_t h, uint64_t word)
{
    h = (h ^ word) * 0xd6e8feb86659fd93u;
    return h ^ h >> 32;
}

/* The hash of four words at a time: those of one block do not wait for each other. */
enum { LANES = 4, BLOCK = LANES * sizeof(uint64_t) };

static uint64_t hash_of_blocks(const unsigned char *bytes, size_t count, uint64_t h)
{
    uint64_t lanes[LANES] = {h, h + 1, h + 2, h + 3};
    for (; count > 0; count--, bytes += BLOCK) {
        uint64_t words[LANES];
        memcpy(words, bytes, BLOCK);
        lanes[0] = mixed(lanes[0], words[0]);
        lanes[1] = mixed(lanes[1], words[1]);
        lanes[2] = mixed(lanes[2], words[2]);
        lanes[3] = mixed(lanes[3], words[3]);
    }
    return mixed(mixed(mixed(lanes[0], lanes[1]), lanes[2]), lanes[3]);
}

/* Eight bytes at a time, multiplied and folded; the last step makes the low bits usable. Long states are those of machines that
 * share an array with thousands of others. */
static uint32_t hash(const unsigned char *bytes, size_t size)
{
    enum { LONG = 8 * BLOCK };
    uint64_t h = 0x9e3779b97f4a7c15u ^ size;
    if (size >= LONG) {
        h = hash_of_blocks(bytes, size / BLOCK, h);
        bytes += size / BLOCK * BLOCK;
        size %= BLOCK;
    }
    while (size > 0) {
        uint64_t word = 0;
        size_t part = size < sizeof word ? size : sizeof word;
        memcpy(&word, bytes, part);
        h = mixed(h, word);
        bytes += part;
        size -= part;
    }
    h *= 0xd6e8feb86659fd93u;
    return (uint32_t)(h ^ (h >> 32));
}

/* The slot that holds the state, or the empty one where it belongs. */
static uint32_t find_slot(const fsm_store *self, const void *state)
{
    uint32_t mask = self->capacity - 1;
    uint32_t slot = hash(state, self->state_size) & mask;
    for (; self->slots[slot] != 0; slot = (slot + 1) & mask)
        if (memcmp(fsm_store_at(self, self->slots[slot] - 1), state, self->state_size) == 0)
            break;
    return slot;
}

static bool grow_states(fsm_store *self, size_t limit)
{
    uint64_t room = fsm_segmented_array_room(self->count);
    if (self->count == FSM_NONE - 1 || room > SIZE_MAX / self->state_size
        || room * self->state_size + (size_t)self->capacity * sizeof *self->slots > limit
        || !fsm_segmented_array_make_room(&self->states, self->count, self->state_size))
        return false;
    self->room = room;
    return true;
}

static bool grow_slots(fsm_store *self, size_t limit)
{
    if (self->capacity > FSM_NONE / 2)
        return false;
    uint32_t capacity = self->capacity * 2;
    size_t bytes = (size_t)capacity * sizeof *self->slots;
    if (bytes + (size_t)self->room * self->state_size > limit)
        return false;
    uint32_t *slots = calloc(capacity, sizeof *slots);
    if (slots == NULL)
        return false;
    for (uint32_t number = 0; number < self->count; number++) {
        uint32_t slot = hash(fsm_store_at(self, number), self->state_size) & (capacity - 1);
        while (slots[slot] != 0)
            slot = (slot + 1) & (capacity - 1);
        slots[slot] = number + 1;
    }
    free(self->slots);
    self->slots = slots;
    self->capacity = capacity;
    return true;
}

uint32_t fsm_store_find(const fsm_store *self, const void *state)
{
    uint32_t found = self->slots[find_slot(self, state)];
    return found == 0 ? FSM_NONE : found - 1;
}

uint32_t fsm_store_insert(fsm_store *self, const void *state, size_t limit, bool *added)
{
    if (added != NULL)
        *added = false;
    uint32_t slot = find_slot(self, state);
    if (self->slots[slot] != 0)
        return self->slots[slot] - 1;
    if (self->count == self->room && !grow_states(self, limit))
        return FSM_NONE;
    if (self->count >= self->capacity / 2) {
        if (!grow_slots(self, limit))
            return FSM_NONE;
        slot = find_slot(self, state);
    }
    if (added != NULL)
        *added = true;
    memcpy(fsm_segmented_array_at(&self->states, self->count, self->state_size), state, self->state_size);
    self->slots[slot] = self->count + 1;
    return self->count++;
}
