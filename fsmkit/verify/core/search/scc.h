/* scc.h: depth-first walks over the places of a set, and its strongly connected components (Tarjan 1972). */
#ifndef FSM_SCC_H
#define FSM_SCC_H

#include "search/search.h"

/* An edge of the graph, and a frame of the walk: the edges of a state that are still to be followed
 * lie on the stack of edges from `edge` on. */
typedef struct {
    uint64_t to; /* a place */
    uint32_t step;
} fsm_edge;

typedef struct {
    uint64_t state;
    size_t first, edge, end;
} fsm_frame;

typedef struct {
    fsm_search *search;
    bool internal_only;            /* follow internal steps only */
    const unsigned char *flags;    /* by place; NULL: go everywhere */
    unsigned char outside;         /* flags of places that are not entered */
    fsm_steps steps;
    fsm_edge *edges;
    size_t edge_count, edge_room;
    fsm_frame *frames;
    size_t frame_count, frame_room;
    uint64_t checks;
} fsm_scc;

bool fsm_scc_init(fsm_scc *self, fsm_search *search);
void fsm_scc_free(fsm_scc *self);

/* Enters a state: a new frame with all its edges. False if memory ran out or the search was stopped. */
bool fsm_scc_enter(fsm_scc *self, uint64_t state);
void fsm_scc_leave(fsm_scc *self);

static inline fsm_frame *fsm_scc_top(const fsm_scc *self)
{
    return &self->frames[self->frame_count - 1];
}

/* Strongly connected components. A component gets a value once all of its successors are complete. */
enum { FSM_LEAVES = 1 };

typedef struct fsm_components fsm_components;

/* Returns the value of a component. `leaves` is 0 if no step leaves it, else FSM_LEAVES and the values of
 * where such steps lead. */
typedef unsigned char fsm_close_component(void *context, const fsm_components *all, const uint64_t *places,
                                          size_t count, unsigned char leaves);

struct fsm_components {
    fsm_close_component *close;
    void *context;
    uint32_t *index; /* 0: not met; of complete components: their number */
    uint32_t *low;   /* 0 once its component is complete */
    unsigned char *value;
    uint64_t *stack;
    size_t stack_count;
    uint32_t clock;
};

bool fsm_components_init(fsm_components *self, const fsm_search *search);
void fsm_components_free(fsm_components *self);

/* Goes through all components that are reached from a place and not complete yet. */
bool fsm_components_from(fsm_components *self, fsm_scc *walk, uint64_t root);

#endif
