#include "store/hash_compaction.h"

__extension__ typedef unsigned __int128 wide;

#define GOLDEN UINT64_C(0x9e3779b97f4a7c15)

/* A line of hash compaction: states in the order in which they came, 24 bits each. */
typedef struct {
    unsigned char taken, high[FSM_LINE_STATES];
    uint16_t low[FSM_LINE_STATES];
} line;

/* --- hashes ---------------------------------------------------------------------------------------- */

/* The finaliser of MurmurHash3: one to one, and each bit of the result hangs on all bits of `x`. */
static uint64_t mixed(uint64_t x)
{
    x = (x ^ x >> 33) * UINT64_C(0xff51afd7ed558ccd);
    x = (x ^ x >> 33) * UINT64_C(0xc4ceb9fe1a85ec53);
    return x ^ x >> 33;
}

/* The hash of that number; its upper bits serve for `scaled`, its lower ones for themselves. */
static uint64_t hash_of(uint64_t first, unsigned number)
{
    return mixed(first + number * GOLDEN);
}

static uint64_t scaled(uint64_t hash, uint64_t range)
{
    return (uint64_t)((wide)hash * range >> 64);
}

static uint32_t part_of(uint64_t first)
{
    return (uint32_t)first & (FSM_HASH_COMPACTION_PARTS - 1);
}

/* From which all others are made. */
static uint64_t first_hash(const fsm_hash_compaction *self, fsm_state state)
{
    return mixed(state ^ self->seed * GOLDEN);
}

uint32_t fsm_hash_compaction_part_of(const fsm_hash_compaction *self, fsm_state state)
{
    return part_of(first_hash(self, state));
}

/* --- bitstate: a home is the first hash -------------------------------------------------------------- */

static unsigned char *byte_of(const fsm_hash_compaction *self, uint64_t home, unsigned function, unsigned *bit)
{
    uint64_t bits = self->lines * FSM_LINE_BITS;
    uint64_t at = part_of(home) * bits + scaled(hash_of(home, function), bits);
    *bit = 1u << at % 8;
    return (unsigned char *)self->region.base + at / 8;
}

static bool has_bits(const fsm_hash_compaction *self, uint64_t home)
{
    for (unsigned function = 1; function <= FSM_BIT_FUNCTIONS; function++) {
        unsigned bit;
        if ((*byte_of(self, home, function, &bit) & bit) == 0)
            return false;
    }
    return true;
}

static fsm_put put_bits(fsm_hash_compaction *self, uint64_t home)
{
    if (has_bits(self, home))
        return FSM_KNOWN;
    fsm_hash_compaction_part *part = &self->parts[part_of(home)];
    for (unsigned function = 1; function <= FSM_BIT_FUNCTIONS; function++) {
        unsigned bit;
        unsigned char *byte = byte_of(self, home, function, &bit);
        part->full += (*byte & bit) == 0;
        *byte = (unsigned char)(*byte | bit);
    }
    part->count++;
    return FSM_ADDED;
}

/* --- hash compaction: a home is a line, and the bits that represent the state ---------------------------- */

static line *line_at(const fsm_hash_compaction *self, uint64_t number)
{
    return (line *)self->region.base + number;
}

/* The line after one, in the same part. */
static uint64_t next_line(const fsm_hash_compaction *self, uint64_t number)
{
    return (number + 1) % self->lines == 0 ? number + 1 - self->lines : number + 1;
}

static bool line_has(const line *self, uint32_t value)
{
    for (unsigned i = 0; i < self->taken; i++)
        if (self->low[i] == (value & 0xffff) && self->high[i] == value >> 16)
            return true;
    return false;
}

/* The first line from its home on that is not full, unless one before has the state: then NULL. */
static line *place_for(const fsm_hash_compaction *self, uint64_t home, uint32_t *value)
{
    uint64_t number = home >> FSM_COMPACT_BITS;
    *value = (uint32_t)(home & ((1u << FSM_COMPACT_BITS) - 1));
    for (;;) {
        line *at = line_at(self, number);
        if (line_has(at, *value))
            return NULL;
        if (at->taken < FSM_LINE_STATES)
            return at;
        number = next_line(self, number);
    }
}

