#include "symbolic/mdd.h"

#include <stdlib.h>
#include <string.h>

enum {
    FIRST_NODES = 1 << 10,
    FIRST_PAIRS = 1 << 12,
    FIRST_SLOTS = 1 << 11,
    FIRST_ROOM = 16,      /* values of a buffer */
    COLLECT_EVERY = 1 << 18,
    RESERVE = 8,
    LEAST_BITS = 12, MOST_BITS = 22, /* of caches */
    DENSE = 4 /* where at least one value in so many is used, they are looked for in order rather than sorted */
};

/* --- memory ------------------------------------------------------------------------------------- */

size_t fsm_mdd_bytes(const fsm_mdd *self)
{
    size_t caches = 0;
    const fsm_mdd_cache *all[] = {&self->unions, &self->fires, &self->others, &self->relations};
    for (int i = 0; i < 4; i++)
        caches += all[i]->entries == NULL ? 0 : sizeof(fsm_mdd_entry) << all[i]->bits;
    return self->node_room * sizeof *self->nodes + self->pair_room * sizeof *self->pairs
        + self->slot_count * sizeof *self->slots + self->freed_room * sizeof *self->freed
        + self->scratch_room * sizeof *self->scratch + self->root_room * sizeof *self->roots + self->buffer_bytes + caches;
}

void *fsm_mdd_allocate(fsm_mdd *self, void *old, size_t old_bytes, size_t bytes)
{
    bool refused = self->fail_at > 0 && ++self->allocations >= self->fail_at;
    void *made = NULL;
    size_t limit = self->failed ? self->limit + self->limit / RESERVE : self->limit; /* to keep incomplete nodes */
    if (!refused && (bytes <= old_bytes || fsm_mdd_bytes(self) + (bytes - old_bytes) <= limit))
        made = realloc(old, bytes);
    self->failed = self->failed || made == NULL;
    return made;
}

static bool grow_nodes(fsm_mdd *self)
{
    uint32_t room = self->node_room == 0 ? FIRST_NODES : self->node_room + self->node_room / 2;
    if (room >= FSM_MDD_FREE / 2) {
        self->failed = true;
        return false;
    }
    fsm_mdd_node *nodes =
        fsm_mdd_allocate(self, self->nodes, self->node_room * sizeof *nodes, room * sizeof *nodes);
    if (nodes == NULL)
        return false;
    self->nodes = nodes;
    self->node_room = room;
    return true;
}

static bool make_pair_room(fsm_mdd *self, size_t count)
{
    if (self->pair_count + count <= self->pair_room)
        return true;
    size_t room = self->pair_room == 0 ? FIRST_PAIRS : self->pair_room + self->pair_room / 2;
    while (room < self->pair_count + count)
        room += room / 2;
    if (room > UINT32_MAX) {
        self->failed = true;
        return false;
    }
    fsm_mdd_pair *pairs =
        fsm_mdd_allocate(self, self->pairs, self->pair_room * sizeof *pairs, room * sizeof *pairs);
    if (pairs == NULL)
        return false;
    self->pairs = pairs;
    self->pair_room = room;
    return true;
}

static void put_in_slot(fsm_mdd *self, uint32_t node)
{
    uint32_t slot = self->nodes[node].hash & (self->slot_count - 1);
    while (self->slots[slot] != 0)
        slot = (slot + 1) & (self->slot_count - 1);
    self->slots[slot] = node;
}

static void fill_slots(fsm_mdd *self)
{
    memset(self->slots, 0, self->slot_count * sizeof *self->slots);
    for (uint32_t i = 1; i < self->node_count; i++)
        if (self->nodes[i].level != FSM_MDD_FREE && self->nodes[i].level != 0)
            put_in_slot(self, i);
}

static bool grow_slots(fsm_mdd *self)
{
    uint32_t count = self->slot_count == 0 ? FIRST_SLOTS : 2 * self->slot_count;
    uint32_t *slots =
        fsm_mdd_allocate(self, self->slots, self->slot_count * sizeof *slots, count * sizeof *slots);
    if (slots == NULL)
        return false;
    self->slots = slots;
    self->slot_count = count;
    fill_slots(self);
    return true;
}

