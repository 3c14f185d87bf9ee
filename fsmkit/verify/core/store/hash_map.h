/* hash_map.h: a map from 64-bit keys to 64-bit values that only grows. One thread at a time may add to it
 * while others look things up. */
#ifndef FSM_HASH_MAP_H
#define FSM_HASH_MAP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint64_t key; /* plus one; 0 is empty */
    uint64_t value;
} fsm_hash_map_slot;

typedef struct fsm_hash_map_table fsm_hash_map_table;

struct fsm_hash_map_table {
    size_t capacity;
    fsm_hash_map_table *older; /* smaller ones that somebody may still be reading */
    fsm_hash_map_slot slots[];
};

typedef struct {
    fsm_hash_map_table *table;
    size_t count, bytes;
} fsm_hash_map;

void fsm_hash_map_free(fsm_hash_map *self);

/* Frees memory that only readers needed. No thread may be reading. */
void fsm_hash_map_tidy(fsm_hash_map *self);

static inline size_t fsm_hash_map_first_slot(const fsm_hash_map_table *table, uint64_t key)
{
    uint64_t h = (key ^ (key >> 32)) * 0xd6e8feb86659fd93u;
    return (size_t)(h ^ (h >> 32)) & (table->capacity - 1);
}

/* The slot that holds a key, or the empty one where it belongs; and what it holds. */
static inline size_t fsm_hash_map_slot_of(const fsm_hash_map_table *table, uint64_t key, uint64_t *held)
{
    size_t slot = fsm_hash_map_first_slot(table, key);
    for (;;) {
        *held = __atomic_load_n(&table->slots[slot].key, __ATOMIC_ACQUIRE);
        if (*held == 0 || *held == key + 1)
            return slot;
        slot = (slot + 1) & (table->capacity - 1);
    }
}

/* The value of a key (not UINT64_MAX), or NULL. */
static inline const uint64_t *fsm_hash_map_find(const fsm_hash_map *self, uint64_t key)
{
    const fsm_hash_map_table *table = __atomic_load_n(&self->table, __ATOMIC_ACQUIRE);
    if (table == NULL)
        return NULL;
    uint64_t held;
    size_t slot = fsm_hash_map_slot_of(table, key, &held);
    return held == 0 ? NULL : &table->slots[slot].value;
}

/* Fetches from memory where a key is, or would be. */
static inline void fsm_hash_map_fetch(const fsm_hash_map *self, uint64_t key)
{
    const fsm_hash_map_table *table = __atomic_load_n(&self->table, __ATOMIC_ACQUIRE);
    if (table != NULL)
        __builtin_prefetch(&table->slots[fsm_hash_map_first_slot(table, key)]);
}

/* Adds a key, unless it is there. False if memory ran out. */
bool fsm_hash_map_add(fsm_hash_map *self, uint64_t key, uint64_t value);

static inline size_t fsm_hash_map_bytes(const fsm_hash_map *self)
{
    return self->bytes;
}

#endif
