/* layer.h: a search with its layers and data, and the processing of one state of a layer, by any
 * thread. */
#ifndef FSM_LAYER_H
#define FSM_LAYER_H

#include "store/set.h"

typedef enum {
    FSM_COMPLETE,
    FSM_DECIDED, /* all awaited marks have been seen */
    FSM_OUT_OF_MEMORY,
    FSM_OUT_OF_TIME,
    FSM_INTERRUPTED,
    FSM_MODEL_FAILED
} fsm_outcome;

/* States in the order they were found, each with its ancestor's place in the checkpoint before, and the footprint of the
 * step by which it was found. */
typedef struct {
    fsm_region states, tags, footprints;
    size_t count, seen; /* the first ones of them have been looked at: what marks they have */
} fsm_layer;

typedef struct {
    uint32_t depth;
    uint32_t count;
    fsm_state *states;
    uint32_t *tags;
} fsm_checkpoint;

/* A state that was found, with what its path can be built from. */
typedef struct {
    fsm_state state;
    uint32_t depth;      /* steps from an initial state */
    uint32_t checkpoint; /* number of the checkpoint before it, or the one that it is in */
    uint32_t tag;        /* place in that checkpoint */
} fsm_found;

/* The first, and so a nearest, place where a mark was seen. */
typedef struct {
    fsm_found at;   /* at.state is FSM_NO_STATE: the mark is of an initial step */
    uint32_t step;  /* ordinal of the marked step; FSM_NONE: the state itself is marked */
    uint64_t count; /* marked states or steps in all */
} fsm_witness;

/* A state to which a path is wanted, or to another state of its group. */
typedef struct {
    fsm_state state;
    uint32_t group;
} fsm_target;

/* Steps of a few states of a layer, requested some time before they are finished: memory is
 * fetched meanwhile. */
enum { FSM_AHEAD = 8 };

typedef struct {
    fsm_steps steps[FSM_AHEAD];
    size_t requested; /* the states before this one have been requested */
} fsm_ahead;

struct fsm_path; /* path.h */

typedef struct fsm_search fsm_search;
typedef struct fsm_parallel_search fsm_parallel_search;

struct fsm_search {
    const fsm_model *model;
    size_t memory_limit;           /* bytes */
    uint32_t cores;                /* that it may use; more than one is used only for large layers */
    uint32_t large, chunk;         /* states of a large layer, and those that a core takes at a time */
    bool sleepless;                /* every step is taken, also where another order of the same steps is (sleep_sets.h) */
    bool (*keep_on)(fsm_search *); /* called now and then; sets `outcome` to stop; may be NULL */
    /* The path to a nearest state with one of some flags, by places; NULL: the states are explored again for it. */
    fsm_state (*trace)(const fsm_search *, const unsigned char *flags, unsigned char wanted, struct fsm_path *path);
    bool (*seeks_on)(const fsm_search *); /* called now and then by searches for a path: false to stop; may be NULL */
    void *context;                 /* for both */
    uint64_t most;                 /* for them: states that are enough; 0: all */
    const bool *awaited;           /* by mark: stop when all of these were seen; NULL: explore all */
    uint32_t awaited_count;        /* those not seen yet */
    const fsm_target *targets;     /* by state; if there are any: stop when each group was found */
    size_t target_count;
    bool (*is_target)(void *context, fsm_state state); /* or those for which this holds, group 0; may be NULL */
    void *target_context;
    fsm_found *groups;             /* where the first state of each was found; FSM_NO_STATE: not yet */
    uint32_t group_count, groups_left;

    fsm_set passed;
    fsm_layer layers[2];           /* the one that is expanded, and the next */
    uint32_t depth;                /* of the layer that is expanded */
    uint64_t expanded, transitions, left_out; /* states; their steps; those of them that slept */
    uint64_t checked_at;             /* steps at the last call of `keep_on` */
    bool maybe_cyclic;             /* some internal step led to a state that was known */
    fsm_witness *witnesses;        /* one for each mark of the model */
    fsm_checkpoint *checkpoints;
    uint32_t checkpoint_count, checkpoint_room, interval; /* layers from one to the next */
    size_t checkpoint_bytes, model_bytes;
    fsm_ahead ahead;
    fsm_found at;                  /* the current state */
    fsm_outcome outcome;
    fsm_parallel_search *parallel;            /* NULL: one thread does it all */
    uint32_t cores_used;
};

/* Notes that a mark was seen, or the first state of a group. */
bool fsm_witness_note(fsm_witness *self, fsm_found at, uint32_t step); /* whether it is the first time */
void fsm_search_note_mark(fsm_search *self, uint32_t mark, fsm_found at, uint32_t step);
void fsm_search_note_group(fsm_search *self, uint32_t group, fsm_found found);

/* The steps of a state of a layer, requested with those of the states after it up to before `end`, if `looks_ahead`; NULL
 * if the model failed. To be called for one state after the other; `ahead->requested` is initially the first one. */
fsm_steps *fsm_search_steps(const fsm_search *self, fsm_ahead *ahead, const fsm_layer *layer, size_t at, size_t end,
                            bool looks_ahead);
void fsm_ahead_free(fsm_ahead *self);

/* The group of a state that was not found yet, or FSM_NONE. */
uint32_t fsm_search_group_of(const fsm_search *self, fsm_state state);

static inline bool fsm_search_has_targets(const fsm_search *self)
{
    return self->target_count > 0 || self->is_target != NULL;
}

static inline bool fsm_layer_has_room(const fsm_layer *layer, size_t count)
{
    return count * sizeof(fsm_state) <= layer->states.reserved && count * sizeof(uint32_t) <= layer->tags.reserved
        && count * sizeof(fsm_footprint_number) <= layer->footprints.reserved;
}

static inline fsm_state *fsm_layer_states(const fsm_layer *layer)
{
    return layer->states.base;
}

static inline uint32_t *fsm_layer_tags(const fsm_layer *layer)
{
    return layer->tags.base;
}

static inline fsm_footprint_number *fsm_layer_footprints(const fsm_layer *layer)
{
    return layer->footprints.base;
}

#endif
