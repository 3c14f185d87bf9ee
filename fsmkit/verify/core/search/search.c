#include "search/search.h"

#include "search/parallel_search.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

enum {
    CHECK_EVERY = 1024, /* states between two calls of `keep_on` */
    CHECK_AFTER = 1 << 16, /* and steps, where states have many */
    LARGE_LAYER = 1 << 14,
    CHUNK = 512,
    PIPE = 64,        /* steps under way while their places in the set are fetched */
    LAG = 16,         /* states found while what is seen of them is fetched */
    FREE_CHECKPOINTS = 32 << 20 /* bytes that need not be saved */
};

bool fsm_steps_grow(fsm_steps *self)
{
    return FSM_HAS_ROOM(self->items, self->count, self->room, 64);
}

static bool layer_init(fsm_layer *self, size_t limit)
{
    return fsm_region_reserve(&self->states, limit) && fsm_region_reserve(&self->tags, limit / 2)
        && fsm_region_reserve(&self->footprints, limit / 4);
}

static void layer_free(fsm_layer *self)
{
    fsm_region_release(&self->states);
    fsm_region_release(&self->tags);
    fsm_region_release(&self->footprints);
}

bool fsm_search_init(fsm_search *self, const fsm_model *model, size_t memory_limit)
{
    *self = (fsm_search){.model = model, .memory_limit = memory_limit, .cores = 1, .cores_used = 1, .interval = 1};
    self->large = LARGE_LAYER;
    self->chunk = CHUNK;
    self->witnesses = calloc((size_t)model->mark_count + 1, sizeof *self->witnesses);
    if (self->witnesses != NULL && fsm_set_init(&self->passed, memory_limit)
        && layer_init(&self->layers[0], memory_limit) && layer_init(&self->layers[1], memory_limit))
        return true;
    fsm_search_free(self);
    return false;
}

bool fsm_search_make_lossy(fsm_search *self, fsm_storage storage, size_t bytes)
{
    return fsm_set_make_lossy(&self->passed, storage, bytes);
}

void fsm_search_forget(fsm_search *self)
{
    fsm_parallel_search_stop(self->parallel);
    self->parallel = NULL;
    fsm_set_free(&self->passed);
    layer_free(&self->layers[0]);
    layer_free(&self->layers[1]);
    fsm_ahead_free(&self->ahead);
}

void fsm_search_free(fsm_search *self)
{
    fsm_search_forget(self);
    for (uint32_t i = 0; i < self->checkpoint_count; i++) {
        free(self->checkpoints[i].states);
        free(self->checkpoints[i].tags);
    }
    free(self->checkpoints);
    free(self->witnesses);
    *self = (fsm_search){0};
}

size_t fsm_search_bytes(const fsm_search *self)
{
    const size_t each = sizeof(fsm_state) + sizeof(uint32_t) + sizeof(fsm_footprint_number);
    return fsm_set_bytes(&self->passed) + (self->layers[0].count + self->layers[1].count) * each
        + self->checkpoint_bytes + self->model_bytes + (self->parallel == NULL ? 0 : fsm_parallel_search_bytes(self->parallel));
}

/* --- checkpoints --------------------------------------------------------------------------------- */

/* The checkpoints with odd numbers are dropped: what referred to one refers to the one before. */
static void refer_back(const fsm_search *self, fsm_found *found)
{
    if (found->state == FSM_NO_STATE)
        return;
    if (found->checkpoint % 2 != 0)
        found->tag = self->checkpoints[found->checkpoint].tags[found->tag];
    found->checkpoint /= 2;
}

/* Drops every other checkpoint; that is linear in their number, so all times together are, too. Number i has the depth i times
 * the interval. */
static void drop_odd_checkpoints(fsm_search *self, fsm_layer *layer)
{
    uint32_t count = self->checkpoint_count;
    for (uint32_t mark = 0; mark < self->model->mark_count; mark++)
        if (self->witnesses[mark].count > 0)
            refer_back(self, &self->witnesses[mark].at);
    for (uint32_t i = 0; i < self->group_count; i++)
        refer_back(self, &self->groups[i]);
    for (uint32_t number = 1; number < count; number += 2) {
        fsm_checkpoint *dropped = &self->checkpoints[number];
        uint32_t *tags = number + 1 < count ? dropped[1].tags : fsm_layer_tags(layer);
        size_t after = number + 1 < count ? dropped[1].count : layer->count;
        for (size_t i = 0; i < after; i++)
            tags[i] = dropped->tags[tags[i]];
        self->checkpoint_bytes -= dropped->count * (sizeof(fsm_state) + sizeof(uint32_t));
        free(dropped->states);
        free(dropped->tags);
    }
    for (uint32_t number = 2; number < count; number += 2)
        self->checkpoints[number / 2] = self->checkpoints[number];
    self->checkpoint_count = (count + 1) / 2;
    self->interval *= 2;
}

