#include "store/shard.h"

#include "store/bucket.h"

#include <stdlib.h>
#include <string.h>

__extension__ typedef unsigned __int128 wide;

enum {
    FIRST_BITS = 9, /* of each half */
    MOST_BITS = 31, /* of each half */
    LINE = 512,     /* pairs in a cache line */
    FIRST_BUCKETS = 64,
    SMALL = 16 << 20 /* bytes: less than this may be dense whatever it would be hashed */
};

/* --- the permutation of the bits of a state --------------------------------------------------- */

static unsigned bits_of(const fsm_shard *self)
{
    return self->left_bits + self->right_bits;
}

static uint64_t mask_of(const fsm_shard *self)
{
    return (UINT64_C(1) << bits_of(self)) - 1;
}

/* The inverse of an odd number, modulo 2^64: Newton's iteration doubles the bits that are right. */
static uint64_t inverse(uint64_t odd)
{
    uint64_t x = odd;
    for (int i = 0; i < 5; i++)
        x *= 2 - odd * x;
    return x;
}

/* Folding the upper half onto the lower and multiplying by an odd number can both be undone. */
static uint64_t permuted(const fsm_shard *self, fsm_state state)
{
    unsigned half = (bits_of(self) + 1) / 2;
    uint64_t mask = mask_of(self);
    uint64_t x = (uint64_t)fsm_left(state) << self->right_bits | fsm_right(state);
    for (int i = 0; i < 2; i++) {
        x = (x * self->factors[i]) & mask;
        x ^= x >> half;
    }
    return x;
}

static fsm_state restored(const fsm_shard *self, uint64_t x)
{
    unsigned half = (bits_of(self) + 1) / 2;
    uint64_t mask = mask_of(self);
    for (int i = 1; i >= 0; i--) {
        x ^= x >> half;
        x = (x * self->inverses[i]) & mask;
    }
    return fsm_join((uint32_t)(x >> self->right_bits),
                    (uint32_t)(x & ((UINT64_C(1) << self->right_bits) - 1)));
}

static void divide(const fsm_shard *self, uint64_t x, uint64_t *bucket, uint32_t *rest)
{
    uint64_t quotient = (uint64_t)((wide)x * self->reciprocal >> 64);
    uint64_t left = x - quotient * self->divisor;
    if (left >= self->divisor) {
        quotient++;
        left -= self->divisor;
    }
    *bucket = quotient;
    *rest = (uint32_t)left << 1 | 1;
}

/* States that so many buckets are made for. */
static uint64_t capacity(uint64_t buckets, unsigned slots)
{
    return buckets * slots / 5 * 4;
}

static void set_buckets(fsm_shard *self, uint64_t buckets)
{
    self->buckets = buckets;
    self->most = capacity(buckets, self->slots);
    self->divisor = (mask_of(self) + buckets) / buckets; /* 2^bits / buckets, rounded up */
    self->reciprocal = UINT64_MAX / self->divisor;
}

/* --- what finds its bucket full ---------------------------------------------------------------- */

static uint64_t *overflow_slot(const fsm_overflow *self, uint64_t x)
{
    size_t slot = (size_t)((x * 0x9e3779b97f4a7c15u) >> 20) & (self->capacity - 1);
    while (self->slots[slot] != 0 && self->slots[slot] >> 1 != x)
        slot = (slot + 1) & (self->capacity - 1);
    return &self->slots[slot];
}

static bool overflow_add(fsm_overflow *self, uint64_t x)
{
    if (2 * (self->count + 1) > self->capacity) {
        fsm_overflow bigger = {.capacity = self->capacity == 0 ? 64 : 2 * self->capacity};
        bigger.slots = calloc(bigger.capacity, sizeof *bigger.slots);
        if (bigger.slots == NULL)
            return false;
        for (size_t i = 0; i < self->capacity; i++)
            if (self->slots[i] != 0)
                *overflow_slot(&bigger, self->slots[i] >> 1) = self->slots[i];
        bigger.count = self->count;
        free(self->slots);
        *self = bigger;
    }
    *overflow_slot(self, x) = x << 1 | 1;
    self->count++;
    return true;
}