static fsm_put put_compact(fsm_hash_compaction *self, uint64_t home)
{
    uint32_t value;
    line *at = place_for(self, home, &value);
    if (at == NULL)
        return FSM_KNOWN;
    fsm_hash_compaction_part *part = &self->parts[(home >> FSM_COMPACT_BITS) / self->lines];
    if (part->count == self->most)
        return FSM_NO_ROOM;
    at->low[at->taken] = (uint16_t)value;
    at->high[at->taken] = (unsigned char)(value >> 16);
    at->taken++;
    part->full += at->taken == FSM_LINE_STATES;
    part->count++;
    return FSM_ADDED;
}

/* A look-up that starts at a full line continues in the next: so from a line that is not full
 * backwards. */
static uint64_t states_compared(const fsm_hash_compaction *self, uint32_t part)
{
    const line *lines = line_at(self, part * self->lines);
    uint64_t last = 0, all = 0, compared = 0;
    if (self->parts[part].full == 0)
        return self->parts[part].count;
    while (lines[last].taken == FSM_LINE_STATES)
        last++;
    for (uint64_t i = self->lines; i > 0; i--) {
        const line *at = &lines[(last + i) % self->lines];
        compared = at->taken + (at->taken == FSM_LINE_STATES ? compared : 0);
        all += compared;
    }
    return all;
}

/* --- the table ------------------------------------------------------------------------------------------ */

bool fsm_hash_compaction_init(fsm_hash_compaction *self, fsm_storage storage, size_t bytes)
{
    *self = (fsm_hash_compaction){.storage = storage};
    if (!fsm_region_reserve(&self->region, bytes))
        return false;
    size_t most = bytes < self->region.reserved ? bytes : self->region.reserved;
    size_t each = most / FSM_HASH_COMPACTION_PARTS / sizeof(line);
    self->lines = each == 0 ? 1 : each;
    /* One in twenty places stays free, so that look-ups end soon. */
    self->most = self->lines * FSM_LINE_STATES - self->lines * FSM_LINE_STATES / 20 - 1;
    return true;
}

void fsm_hash_compaction_free(fsm_hash_compaction *self)
{
    fsm_region_release(&self->region);
    *self = (fsm_hash_compaction){0};
}

uint64_t fsm_hash_compaction_home(const fsm_hash_compaction *self, fsm_state state)
{
    uint64_t first = first_hash(self, state);
    if (self->storage == FSM_BITSTATE) {
        for (unsigned function = 1; function <= FSM_BIT_FUNCTIONS; function++) {
            unsigned bit;
            __builtin_prefetch(byte_of(self, first, function, &bit));
        }
        return first;
    }
    uint64_t hash = hash_of(first, 1), number = part_of(first) * self->lines + scaled(hash, self->lines);
    __builtin_prefetch(line_at(self, number));
    return number << FSM_COMPACT_BITS | (hash & ((1u << FSM_COMPACT_BITS) - 1));
}

bool fsm_hash_compaction_has(const fsm_hash_compaction *self, uint64_t home)
{
    uint32_t value;
    return self->storage == FSM_BITSTATE ? has_bits(self, home) : place_for(self, home, &value) == NULL;
}

fsm_put fsm_hash_compaction_put(fsm_hash_compaction *self, uint64_t home)
{
    return self->storage == FSM_BITSTATE ? put_bits(self, home) : put_compact(self, home);
}

size_t fsm_hash_compaction_bytes(const fsm_hash_compaction *self)
{
    return (size_t)self->lines * FSM_HASH_COMPACTION_PARTS * sizeof(line);
}

uint64_t fsm_hash_compaction_filled(const fsm_hash_compaction *self, uint32_t part)
{
    return self->storage == FSM_BITSTATE ? self->parts[part].full : states_compared(self, part);
}
