/* search.h: breadth-first exploration of a model, and what is asked of its graph afterwards.
 *
 * The store doubles as the waiting list: states are numbered in the order they were found, so those
 * not yet expanded are the ones from `next` on. */
#ifndef FSM_SEARCH_H
#define FSM_SEARCH_H

#include "model.h"
#include "store.h"

typedef enum {
    FSM_COMPLETE,
    FSM_DECIDED, /* every mark that was waited for has been seen */
    FSM_OUT_OF_MEMORY,
    FSM_OUT_OF_TIME,
    FSM_INTERRUPTED,
    FSM_MODEL_FAILED
} fsm_outcome;

/* How a state was found first: the counterexample tree. An initial state has no `from`. */
typedef struct {
    uint32_t from; /* FSM_NONE: initial */
    uint32_t step; /* ordinal among the steps of `from`, or among the initial states */
} fsm_origin;

/* The first, and so a nearest, place where a mark was seen. */
typedef struct {
    uint32_t state; /* FSM_NONE with step FSM_NONE: never; else FSM_NONE is "before the start" */
    uint32_t step;  /* ordinal of the marked step of `state`; FSM_NONE: the state itself is marked */
    uint64_t count; /* marked states or steps in all */
} fsm_witness;

typedef struct fsm_search fsm_search;

struct fsm_search {
    const fsm_model *model;
    size_t memory_limit;            /* bytes */
    size_t model_bytes;             /* what the model held when last asked */
    bool (*keep_on)(fsm_search *);  /* asked now and then; sets `outcome` to stop; may be NULL */
    void *context;                  /* for `keep_on` */

    fsm_store passed;
    fsm_origin *origins;
    uint32_t origin_room;
    uint32_t next;                  /* the state being expanded, or to be expanded next */
    uint32_t step;                  /* ordinal of the step at hand */
    uint32_t depth, layer_end;      /* steps to the layer of `next`; the number after its last */
    uint64_t transitions;
    bool internal_back_edge;        /* some internal step led to a state no newer than its source */
    fsm_witness *witnesses;         /* one for each mark of the model */
    bool *awaited;                  /* by mark; NULL: explore everything */
    uint32_t awaited_count;         /* those not seen yet */
    uint32_t *marks;                /* room for the marks of one state */
    unsigned char *current;         /* a copy: inserting may move the store */
    fsm_outcome outcome;
};

bool fsm_search_init(fsm_search *self, const fsm_model *model, size_t memory_limit);
void fsm_search_free(fsm_search *self);

/* Explores until everything is known or a limit is met; says so in `outcome`. */
void fsm_search_run(fsm_search *self);

size_t fsm_search_bytes(const fsm_search *self);

/* Writes the ordinals that lead to a state, that of its initial state first, and returns how many;
 * `path` may be NULL to ask only that. */
uint32_t fsm_search_path(const fsm_search *self, uint32_t state, uint32_t *path);

#endif