/* --- hashed ---------------------------------------------------------------------------------- */

static unsigned char *bucket_at(const fsm_shard *self, uint64_t bucket)
{
    return (unsigned char *)self->region.base + bucket * FSM_BUCKET;
}

/* Adds what is known to be new. */
static bool hashed_add(fsm_shard *self, uint64_t x)
{
    uint64_t bucket;
    uint32_t rest;
    divide(self, x, &bucket, &rest);
    void *slots = bucket_at(self, bucket);
    unsigned taken = fsm_bucket_taken(slots, self->slots);
    if (taken == self->slots)
        return overflow_add(&self->overflow, x);
    fsm_bucket_set(slots, self->slots, taken, rest);
    return true;
}

/* Once buckets have room again, what overflowed goes back where it belongs. */
static bool readmit(fsm_shard *self)
{
    fsm_overflow old = self->overflow;
    bool fine = true;
    self->overflow = (fsm_overflow){0};
    for (size_t i = 0; i < old.capacity; i++)
        if (old.slots[i] != 0)
            fine = fine && hashed_add(self, old.slots[i] >> 1);
    free(old.slots);
    return fine;
}

/* In place, from the last bucket to the first: no state moves to a smaller bucket. Those of one bucket go to a few that
 * follow each other, of which it is known how full they are. */
static bool hashed_grow(fsm_shard *self, uint64_t buckets)
{
    enum { RECENT = 8 };
    if (buckets * FSM_BUCKET > self->region.reserved)
        return false;
    fsm_shard old = *self;
    uint64_t first = UINT64_MAX; /* of the buckets that got something */
    unsigned char taken[RECENT];
    bool fine = true;
    set_buckets(self, buckets);
    self->edition++;
    for (uint64_t bucket = old.buckets; bucket-- > 0;) {
        uint32_t slots[FSM_BUCKET / sizeof(uint32_t)], held, rest;
        memcpy(slots, bucket_at(self, bucket), sizeof slots);
        memset(bucket_at(self, bucket), 0, sizeof slots);
        uint64_t x = bucket * old.divisor, to, from;
        divide(self, x, &from, &rest);
        for (uint64_t n = from; n < first && n < from + RECENT; n++)
            taken[n % RECENT] = 0;
        first = from;
        for (unsigned i = 0; i < self->slots && (held = fsm_bucket_slot(slots, self->slots, i)) != 0; i++) {
            divide(self, x + (held >> 1), &to, &rest);
            if (taken[to % RECENT] < self->slots)
                fsm_bucket_set(bucket_at(self, to), self->slots, taken[to % RECENT]++, rest);
            else
                fine = fine && overflow_add(&self->overflow, x + (held >> 1));
        }
    }
    return fine && readmit(self);
}

/* --- dense ------------------------------------------------------------------------------------ */

static uint64_t cell_of(const fsm_shard *self, fsm_state state)
{
    return fsm_left(state) * self->width + fsm_right(state);
}

static bool has_cell(const fsm_shard *self, uint64_t cell)
{
    return (((const unsigned char *)self->region.base)[cell / 8] >> cell % 8 & 1) != 0;
}

/* Sixty-four cells at a time. Those of the last word that are no cells are empty. */
static uint64_t next_cell(const fsm_shard *self, uint64_t cell, uint64_t cells)
{
    const unsigned char *bytes = self->region.base;
    for (; cell < cells; cell = (cell / 64 + 1) * 64) {
        uint64_t word = 0;
        for (unsigned i = 0; i < 8; i++)
            word |= (uint64_t)bytes[cell / 64 * 8 + i] << 8 * i;
        word &= UINT64_MAX << cell % 64;
        if (word != 0)
            return cell / 64 * 64 + (unsigned)__builtin_ctzll(word);
    }
    return cells;
}