/* Twice as far apart, while they take more than a byte for each state. */
static void thin_out(fsm_search *self, fsm_layer *layer)
{
    while (self->checkpoint_bytes > FREE_CHECKPOINTS && self->checkpoint_bytes > self->passed.count
           && self->checkpoint_count > 2)
        drop_odd_checkpoints(self, layer);
}

/* Keeps the layer that is about to be expanded as the ancestor of the following ones. */
static bool keep_checkpoint(fsm_search *self, fsm_layer *layer)
{
    size_t count = layer->count;
    if (count > FSM_NONE - 1)
        return false;
    if (self->checkpoint_count == self->checkpoint_room) {
        size_t room = self->checkpoint_room == 0 ? 64 : 2 * (size_t)self->checkpoint_room;
        fsm_checkpoint *all = room >= FSM_NONE ? NULL : realloc(self->checkpoints, room * sizeof *all);
        if (all == NULL)
            return false;
        self->checkpoints = all;
        self->checkpoint_room = (uint32_t)room;
    }
    fsm_checkpoint *new = &self->checkpoints[self->checkpoint_count];
    *new = (fsm_checkpoint){.depth = self->depth, .count = (uint32_t)count};
    new->states = malloc(count * sizeof *new->states);
    new->tags = malloc(count * sizeof *new->tags);
    if (new->states == NULL || new->tags == NULL) {
        free(new->states);
        free(new->tags);
        return false;
    }
    memcpy(new->states, fsm_layer_states(layer), count * sizeof *new->states);
    memcpy(new->tags, fsm_layer_tags(layer), count * sizeof *new->tags);
    self->checkpoint_count++;
    self->checkpoint_bytes += count * (sizeof *new->states + sizeof *new->tags);
    for (size_t i = 0; i < count; i++)
        fsm_layer_tags(layer)[i] = (uint32_t)i;
    return true;
}

/* --- one state -------------------------------------------------------------------------------- */

static bool stop(fsm_search *self, fsm_outcome outcome)
{
    self->outcome = outcome;
    return false;
}

static void note_marks(fsm_search *self, uint32_t set, fsm_found at, uint32_t step)
{
    uint32_t count;
    const uint32_t *marks = self->model->mark_set(self->model->self, set, &count);
    for (uint32_t i = 0; i < count; i++)
        fsm_search_note_mark(self, marks[i], at, step);
}

static bool found_new(fsm_search *self, fsm_layer *next, fsm_state state, uint32_t tag, fsm_footprint_number footprint)
{
    size_t count = next->count;
    if (!fsm_layer_has_room(next, count + 1))
        return stop(self, FSM_OUT_OF_MEMORY);
    fsm_layer_states(next)[count] = state;
    fsm_layer_tags(next)[count] = tag;
    fsm_layer_footprints(next)[count] = footprint;
    next->count++;
    if (self->model->fetch_first != NULL)
        self->model->fetch_first(self->model->self, state);
    return true;
}

/* Looks at the states of a layer that have not been looked at, all but the last `left` ones. */
static bool look_at_new(fsm_search *self, fsm_layer *next, uint32_t depth, size_t left)
{
    const fsm_model *model = self->model;
    for (; next->seen + left < next->count; next->seen++) {
        fsm_found found = {fsm_layer_states(next)[next->seen], depth, self->checkpoint_count - 1,
                           fsm_layer_tags(next)[next->seen]};
        uint32_t marks = model->marks(model->self, found.state);
        if (marks == FSM_NONE)
            return stop(self, FSM_MODEL_FAILED);
        if (marks != 0)
            note_marks(self, marks, found, FSM_NONE);
        uint32_t group = fsm_search_has_targets(self) ? fsm_search_group_of(self, found.state) : FSM_NONE;
        if (group != FSM_NONE)
            fsm_search_note_group(self, group, found);
    }
    return true;
}

/* --- a layer ---------------------------------------------------------------------------------- */

