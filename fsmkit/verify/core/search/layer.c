#include "search/layer.h"

#include <stdlib.h>

/* --- what is noted -------------------------------------------------------------------------------- */

bool fsm_witness_note(fsm_witness *self, fsm_found at, uint32_t step)
{
    if (self->count++ > 0)
        return false;
    self->at = at;
    self->step = step;
    return true;
}

void fsm_search_note_mark(fsm_search *self, uint32_t mark, fsm_found at, uint32_t step)
{
    if (fsm_witness_note(&self->witnesses[mark], at, step) && self->awaited != NULL && self->awaited[mark])
        self->awaited_count -= self->awaited_count > 0;
}

uint32_t fsm_search_group_of(const fsm_search *self, fsm_state state)
{
    size_t first = 0, last = self->target_count;
    if (self->is_target != NULL)
        return self->groups_left > 0 && self->is_target(self->target_context, state) ? 0 : FSM_NONE;
    while (first < last) {
        size_t middle = first + (last - first) / 2;
        if (self->targets[middle].state < state)
            first = middle + 1;
        else
            last = middle;
    }
    if (first == self->target_count || self->targets[first].state != state)
        return FSM_NONE;
    uint32_t group = self->targets[first].group;
    return self->groups[group].state == FSM_NO_STATE ? group : FSM_NONE;
}

void fsm_search_note_group(fsm_search *self, uint32_t group, fsm_found found)
{
    if (self->groups[group].state != FSM_NO_STATE)
        return;
    self->groups[group] = found;
    self->groups_left--;
}

/* --- steps ---------------------------------------------------------------------------------------- */

/* Fetches from memory what states a few places after one in a layer will need. */
static void fetch(const fsm_search *self, const fsm_layer *layer, size_t at)
{
    enum { FIRST = 16, NEXT = 8 };
    const fsm_model *model = self->model;
    if (model->fetch_first == NULL)
        return;
    if (at + FIRST < layer->count)
        model->fetch_first(model->self, fsm_layer_states(layer)[at + FIRST]);
    if (at + NEXT < layer->count)
        model->fetch_next(model->self, fsm_layer_states(layer)[at + NEXT]);
}

/* The footprint of the step by which a state was found, or 0 if every step of it is to be taken. A lossy set takes them all:
 * a state that it misses may be found from another one. */
static fsm_footprint_number found_by(const fsm_search *self, const fsm_layer *layer, size_t at)
{
    bool sleeps = !self->sleepless && self->passed.lossy == NULL;
    return sleeps ? fsm_layer_footprints(layer)[at] : 0;
}

fsm_steps *fsm_search_steps(const fsm_search *self, fsm_ahead *ahead, const fsm_layer *layer, size_t at, size_t end,
                            bool looks_ahead)
{
    const fsm_model *model = self->model;
    const fsm_state *states = fsm_layer_states(layer);
    size_t last = looks_ahead && at + FSM_AHEAD < end ? at + FSM_AHEAD : looks_ahead ? end : at + 1;
    for (; ahead->requested < last; ahead->requested++) {
        fsm_steps *steps = &ahead->steps[ahead->requested % FSM_AHEAD];
        fetch(self, layer, ahead->requested);
        fsm_steps_clear(steps, found_by(self, layer, ahead->requested));
        if (!model->successors(model->self, states[ahead->requested], steps))
            return NULL;
    }
    fsm_steps *steps = &ahead->steps[at % FSM_AHEAD];
    return fsm_finish(model, states[at], steps) ? steps : NULL;
}

void fsm_ahead_free(fsm_ahead *self)
{
    for (int i = 0; i < FSM_AHEAD; i++)
        free(self->steps[i].items);
    *self = (fsm_ahead){.requested = 0};
}