static void set_cell(fsm_shard *self, uint64_t cell)
{
    unsigned char *byte = (unsigned char *)self->region.base + cell / 8;
    *byte = (unsigned char)(*byte | 1u << cell % 8);
}

/* --- from one form to another ------------------------------------------------------------------- */

static unsigned bits_for(uint32_t most)
{
    unsigned bits = FIRST_BITS;
    while (bits < MOST_BITS && most >> bits != 0)
        bits += 2;
    return bits < MOST_BITS ? bits : MOST_BITS;
}

uint64_t fsm_shard_places(const fsm_shard *self)
{
    return self->dense ? self->rows * self->width
                       : self->buckets * self->slots + self->overflow.capacity;
}

/* The content of a slot of the table. */
static uint32_t held_at(const fsm_shard *self, uint64_t place)
{
    return fsm_bucket_slot(bucket_at(self, place / self->slots), self->slots, (unsigned)(place % self->slots));
}

bool fsm_shard_taken(const fsm_shard *self, uint64_t place)
{
    uint64_t slots = self->buckets * self->slots;
    if (self->dense)
        return has_cell(self, place);
    return place < slots ? held_at(self, place) != 0 : self->overflow.slots[place - slots] != 0;
}

fsm_state fsm_shard_at(const fsm_shard *self, uint64_t place)
{
    uint64_t slots = self->buckets * self->slots;
    if (self->dense)
        return fsm_join((uint32_t)(place / self->width), (uint32_t)(place % self->width));
    if (place >= slots)
        return restored(self, self->overflow.slots[place - slots] >> 1);
    return restored(self, place / self->slots * self->divisor + (held_at(self, place) >> 1));
}

/* Buckets for so many states, of which the rests fit into slots. */
static uint64_t buckets_for(const fsm_shard *self, unsigned slots, uint64_t states)
{
    unsigned rest_bits = FSM_BUCKET * 8 / slots - 1;
    uint64_t least = bits_of(self) > rest_bits ? UINT64_C(1) << (bits_of(self) - rest_bits) : 1;
    uint64_t buckets = FIRST_BUCKETS;
    while (buckets < least || capacity(buckets, slots) < states)
        buckets += buckets / 4;
    return buckets;
}

static void start_hashed(fsm_shard *self, uint64_t states)
{
    static const uint64_t odd[2] = {0x9e3779b97f4a7c15u, 0xd6e8feb86659fd93u};
    for (int i = 0; i < 2; i++) {
        self->factors[i] = odd[i];
        self->inverses[i] = inverse(odd[i]);
    }
    self->dense = false;
    self->left_bits = bits_for(self->most_left);
    self->right_bits = bits_for(self->most_right);
    uint64_t of_wide = buckets_for(self, FSM_WIDE, states), of_narrow = buckets_for(self, FSM_NARROW, states);
    self->slots = of_narrow < of_wide ? FSM_NARROW : FSM_WIDE;
    set_buckets(self, of_narrow < of_wide ? of_narrow : of_wide);
}

static void start_dense(fsm_shard *self)
{
    self->dense = true;
    self->width = ((uint64_t)self->most_right + self->most_right / 4 + self->line) / self->line * self->line;
    self->rows = (uint64_t)self->most_left + 1;
}

static bool add_new(fsm_shard *self, fsm_state state)
{
    if (!self->dense)
        return hashed_add(self, permuted(self, state));
    set_cell(self, cell_of(self, state));
    return true;
}

static size_t needed(const fsm_shard *self)
{
    return self->dense ? (size_t)(self->rows * self->width / 8)
                       : (size_t)(self->buckets * FSM_BUCKET);
}

/* Whether to be dense rather than hashed: it is much faster, and spaces become denser as they are
 * explored, so it may take more at first. */