/* A step on its way into the set. */
typedef struct {
    fsm_state to;
    fsm_shard *shard; /* of the set, if it is exact */
    uint64_t home;
    uint32_t edition, tag;
    fsm_footprint_number footprint;
    unsigned char kind;
} pending;

typedef struct {
    pending items[PIPE];
    uint32_t first, count;
} pipeline;

/* Whether the set is `lossy` is a constant of each call, and the functions are made for it: so an exact one is not
 * slowed down by the question. */
#define SPECIAL static inline __attribute__((always_inline))

SPECIAL bool arrive(fsm_search *self, fsm_layer *next, pending what, bool lossy)
{
    switch (lossy ? fsm_set_put_lossy(&self->passed, what.home)
                  : fsm_set_put_home(&self->passed, what.to, what.shard, what.home, what.edition)) {
    case FSM_KNOWN:
        self->maybe_cyclic = self->maybe_cyclic || what.kind == FSM_STEP_INTERNAL;
        return true;
    case FSM_ADDED:
        return found_new(self, next, what.to, what.tag, what.footprint);
    case FSM_NO_ROOM:
        break;
    }
    return stop(self, FSM_OUT_OF_MEMORY);
}

SPECIAL bool drain(fsm_search *self, fsm_layer *next, pipeline *pipe, uint32_t left, bool lossy)
{
    while (pipe->count > left) {
        pending what = pipe->items[pipe->first];
        pipe->first = (pipe->first + 1) % PIPE;
        pipe->count--;
        if (!arrive(self, next, what, lossy))
            return false;
    }
    return true;
}

SPECIAL pending looked_up(const fsm_search *self, const fsm_step *step, bool lossy)
{
    const fsm_set *passed = &self->passed;
    if (lossy)
        return (pending){step->to, NULL, fsm_hash_compaction_home(passed->lossy, step->to), 0, self->at.tag, 0, step->kind};
    fsm_shard *shard = fsm_set_shard(passed, step->to);
    return (pending){step->to, shard, fsm_shard_home(shard, fsm_set_inner(passed, step->to)), shard->edition,
                     self->at.tag, step->footprint, step->kind};
}

SPECIAL bool expand(fsm_search *self, fsm_layer *next, pipeline *pipe, const fsm_steps *steps, bool lossy)
{
    if (steps == NULL)
        return stop(self, FSM_MODEL_FAILED);
    if (steps->deadlock)
        fsm_search_note_mark(self, 0, self->at, FSM_NONE);
    for (size_t i = 0; i < steps->count; i++) {
        const fsm_step *step = &steps->items[i];
        if (step->marks != 0)
            note_marks(self, step->marks, self->at, step->ordinal);
        if (pipe->count == PIPE && !drain(self, next, pipe, PIPE - 1, lossy))
            return false;
        pipe->items[(pipe->first + pipe->count++) % PIPE] = looked_up(self, step, lossy);
    }
    self->transitions += steps->count + steps->left_out;
    self->left_out += steps->left_out;
    self->maybe_cyclic = self->maybe_cyclic || steps->left_out_internal;
    self->expanded++;
    return true;
}

static bool is_decided(const fsm_search *self)
{
    return (self->awaited != NULL && self->awaited_count == 0)
        || (fsm_search_has_targets(self) && self->groups_left == 0);
}

static bool is_to_check(const fsm_search *self)
{
    return self->expanded % CHECK_EVERY == 0 || self->transitions - self->checked_at >= CHECK_AFTER;
}

/* Called now and then. */
static bool is_within_limits(fsm_search *self)
{
    self->checked_at = self->transitions;
    self->model_bytes = self->model->memory(self->model->self);
    if (fsm_search_bytes(self) > self->memory_limit)
        return stop(self, FSM_OUT_OF_MEMORY);
    return self->keep_on == NULL || self->keep_on(self);
}

static bool may_go_on(fsm_search *self)
{
    return !is_decided(self) || stop(self, FSM_DECIDED);
}

SPECIAL bool expand_some(fsm_search *self, const fsm_layer *layer, size_t first, size_t count, fsm_layer *next,
                         bool lossy)
{
    bool each = layer->count < self->large, fine = true;
    pipeline pipe = {.count = 0};
    self->ahead.requested = first;
    for (size_t i = first; fine && i < first + count; i++) {
        self->at = (fsm_found){fsm_layer_states(layer)[i], self->depth, self->checkpoint_count - 1,
                               fsm_layer_tags(layer)[i]};
        fine = (!each || may_go_on(self)) && (!is_to_check(self) || is_within_limits(self))
            && expand(self, next, &pipe, fsm_search_steps(self, &self->ahead, layer, i, first + count, !each), lossy)
            && look_at_new(self, next, self->depth + 1, each ? 0 : LAG);
    }
    fine = drain(self, next, &pipe, 0, lossy) && fine;
    return look_at_new(self, next, self->depth + 1, 0) && fine;
}

