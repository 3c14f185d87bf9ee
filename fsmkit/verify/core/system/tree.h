/* tree.h: machines composed, two and two, to groups that behave like machines.
 *
 * A node is a machine or a group of two nodes. Its states are numbered: those of a machine are its
 * local states, those of a group pairs of its children's. What a node can do in a state is found out
 * once, and kept while memory for that lasts; so is what a message does to it. The state of the whole
 * system is the pair of the root's halves, and a step of it a few look-ups.
 *
 * Several threads may call this at once. Known facts never change and are read without a lock: its number,
 * or the pointer to it, is published once it is complete. Making something new takes the lock of the
 * composition. */
#ifndef FSM_TREE_H
#define FSM_TREE_H

#include "store/arena.h"
#include "system/composition.h"
#include "store/lists.h"
#include "search/sleep_sets.h"
#include "search/workers.h"

/* A step of a node: the state it leads to, messages for machines outside it (a list of messages), and
 * marks of the step (a list of marks). */
typedef struct {
    uint32_t to, sent, marks;
    fsm_footprint_number footprint;
    unsigned char kind; /* an fsm_kind */
} fsm_move;

typedef struct {
    uint32_t count, room;
    bool busy; /* some are internal */
    bool fair; /* something fair can happen */
    fsm_move items[];
} fsm_moves;

/* The facts about a state of a node that do not need its steps. */
typedef struct {
    uint32_t waiting, awaited; /* events; timers, without those of monitors */
    unsigned char first;       /* an fsm_part, whose steps come first: those of monitors, of the environment, or all */
    bool ticking;              /* there are timers, those of monitors among them */
    bool faulted, at_rest;
} fsm_summary;

/* One cache line. */
typedef struct {
    fsm_moves *moves[FSM_PARTS];
    uint32_t left, right; /* children's states; of a machine: the local state, and 0 */
    uint32_t elapsed;     /* after a unit of time; FSM_NONE: not requested yet */
    uint32_t aspect;      /* number of the data that properties read */
    fsm_summary summary;
} fsm_node_state;

/* Numbers of a group's states, plus one; 0 is empty. */
typedef struct fsm_pairs fsm_pairs;

struct fsm_pairs {
    uint32_t capacity;
    fsm_pairs *older; /* smaller ones that somebody may still be reading */
    uint32_t slots[];
};

typedef struct fsm_node fsm_node;

struct fsm_node {
    uint32_t first, last; /* machines in it, from the first to before the last */
    fsm_node *left, *right; /* NULL: a machine */
    uint32_t count;
    fsm_pairs *pairs;   /* of a group */
    fsm_hash_map delivered; /* (state, list of messages) -> (state, list of marks) */
    fsm_hash_map aspects;   /* of a group: pairs of its children's */
    fsm_store seen;     /* of a machine: its part that properties read */
    uint32_t aspect_count;
    fsm_segmented_array states;
};

typedef struct fsm_tree {
    fsm_composition *composition;
    fsm_node *nodes, *root_left, *root_right; /* the right one is NULL if there is one machine */
    uint32_t node_count;
    fsm_lists messages, marks;
    fsm_arena moves; /* those that are kept */
    fsm_sleep_sets sleep;
    fsm_hash_map evaluated; /* aspects of both halves -> list of marks */
    size_t kept, most_kept; /* bytes of steps and deliveries that are kept */
    size_t node_bytes;
    uint32_t *buffer; /* room for a list */
    size_t buffer_room;
    unsigned char *seen; /* room for what properties see of a machine */
    fsm_moves **scratch[FSM_MOST_WORKERS]; /* of each thread, for each node and part: for steps that are not kept */
} fsm_tree;

fsm_tree *fsm_tree_make(fsm_composition *composition);
void fsm_tree_free(fsm_tree *self);
size_t fsm_tree_bytes(const fsm_tree *self);

/* The state of the system in which the machines are in these local states; FSM_NO_STATE if memory ran
 * out. And the other way round. */
fsm_state fsm_tree_fold(fsm_tree *self, const uint32_t *locals);
void fsm_tree_unfold(const fsm_tree *self, fsm_state state, uint32_t *locals);

/* Number of a node's state: of a group, the pair of its children's; of a machine, its local state `left`. FSM_NONE if
 * memory ran out. */
uint32_t fsm_node_number(fsm_tree *self, fsm_node *node, uint32_t left, uint32_t right);

/* Frees what only threads that read needed. No other may be at work. */
void fsm_tree_tidy(fsm_tree *self);

static inline fsm_node_state *fsm_node_at(const fsm_node *node, uint32_t state)
{
    return fsm_segmented_array_at(&node->states, state, sizeof(fsm_node_state));
}

/* Finds out the steps of a node in a state; see fsm_node_moves. */
const fsm_moves *fsm_node_find_moves(fsm_tree *self, uint32_t thread, fsm_node *node, uint32_t state, fsm_part part);

/* The steps of a node in a state; NULL if that failed. They are valid until the next call for the
 * same node by the same thread. */
static inline const fsm_moves *fsm_node_moves(fsm_tree *self, uint32_t thread, fsm_node *node, uint32_t state,
                                              fsm_part part)
{
    fsm_moves *known = __atomic_load_n(&fsm_node_at(node, state)->moves[part], __ATOMIC_ACQUIRE);
    return known != NULL ? known : fsm_node_find_moves(self, thread, node, state, part);
}

/* Finds out what becomes of a node; see fsm_node_deliver. */
uint64_t fsm_node_find_delivered(fsm_tree *self, fsm_node *node, uint32_t state, uint32_t messages);

/* The state after messages have come, and the list of marks of that (both joined as in a memo:
 * state << 32 | marks); UINT64_MAX if it failed. Messages to machines outside the node are ignored. */
static inline uint64_t fsm_node_deliver(fsm_tree *self, fsm_node *node, uint32_t state, uint32_t messages)
{
    if (messages == 0)
        return fsm_join(state, 0);
    const uint64_t *known = fsm_hash_map_find(&node->delivered, fsm_join(state, messages));
    return known != NULL ? *known : fsm_node_find_delivered(self, node, state, messages);
}

/* The state after a unit of time; FSM_NONE if it failed. */
uint32_t fsm_node_elapse(fsm_tree *self, fsm_node *node, uint32_t state);

/* Returns the local step for a node's step in a state: its machine, and its number. */
fsm_description fsm_node_describe(fsm_tree *self, fsm_node *node, uint32_t state, fsm_part part, uint32_t number);

/* Joins two lists of marks, or adds a mark to one. FSM_NONE if memory ran out. */
uint32_t fsm_tree_join_some_marks(fsm_tree *self, uint32_t a, uint32_t b);

static inline uint32_t fsm_tree_join_marks(fsm_tree *self, uint32_t a, uint32_t b)
{
    return a == 0 || b == 0 || a == b ? a | b : fsm_tree_join_some_marks(self, a, b);
}

uint32_t fsm_tree_add_mark(fsm_tree *self, uint32_t marks, uint32_t mark);

#endif
