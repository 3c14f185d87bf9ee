#include "cycles.h"

#include <stdlib.h>
#include <string.h>

/* An edge of the graph, and a frame of the depth-first walk: the edges of a state that are still to
 * be followed lie on the stack of edges from `edge` on. */
typedef struct {
    uint64_t to; /* a place */
    uint32_t step;
} edge;

typedef struct {
    uint64_t state;
    size_t first, edge, end;
} frame;

typedef struct {
    fsm_search *search;
    bool internal_only;
    fsm_steps steps;
    edge *edges;
    size_t edge_count, edge_room;
    frame *frames;
    size_t frame_count, frame_room;
    uint64_t asked;
} walk;

static bool walk_init(walk *self, fsm_search *search, bool internal_only)
{
    *self = (walk){.search = search, .internal_only = internal_only};
    self->edge_room = self->frame_room = 256;
    self->edges = malloc(self->edge_room * sizeof *self->edges);
    self->frames = malloc(self->frame_room * sizeof *self->frames);
    return self->edges != NULL && self->frames != NULL;
}

static void walk_free(walk *self)
{
    free(self->edges);
    free(self->frames);
    free(self->steps.items);
}

static bool push_edge(walk *self, uint64_t to, uint32_t step)
{
    if (self->edge_count == self->edge_room) {
        edge *edges = realloc(self->edges, 2 * self->edge_room * sizeof *edges);
        if (edges == NULL)
            return false;
        self->edges = edges;
        self->edge_room *= 2;
    }
    self->edges[self->edge_count++] = (edge){to, step};
    return true;
}

static bool push_edges(walk *self, uint64_t state)
{
    const fsm_model *model = self->search->model;
    const fsm_set *passed = &self->search->passed;
    self->steps.count = 0;
    if (!model->successors(model->self, fsm_set_at(passed, state), &self->steps))
        return false;
    for (size_t i = 0; i < self->steps.count; i++) {
        const fsm_step *step = &self->steps.items[i];
        if (self->internal_only && step->kind != FSM_STEP_INTERNAL)
            continue;
        uint64_t place = fsm_set_find(passed, step->to);
        if (place == FSM_NOWHERE || !push_edge(self, place, (uint32_t)i))
            return false;
    }
    return true;
}

/* Enters a state: a new frame with all its edges. */
static bool enter(walk *self, uint64_t state)
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
    size_t first = self->edge_count;
    if (!push_edges(self, state))
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

static bool read_cycle(const walk *self, uint64_t start, fsm_cycle *found)
{
    size_t first = self->frame_count;
    while (self->frames[first - 1].state != start)
        first--;
    first--;
    found->state = fsm_set_at(&self->search->passed, start);
    found->length = (uint32_t)(self->frame_count - first);
    found->steps = malloc(found->length * sizeof *found->steps);
    if (found->steps == NULL)
        return false;
    for (size_t i = first; i < self->frame_count; i++)
        found->steps[i - first] = self->edges[self->frames[i].edge - 1].step;
    return true;
}

static bool walk_from(walk *self, uint64_t root, unsigned char *colour, fsm_cycle *found)
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
        uint64_t to = self->edges[at->edge++].to;
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
    *found = (fsm_cycle){.state = FSM_NO_STATE};
    if (!search->maybe_cyclic)
        return true; /* each cycle holds a step to a state that is known */
    const fsm_set *passed = &search->passed;
    uint64_t places = fsm_set_places(passed);
    walk self;
    unsigned char *colour = calloc(places, 1);
    bool fine = walk_init(&self, search, true) && colour != NULL;
    for (uint64_t root = 0; fine && found->state == FSM_NO_STATE && root < places; root++)
        if (fsm_set_taken(passed, root) && colour[root] == 0)
            fine = walk_from(&self, root, colour, found);
    free(colour);
    walk_free(&self);
    return fine;
}

/* --- traps: bottom components, by Tarjan's algorithm ------------------------------------------ */

typedef struct {
    uint32_t *index, *low; /* index 0: not met; low 0 once its component is complete */
    unsigned char *leaks;  /* some step leaves the component */
    uint64_t *stack;
    size_t stack_count;
    uint32_t clock;
    fsm_report_trap *report;
    void *context;
} tarjan;

static void close_component(const fsm_search *search, tarjan *t, uint64_t root)
{
    enum { MOST = 256 };
    const fsm_model *model = search->model;
    fsm_state states[MOST];
    size_t kept = 0;
    uint32_t shown = model->configuration(model->self, fsm_set_at(&search->passed, root));
    bool leaks = false, uniform = true;
    do {
        uint64_t place = t->stack[--t->stack_count];
        fsm_state state = fsm_set_at(&search->passed, place);
        leaks = leaks || t->leaks[place];
        uniform = uniform && model->configuration(model->self, state) == shown
            && !model->at_rest(model->self, state);
        if (kept < MOST)
            states[kept++] = state;
        t->low[place] = 0;
    } while (t->stack[t->stack_count] != root);
    if (!leaks && uniform)
        t->report(t->context, states, kept);
}

static void meet(tarjan *t, uint64_t state)
{
    t->index[state] = t->low[state] = ++t->clock;
    t->stack[t->stack_count++] = state;
}

static bool components_from(walk *self, tarjan *t, uint64_t root)
{
    if (!enter(self, root))
        return false;
    meet(t, root);
    while (self->frame_count > 0) {
        frame *at = top(self);
        uint64_t state = at->state;
        if (at->edge < at->end) {
            uint64_t to = self->edges[at->edge++].to;
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
        uint64_t parent = self->frame_count > 0 ? top(self)->state : FSM_NOWHERE;
        if (t->low[state] == t->index[state]) {
            close_component(self->search, t, state);
            if (parent != FSM_NOWHERE)
                t->leaks[parent] = 1;
        } else if (t->low[state] < t->low[parent]) {
            t->low[parent] = t->low[state];
        }
    }
    return true;
}

bool fsm_find_traps(fsm_search *search, fsm_report_trap *report, void *context)
{
    const fsm_set *passed = &search->passed;
    uint64_t places = fsm_set_places(passed);
    walk self;
    tarjan t = {.report = report, .context = context};
    t.index = calloc(places, sizeof *t.index);
    t.low = calloc(places, sizeof *t.low);
    t.leaks = calloc(places, 1);
    t.stack = malloc((passed->count + 1) * sizeof *t.stack);
    bool fine = walk_init(&self, search, false) && t.index != NULL && t.low != NULL
        && t.leaks != NULL && t.stack != NULL && passed->count < UINT32_MAX;
    for (uint64_t root = 0; fine && root < places; root++)
        if (fsm_set_taken(passed, root) && t.index[root] == 0)
            fine = components_from(&self, &t, root);
    free(t.index);
    free(t.low);
    free(t.leaks);
    free(t.stack);
    walk_free(&self);
    return fine;
}
