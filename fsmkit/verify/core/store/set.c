#include "store/set.h"

#include <stdlib.h>

static void free_shards(fsm_shard *shards, uint32_t count)
{
    for (uint32_t i = 0; shards != NULL && i < count; i++)
        fsm_shard_free(&shards[i]);
    free(shards);
}

bool fsm_set_init(fsm_set *self, size_t limit)
{
    *self = (fsm_set){.limit = limit, .shards = calloc(1, sizeof *self->shards)};
    return self->shards != NULL && fsm_shard_init(self->shards, limit, 1, 0, 0, 0);
}

void fsm_set_free(fsm_set *self)
{
    free_shards(self->shards, self->shards == NULL ? 0 : 1u << self->shift);
    if (self->lossy != NULL)
        fsm_hash_compaction_free(self->lossy);
    free(self->lossy);
    *self = (fsm_set){0};
}

bool fsm_set_make_lossy(fsm_set *self, fsm_storage storage, size_t bytes)
{
    fsm_hash_compaction *lossy = malloc(sizeof *lossy);
    if (lossy == NULL || !fsm_hash_compaction_init(lossy, storage, bytes)) {
        free(lossy);
        return false;
    }
    size_t limit = self->limit;
    fsm_set_free(self);
    *self = (fsm_set){.limit = limit, .shift = FSM_HASH_COMPACTION_SHIFT, .lossy = lossy};
    return true;
}

static bool put_all(fsm_set *self, const fsm_shard *old)
{
    uint64_t places = fsm_shard_places(old);
    bool fine = true;
    for (uint64_t place = fsm_shard_next(old, 0); fine && place < places; place = fsm_shard_next(old, place + 1))
        fine = fsm_set_put(self, fsm_shard_at(old, place)) != FSM_NO_ROOM;
    return fine;
}

bool fsm_set_split(fsm_set *self, unsigned shift)
{
    if (self->lossy != NULL)
        return true;
    uint32_t count = 1u << shift;
    const fsm_shard *old = self->shards;
    /* Parts are about equally large; one may be half as large again as the others. */
    size_t limit = self->limit / count + self->limit / count / 2;
    uint64_t states = old->count / count + old->count / count / 4 + 1;
    fsm_set next = {.limit = self->limit, .shift = shift, .shards = calloc(count, sizeof *next.shards)};
    bool fine = next.shards != NULL;
    for (uint32_t i = 0; fine && i < count; i++)
        fine = fsm_shard_init(&next.shards[i], limit, count, states, old->most_left, old->most_right >> shift);
    fine = fine && put_all(&next, old);
    fsm_set discarded = fine ? *self : next;
    if (fine)
        *self = next;
    fsm_set_free(&discarded);
    return fine;
}

fsm_put fsm_set_put(fsm_set *self, fsm_state state)
{
    if (self->lossy != NULL)
        return fsm_set_put_lossy(self, fsm_hash_compaction_home(self->lossy, state));
    fsm_put put = fsm_shard_put(&self->shards[fsm_set_shard_of(self, state)], fsm_set_inner(self, state));
    self->count += put == FSM_ADDED;
    return put;
}

void fsm_set_count_again(fsm_set *self)
{
    self->count = 0;
    for (uint32_t i = 0; i < 1u << self->shift; i++)
        self->count += self->lossy != NULL ? self->lossy->parts[i].count : self->shards[i].count;
}

size_t fsm_set_bytes(const fsm_set *self)
{
    size_t bytes = self->lossy == NULL ? 0 : fsm_hash_compaction_bytes(self->lossy);
    for (uint32_t i = 0; self->shards != NULL && i < 1u << self->shift; i++)
        bytes += fsm_shard_bytes(&self->shards[i]);
    return bytes;
}

bool fsm_set_is_dense(const fsm_set *self)
{
    return self->lossy == NULL && self->shards[0].dense;
}

/* --- places: the shard is in the lowest bits ------------------------------------------------------------ */

uint64_t fsm_set_places(const fsm_set *self)
{
    uint64_t most = 0;
    for (uint32_t i = 0; i < 1u << self->shift; i++)
        most = fsm_shard_places(&self->shards[i]) > most ? fsm_shard_places(&self->shards[i]) : most;
    return most << self->shift;
}

uint64_t fsm_set_find(const fsm_set *self, fsm_state state)
{
    uint32_t shard = fsm_set_shard_of(self, state);
    uint64_t place = fsm_shard_find(&self->shards[shard], fsm_set_inner(self, state));
    return place == FSM_NOWHERE ? FSM_NOWHERE : place << self->shift | shard;
}

bool fsm_set_taken(const fsm_set *self, uint64_t place)
{
    const fsm_shard *shard = &self->shards[place & ((1u << self->shift) - 1)];
    return place >> self->shift < fsm_shard_places(shard) && fsm_shard_taken(shard, place >> self->shift);
}

fsm_state fsm_set_at(const fsm_set *self, uint64_t place)
{
    uint32_t shard = (uint32_t)place & ((1u << self->shift) - 1);
    return fsm_set_outer(self, shard, fsm_shard_at(&self->shards[shard], place >> self->shift));
}
