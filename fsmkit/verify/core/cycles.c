#include "cycles.h"

#include <stdlib.h>
#include <string.h>

/* An edge of the graph, and a frame of the depth-first walk: the edges of a state that are still to
 * be followed lie on the stack of edges from `edge` on. */
typedef struct {
    uint32_t to, step;
} edge;

typedef struct {
    uint32_t state;
    size_t first, edge, end;
} frame;

typedef struct {
    fsm_search *search;
    bool internal_only;
    uint32_t step; /* ordinal of the step being emitted */
    edge *edges;
    size_t edge_count, edge_room;
    frame *frames;
    size_t frame_count, frame_room;
    unsigned char *state;
    uint64_t asked;
    bool failed;
} walk;

static bool walk_init(walk *self, fsm_search *search, bool internal_only)
{
    *self = (walk){.search = search, .internal_only = internal_only};
    self->edge_room = self->frame_room = 256;
    self->edges = malloc(self->edge_room * sizeof *self->edges);
    self->frames = malloc(self->frame_room * sizeof *self->frames);
    self->state = malloc(search->model->state_size);
    return self->edges != NULL && self->frames != NULL && self->state != NULL;
}

static void walk_free(walk *self)
{
    free(self->edges);
    free(self->frames);
    free(self->state);
}

static bool push_edge(void *context, const fsm_step *step)
{
    walk *self = context;
    uint32_t ordinal = self->step++;
    if (self->internal_only && step->kind != FSM_STEP_INTERNAL)
        return true;
    uint32_t number = fsm_store_find(&self->search->passed, step->state);
    if (number == FSM_NONE)
        return !(self->failed = true);
    if (self->edge_count == self->edge_room) {
        edge *edges = realloc(self->edges, 2 * self->edge_room * sizeof *edges);
        if (edges == NULL)
            return !(self->failed = true);
        self->edges = edges;
        self->edge_room *= 2;
    }
    self->edges[self->edge_count++] = (edge){number, ordinal};
    return true;
}

/* Enters a state: a new frame with all its edges. */
static bool enter(walk *self, uint32_t state)
{
    fsm_search *search = self->search;
    if (++self->asked % 1024 == 0 && search->keep_on != NULL && !search->keep_on(search))
        return false;
    if (self->frame_count == self->frame_room) {
        frame *frames = realloc(self->frames, 2 * self->frame_room * sizeof *frames);
        if (frames == NULL)
            return false;
        self->frames = frames;
        self->frame_room *= 2;
    }
    memcpy(self->state, fsm_store_at(&search->passed, state), search->model->state_size);
    size_t first = self->edge_count;
    self->step = 0;
    if (!search->model->successors(search->model->self, self->state, push_edge, self) || self->failed)
        return false;
    self->frames[self->frame_count++] = (frame){state, first, first, self->edge_count};
    return true;
}

static void leave(walk *self)
{
    self->edge_count = self->frames[--self->frame_count].first;
}

static frame *top(walk *self)
{
    return &self->frames[self->frame_count - 1];
}

/* --- livelock: a grey state met again ------------------------------------------------------- */

static bool read_cycle(const walk *self, uint32_t start, fsm_cycle *found)
{
    size_t first = self->frame_count;
    while (self->frames[first - 1].state != start)
        first--;
    first--;
    found->state = start;
    found->length = (uint32_t)(self->frame_count - first);
    found->steps = malloc(found->length * sizeof *found->steps);
    if (found->steps == NULL)
        return false;
    for (size_t i = first; i < self->frame_count; i++)
        found->steps[i - first] = self->edges[self->frames[i].edge - 1].step;
    return true;
}

static bool walk_from(walk *self, uint32_t root, unsigned char *colour, fsm_cycle *found)
{
    enum { WHITE, GREY, BLACK };
    if (!enter(self, root))
        return false;
    colour[root] = GREY;
    while (self->frame_count > 0) {
        frame *at = top(self);
        if (at->edge == at->end) {
            colour[at->state] = BLACK;
            leave(self);
            continue;
        }
        uint32_t to = self->edges[at->edge++].to;
        if (colour[to] == GREY)
            return read_cycle(self, to, found);
        if (colour[to] == WHITE) {
            if (!enter(self, to))
                return false;
            colour[to] = GREY;
        }
    }
    return true;
}