static bool prefers_dense(const fsm_shard *dense, size_t hashed)
{
    size_t most = hashed < SIZE_MAX / 2 ? 2 * hashed : SIZE_MAX;
    size_t small = dense->limit / 64 < SMALL ? dense->limit / 64 : SMALL;
    if (most < small)
        most = small;
    return dense->rows <= dense->limit / (dense->width / 8) && needed(dense) <= most;
}

uint64_t fsm_shard_next(const fsm_shard *self, uint64_t place)
{
    uint64_t places = fsm_shard_places(self);
    if (self->dense)
        return next_cell(self, place, places);
    while (place < places && !fsm_shard_taken(self, place))
        place++;
    return place;
}

/* Chooses the form that is better, with room for so many states and the largest halves met. */
static void choose_form(fsm_shard *self, uint64_t states)
{
    fsm_shard dense = *self;
    start_hashed(self, states);
    start_dense(&dense);
    if (prefers_dense(&dense, needed(self)))
        *self = dense;
}

/* Memory for the form chosen. */
static bool reserve(fsm_shard *self)
{
    if ((self->most_left | self->most_right) >> MOST_BITS != 0 || needed(self) > self->limit
        || !fsm_region_reserve(&self->region, self->limit))
        return false;
    size_t most = self->limit < self->region.reserved ? self->limit : self->region.reserved;
    self->most_rows = self->dense ? most / (self->width / 8) : 0;
    return needed(self) <= self->region.reserved;
}

/* Makes the set anew. */
static bool rebuild(fsm_shard *self)
{
    fsm_shard next = *self;
    next.overflow = (fsm_overflow){0};
    choose_form(&next, self->count + self->count / 5);
    next.edition++;
    next.region = (fsm_region){0};
    bool fine = reserve(&next);
    uint64_t places = fsm_shard_places(self);
    for (uint64_t place = fsm_shard_next(self, 0); fine && place < places; place = fsm_shard_next(self, place + 1))
        fine = add_new(&next, fsm_shard_at(self, place));
    fsm_shard discarded = fine ? *self : next;
    if (fine)
        *self = next;
    fsm_shard_free(&discarded);
    return fine;
}

static bool fits(const fsm_shard *self, fsm_state state)
{
    if (self->dense)
        return fsm_right(state) < self->width && fsm_left(state) < self->most_rows;
    return fsm_left(state) >> self->left_bits == 0 && fsm_right(state) >> self->right_bits == 0;
}

static bool make_room(fsm_shard *self)
{
    fsm_shard dense = *self;
    start_dense(&dense);
    uint64_t buckets = self->buckets + self->buckets / 4;
    size_t bytes = (size_t)(buckets * FSM_BUCKET);
    bool narrow = self->slots == FSM_WIDE && buckets_for(self, FSM_NARROW, self->count) < buckets;
    if ((prefers_dense(&dense, bytes) || narrow) && rebuild(self))
        return true;
    return bytes <= self->limit && hashed_grow(self, buckets);
}

/* --- the set ------------------------------------------------------------------------------------ */

bool fsm_shard_init(fsm_shard *self, size_t limit, uint32_t shards, uint64_t states, uint32_t most_left, uint32_t most_right)
{
    *self = (fsm_shard){.limit = limit, .line = LINE / shards < 8 ? 8 : LINE / shards};
    self->most_left = most_left;
    self->most_right = most_right;
    if (states == 0)
        start_hashed(self, 0);
    else
        choose_form(self, states);
    return reserve(self);
}

void fsm_shard_free(fsm_shard *self)
{
    fsm_region_release(&self->region);
    free(self->overflow.slots);
    *self = (fsm_shard){0};
}

size_t fsm_shard_bytes(const fsm_shard *self)
{
    return needed(self) + self->overflow.capacity * sizeof *self->overflow.slots;
}

uint64_t fsm_shard_bucket_home(const fsm_shard *self, fsm_state state)
{
    uint64_t bucket;
    uint32_t rest;
    if (!fits(self, state))
        return FSM_NOWHERE;
    divide(self, permuted(self, state), &bucket, &rest);
    __builtin_prefetch(bucket_at(self, bucket));
    return bucket << 32 | rest;
}

