/* set.h: the passed list, an exact set of states.
 *
 * Hashed form: the bits of a state are permuted; the quotient of that number names a bucket of one
 * cache line, the rest is kept in a slot of 32 bits (quotienting: Cleary 1984). What finds its
 * bucket full goes to a small table of whole states. Buckets are in the order of the permuted
 * numbers, so the table grows in place, by a little at a time.
 *
 * Dense form: a bit for each pair of halves; chosen where that is smaller. */
#ifndef FSM_SET_H
#define FSM_SET_H

#include "model.h"
#include "region.h"

typedef struct {
    uint64_t *slots; /* permuted state << 1 | 1; 0 is empty */
    size_t count, capacity;
} fsm_overflow;

typedef struct {
    uint64_t count;
    size_t limit;    /* bytes */
    uint32_t edition; /* another one each time that states change their places */
    bool dense;
    fsm_region region;
    /* hashed */
    unsigned left_bits, right_bits; /* of the halves */
    uint64_t buckets, most;         /* states that fit before the table must grow */
    uint64_t divisor, reciprocal;   /* permuted number / divisor is the bucket */
    uint64_t factors[2], inverses[2];
    fsm_overflow overflow;
    /* dense */
    uint64_t rows, width;
    uint32_t most_left, most_right; /* the largest halves met */
} fsm_set;

typedef enum { FSM_KNOWN, FSM_ADDED, FSM_NO_ROOM } fsm_put;

bool fsm_set_init(fsm_set *self, size_t limit);
void fsm_set_free(fsm_set *self);

/* Where a state belongs, in the present edition of the set; its memory is fetched meanwhile. */
uint64_t fsm_set_home(const fsm_set *self, fsm_state state);

/* Adds a state, if it is new. */
fsm_put fsm_set_put(fsm_set *self, fsm_state state);

/* The same, knowing its home in an edition. */
fsm_put fsm_set_put_home(fsm_set *self, fsm_state state, uint64_t home, uint32_t edition);

size_t fsm_set_bytes(const fsm_set *self);

/* Places: where a state is kept, as long as nothing is added. Not all places are taken. */
#define FSM_NOWHERE UINT64_MAX
uint64_t fsm_set_places(const fsm_set *self);
uint64_t fsm_set_find(const fsm_set *self, fsm_state state);
bool fsm_set_taken(const fsm_set *self, uint64_t place);
fsm_state fsm_set_at(const fsm_set *self, uint64_t place);

#endif