bool fsm_find_livelock(fsm_search *search, fsm_cycle *found)
{
    *found = (fsm_cycle){.state = FSM_NONE};
    if (!search->internal_back_edge)
        return true; /* each cycle holds a step to a state no newer than its source */
    walk self;
    unsigned char *colour = calloc(search->passed.count, 1);
    bool fine = walk_init(&self, search, true) && colour != NULL;
    for (uint32_t root = 0; fine && found->state == FSM_NONE && root < search->passed.count; root++)
        if (colour[root] == 0)
            fine = walk_from(&self, root, colour, found);
    free(colour);
    walk_free(&self);
    return fine;
}

/* --- traps: bottom components, by Tarjan's algorithm ------------------------------------------ */

typedef struct {
    uint32_t *index, *low; /* index 0: not met; low 0 once its component is complete */
    unsigned char *leaks;  /* some step leaves the component */
    uint32_t *stack;
    uint32_t stack_count, clock;
} tarjan;

static void close_component(const fsm_search *search, tarjan *t, uint32_t root,
                            void (*report)(void *, uint32_t), void *context)
{
    const fsm_model *model = search->model;
    uint32_t oldest = root;
    uint32_t shown = model->configuration(model->self, fsm_store_at(&search->passed, root));
    bool leaks = false, uniform = true;
    do {
        uint32_t state = t->stack[--t->stack_count];
        const void *bytes = fsm_store_at(&search->passed, state);
        leaks = leaks || t->leaks[state];
        uniform = uniform && model->configuration(model->self, bytes) == shown
            && !model->at_rest(model->self, bytes);
        oldest = state < oldest ? state : oldest;
        t->low[state] = 0;
    } while (t->stack[t->stack_count] != root);
    if (!leaks && uniform)
        report(context, oldest);
}

static void meet(tarjan *t, uint32_t state)
{
    t->index[state] = t->low[state] = ++t->clock;
    t->stack[t->stack_count++] = state;
}

static bool components_from(walk *self, tarjan *t, uint32_t root,
                            void (*report)(void *, uint32_t), void *context)
{
    if (!enter(self, root))
        return false;
    meet(t, root);
    while (self->frame_count > 0) {
        frame *at = top(self);
        uint32_t state = at->state;
        if (at->edge < at->end) {
            uint32_t to = self->edges[at->edge++].to;
            if (t->index[to] == 0) {
                if (!enter(self, to))
                    return false;
                meet(t, to);
            } else if (t->low[to] == 0) {
                t->leaks[state] = 1;
            } else if (t->index[to] < t->low[state]) {
                t->low[state] = t->index[to];
            }
            continue;
        }
        leave(self);
        uint32_t parent = self->frame_count > 0 ? top(self)->state : FSM_NONE;
        if (t->low[state] == t->index[state]) {
            close_component(self->search, t, state, report, context);
            if (parent != FSM_NONE)
                t->leaks[parent] = 1;
        } else if (t->low[state] < t->low[parent]) {
            t->low[parent] = t->low[state];
        }
    }
    return true;
}

bool fsm_find_traps(fsm_search *search, void (*report)(void *context, uint32_t state), void *context)
{
    size_t count = search->passed.count;
    walk self;
    tarjan t = {0};
    t.index = calloc(count + 1, sizeof *t.index);
    t.low = calloc(count + 1, sizeof *t.low);
    t.leaks = calloc(count + 1, 1);
    t.stack = malloc((count + 1) * sizeof *t.stack);
    bool fine = walk_init(&self, search, false) && t.index != NULL && t.low != NULL
        && t.leaks != NULL && t.stack != NULL;
    for (uint32_t root = 0; fine && root < count; root++)
        if (t.index[root] == 0)
            fine = components_from(&self, &t, root, report, context);
    free(t.index);
    free(t.low);
    free(t.leaks);
    free(t.stack);
    walk_free(&self);
    return fine;
}
