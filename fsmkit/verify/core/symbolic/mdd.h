/* mdd.h: sets of states as multi-valued decision diagrams.
 *
 * A node of level n is a function of the value at that level: each value leads to a node below, or nowhere. Values that lead
 * somewhere are kept, sorted, with where they lead. Equal nodes are one, so equal sets have equal numbers. Level 0 has the
 * terminals, which are made by whoever uses the diagrams; each holds a number. Node 0 is the empty set, at every level.
 *
 * Nodes are made of buffers, which hold a node while it grows. Garbage is collected only on request: then everything remains
 * that can be reached from buffers in use, from what was pushed on the stack of roots, and from the terminals. */
#ifndef FSM_MDD_H
#define FSM_MDD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint32_t value, child;
} fsm_mdd_pair;

typedef struct {
    uint32_t first, count; /* range of `pairs`; of a terminal: its number, and 0 */
    uint32_t level;        /* FSM_MDD_FREE: there is no such node */
    uint32_t hash;
    uint32_t flags;        /* of a terminal as given; else those of all children together */
} fsm_mdd_node;

#define FSM_MDD_FREE UINT32_MAX

/* A node in the making. Values whose child changed wait in a queue, each once. */
typedef struct fsm_mdd_buffer fsm_mdd_buffer;

struct fsm_mdd_buffer {
    uint32_t *children;         /* by value; `room` of them */
    uint32_t *used, used_count; /* values that have one, in any order */
    uint32_t *queue, queue_first, queue_count;
    unsigned char *queued;      /* by value: it is in the queue */
    uint32_t room, level;
    fsm_mdd_buffer *next;       /* of those that are free, or in use */
};

typedef struct {
    uint32_t a, b, c, result;
} fsm_mdd_entry;

/* A cache that forgets: an entry goes where another one comes. Its size is a power of two; it grows once as many entries
 * were lost as it holds. */
typedef struct {
    fsm_mdd_entry *entries;
    uint32_t bits, most, lost;
    bool a, b, c; /* which of these are nodes */
} fsm_mdd_cache;

typedef struct fsm_mdd fsm_mdd;

struct fsm_mdd {
    fsm_mdd_node *nodes;
    uint32_t node_count, node_room; /* places, those of freed nodes among them */
    uint32_t *freed;                /* such places */
    uint32_t freed_count, freed_room;
    fsm_mdd_pair *pairs;
    size_t pair_count, pair_room;
    uint32_t *slots; /* node by content; 0 is empty */
    uint32_t slot_count;
    fsm_mdd_pair *scratch; /* a stack: nodes in the making whose values come in order */
    size_t scratch_count, scratch_room;
    uint32_t *roots;
    size_t root_count, root_room;
    uint32_t levels; /* from 0 to this one */
    fsm_mdd_buffer **free_buffers, *used_buffers; /* of each level */
    size_t buffer_bytes;
    fsm_mdd_cache unions, fires, others, relations; /* of unions; of events; of other sets; of relation.h */
    size_t limit;           /* bytes */
    size_t allocations;     /* so far */
    size_t fail_at;         /* for tests: the allocation from which on all fail; 0: none */
    uint32_t collect_every; /* nodes that are made at least before garbage is collected again */
    uint32_t created_since, live_after, peak;
    uint64_t made, collections;
    bool failed; /* memory ran out; nodes created before are valid */
};

/* For levels 1 to `levels`. `cache_bits`: of the smallest caches; 0: as is best. False if memory ran out. */
bool fsm_mdd_init(fsm_mdd *self, uint32_t levels, size_t limit, uint32_t cache_bits);
void fsm_mdd_free(fsm_mdd *self);
size_t fsm_mdd_bytes(const fsm_mdd *self);

/* Nodes that are there, terminals among them. */
static inline uint32_t fsm_mdd_live(const fsm_mdd *self)
{
    return self->node_count - 1 - self->freed_count;
}

/* A terminal with a number of its own and flags; 0 if memory ran out. Each call makes one. */
uint32_t fsm_mdd_terminal(fsm_mdd *self, uint32_t number, uint32_t flags);

