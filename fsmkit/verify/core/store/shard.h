/* shard.h: a shard of the passed list (set.h), an exact set of states.
 *
 * Hashed form: the bits of a state are permuted; the quotient of that number names a bucket of one
 * cache line, the rest is kept in a slot of 32 bits, or 16 where there are so many buckets that the rest is
 * small (quotienting: Cleary 1984). What finds its bucket full goes to a small table of whole states. Buckets are
 * in the order of the permuted numbers, so the table grows in place, by a little at a time.
 *
 * Dense form: a bit for each pair of halves; chosen where that is smaller. */
#ifndef FSM_SHARD_H
#define FSM_SHARD_H

#include "model.h"
#include "store/region.h"

typedef struct {
    uint64_t *slots; /* permuted state << 1 | 1; 0 is empty */
    size_t count, capacity;
} fsm_overflow;

typedef struct {
    uint64_t count;
    size_t limit;    /* bytes */
    uint64_t line;   /* dense: the width is a multiple of so many cells */
    uint32_t edition; /* another one each time that states change their places */
    bool dense;
    fsm_region region;
    /* hashed */
    unsigned left_bits, right_bits; /* of the halves */
    unsigned slots;                 /* in a bucket: 16, or 32 of half the size */
    uint64_t buckets, most;         /* states that fit before the table must grow */
    uint64_t divisor, reciprocal;   /* permuted number / divisor is the bucket */
    uint64_t factors[2], inverses[2];
    fsm_overflow overflow;
    /* dense */
    uint64_t rows, width;
    uint64_t most_rows; /* for which there is room */
    uint32_t most_left, most_right; /* the largest halves met */
} fsm_shard;

typedef enum { FSM_KNOWN, FSM_ADDED, FSM_NO_ROOM } fsm_put;

/* Makes an empty one, of `shards` that there are, for so many states with halves up to these. */
bool fsm_shard_init(fsm_shard *self, size_t limit, uint32_t shards, uint64_t states, uint32_t most_left, uint32_t most_right);
void fsm_shard_free(fsm_shard *self);

#define FSM_NOWHERE UINT64_MAX

/* The same as the two below, in the hashed form. */
uint64_t fsm_shard_bucket_home(const fsm_shard *self, fsm_state state);
bool fsm_shard_bucket_has(const fsm_shard *self, uint64_t home);

/* Where a state belongs, in the present edition of the set; its memory is fetched meanwhile. A home is a
 * cell, or a bucket and what is kept in a slot of it. */
static inline uint64_t fsm_shard_home(const fsm_shard *self, fsm_state state)
{
    if (!self->dense)
        return fsm_shard_bucket_home(self, state);
    if (fsm_right(state) >= self->width || fsm_left(state) >= self->most_rows)
        return FSM_NOWHERE;
    uint64_t cell = fsm_left(state) * self->width + fsm_right(state);
    __builtin_prefetch((const char *)self->region.base + cell / 8);
    return cell;
}

/* Whether it has the state with this home in the present edition. */
static inline bool fsm_shard_has(const fsm_shard *self, uint64_t home)
{
    if (home == FSM_NOWHERE)
        return false;
    if (!self->dense)
        return fsm_shard_bucket_has(self, home);
    return (((const unsigned char *)self->region.base)[home / 8] >> home % 8 & 1) != 0;
}

/* Adds a state, if it is new. */
fsm_put fsm_shard_put(fsm_shard *self, fsm_state state);

/* The same, knowing its home in an edition. */
fsm_put fsm_shard_put_new_home(fsm_shard *self, fsm_state state, uint64_t home, uint32_t edition);

static inline fsm_put fsm_shard_put_home(fsm_shard *self, fsm_state state, uint64_t home, uint32_t edition)
{
    if (self->dense && edition == self->edition && fsm_shard_has(self, home))
        return FSM_KNOWN; /* as most are */
    return fsm_shard_put_new_home(self, state, home, edition);
}

size_t fsm_shard_bytes(const fsm_shard *self);

/* Places: where a state is kept, as long as nothing is added. Not all places are taken. */
uint64_t fsm_shard_places(const fsm_shard *self);
uint64_t fsm_shard_find(const fsm_shard *self, fsm_state state);
bool fsm_shard_taken(const fsm_shard *self, uint64_t place);

/* Returns the first used position at or after the given one, or one after the last position. */
uint64_t fsm_shard_next(const fsm_shard *self, uint64_t place);
fsm_state fsm_shard_at(const fsm_shard *self, uint64_t place);

#endif
