#include "search.h"

#include <stdlib.h>
#include <string.h>

enum { ASK_EVERY = 1024 }; /* states between two calls of `keep_on` */

bool fsm_search_init(fsm_search *self, const fsm_model *model, size_t memory_limit)
{
    *self = (fsm_search){.model = model, .memory_limit = memory_limit, .origin_room = 64};
    size_t marks = (size_t)model->mark_count + 1;
    self->origins = malloc(self->origin_room * sizeof *self->origins);
    self->witnesses = malloc(marks * sizeof *self->witnesses);
    self->marks = malloc(marks * sizeof *self->marks);
    self->current = malloc(model->state_size);
    bool stored = fsm_store_init(&self->passed, model->state_size);
    if (self->origins == NULL || self->witnesses == NULL || self->marks == NULL
        || self->current == NULL || !stored) {
        fsm_search_free(self);
        return false;
    }
    for (size_t i = 0; i < marks; i++)
        self->witnesses[i] = (fsm_witness){FSM_NONE, FSM_NONE, 0};
    return true;
}

void fsm_search_free(fsm_search *self)
{
    fsm_store_free(&self->passed);
    free(self->origins);
    free(self->witnesses);
    free(self->marks);
    free(self->current);
    *self = (fsm_search){0};
}

size_t fsm_search_bytes(const fsm_search *self)
{
    return fsm_store_bytes(&self->passed) + (size_t)self->origin_room * sizeof *self->origins
        + self->model_bytes;
}

static bool note_origin(fsm_search *self, uint32_t number, fsm_origin origin)
{
    if (number >= self->origin_room) {
        size_t room = (size_t)self->origin_room * 2;
        size_t rest = fsm_search_bytes(self) - self->origin_room * sizeof *self->origins;
        if (room > FSM_NONE || rest + room * sizeof *self->origins > self->memory_limit)
            return false;
        fsm_origin *origins = realloc(self->origins, room * sizeof *origins);
        if (origins == NULL)
            return false;
        self->origins = origins;
        self->origin_room = (uint32_t)room;
    }
    self->origins[number] = origin;
    return true;
}

static void note_mark(fsm_search *self, uint32_t mark, uint32_t state, uint32_t step)
{
    fsm_witness *witness = &self->witnesses[mark];
    if (witness->count++ == 0) {
        if (self->awaited != NULL && self->awaited[mark])
            self->awaited_count--;
        witness->state = state;
        witness->step = step;
    }
}

static bool visit(void *context, const fsm_step *step)
{
    fsm_search *self = context;
    size_t others = fsm_search_bytes(self) - fsm_store_bytes(&self->passed);
    size_t limit = others < self->memory_limit ? self->memory_limit - others : 0;
    bool added;
    uint32_t number = fsm_store_insert(&self->passed, step->state, limit, &added);
    if (number == FSM_NONE || (added && !note_origin(self, number, (fsm_origin){self->next, self->step}))) {
        self->outcome = FSM_OUT_OF_MEMORY;
        return false;
    }
    for (uint32_t i = 0; i < step->mark_count; i++)
        note_mark(self, step->marks[i], self->next, self->step);
    if (added) {
        uint32_t count = self->model->marks(self->model->self, step->state, self->marks);
        for (uint32_t i = 0; i < count; i++)
            note_mark(self, self->marks[i], number, FSM_NONE);
    }
    if (step->kind == FSM_STEP_INTERNAL && self->next != FSM_NONE && number <= self->next)
        self->internal_back_edge = true;
    self->transitions += self->next != FSM_NONE;
    self->step++;
    return true;
}

static bool may_go_on(fsm_search *self)
{
    if (self->next == self->layer_end) {
        self->layer_end = self->passed.count;
        self->depth++;
    }
    if (self->next % ASK_EVERY != 0)
        return true;
    self->model_bytes = self->model->memory(self->model->self);
    return self->keep_on == NULL || self->keep_on(self);
}

void fsm_search_run(fsm_search *self)
{
    const fsm_model *model = self->model;
    self->outcome = FSM_COMPLETE;
    self->next = FSM_NONE;
    bool whole = model->initial(model->self, visit, self);
    self->layer_end = self->passed.count;
    for (self->next = 0; whole && self->next < self->passed.count; self->next++) {
        if (!may_go_on(self))
            return;
        memcpy(self->current, fsm_store_at(&self->passed, self->next), model->state_size);
        self->step = 0;
        whole = model->successors(model->self, self->current, visit, self);
        if (whole && self->awaited != NULL && self->awaited_count == 0) {
            self->outcome = FSM_DECIDED;
            self->next++;
            return;
        }
    }
    if (!whole && self->outcome == FSM_COMPLETE)
        self->outcome = FSM_MODEL_FAILED;
}

uint32_t fsm_search_path(const fsm_search *self, uint32_t state, uint32_t *path)
{
    uint32_t length = 0;
    for (uint32_t at = state; at != FSM_NONE; at = self->origins[at].from)
        length++;
    if (path != NULL)
        for (uint32_t at = state, i = length; at != FSM_NONE; at = self->origins[at].from)
            path[--i] = self->origins[at].step;
    return length;
}
