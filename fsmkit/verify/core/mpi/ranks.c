#include "mpi/ranks.h"

#include "search/search.h"

enum {
    CHECK_EVERY = 1024,  /* states between two looks at time and memory */
    LOOK_EVERY = 4096  /* and at what has come: each look may let other processes run first */
};

bool fsm_ranks_stop(fsm_ranks *self, fsm_outcome outcome)
{
    self->outcome = outcome;
    return false;
}

size_t fsm_ranks_bytes(const fsm_ranks *self)
{
    return fsm_set_bytes(&self->passed) + self->model->memory(self->model->self) + self->words.bytes
        + (self->layers[0].count + self->layers[1].count + self->stop_members) * sizeof(fsm_member)
        + fsm_exchange_bytes(&self->exchange);
}

bool fsm_ranks_keep_on(fsm_ranks *self)
{
    size_t bytes = fsm_ranks_bytes(self);
    if (bytes > self->options.memory)
        return fsm_ranks_stop(self, FSM_OUT_OF_MEMORY);
    const fsm_progress progress = {self->all_states + self->layers[(self->depth + 1) % 2].count * self->ranks,
                                   self->all_transitions, self->depth, bytes * self->ranks};
    fsm_outcome why = fsm_pace_check(self->options.pace, progress);
    return why == FSM_COMPLETE || fsm_ranks_stop(self, why);
}