static inline const fsm_mdd_node *fsm_mdd_at(const fsm_mdd *self, uint32_t node)
{
    return &self->nodes[node];
}

static inline const fsm_mdd_pair *fsm_mdd_pairs(const fsm_mdd *self, uint32_t node)
{
    return self->pairs + self->nodes[node].first;
}

/* The child for a value; 0: none. */
uint32_t fsm_mdd_child(const fsm_mdd *self, uint32_t node, uint32_t value);

/* --- nodes of values in order: push them, then make the node of those from `base` on */
static inline size_t fsm_mdd_start(const fsm_mdd *self)
{
    return self->scratch_count;
}

bool fsm_mdd_push(fsm_mdd *self, uint32_t value, uint32_t child);

/* Takes what was pushed from `base` on. Without any it is 0. 0, too, if memory ran out: then `failed`. */
uint32_t fsm_mdd_make(fsm_mdd *self, uint32_t level, size_t base);

/* --- nodes of values in any order. Buffers are given back in the reverse order in which they were taken. */
fsm_mdd_buffer *fsm_mdd_take(fsm_mdd *self, uint32_t level); /* NULL if memory ran out */
bool fsm_mdd_set(fsm_mdd *self, fsm_mdd_buffer *buffer, uint32_t value, uint32_t child); /* queues the value if it changes */
uint32_t fsm_mdd_finish(fsm_mdd *self, fsm_mdd_buffer *buffer); /* the node; the buffer is given back */

static inline uint32_t fsm_mdd_in(const fsm_mdd_buffer *buffer, uint32_t value)
{
    return value < buffer->room ? buffer->children[value] : 0;
}

static inline bool fsm_mdd_next_changed(fsm_mdd_buffer *buffer, uint32_t *value)
{
    if (buffer->queue_count == 0)
        return false;
    *value = buffer->queue[buffer->queue_first];
    buffer->queue_first = buffer->queue_first + 1 == buffer->room ? 0 : buffer->queue_first + 1;
    buffer->queue_count--;
    buffer->queued[*value] = 0;
    return true;
}

/* --- sets. In a product and a difference, skipped levels of a set count as if each value led on. */
uint32_t fsm_mdd_union(fsm_mdd *self, uint32_t a, uint32_t b);
uint32_t fsm_mdd_intersection(fsm_mdd *self, uint32_t a, uint32_t b);
uint32_t fsm_mdd_difference(fsm_mdd *self, uint32_t a, uint32_t b);

/* --- nodes in order. Those of a set without its terminals, those of lower levels first; to be freed. NULL if memory ran out. */
uint32_t *fsm_nodes_of(const fsm_mdd *mdd, uint32_t root, uint32_t *count);

/* --- caches */
fsm_mdd_entry *fsm_mdd_entry_of(const fsm_mdd_cache *cache, uint32_t a, uint32_t b, uint32_t c);
void fsm_mdd_keep(fsm_mdd *self, fsm_mdd_cache *cache, fsm_mdd_entry entry);

static inline bool fsm_mdd_knows(const fsm_mdd_entry *entry, uint32_t a, uint32_t b, uint32_t c)
{
    return entry->a == a && entry->b == b && entry->c == c;
}

void fsm_mdd_forget(fsm_mdd *self, fsm_mdd_cache *cache);

/* --- garbage */
bool fsm_mdd_root(fsm_mdd *self, uint32_t node); /* pushes a root */

static inline void fsm_mdd_unroot(fsm_mdd *self, size_t count)
{
    self->root_count -= count;
}

static inline bool fsm_mdd_is_full(const fsm_mdd *self)
{
    return self->created_since >= self->collect_every && self->created_since >= 2 * (uint64_t)self->live_after;
}

void fsm_mdd_collect(fsm_mdd *self);

/* Memory that counts, and may be made to fail. */
void *fsm_mdd_allocate(fsm_mdd *self, void *old, size_t old_bytes, size_t bytes);

#endif
