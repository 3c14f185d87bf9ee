#include "store/hash_map.h"

#include "store/region.h"

#include <stdlib.h>

static void free_tables(fsm_hash_map_table *table)
{
    while (table != NULL) {
        fsm_hash_map_table *older = table->older;
        free(table);
        table = older;
    }
}

static size_t table_bytes(size_t capacity)
{
    return sizeof(fsm_hash_map_table) + capacity * sizeof(fsm_hash_map_slot);
}

void fsm_hash_map_free(fsm_hash_map *self)
{
    free_tables(self->table);
    *self = (fsm_hash_map){0};
}

void fsm_hash_map_tidy(fsm_hash_map *self)
{
    if (self->table == NULL)
        return;
    free_tables(self->table->older);
    self->table->older = NULL;
    self->bytes = table_bytes(self->table->capacity);
}

static bool grow(fsm_hash_map *self)
{
    fsm_hash_map_table *old = self->table;
    size_t capacity = old == NULL ? 1024 : old->capacity * 2;
    fsm_hash_map_table *bigger = calloc(1, table_bytes(capacity));
    uint64_t held;
    if (bigger == NULL)
        return false;
    fsm_region_advise(bigger, table_bytes(capacity));
    bigger->capacity = capacity;
    bigger->older = old;
    for (size_t i = 0; old != NULL && i < old->capacity; i++)
        if (old->slots[i].key != 0)
            bigger->slots[fsm_hash_map_slot_of(bigger, old->slots[i].key - 1, &held)] = old->slots[i];
    self->bytes += table_bytes(capacity);
    __atomic_store_n(&self->table, bigger, __ATOMIC_RELEASE);
    return true;
}

bool fsm_hash_map_add(fsm_hash_map *self, uint64_t key, uint64_t value)
{
    uint64_t held;
    if ((self->table == NULL || 2 * (self->count + 1) > self->table->capacity) && !grow(self))
        return false;
    fsm_hash_map_slot *slot = &self->table->slots[fsm_hash_map_slot_of(self->table, key, &held)];
    if (held != 0)
        return true;
    slot->value = value;
    __atomic_store_n(&slot->key, key + 1, __ATOMIC_RELEASE);
    self->count++;
    return true;
}