/* --- caches -------------------------------------------------------------------------------------- */

static uint32_t place_of(uint32_t a, uint32_t b, uint32_t c, uint32_t bits)
{
    uint64_t h = a * 0x9E3779B97F4A7C15u ^ b * 0xC2B2AE3D27D4EB4Fu ^ c * 0x165667B19E3779F9u;
    h = (h ^ h >> 31) * 0xff51afd7ed558ccdu;
    return (uint32_t)(h >> (64 - bits));
}

fsm_mdd_entry *fsm_mdd_entry_of(const fsm_mdd_cache *cache, uint32_t a, uint32_t b, uint32_t c)
{
    return &cache->entries[place_of(a, b, c, cache->bits)];
}

static bool make_cache(fsm_mdd *self, fsm_mdd_cache *cache, uint32_t bits)
{
    size_t bytes = sizeof(fsm_mdd_entry) << bits;
    fsm_mdd_entry *entries = fsm_mdd_allocate(self, NULL, 0, bytes);
    if (entries == NULL)
        return false;
    memset(entries, 0, bytes);
    for (size_t i = 0; cache->entries != NULL && i < (size_t)1 << cache->bits; i++) {
        const fsm_mdd_entry *old = &cache->entries[i];
        if (old->a != 0)
            entries[place_of(old->a, old->b, old->c, bits)] = *old;
    }
    free(cache->entries);
    cache->entries = entries;
    cache->bits = bits;
    return true;
}

/* A cache that cannot grow stays as it is. */
static void grow_cache(fsm_mdd *self, fsm_mdd_cache *cache)
{
    enum { PART = 4 }; /* of the memory, at most, for a cache */
    bool failed = self->failed;
    cache->lost = 0;
    if (cache->bits < cache->most && sizeof(fsm_mdd_entry) << (cache->bits + 1) <= self->limit / PART
        && !make_cache(self, cache, cache->bits + 1))
        self->failed = failed;
}

void fsm_mdd_keep(fsm_mdd *self, fsm_mdd_cache *cache, fsm_mdd_entry entry)
{
    fsm_mdd_entry *place = fsm_mdd_entry_of(cache, entry.a, entry.b, entry.c);
    cache->lost += place->a != 0;
    *place = entry;
    if (cache->lost >> cache->bits != 0)
        grow_cache(self, cache);
}

void fsm_mdd_forget(fsm_mdd *self, fsm_mdd_cache *cache)
{
    (void)self;
    memset(cache->entries, 0, sizeof(fsm_mdd_entry) << cache->bits);
}

/* --- making one ------------------------------------------------------------------------------------ */

bool fsm_mdd_init(fsm_mdd *self, uint32_t levels, size_t limit, uint32_t cache_bits)
{
    size_t fail_at = self->fail_at;
    *self = (fsm_mdd){.levels = levels, .limit = limit, .fail_at = fail_at, .collect_every = COLLECT_EVERY};
    uint32_t least = cache_bits == 0 ? LEAST_BITS : cache_bits, most = cache_bits == 0 ? MOST_BITS : cache_bits;
    fsm_mdd_cache *caches[] = {&self->unions, &self->fires, &self->others, &self->relations};
    self->unions = self->others = (fsm_mdd_cache){.a = true, .b = true};
    self->fires = (fsm_mdd_cache){.b = true};
    self->relations = (fsm_mdd_cache){.b = true, .c = true};
    bool fine = true;
    for (int i = 0; i < 4; i++) {
        caches[i]->most = most;
        fine = fine && make_cache(self, caches[i], least);
    }
    size_t bytes = ((size_t)levels + 1) * sizeof *self->free_buffers;
    self->free_buffers = fine ? fsm_mdd_allocate(self, NULL, 0, bytes) : NULL;
    if (self->free_buffers != NULL)
        memset(self->free_buffers, 0, bytes);
    if (self->free_buffers != NULL && grow_nodes(self) && make_pair_room(self, 1) && grow_slots(self)) {
        self->nodes[0] = (fsm_mdd_node){.level = 0};
        self->node_count = 1;
        return true;
    }
    fsm_mdd_free(self);
    return false;
}

