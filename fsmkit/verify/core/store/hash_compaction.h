/* hash_compaction.h: a passed list that stores states lossily, in a table of fixed size.
 *
 * Hash compaction (Wolper and Leroy 1993; Stern and Dill 1996): a hash of the state names a line of the table, and 24
 * bits of another one stand there for it; a full line goes on in the next. Bitstate (Holzmann 1988; with several hash
 * functions a filter of Bloom 1970): three hashes of the state name bits of the table, which are set.
 *
 * A state that is new may so be taken for one that is known, never the other way round. The table has parts, so that as
 * many threads can add to it at once, each to parts of its own; their number is fixed, as no part can be made anew. What
 * is hashed are the numbers that the model gave: if several threads call it, these depend on which was first, and so does
 * which states are missed. */
#ifndef FSM_HASH_COMPACTION_H
#define FSM_HASH_COMPACTION_H

#include "store/region.h"
#include "store/shard.h"

typedef enum { FSM_EXACT, FSM_HASH_COMPACT, FSM_BITSTATE } fsm_storage;

enum {
    FSM_HASH_COMPACTION_SHIFT = 5,
    FSM_HASH_COMPACTION_PARTS = 1 << FSM_HASH_COMPACTION_SHIFT,
    FSM_COMPACT_BITS = 24,
    FSM_BIT_FUNCTIONS = 3,
    FSM_LINE_STATES = 21,  /* of hash compaction, in a line */
    FSM_LINE_BITS = 512
};

typedef struct {
    uint64_t count; /* states added */
    uint64_t full;  /* hash compaction: lines without a free place; bitstate: bits that are set */
    char apart[48]; /* from what another thread counts */
} fsm_hash_compaction_part;

typedef struct {
    fsm_storage storage;
    uint64_t lines; /* of 64 bytes, in each part */
    uint64_t most;  /* hash compaction: states that a part takes */
    uint64_t seed;  /* of the hashes: with another one other states are missed */
    fsm_region region;
    fsm_hash_compaction_part parts[FSM_HASH_COMPACTION_PARTS];
} fsm_hash_compaction;

/* Makes a table of so many bytes (at least a line for each part), or of as many as can be had. False if there is no memory. */
bool fsm_hash_compaction_init(fsm_hash_compaction *self, fsm_storage storage, size_t bytes);
void fsm_hash_compaction_free(fsm_hash_compaction *self);

/* Returns the part that a state belongs to. */
uint32_t fsm_hash_compaction_part_of(const fsm_hash_compaction *self, fsm_state state);

/* Returns its position in the table, for the two functions below, and prefetches its memory. */
uint64_t fsm_hash_compaction_home(const fsm_hash_compaction *self, fsm_state state);

/* Whether it counts as known. */
bool fsm_hash_compaction_has(const fsm_hash_compaction *self, uint64_t home);

/* Adds it, unless it counts as known. */
fsm_put fsm_hash_compaction_put(fsm_hash_compaction *self, uint64_t home);

size_t fsm_hash_compaction_bytes(const fsm_hash_compaction *self);

/* How full a part is, from which the rate of false matches follows. Bitstate: the bits that are set, of
 * FSM_LINE_BITS times `lines`. Hash compaction: the states that a look-up compares, added up over all `lines` where it can
 * start. */
uint64_t fsm_hash_compaction_filled(const fsm_hash_compaction *self, uint32_t part);

#endif
