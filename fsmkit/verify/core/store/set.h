/* set.h: the passed list, an exact set of states; or, where less is kept of them (hash_compaction.h), the table of that.
 *
 * It has one shard, or as many as a power of two, so that as many threads can add to it at once, each to
 * shards of its own. The lower bits of both halves select the shard; those of the right half are not kept.
 * If it is lossy it has no shards but parts, of which the number is fixed, and no places. */
#ifndef FSM_SET_H
#define FSM_SET_H

#include "store/hash_compaction.h"
#include "store/shard.h"

typedef struct {
    uint64_t count;
    size_t limit; /* bytes */
    unsigned shift; /* there are 1 << shift shards */
    fsm_shard *shards;
    fsm_hash_compaction *lossy; /* NULL: exact */
} fsm_set;

bool fsm_set_init(fsm_set *self, size_t limit);
void fsm_set_free(fsm_set *self);

/* Makes an empty one lossy, with a table of so many bytes. False if they cannot be had. */
bool fsm_set_make_lossy(fsm_set *self, fsm_storage storage, size_t bytes);

/* Divides a set that has one shard. False if memory ran out; the set stays as it was. A lossy one is divided already. */
bool fsm_set_split(fsm_set *self, unsigned shift);

static inline uint32_t fsm_set_shard_of(const fsm_set *self, fsm_state state)
{
    return (fsm_left(state) ^ fsm_right(state)) & ((1u << self->shift) - 1);
}

/* A state as its shard keeps it, and the other way round. */
static inline fsm_state fsm_set_inner(const fsm_set *self, fsm_state state)
{
    return fsm_join(fsm_left(state), fsm_right(state) >> self->shift);
}

static inline fsm_state fsm_set_outer(const fsm_set *self, uint32_t shard, fsm_state inner)
{
    uint32_t lower = (fsm_left(inner) ^ shard) & ((1u << self->shift) - 1);
    return fsm_join(fsm_left(inner), fsm_right(inner) << self->shift | lower);
}

/* The same for any set: the shard or part that a state belongs to, by number; where it belongs in the present edition of
 * that, while its memory is fetched; and whether it is known there. */
static inline uint32_t fsm_set_part_of(const fsm_set *self, fsm_state state)
{
    return self->lossy != NULL ? fsm_hash_compaction_part_of(self->lossy, state) : fsm_set_shard_of(self, state);
}

static inline uint64_t fsm_set_home(const fsm_set *self, fsm_state state)
{
    return self->lossy != NULL
        ? fsm_hash_compaction_home(self->lossy, state)
        : fsm_shard_home(&self->shards[fsm_set_shard_of(self, state)], fsm_set_inner(self, state));
}

static inline bool fsm_set_has(const fsm_set *self, uint32_t part, uint64_t home)
{
    return self->lossy != NULL ? fsm_hash_compaction_has(self->lossy, home) : fsm_shard_has(&self->shards[part], home);
}

static inline fsm_shard *fsm_set_shard(const fsm_set *self, fsm_state state)
{
    return &self->shards[fsm_set_shard_of(self, state)];
}

/* Adds a state, if it is new; knowing its shard and its home there in an edition, or not. */
fsm_put fsm_set_put(fsm_set *self, fsm_state state);

static inline fsm_put fsm_set_put_home(fsm_set *self, fsm_state state, fsm_shard *shard, uint64_t home, uint32_t edition)
{
    fsm_put put = fsm_shard_put_home(shard, fsm_set_inner(self, state), home, edition);
    self->count += put == FSM_ADDED;
    return put;
}

static inline fsm_put fsm_set_put_lossy(fsm_set *self, uint64_t home)
{
    fsm_put put = fsm_hash_compaction_put(self->lossy, home);
    self->count += put == FSM_ADDED;
    return put;
}

/* Counts again, after shards were added to by themselves. */
void fsm_set_count_again(fsm_set *self);

size_t fsm_set_bytes(const fsm_set *self);
bool fsm_set_is_dense(const fsm_set *self);

/* Places: where a state is kept, as long as nothing is added. Not all places are taken. */
uint64_t fsm_set_places(const fsm_set *self);
uint64_t fsm_set_find(const fsm_set *self, fsm_state state);
bool fsm_set_taken(const fsm_set *self, uint64_t place);
fsm_state fsm_set_at(const fsm_set *self, uint64_t place);

#endif