static void free_buffers(fsm_mdd_buffer *first)
{
    while (first != NULL) {
        fsm_mdd_buffer *next = first->next;
        free(first->children);
        free(first->used);
        free(first->queue);
        free(first->queued);
        free(first);
        first = next;
    }
}

void fsm_mdd_free(fsm_mdd *self)
{
    for (uint32_t level = 0; self->free_buffers != NULL && level <= self->levels; level++)
        free_buffers(self->free_buffers[level]);
    free_buffers(self->used_buffers);
    free(self->free_buffers);
    free(self->nodes);
    free(self->freed);
    free(self->pairs);
    free(self->slots);
    free(self->scratch);
    free(self->roots);
    free(self->unions.entries);
    free(self->fires.entries);
    free(self->others.entries);
    free(self->relations.entries);
    *self = (fsm_mdd){.failed = self->failed};
}

/* --- nodes ------------------------------------------------------------------------------------------ */

/* A place for a node; 0 if memory ran out. */
static uint32_t new_node(fsm_mdd *self)
{
    uint32_t place = 0;
    if (self->freed_count > 0)
        place = self->freed[--self->freed_count];
    else if (self->node_count < self->node_room || grow_nodes(self))
        place = self->node_count++;
    if (place != 0) {
        self->made++;
        self->created_since++;
        if (fsm_mdd_live(self) > self->peak)
            self->peak = fsm_mdd_live(self);
    }
    return place;
}

uint32_t fsm_mdd_terminal(fsm_mdd *self, uint32_t number, uint32_t flags)
{
    uint32_t place = new_node(self);
    if (place != 0)
        self->nodes[place] = (fsm_mdd_node){.first = number, .flags = flags};
    return place;
}

uint32_t fsm_mdd_child(const fsm_mdd *self, uint32_t node, uint32_t value)
{
    const fsm_mdd_pair *pairs = fsm_mdd_pairs(self, node);
    uint32_t first = 0, last = self->nodes[node].count;
    while (first < last) {
        uint32_t middle = first + (last - first) / 2;
        if (pairs[middle].value < value)
            first = middle + 1;
        else
            last = middle;
    }
    return first < self->nodes[node].count && pairs[first].value == value ? pairs[first].child : 0;
}

bool fsm_mdd_push(fsm_mdd *self, uint32_t value, uint32_t child)
{
    if (self->scratch_count == self->scratch_room) {
        size_t room = self->scratch_room == 0 ? FIRST_PAIRS : 2 * self->scratch_room;
        fsm_mdd_pair *scratch =
            fsm_mdd_allocate(self, self->scratch, self->scratch_room * sizeof *scratch, room * sizeof *scratch);
        if (scratch == NULL)
            return false;
        self->scratch = scratch;
        self->scratch_room = room;
    }
    self->scratch[self->scratch_count++] = (fsm_mdd_pair){value, child};
    return true;
}

static bool is_node(const fsm_mdd *self, uint32_t node, uint32_t level, uint32_t hash, const fsm_mdd_pair *pairs,
                    uint32_t count)
{
    const fsm_mdd_node *at = &self->nodes[node];
    return at->hash == hash && at->level == level && at->count == count
        && memcmp(self->pairs + at->first, pairs, count * sizeof *pairs) == 0;
}

