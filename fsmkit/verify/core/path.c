#include "path.h"

#include <stdlib.h>

bool fsm_path_add(fsm_path *self, uint32_t step)
{
    if (self->count == self->room) {
        size_t room = self->room == 0 ? 64 : 2 * self->room;
        uint32_t *steps = realloc(self->steps, room * sizeof *steps);
        if (steps == NULL)
            return false;
        self->steps = steps;
        self->room = room;
    }
    self->steps[self->count++] = step;
    return true;
}

/* --- between two checkpoints ---------------------------------------------------------------------- */

/* How a state was first reached; the nodes double as the waiting list. */
typedef struct {
    fsm_state state;
    uint32_t from, step;
} node;

typedef struct {
    node *nodes;
    uint32_t *slots; /* number of a node plus one; 0 is empty */
    uint32_t count, capacity;
} tree;

static uint32_t *slot_of(const tree *self, fsm_state state)
{
    uint64_t h = (state ^ state >> 29) * 0x9e3779b97f4a7c15u;
    uint32_t slot = (uint32_t)(h >> 32) & (self->capacity - 1);
    while (self->slots[slot] != 0 && self->nodes[self->slots[slot] - 1].state != state)
        slot = (slot + 1) & (self->capacity - 1);
    return &self->slots[slot];
}

static bool grow(tree *self)
{
    uint32_t capacity = self->capacity == 0 ? 256 : 2 * self->capacity;
    node *nodes = realloc(self->nodes, capacity / 2 * sizeof *nodes);
    if (nodes != NULL)
        self->nodes = nodes;
    uint32_t *slots = calloc(capacity, sizeof *slots);
    if (nodes == NULL || slots == NULL || capacity > UINT32_MAX / 2) {
        free(slots);
        return false;
    }
    free(self->slots);
    self->slots = slots;
    self->capacity = capacity;
    for (uint32_t i = 0; i < self->count; i++)
        *slot_of(self, self->nodes[i].state) = i + 1;
    return true;
}

static bool add(tree *self, fsm_state state, uint32_t from, uint32_t step)
{
    if (self->count == self->capacity / 2 && !grow(self))
        return false;
    uint32_t *slot = slot_of(self, state);
    if (*slot != 0)
        return true;
    self->nodes[self->count] = (node){state, from, step};
    *slot = ++self->count;
    return true;
}

static bool add_back(const tree *self, uint32_t number, fsm_path *path)
{
    if (self->nodes[number].from == FSM_NONE)
        return true;
    return add_back(self, self->nodes[number].from, path)
        && fsm_path_add(path, self->nodes[number].step);
}

static bool search_segment(const fsm_model *model, tree *self, fsm_state from, fsm_state to, fsm_path *path)
{
    fsm_steps steps = {0};
    bool fine = add(self, from, FSM_NONE, 0);
    for (uint32_t at = 0; fine && at < self->count; at++) {
        if (self->nodes[at].state == to) {
            fine = add_back(self, at, path);
            free(steps.items);
            return fine;
        }
        steps.count = 0;
        fine = model->successors(model->self, self->nodes[at].state, &steps);
        for (uint32_t i = 0; fine && i < steps.count; i++)
            fine = add(self, steps.items[i].to, at, i);
    }
    free(steps.items);
    return false;
}

static bool add_segment(const fsm_search *search, fsm_state from, fsm_state to, fsm_path *path)
{
    tree self = {0};
    bool fine = search_segment(search->model, &self, from, to, path);
    free(self.nodes);
    free(self.slots);
    return fine;
}

bool fsm_path_to(const fsm_search *search, const fsm_found *found, fsm_path *path)
{
    uint32_t number = found->checkpoint;
    fsm_state *stops = malloc(((size_t)number + 1) * sizeof *stops);
    if (stops == NULL)
        return false;
    uint32_t tag = found->tag;
    for (uint32_t i = number + 1; i-- > 0;) {
        stops[i] = search->checkpoints[i].states[tag];
        tag = search->checkpoints[i].tags[tag];
    }
    bool fine = fsm_path_add(path, tag);
    for (uint32_t i = 0; fine && i < number; i++)
        fine = add_segment(search, stops[i], stops[i + 1], path);
    fine = fine && add_segment(search, stops[number], found->state, path);
    free(stops);
    return fine;
}