static bool expand_alone(fsm_search *self, const fsm_layer *layer, size_t first, size_t count, fsm_layer *next)
{
    return self->passed.lossy == NULL ? expand_some(self, layer, first, count, next, false)
                                      : expand_some(self, layer, first, count, next, true);
}

static void engage(fsm_search *self)
{
    self->parallel = fsm_parallel_search_start(self);
    if (self->parallel == NULL)
        self->cores = 1;
    self->cores_used = self->cores;
}

/* A large layer by blocks, after each of which the search checks whether all is decided: so the result does not
 * depend on how many threads there are. */
static bool expand_layer(fsm_search *self, const fsm_layer *layer, fsm_layer *next)
{
    size_t block = fsm_parallel_search_block(self);
    if (layer->count < self->large)
        return expand_alone(self, layer, 0, layer->count, next);
    if (self->cores > 1 && self->parallel == NULL)
        engage(self);
    for (size_t first = 0; first < layer->count; first += block) {
        size_t count = layer->count - first < block ? layer->count - first : block;
        bool fine = may_go_on(self)
            && (self->parallel == NULL ? expand_alone(self, layer, first, count, next)
                                   : is_within_limits(self) && fsm_parallel_search_expand(self->parallel, layer, first, count, next));
        if (!fine)
            return false;
    }
    return true;
}

/* --- the whole ---------------------------------------------------------------------------------- */

/* The first layer is the first checkpoint; its tags are the ordinals of the initial steps. */
static bool begin(fsm_search *self)
{
    fsm_layer *first = &self->layers[0];
    fsm_steps steps = {0};
    bool fine = self->model->initial(self->model->self, &steps) || stop(self, FSM_MODEL_FAILED);
    for (uint32_t i = 0; fine && i < steps.count; i++) {
        fsm_found nowhere = {FSM_NO_STATE, 0, 0, i};
        if (steps.items[i].marks != 0)
            note_marks(self, steps.items[i].marks, nowhere, i);
        fsm_put put = fsm_set_put(&self->passed, steps.items[i].to);
        if (put == FSM_NO_ROOM)
            fine = stop(self, FSM_OUT_OF_MEMORY);
        else if (put == FSM_ADDED)
            fine = found_new(self, first, steps.items[i].to, i, 0);
    }
    free(steps.items);
    return fine && (keep_checkpoint(self, first) || stop(self, FSM_OUT_OF_MEMORY)) && look_at_new(self, first, 0, 0);
}

void fsm_search_run(fsm_search *self)
{
    self->outcome = FSM_COMPLETE;
    if (!begin(self))
        return;
    for (;;) {
        fsm_layer *layer = &self->layers[self->depth % 2], *next = &self->layers[(self->depth + 1) % 2];
        if (!expand_layer(self, layer, next))
            return;
        layer->count = layer->seen = 0;
        if (next->count == 0)
            break;
        self->depth++;
        if (self->depth % self->interval == 0) {
            if (!keep_checkpoint(self, next)) {
                self->outcome = FSM_OUT_OF_MEMORY;
                return;
            }
            thin_out(self, next);
        }
    }
    if (is_decided(self))
        self->outcome = FSM_DECIDED;
}

void fsm_search_locate(fsm_search *self, const fsm_target *targets, size_t count, fsm_found *groups,
                       uint32_t group_count)
{
    fsm_search again;
    fsm_search_forget(self);
    for (uint32_t i = 0; i < group_count; i++)
        groups[i] = (fsm_found){.state = FSM_NO_STATE};
    if (!fsm_search_init(&again, self->model, self->memory_limit))
        return;
    again.cores = self->cores;
    again.large = self->large;
    again.chunk = self->chunk;
    again.sleepless = self->sleepless;
    again.keep_on = self->keep_on;
    again.seeks_on = self->seeks_on;
    again.context = self->context;
    again.targets = targets;
    again.target_count = count;
    again.groups = groups;
    again.group_count = again.groups_left = group_count;
    fsm_search_run(&again);
    fsm_search_free(self);
    *self = again;
    fsm_search_forget(self);
}