uint64_t fsm_ranks_sum(uint64_t own)
{
    uint64_t all = 0;
    MPI_Allreduce(&own, &all, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
    return all;
}

fsm_outcome fsm_ranks_agree(fsm_ranks *self)
{
    int own = (int)self->outcome, all = 0;
    MPI_Allreduce(&own, &all, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    self->outcome = (fsm_outcome)all;
    return self->outcome;
}

bool fsm_ranks_add(fsm_ranks *self, fsm_members *layer, fsm_member member)
{
    if ((layer->count + 1) * sizeof member > layer->region.reserved)
        return fsm_ranks_stop(self, FSM_OUT_OF_MEMORY);
    fsm_members_of(layer)[layer->count++] = member;
    return true;
}

/* Fetches from memory what states a few places after one in a layer will need. */
static void fetch(const fsm_ranks *self, const fsm_members *layer, size_t at)
{
    enum { FIRST = 16, NEXT = 8 };
    const fsm_model *model = self->model;
    if (at + FIRST < layer->count && model->fetch_first != NULL)
        model->fetch_first(model->self, fsm_members_of(layer)[at + FIRST].state);
    if (at + NEXT < layer->count && model->fetch_next != NULL)
        model->fetch_next(model->self, fsm_members_of(layer)[at + NEXT].state);
}

/* --- marks ----------------------------------------------------------------------------------------------- */

static void note_marks(fsm_ranks *self, uint32_t set, fsm_member at, uint32_t depth, uint32_t step)
{
    uint32_t count;
    const uint32_t *marks = self->model->mark_set(self->model->self, set, &count);
    for (uint32_t i = 0; i < count; i++) {
        fsm_sight *sight = &self->sights[marks[i]];
        if (sight->count++ == 0)
            *sight = (fsm_sight){at, depth, self->stop_count - 1, step, 1};
    }
}

/* Looks at the states of a layer that have not been looked at. */
static bool look_at_new(fsm_ranks *self, fsm_members *layer, uint32_t depth)
{
    for (; layer->seen < layer->count; layer->seen++) {
        fetch(self, layer, layer->seen);
        fsm_member at = fsm_members_of(layer)[layer->seen];
        uint32_t marks = self->model->marks(self->model->self, at.state);
        if (marks == FSM_NONE)
            return fsm_ranks_stop(self, FSM_MODEL_FAILED);
        if (marks != 0)
            note_marks(self, marks, at, depth, FSM_NONE);
        if (at.state == self->target)
            self->found = (fsm_sight){at, depth, self->stop_count - 1, FSM_NONE, 1};
    }
    return true;
}

/* Whether all awaited marks have been seen, in some rank. */
static bool is_decided(const fsm_ranks *self)
{
    uint32_t left = self->options.awaited_count, marks = self->model->mark_count;
    if (self->options.awaited == NULL || left == 0)
        return false;
    unsigned char *seen = malloc(marks);
    if (seen == NULL)
        MPI_Abort(MPI_COMM_WORLD, 1);
    for (uint32_t i = 0; i < marks; i++)
        seen[i] = self->sights[i].count > 0;
    MPI_Allreduce(MPI_IN_PLACE, seen, (int)marks, MPI_UNSIGNED_CHAR, MPI_MAX, MPI_COMM_WORLD);
    for (uint32_t i = 0; i < marks && left > 0; i++)
        left -= self->options.awaited[i] && seen[i] != 0;
    free(seen);
    return left == 0;
}

/* --- a layer ------------------------------------------------------------------------------------------------ */

static bool enter(fsm_ranks *self, const fsm_pending *what)
{
    switch (fsm_set_put_home(&self->passed, what->member.state, what->shard, what->home, what->edition)) {
    case FSM_KNOWN:
        self->maybe_cyclic = self->maybe_cyclic || what->internal;
        return true;
    case FSM_ADDED:
        return fsm_ranks_add(self, &self->layers[(self->depth + 1) % 2], what->member);
    case FSM_NO_ROOM:
        break;
    }
    return fsm_ranks_stop(self, FSM_OUT_OF_MEMORY);
}

/* Lets those enter that have waited longest, until so many are left. */
static bool drain(fsm_ranks *self, uint32_t left)
{
    while (self->pending_count > left) {
        const fsm_pending *what = &self->pending[self->first_pending];
        self->first_pending = (self->first_pending + 1) % FSM_PENDING;
        self->pending_count--;
        if (!enter(self, what))
            return false;
    }
    return true;
}

static bool arrive(fsm_ranks *self, fsm_member member, bool internal)
{
    if (self->pending_count == FSM_PENDING && !drain(self, FSM_PENDING - 1))
        return false;
    fsm_shard *shard = fsm_set_shard(&self->passed, member.state);
    self->pending[(self->first_pending + self->pending_count++) % FSM_PENDING] = (fsm_pending){
        member, shard, fsm_shard_home(shard, fsm_set_inner(&self->passed, member.state)), shard->edition, internal};
    return true;
}

/* Results of the peers. */
static bool take_found(void *context, uint32_t peer, fsm_unread *from)
{
    fsm_ranks *self = context;
    fsm_member member = {.place = 0};
    if (!fsm_dictionary_receive(&self->words, peer, from, &member.state))
        return fsm_ranks_stop(self, FSM_MODEL_FAILED);
    member.place = fsm_read_small(from);
    uint32_t rank = fsm_read_small(from);
    member.rank = (uint16_t)(rank >> 1);
    if (!fsm_dictionary_receive_footprint(&self->words, peer, from, &member.footprint) || from->failed)
        return fsm_ranks_stop(self, FSM_MODEL_FAILED);
    return arrive(self, member, (rank & 1) != 0);
}

/* Whether a state was sent, not long ago; from now on it was. One that was sent is known to its rank, or will be. */
static bool was_sent(fsm_ranks *self, fsm_state state)
{
    fsm_state *place = &self->lately[(state ^ state >> 29) * 0x9e3779b97f4a7c15u >> (64 - FSM_LATELY_BITS)];
    if (*place == state)
        return true;
    *place = state;
    return false;
}

static bool send_found(fsm_ranks *self, uint32_t owner, fsm_member member, bool internal)
{
    if (was_sent(self, member.state)) {
        self->maybe_cyclic = self->maybe_cyclic || internal;
        self->filtered++;
        return true;
    }
    fsm_wire *wire = fsm_exchange_to(&self->exchange, owner);
    if (!fsm_dictionary_send(&self->words, owner, member.state, wire))
        return fsm_ranks_stop(self, FSM_OUT_OF_MEMORY);
    fsm_wire_number(wire, member.place);
    fsm_wire_number(wire, (uint64_t)member.rank << 1 | internal);
    if (!fsm_dictionary_send_footprint(&self->words, owner, member.footprint, wire))
        return fsm_ranks_stop(self, FSM_OUT_OF_MEMORY);
    self->sent_states++;
    fsm_exchange_wrote(&self->exchange, owner);
    return true;
}

static bool expand(fsm_ranks *self, const fsm_member *at)
{
    fsm_steps *steps = &self->steps;
    fsm_steps_clear(steps, self->options.sleepless ? 0 : at->footprint);
    if (!fsm_successors(self->model, at->state, steps))
        return fsm_ranks_stop(self, FSM_MODEL_FAILED);
    if (steps->deadlock && self->sights[0].count++ == 0)
        self->sights[0] = (fsm_sight){*at, self->depth, self->stop_count - 1, FSM_NONE, 1};
    for (size_t i = 0; i < steps->count; i++) {
        const fsm_step *step = &steps->items[i];
        bool internal = step->kind == FSM_STEP_INTERNAL;
        fsm_member member = {step->to, at->place, at->rank, step->footprint};
        if (step->marks != 0)
            note_marks(self, step->marks, *at, self->depth, step->ordinal);
        uint32_t owner = fsm_dictionary_owner(&self->words, step->to);
        if (owner == FSM_NONE)
            return fsm_ranks_stop(self, FSM_OUT_OF_MEMORY);
        if (owner == self->rank ? !arrive(self, member, internal) : !send_found(self, owner, member, internal))
            return false;
    }
    self->transitions += steps->count + steps->left_out;
    self->maybe_cyclic = self->maybe_cyclic || steps->left_out_internal;
    self->expanded++;
    return true;
}

/* Expands this rank's part of a layer, and collects its part of the next layer. */
static void expand_layer(fsm_ranks *self, const fsm_members *layer)
{
    bool fine = true;
    fsm_exchange_start(&self->exchange, take_found, self);
    for (size_t i = 0; fine && i < layer->count; i++) {
        if (i % LOOK_EVERY == 0)
            fsm_exchange_look(&self->exchange);
        fetch(self, layer, i);
        fine = !self->exchange.failed && (i % CHECK_EVERY != 0 || fsm_ranks_keep_on(self))
            && expand(self, &fsm_members_of(layer)[i]);
    }
    if (!fsm_exchange_end(&self->exchange) && self->outcome == FSM_COMPLETE)
        (void)fsm_ranks_stop(self, FSM_OUT_OF_MEMORY);
    fsm_members *next = &self->layers[(self->depth + 1) % 2];
    if (drain(self, 0) && self->outcome == FSM_COMPLETE)
        (void)look_at_new(self, next, self->depth + 1);
}

/* --- the whole ------------------------------------------------------------------------------------------------ */

/* The first layer is the first stop; its places are the ordinals of the initial steps. Each rank takes its own states, and
 * rank 0 the marks of the steps. */
static bool begin(fsm_ranks *self)
{
    fsm_members *first = &self->layers[0];
    fsm_steps steps = {0};
    bool fine = self->model->initial(self->model->self, &steps) || fsm_ranks_stop(self, FSM_MODEL_FAILED);
    for (uint32_t i = 0; fine && i < steps.count; i++) {
        fsm_member member = {steps.items[i].to, i, 0, 0};
        fsm_member nowhere = {FSM_NO_STATE, i, 0, 0};
        if (self->rank == 0 && steps.items[i].marks != 0)
            note_marks(self, steps.items[i].marks, nowhere, 0, i);
        if (fsm_dictionary_owner(&self->words, member.state) != self->rank)
            continue;
        fsm_put put = fsm_set_put(&self->passed, member.state);
        fine = put != FSM_NO_ROOM || fsm_ranks_stop(self, FSM_OUT_OF_MEMORY);
        if (put == FSM_ADDED)
            fine = fsm_ranks_add(self, first, member);
    }
    free(steps.items);
    return fine && (fsm_stops_keep(self, first) || fsm_ranks_stop(self, FSM_OUT_OF_MEMORY)) && look_at_new(self, first, 0)
        && fsm_saved_layer(self, first);
}

/* Ends a layer: the next one becomes the current layer. False at the end. */
static bool go_on(fsm_ranks *self)
{
    fsm_members *layer = &self->layers[self->depth % 2], *next = &self->layers[(self->depth + 1) % 2];
    (void)(self->outcome != FSM_COMPLETE || fsm_saved_layer(self, next));
    if (fsm_ranks_agree(self) != FSM_COMPLETE)
        return false;
    layer->count = layer->seen = 0;
    uint64_t found = fsm_ranks_sum(next->count);
    self->all_states = fsm_ranks_sum(self->passed.count);
    self->all_transitions = fsm_ranks_sum(self->transitions);
    bool arrived = fsm_ranks_sum(self->found.count) > 0;
    if (arrived || (found > 0 && is_decided(self)))
        self->outcome = FSM_DECIDED;
    if (found == 0 || self->outcome != FSM_COMPLETE)
        return false;
    self->depth++;
    if (self->depth % self->interval == 0
        && (!fsm_stops_keep(self, next) || !fsm_stops_thin_out(self, next)))
        (void)fsm_ranks_stop(self, FSM_OUT_OF_MEMORY);
    if (self->depth % self->options.save_every == 0)
        (void)fsm_saved_commit(self, next);
    return fsm_ranks_agree(self) == FSM_COMPLETE;
}

void fsm_ranks_run(fsm_ranks *self, bool begins)
{
    self->outcome = FSM_COMPLETE;
    if (begins)
        (void)begin(self);
    if (fsm_ranks_agree(self) != FSM_COMPLETE)
        return;
    do
        expand_layer(self, &self->layers[self->depth % 2]);
    while (go_on(self));
    if (self->outcome == FSM_COMPLETE && is_decided(self))
        self->outcome = FSM_DECIDED;
}

void fsm_ranks_forget(fsm_ranks *self)
{
    for (uint32_t i = 0; i < self->stop_count; i++)
        free(self->stops[i].members);
    free(self->stops);
    self->stops = NULL;
    self->stop_count = self->depth = 0;
    self->stop_members = 0;
    self->interval = 1;
    fsm_set_free(&self->passed);
    for (int i = 0; i < 2; i++) {
        fsm_region_release(&self->layers[i].region);
        self->layers[i] = (fsm_members){.count = 0};
    }
}