static fsm_put dense_put(fsm_shard *self, fsm_state state, uint64_t cell)
{
    if (has_cell(self, cell))
        return FSM_KNOWN;
    set_cell(self, cell);
    if (fsm_left(state) >= self->rows)
        self->rows = (uint64_t)fsm_left(state) + 1;
    self->count++;
    return FSM_ADDED;
}

static fsm_put hashed_put(fsm_shard *self, fsm_state state, uint64_t home)
{
    uint64_t bucket = home >> 32, x = bucket * self->divisor + ((uint32_t)home >> 1);
    void *slots = bucket_at(self, bucket);
    if (fsm_bucket_find(slots, self->slots, (uint32_t)home) < self->slots)
        return FSM_KNOWN;
    unsigned taken = fsm_bucket_taken(slots, self->slots);
    if (taken == self->slots && self->overflow.capacity > 0 && *overflow_slot(&self->overflow, x) != 0)
        return FSM_KNOWN;
    if (self->count >= self->most)
        return make_room(self) ? fsm_shard_put(self, state) : FSM_NO_ROOM;
    if (taken < self->slots)
        fsm_bucket_set(slots, self->slots, taken, (uint32_t)home);
    else if (!overflow_add(&self->overflow, x))
        return FSM_NO_ROOM;
    self->count++;
    return FSM_ADDED;
}

bool fsm_shard_bucket_has(const fsm_shard *self, uint64_t home)
{
    uint64_t bucket = home >> 32;
    const void *slots = bucket_at(self, bucket);
    if (fsm_bucket_find(slots, self->slots, (uint32_t)home) < self->slots)
        return true;
    uint64_t x = bucket * self->divisor + ((uint32_t)home >> 1);
    return self->overflow.capacity > 0 && fsm_bucket_taken(slots, self->slots) == self->slots
        && *overflow_slot(&self->overflow, x) != 0;
}

fsm_put fsm_shard_put(fsm_shard *self, fsm_state state)
{
    if (fsm_left(state) > self->most_left)
        self->most_left = fsm_left(state);
    if (fsm_right(state) > self->most_right)
        self->most_right = fsm_right(state);
    if (!fits(self, state) && !rebuild(self))
        return FSM_NO_ROOM;
    uint64_t home = fsm_shard_home(self, state);
    return self->dense ? dense_put(self, state, home) : hashed_put(self, state, home);
}

fsm_put fsm_shard_put_new_home(fsm_shard *self, fsm_state state, uint64_t home, uint32_t edition)
{
    if (home == FSM_NOWHERE || edition != self->edition || fsm_left(state) > self->most_left
        || fsm_right(state) > self->most_right)
        return fsm_shard_put(self, state);
    return self->dense ? dense_put(self, state, home) : hashed_put(self, state, home);
}

uint64_t fsm_shard_find(const fsm_shard *self, fsm_state state)
{
    if (!fits(self, state))
        return FSM_NOWHERE;
    if (self->dense) {
        uint64_t cell = cell_of(self, state);
        return has_cell(self, cell) ? cell : FSM_NOWHERE;
    }
    uint64_t x = permuted(self, state), bucket;
    uint32_t rest;
    divide(self, x, &bucket, &rest);
    const void *slots = bucket_at(self, bucket);
    unsigned at = fsm_bucket_find(slots, self->slots, rest);
    if (at < self->slots)
        return bucket * self->slots + at;
    if (self->overflow.capacity == 0 || fsm_bucket_taken(slots, self->slots) < self->slots)
        return FSM_NOWHERE;
    const uint64_t *slot = overflow_slot(&self->overflow, x);
    return *slot == 0 ? FSM_NOWHERE
                      : self->buckets * self->slots + (uint64_t)(slot - self->overflow.slots);
}