uint32_t fsm_mdd_make(fsm_mdd *self, uint32_t level, size_t base)
{
    uint32_t count = (uint32_t)(self->scratch_count - base), flags = 0;
    uint64_t h = level * 0x9E3779B97F4A7C15u;
    self->scratch_count = base;
    if (count == 0)
        return 0;
    const fsm_mdd_pair *pairs = self->scratch + base;
    for (uint32_t i = 0; i < count; i++) {
        h = (h ^ ((uint64_t)pairs[i].value << 32 | pairs[i].child)) * 0xff51afd7ed558ccdu;
        h ^= h >> 32;
        flags |= self->nodes[pairs[i].child].flags;
    }
    uint32_t hash = (uint32_t)(h ^ h >> 29), slot = hash & (self->slot_count - 1);
    for (; self->slots[slot] != 0; slot = (slot + 1) & (self->slot_count - 1))
        if (is_node(self, self->slots[slot], level, hash, pairs, count))
            return self->slots[slot];
    if (!make_pair_room(self, count))
        return 0;
    uint32_t node = new_node(self);
    if (node == 0)
        return 0;
    self->nodes[node] = (fsm_mdd_node){(uint32_t)self->pair_count, count, level, hash, flags};
    memcpy(self->pairs + self->pair_count, pairs, count * sizeof *pairs);
    self->pair_count += count;
    self->slots[slot] = node;
    if (2 * (uint64_t)fsm_mdd_live(self) > self->slot_count && !grow_slots(self)
        && fsm_mdd_live(self) + 2 >= self->slot_count) {
        self->slots[slot] = 0; /* a full table would be looked through for ever */
        self->nodes[node].level = FSM_MDD_FREE;
        return 0;
    }
    return node;
}

/* --- buffers ------------------------------------------------------------------------------------------ */

static bool grow_buffer(fsm_mdd *self, fsm_mdd_buffer *buffer, uint32_t least)
{
    uint32_t room = buffer->room == 0 ? FIRST_ROOM : 2 * buffer->room, old = buffer->room;
    enum { EACH = 3 * sizeof(uint32_t) + 1 };
    while (room <= least)
        room *= 2;
    uint32_t **arrays[] = {&buffer->children, &buffer->used, &buffer->queue};
    for (int i = 0; i < 3; i++) {
        uint32_t *grown = fsm_mdd_allocate(self, *arrays[i], old * sizeof *grown, room * sizeof *grown);
        if (grown == NULL)
            return false;
        *arrays[i] = grown;
    }
    unsigned char *queued = fsm_mdd_allocate(self, buffer->queued, old, room);
    if (queued == NULL)
        return false;
    memset(buffer->children + old, 0, (room - old) * sizeof *buffer->children);
    memset(queued + old, 0, room - old);
    for (uint32_t i = 0; i < buffer->queue_first && buffer->queue_first + buffer->queue_count > old; i++)
        buffer->queue[old + i] = buffer->queue[i]; /* the rest at its start */
    buffer->queued = queued;
    buffer->room = room;
    self->buffer_bytes += (size_t)(room - old) * EACH;
    return true;
}

fsm_mdd_buffer *fsm_mdd_take(fsm_mdd *self, uint32_t level)
{
    fsm_mdd_buffer *buffer = self->free_buffers[level];
    if (buffer != NULL) {
        self->free_buffers[level] = buffer->next;
    } else {
        buffer = fsm_mdd_allocate(self, NULL, 0, sizeof *buffer);
        if (buffer == NULL)
            return NULL;
        *buffer = (fsm_mdd_buffer){.level = level};
        self->buffer_bytes += sizeof *buffer;
    }
    buffer->next = self->used_buffers;
    self->used_buffers = buffer;
    return buffer;
}

bool fsm_mdd_set(fsm_mdd *self, fsm_mdd_buffer *buffer, uint32_t value, uint32_t child)
{
    if (value >= buffer->room && !grow_buffer(self, buffer, value))
        return false;
    if (buffer->children[value] == child)
        return true;
    if (buffer->children[value] == 0)
        buffer->used[buffer->used_count++] = value;
    buffer->children[value] = child;
    if (buffer->queued[value])
        return true;
    uint32_t last = buffer->queue_first + buffer->queue_count;
    buffer->queue[last >= buffer->room ? last - buffer->room : last] = value;
    buffer->queue_count++;
    buffer->queued[value] = 1;
    return true;
}

