#include "zones/timed_arrivals.h"

#include <stdlib.h>
#include <string.h>

/* An arrival in `bytes`: the further effects of the step, the discrete part, the zone. */
typedef struct {
    uint64_t ended;
    uint32_t action, size;
    uint32_t kind, sure;
} head;

void fsm_timed_arrivals_clear(fsm_timed_arrivals *self)
{
    self->size = 0;
    self->count = 0;
    for (uint32_t i = 0; i < self->capacity; i++)
        self->slots[i] = UINT64_MAX;
}

void fsm_timed_arrivals_free(fsm_timed_arrivals *self)
{
    free(self->bytes);
    free(self->slots);
    *self = (fsm_timed_arrivals){0};
}

static bool grow_bytes(fsm_timed_arrivals *self, size_t more)
{
    size_t room = self->room == 0 ? 4096 : self->room;
    while (room < self->size + more)
        room *= 2;
    if (room > UINT32_MAX)
        return false;
    unsigned char *bytes = room == self->room ? self->bytes : realloc(self->bytes, room);
    if (bytes == NULL)
        return false;
    self->bytes = bytes;
    self->room = room;
    return true;
}

static void put(fsm_timed_arrivals *self, uint64_t entry)
{
    uint32_t slot = (uint32_t)(entry >> 32) & (self->capacity - 1);
    while (self->slots[slot] != UINT64_MAX)
        slot = (slot + 1) & (self->capacity - 1);
    self->slots[slot] = entry;
}

static bool grow_slots(fsm_timed_arrivals *self)
{
    uint32_t capacity = self->capacity == 0 ? 64 : 2 * self->capacity, before = self->capacity;
    uint64_t *old = self->slots;
    self->slots = malloc(capacity * sizeof *self->slots);
    if (self->slots == NULL) {
        self->slots = old;
        return false;
    }
    self->capacity = capacity;
    for (uint32_t i = 0; i < capacity; i++)
        self->slots[i] = UINT64_MAX;
    for (uint32_t i = 0; i < before; i++)
        if (old[i] != UINT64_MAX)
            put(self, old[i]);
    free(old);
    return true;
}

static uint32_t hash_of(const unsigned char *bytes, size_t size)
{
    uint64_t h = 0x9e3779b97f4a7c15u;
    for (size_t i = 0; i + 4 <= size; i += 4) {
        uint32_t word;
        memcpy(&word, bytes + i, sizeof word);
        h = (h ^ word) * 0xd6e8feb86659fd93u;
        h ^= h >> 32;
    }
    return (uint32_t)h;
}

bool fsm_timed_arrivals_add(fsm_timed_arrivals *self, size_t tuple_bytes, const fsm_timed_step *step, fsm_kind kind,
                            const fsm_timed_move *move, bool *is_new)
{
    size_t zone_bytes = (size_t)step->size * step->size * sizeof *step->zone;
    const head first = {move->ended, move->action, step->size, kind, move->sure};
    size_t size = sizeof first + tuple_bytes + zone_bytes;
    if (!grow_bytes(self, size) || (2 * self->count >= self->capacity && !grow_slots(self)))
        return false;
    unsigned char *new = self->bytes + self->size;
    memcpy(new, &first, sizeof first);
    memcpy(new + sizeof first, step->tuple, tuple_bytes);
    memcpy(new + sizeof first + tuple_bytes, step->zone, zone_bytes);
    uint64_t entry = (uint64_t)hash_of(new, size) << 32 | self->size;
    *is_new = true;
    for (uint32_t slot = (uint32_t)(entry >> 32) & (self->capacity - 1); self->slots[slot] != UINT64_MAX;
         slot = (slot + 1) & (self->capacity - 1)) {
        size_t at = (uint32_t)self->slots[slot];
        if (self->slots[slot] >> 32 == entry >> 32 && at + size <= self->size && memcmp(self->bytes + at, new, size) == 0) {
            *is_new = false;
            return true;
        }
    }
    put(self, entry);
    self->size += size;
    self->count++;
    return true;
}
