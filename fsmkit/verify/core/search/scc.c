#include "search/scc.h"
#include "store/room.h"

#include <stdlib.h>

bool fsm_scc_init(fsm_scc *self, fsm_search *search)
{
    *self = (fsm_scc){.search = search};
    self->edge_room = self->frame_room = 256;
    self->edges = malloc(self->edge_room * sizeof *self->edges);
    self->frames = malloc(self->frame_room * sizeof *self->frames);
    return self->edges != NULL && self->frames != NULL;
}

void fsm_scc_free(fsm_scc *self)
{
    free(self->edges);
    free(self->frames);
    free(self->steps.items);
}

static bool push_edge(fsm_scc *self, uint64_t to, uint32_t step)
{
    if (!FSM_HAS_ROOM(self->edges, self->edge_count, self->edge_room, 1))
        return false;
    self->edges[self->edge_count++] = (fsm_edge){to, step};
    return true;
}

static bool push_edges(fsm_scc *self, uint64_t state)
{
    const fsm_model *model = self->search->model;
    const fsm_set *passed = &self->search->passed;
    fsm_steps_clear(&self->steps, 0);
    if (!fsm_successors(model, fsm_set_at(passed, state), &self->steps))
        return false;
    for (size_t i = 0; i < self->steps.count; i++) {
        const fsm_step *step = &self->steps.items[i];
        if (self->internal_only && step->kind != FSM_STEP_INTERNAL)
            continue;
        uint64_t place = fsm_set_find(passed, step->to);
        if (place == FSM_NOWHERE)
            return false;
        if (self->flags != NULL && (self->flags[place] & self->outside) != 0)
            continue;
        if (!push_edge(self, place, (uint32_t)i))
            return false;
    }
    return true;
}

bool fsm_scc_enter(fsm_scc *self, uint64_t state)
{
    fsm_search *search = self->search;
    if (++self->checks % 1024 == 0 && search->keep_on != NULL && !search->keep_on(search))
        return false;
    if (!FSM_HAS_ROOM(self->frames, self->frame_count, self->frame_room, 1))
        return false;
    size_t first = self->edge_count;
    if (!push_edges(self, state))
        return false;
    self->frames[self->frame_count++] = (fsm_frame){state, first, first, self->edge_count};
    return true;
}

void fsm_scc_leave(fsm_scc *self)
{
    self->edge_count = self->frames[--self->frame_count].first;
}

/* --- components ------------------------------------------------------------------------------------ */

bool fsm_components_init(fsm_components *self, const fsm_search *search)
{
    const fsm_set *passed = &search->passed;
    uint64_t places = fsm_set_places(passed);
    self->index = calloc(places, sizeof *self->index);
    self->low = calloc(places, sizeof *self->low);
    self->value = calloc(places, 1);
    self->stack = malloc((passed->count + 1) * sizeof *self->stack);
    self->stack_count = self->clock = 0;
    return self->index != NULL && self->low != NULL && self->value != NULL && self->stack != NULL
        && passed->count < UINT32_MAX;
}

void fsm_components_free(fsm_components *self)
{
    free(self->index);
    free(self->low);
    free(self->value);
    free(self->stack);
}

static void close_component(fsm_components *self, uint64_t root)
{
    size_t first = self->stack_count;
    unsigned char leaves = 0;
    do
        leaves |= self->value[self->stack[--first]];
    while (self->stack[first] != root);
    size_t count = self->stack_count - first;
    unsigned char value = self->close(self->context, self, self->stack + first, count, leaves);
    uint32_t number = self->index[root];
    for (size_t i = first; i < self->stack_count; i++) {
        uint64_t place = self->stack[i];
        self->index[place] = number;
        self->low[place] = 0;
        self->value[place] = value;
    }
    self->stack_count = first;
}

static void meet(fsm_components *self, uint64_t place)
{
    self->index[place] = self->low[place] = ++self->clock;
    self->stack[self->stack_count++] = place;
}

bool fsm_components_from(fsm_components *self, fsm_scc *walk, uint64_t root)
{
    if (self->index[root] != 0)
        return true;
    if (!fsm_scc_enter(walk, root))
        return false;
    meet(self, root);
    while (walk->frame_count > 0) {
        fsm_frame *at = fsm_scc_top(walk);
        uint64_t place = at->state;
        if (at->edge < at->end) {
            uint64_t to = walk->edges[at->edge++].to;
            if (self->index[to] == 0) {
                if (!fsm_scc_enter(walk, to))
                    return false;
                meet(self, to);
            } else if (self->low[to] == 0) {
                self->value[place] |= (unsigned char)(FSM_LEAVES | self->value[to]);
            } else if (self->index[to] < self->low[place]) {
                self->low[place] = self->index[to];
            }
            continue;
        }
        fsm_scc_leave(walk);
        uint64_t parent = walk->frame_count > 0 ? fsm_scc_top(walk)->state : FSM_NOWHERE;
        if (self->low[place] == self->index[place]) {
            close_component(self, place);
            if (parent != FSM_NOWHERE)
                self->value[parent] |= (unsigned char)(FSM_LEAVES | self->value[place]);
        } else if (self->low[place] < self->low[parent]) {
            self->low[parent] = self->low[place];
        }
    }
    return true;
}
