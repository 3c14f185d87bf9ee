#include "search/path.h"
#include "store/room.h"

#include <stdlib.h>

bool fsm_path_add(fsm_path *self, uint32_t step)
{
    if (!FSM_HAS_ROOM(self->steps, self->count, self->room, 64))
        return false;
    self->steps[self->count++] = step;
    return true;
}

void fsm_path_reverse(fsm_path *self, size_t first)
{
    for (size_t i = first, n = self->count; i + 1 < n; i++) {
        uint32_t held = self->steps[i];
        self->steps[i] = self->steps[--n];
        self->steps[n] = held;
    }
}

/* --- between two checkpoints ---------------------------------------------------------------------- */

/* How a state was first reached; the nodes double as the waiting list. */
enum { STEP_BITS = 20, FOOTPRINT_BITS = 12, CHECK_EVERY = 1024 };

typedef struct {
    fsm_state state;
    uint32_t from;
    uint32_t step : STEP_BITS, footprint : FOOTPRINT_BITS;
} node;

typedef struct {
    node *nodes;
    uint32_t *slots; /* number of a node plus one; 0 is empty */
    uint32_t count, capacity;
    size_t limit; /* bytes */
    bool sleeps;  /* steps that are taken in another order are skipped (sleep_sets.h) */
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
    if (capacity / 2 * sizeof(node) + capacity * sizeof(uint32_t) > self->limit)
        return false;
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

/* Adds the state to which a step leads from that node. False if memory ran out, or its ordinal is beyond all stored ones. */
static bool add(tree *self, uint32_t from, const fsm_step *step)
{
    fsm_state state = step->to;
    if (step->ordinal >> STEP_BITS != 0)
        return false;
    if (self->count == self->capacity / 2 && !grow(self))
        return false;
    uint32_t *slot = slot_of(self, state);
    if (*slot != 0)
        return true;
    bool known = self->sleeps && step->footprint >> FOOTPRINT_BITS == 0;
    self->nodes[self->count] = (node){.state = state, .from = from, .step = step->ordinal & ((1u << STEP_BITS) - 1),
                                      .footprint = known ? step->footprint & ((1u << FOOTPRINT_BITS) - 1) : 0};
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

static fsm_state search_from(const fsm_search *search, tree *self, fsm_classify_step *way, void *context, fsm_path *path)
{
    const fsm_model *model = search->model;
    fsm_steps steps = {0};
    fsm_state end = FSM_NO_STATE;
    bool fine = true;
    for (uint32_t at = 0; fine && end == FSM_NO_STATE && at < self->count; at++) {
        fsm_state from = self->nodes[at].state;
        if (at % CHECK_EVERY == 0 && search->seeks_on != NULL && !search->seeks_on(search))
            break;
        fsm_steps_clear(&steps, (fsm_footprint_number)self->nodes[at].footprint);
        fine = fsm_successors(model, from, &steps);
        for (uint32_t i = 0; fine && end == FSM_NO_STATE && i < steps.count; i++) {
            fsm_path_step goes = way(context, &steps, i, from);
            const fsm_step *step = &steps.items[i];
            if (goes == FSM_ARRIVES && add_back(self, at, path) && fsm_path_add(path, step->ordinal))
                end = step->to;
            fine = goes == FSM_GOES_ON ? add(self, at, step) : goes == FSM_OFF_PATH || end != FSM_NO_STATE;
        }
    }
    free(steps.items);
    return end;
}

/* What the search has left, but at least a part: it may have ended because it had nothing left. */
static size_t room_for_paths(const fsm_search *search)
{
    enum { PART = 8 };
    size_t used = fsm_search_bytes(search), limit = search->memory_limit, least = limit / PART;
    return used < limit - least ? limit - used : least;
}

static fsm_state find_path(const fsm_search *search, fsm_state from, fsm_classify_step *way, void *context, bool sleeps,
                           fsm_path *path)
{
    tree self = {.limit = room_for_paths(search), .sleeps = sleeps};
    const fsm_step first = {.to = from};
    fsm_state end = add(&self, FSM_NONE, &first) ? search_from(search, &self, way, context, path) : FSM_NO_STATE;
    free(self.nodes);
    free(self.slots);
    return end;
}

/* Every step is checked: not all may be taken, and then it is another graph. */
fsm_state fsm_path_from(const fsm_search *search, fsm_state from, fsm_classify_step *way, void *context, fsm_path *path)
{
    return find_path(search, from, way, context, false, path);
}

static fsm_path_step path_to(void *context, const fsm_steps *steps, size_t step, fsm_state from)
{
    const fsm_state *to = context;
    (void)from;
    return steps->items[step].to == *to ? FSM_ARRIVES : FSM_GOES_ON;
}

static bool add_segment(const fsm_search *search, fsm_state from, fsm_state to, fsm_path *path)
{
    return from == to || find_path(search, from, path_to, &to, !search->sleepless, path) != FSM_NO_STATE;
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