static int by_number(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static void sort(uint32_t *values, uint32_t count)
{
    enum { FEW = 24 };
    if (count > FEW) {
        qsort(values, count, sizeof *values, by_number);
        return;
    }
    for (uint32_t i = 1; i < count; i++) {
        uint32_t value = values[i], at = i;
        for (; at > 0 && values[at - 1] > value; at--)
            values[at] = values[at - 1];
        values[at] = value;
    }
}

uint32_t fsm_mdd_finish(fsm_mdd *self, fsm_mdd_buffer *buffer)
{
    size_t base = fsm_mdd_start(self);
    bool fine = true;
    if (buffer->used_count >= buffer->room / DENSE) {
        for (uint32_t value = 0; value < buffer->room; value++)
            if (buffer->children[value] != 0)
                fine = fine && fsm_mdd_push(self, value, buffer->children[value]);
    } else {
        sort(buffer->used, buffer->used_count);
        for (uint32_t i = 0; i < buffer->used_count; i++)
            fine = fine && fsm_mdd_push(self, buffer->used[i], buffer->children[buffer->used[i]]);
    }
    for (uint32_t i = 0; i < buffer->used_count; i++)
        buffer->children[buffer->used[i]] = 0;
    uint32_t value;
    while (fsm_mdd_next_changed(buffer, &value))
        ;
    buffer->used_count = buffer->queue_first = 0;
    self->used_buffers = buffer->next;
    buffer->next = self->free_buffers[buffer->level];
    self->free_buffers[buffer->level] = buffer;
    return fsm_mdd_make(self, buffer->level, base); /* what there was room for is a part of the set */
}

/* --- sets ----------------------------------------------------------------------------------------------- */

uint32_t fsm_mdd_union(fsm_mdd *self, uint32_t a, uint32_t b)
{
    if (a == b || b == 0)
        return a;
    if (a == 0)
        return b;
    if (self->failed)
        return a;
    if (a > b) {
        uint32_t other = a;
        a = b;
        b = other;
    }
    const fsm_mdd_entry *known = fsm_mdd_entry_of(&self->unions, a, b, 0);
    if (fsm_mdd_knows(known, a, b, 0))
        return known->result;
    size_t base = fsm_mdd_start(self);
    uint32_t x = 0, y = 0, level = self->nodes[a].level;
    while (x < self->nodes[a].count || y < self->nodes[b].count) {
        fsm_mdd_pair p = {UINT32_MAX, 0}, q = {UINT32_MAX, 0};
        if (x < self->nodes[a].count)
            p = fsm_mdd_pairs(self, a)[x];
        if (y < self->nodes[b].count)
            q = fsm_mdd_pairs(self, b)[y];
        x += p.value <= q.value;
        y += q.value <= p.value;
        uint32_t child = p.value == q.value ? fsm_mdd_union(self, p.child, q.child) : p.value < q.value ? p.child : q.child;
        if (!fsm_mdd_push(self, p.value < q.value ? p.value : q.value, child))
            break;
    }
    uint32_t made = fsm_mdd_make(self, level, base);
    if (self->failed)
        return a;
    fsm_mdd_keep(self, &self->unions, (fsm_mdd_entry){a, b, 0, made});
    return made;
}

enum { INTERSECTION = 1, DIFFERENCE = 2 };

static uint32_t combine(fsm_mdd *self, uint32_t what, uint32_t a, uint32_t b)
{
    if (a == 0 || (b == 0 && what == INTERSECTION))
        return 0;
    if (b == 0)
        return a;
    if (a == b || self->nodes[b].level == 0) /* the rest of `a` is in `b` */
        return what == INTERSECTION ? a : 0;
    if (self->failed)
        return 0;
    const fsm_mdd_entry *known = fsm_mdd_entry_of(&self->others, a, b, what);
    if (fsm_mdd_knows(known, a, b, what))
        return known->result;
    size_t base = fsm_mdd_start(self);
    uint32_t level = self->nodes[a].level;
    bool is_same = self->nodes[b].level == level; /* else `b` leaves the level out */
    for (uint32_t x = 0, y = 0; x < self->nodes[a].count; x++) {
        fsm_mdd_pair p = fsm_mdd_pairs(self, a)[x];
        uint32_t other = b;
        if (is_same) {
            while (y < self->nodes[b].count && fsm_mdd_pairs(self, b)[y].value < p.value)
                y++;
            bool meets = y < self->nodes[b].count && fsm_mdd_pairs(self, b)[y].value == p.value;
            other = meets ? fsm_mdd_pairs(self, b)[y].child : 0;
        }
        uint32_t child = combine(self, what, p.child, other);
        if (child != 0 && !fsm_mdd_push(self, p.value, child))
            break;
    }
    uint32_t made = fsm_mdd_make(self, level, base);
    if (self->failed)
        return 0;
    fsm_mdd_keep(self, &self->others, (fsm_mdd_entry){a, b, what, made});
    return made;
}

uint32_t fsm_mdd_intersection(fsm_mdd *self, uint32_t a, uint32_t b)
{
    return combine(self, INTERSECTION, a, b);
}

uint32_t fsm_mdd_difference(fsm_mdd *self, uint32_t a, uint32_t b)
{
    return combine(self, DIFFERENCE, a, b);
}

/* --- nodes in order ---------------------------------------------------------------------------------------- */

static void note(const fsm_mdd *mdd, uint32_t node, unsigned char *seen, uint32_t *found, uint32_t *count)
{
    if (node == 0 || seen[node] || fsm_mdd_at(mdd, node)->level == 0)
        return;
    seen[node] = 1;
    found[(*count)++] = node;
}

/* By level: places first, then the nodes. */
static bool sort_by_level(const fsm_mdd *mdd, uint32_t *nodes, uint32_t count)
{
    uint32_t *places = calloc((size_t)mdd->levels + 2, sizeof *places), *sorted = malloc((count + 1u) * sizeof *sorted);
    bool fine = places != NULL && sorted != NULL;
    for (uint32_t i = 0; fine && i < count; i++)
        places[fsm_mdd_at(mdd, nodes[i])->level + 1]++;
    for (uint32_t level = 1; fine && level <= mdd->levels; level++)
        places[level + 1] += places[level];
    for (uint32_t i = 0; fine && i < count; i++)
        sorted[places[fsm_mdd_at(mdd, nodes[i])->level]++] = nodes[i];
    if (fine)
        memcpy(nodes, sorted, count * sizeof *nodes);
    free(places);
    free(sorted);
    return fine;
}

uint32_t *fsm_nodes_of(const fsm_mdd *mdd, uint32_t root, uint32_t *count)
{
    unsigned char *seen = calloc(mdd->node_count, 1);
    uint32_t *found = malloc(mdd->node_count * sizeof *found);
    bool fine = seen != NULL && found != NULL;
    *count = 0;
    if (fine)
        note(mdd, root, seen, found, count);
    for (uint32_t at = 0; fine && at < *count; at++)
        for (uint32_t i = 0; i < fsm_mdd_at(mdd, found[at])->count; i++)
            note(mdd, fsm_mdd_pairs(mdd, found[at])[i].child, seen, found, count);
    fine = fine && sort_by_level(mdd, found, *count);
    free(seen);
    if (fine)
        return found;
    free(found);
    return NULL;
}

/* --- garbage ----------------------------------------------------------------------------------------------- */

bool fsm_mdd_root(fsm_mdd *self, uint32_t node)
{
    if (self->root_count == self->root_room) {
        size_t room = self->root_room == 0 ? FIRST_ROOM : 2 * self->root_room;
        uint32_t *roots = fsm_mdd_allocate(self, self->roots, self->root_room * sizeof *roots, room * sizeof *roots);
        if (roots == NULL)
            return false;
        self->roots = roots;
        self->root_room = room;
    }
    self->roots[self->root_count++] = node;
    return true;
}

typedef struct {
    const fsm_mdd *of;
    unsigned char *live; /* by node */
    uint64_t *waiting; /* each node once */
    size_t count;
} marking;

static void mark(marking *self, uint32_t node)
{
    if (node == 0 || self->live[node])
        return;
    self->live[node] = 1;
    if (self->of->nodes[node].level > 0)
        self->waiting[self->count++] = node;
}

static void mark_all(marking *self)
{
    const fsm_mdd *of = self->of;
    for (uint32_t i = 1; i < of->node_count; i++)
        if (of->nodes[i].level == 0)
            mark(self, i);
    for (size_t i = 0; i < of->root_count; i++)
        mark(self, of->roots[i]);
    for (const fsm_mdd_buffer *b = of->used_buffers; b != NULL; b = b->next)
        for (uint32_t i = 0; i < b->used_count; i++)
            mark(self, b->children[b->used[i]]);
    for (size_t i = 0; i < of->scratch_count; i++)
        mark(self, of->scratch[i].child);
    while (self->count > 0) {
        const fsm_mdd_node *at = &of->nodes[(uint32_t)self->waiting[--self->count]];
        for (uint32_t i = 0; i < at->count; i++)
            mark(self, of->pairs[at->first + i].child);
    }
}

static bool lives(const unsigned char *live, uint32_t node, bool is_node)
{
    return !is_node || node == 0 || live[node];
}

/* A cache keeps the entries of live nodes. */
static void sweep_cache(fsm_mdd_cache *cache, const unsigned char *live)
{
    for (size_t i = 0; i < (size_t)1 << cache->bits; i++) {
        fsm_mdd_entry *entry = &cache->entries[i];
        if (entry->a != 0 && !(lives(live, entry->a, cache->a) && lives(live, entry->b, cache->b)
                               && lives(live, entry->c, cache->c) && lives(live, entry->result, true)))
            *entry = (fsm_mdd_entry){0, 0, 0, 0};
    }
}

/* Room for the numbers of all nodes that may be freed. */
static bool make_freed_room(fsm_mdd *self)
{
    bool failed = self->failed;
    if (self->freed_room >= self->node_room)
        return true;
    uint32_t *freed = fsm_mdd_allocate(self, self->freed, self->freed_room * sizeof *freed, self->node_room * sizeof *freed);
    self->failed = failed;
    if (freed == NULL)
        return false;
    self->freed = freed;
    self->freed_room = self->node_room;
    return true;
}

static int by_place(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Moves the pairs of all nodes together, in the order in which they lie. */
static void compact(fsm_mdd *self, uint64_t *places)
{
    size_t count = 0, at = 0;
    bool sorted = true;
    for (uint32_t i = 1; i < self->node_count; i++) {
        if (self->nodes[i].level == FSM_MDD_FREE || self->nodes[i].level == 0)
            continue;
        places[count++] = (uint64_t)self->nodes[i].first << 32 | i;
        sorted = sorted && (count < 2 || places[count - 2] < places[count - 1]);
    }
    if (!sorted)
        qsort(places, count, sizeof *places, by_place);
    for (size_t i = 0; i < count; i++) {
        fsm_mdd_node *node = &self->nodes[(uint32_t)places[i]];
        memmove(self->pairs + at, self->pairs + node->first, node->count * sizeof *self->pairs);
        node->first = (uint32_t)at;
        at += node->count;
    }
    self->pair_count = at;
}

void fsm_mdd_collect(fsm_mdd *self)
{
    self->created_since = 0;
    self->live_after = fsm_mdd_live(self);
    unsigned char *live = calloc(self->node_count, 1);
    uint64_t *room = malloc(self->node_count * sizeof *room);
    if (live != NULL && room != NULL && make_freed_room(self)) {
        marking all = {.of = self, .live = live, .waiting = room};
        mark_all(&all);
        for (uint32_t i = 1; i < self->node_count; i++)
            if (!live[i] && self->nodes[i].level != FSM_MDD_FREE) {
                self->nodes[i].level = FSM_MDD_FREE;
                self->freed[self->freed_count++] = i;
            }
        sweep_cache(&self->unions, live);
        sweep_cache(&self->fires, live);
        sweep_cache(&self->others, live);
        sweep_cache(&self->relations, live);
        compact(self, room);
        fill_slots(self);
        self->collections++;
    }
    free(live);
    free(room);
    self->live_after = fsm_mdd_live(self);
}
