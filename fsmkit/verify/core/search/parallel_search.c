#include "search/parallel_search.h"

#include "search/workers.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

enum {
    PIPE = 64, /* look-ups under way while their places in the set are fetched */
    LAG = 16   /* states found while what is seen of them is fetched */
};

/* A step to a state that the set did not know. */
typedef struct {
    fsm_state to;
    uint32_t tag;
    uint32_t order; /* its number among those of the chunk << 1 | whether it is internal */
    fsm_footprint_number footprint;
} candidate;

typedef struct {
    candidate *items;
    uint32_t count, room;
    uint32_t kept; /* the first ones, which were new */
} candidates;

typedef struct {
    candidates *shards;    /* for each shard of the set */
    uint32_t found, kept; /* of all shards */
    size_t at;            /* where the new ones go in the next layer */
} chunk;

/* The results of one thread. Its chunks come in increasing order, so its first result is the first of all if
 * its chunk is the first. */
typedef struct {
    fsm_ahead ahead;
    fsm_witness *witnesses;   /* by mark */
    uint32_t *witness_chunks;
    fsm_found *groups;
    uint32_t *group_chunks;
    uint64_t *taken;          /* by order: a bit for each candidate that was new */
    uint32_t *ranks;          /* how many of them come before those of a word */
    size_t taken_room;        /* words */
    uint64_t transitions, left_out;
    fsm_outcome outcome;
    bool cyclic;
} hand;

struct fsm_parallel_search {
    fsm_search *search;
    fsm_workers *workers;
    uint32_t count, shards;
    hand hands[FSM_MOST_WORKERS];
    chunk chunks[FSM_BLOCK_CHUNKS];
    size_t bytes; /* of candidates */
    /* the current block */
    const fsm_layer *layer;
    fsm_layer *next;
    size_t first, end;
    uint32_t chunk_count, turns;
};

/* --- making one ------------------------------------------------------------------------------------- */

static bool init_hand(hand *self, const fsm_search *search, uint32_t number)
{
    size_t marks = (size_t)search->model->mark_count + 1, groups = (size_t)search->group_count + 1;
    for (int i = 0; i < FSM_AHEAD; i++)
        self->ahead.steps[i].thread = number;
    self->witnesses = calloc(marks, sizeof *self->witnesses);
    self->witness_chunks = calloc(marks, sizeof *self->witness_chunks);
    self->groups = malloc(groups * sizeof *self->groups);
    self->group_chunks = calloc(groups, sizeof *self->group_chunks);
    for (size_t i = 0; self->groups != NULL && i < groups; i++)
        self->groups[i].state = FSM_NO_STATE;
    return self->witnesses != NULL && self->witness_chunks != NULL && self->groups != NULL && self->group_chunks != NULL;
}

static void free_hand(hand *self)
{
    fsm_ahead_free(&self->ahead);
    free(self->witnesses);
    free(self->witness_chunks);
    free(self->groups);
    free(self->group_chunks);
    free(self->taken);
    free(self->ranks);
}

void fsm_parallel_search_stop(fsm_parallel_search *self)
{
    if (self == NULL)
        return;
    fsm_workers_stop(self->workers);
    for (uint32_t i = 0; i < self->count; i++)
        free_hand(&self->hands[i]);
    for (uint32_t i = 0; i < FSM_BLOCK_CHUNKS; i++) {
        for (uint32_t shard = 0; self->chunks[i].shards != NULL && shard < self->shards; shard++)
            free(self->chunks[i].shards[shard].items);
        free(self->chunks[i].shards);
    }
    free(self);
}

/* More shards than threads, which shortens the wait for the slowest one. */
static unsigned shift_for(uint32_t threads)
{
    unsigned shift = 1;
    while (1u << shift < 2 * threads)
        shift++;
    return shift;
}

fsm_parallel_search *fsm_parallel_search_start(fsm_search *search)
{
    fsm_parallel_search *self = calloc(1, sizeof *self);
    if (self == NULL)
        return NULL;
    self->search = search;
    self->workers = fsm_workers_start(search->cores);
    self->count = self->workers == NULL ? 0 : fsm_workers_count(self->workers);
    unsigned shift = search->passed.lossy != NULL ? search->passed.shift : shift_for(self->count);
    self->shards = 1u << shift;
    bool fine = self->count > 1;
    for (uint32_t i = 0; i < self->count; i++)
        fine = init_hand(&self->hands[i], search, i) && fine;
    for (uint32_t i = 0; fine && i < FSM_BLOCK_CHUNKS; i++) {
        self->chunks[i].shards = calloc(self->shards, sizeof *self->chunks[i].shards);
        fine = self->chunks[i].shards != NULL;
    }
    if (fine && fsm_set_split(&search->passed, shift))
        return self;
    fsm_parallel_search_stop(self);
    return NULL;
}

size_t fsm_parallel_search_bytes(const fsm_parallel_search *self)
{
    return self->bytes;
}

/* --- what is noted ------------------------------------------------------------------------------------ */

static void note_mark(hand *self, uint32_t chunk_number, uint32_t mark, fsm_found at, uint32_t step)
{
    if (self->witnesses[mark].count == 0)
        self->witness_chunks[mark] = chunk_number;
    (void)fsm_witness_note(&self->witnesses[mark], at, step);
}

static void note_marks(const fsm_search *search, hand *self, uint32_t chunk_number, uint32_t set, fsm_found at,
                       uint32_t step)
{
    uint32_t count;
    const uint32_t *marks = search->model->mark_set(search->model->self, set, &count);
    for (uint32_t i = 0; i < count; i++)
        note_mark(self, chunk_number, marks[i], at, step);
}

static void note_target(const fsm_search *search, hand *self, uint32_t chunk_number, fsm_found found)
{
    uint32_t group = fsm_search_group_of(search, found.state);
    if (group == FSM_NONE || self->groups[group].state != FSM_NO_STATE)
        return;
    self->groups[group] = found;
    self->group_chunks[group] = chunk_number;
}

static void gather_mark(fsm_parallel_search *self, uint32_t mark)
{
    uint64_t count = 0;
    const hand *first = NULL;
    for (uint32_t i = 0; i < self->count; i++) {
        const hand *h = &self->hands[i];
        if (h->witnesses[mark].count == 0)
            continue;
        count += h->witnesses[mark].count;
        if (first == NULL || h->witness_chunks[mark] < first->witness_chunks[mark])
            first = h;
    }
    if (first == NULL)
        return;
    fsm_search_note_mark(self->search, mark, first->witnesses[mark].at, first->witnesses[mark].step);
    self->search->witnesses[mark].count += count - 1;
    for (uint32_t i = 0; i < self->count; i++)
        self->hands[i].witnesses[mark].count = 0;
}

static void gather_group(fsm_parallel_search *self, uint32_t group)
{
    const hand *first = NULL;
    for (uint32_t i = 0; i < self->count; i++) {
        const hand *h = &self->hands[i];
        if (h->groups[group].state != FSM_NO_STATE
            && (first == NULL || h->group_chunks[group] < first->group_chunks[group]))
            first = h;
    }
    if (first == NULL)
        return;
    fsm_search_note_group(self->search, group, first->groups[group]);
    for (uint32_t i = 0; i < self->count; i++)
        self->hands[i].groups[group].state = FSM_NO_STATE;
}

/* Adds up what all have noted. False if one of them could not go on. */
static bool gather(fsm_parallel_search *self)
{
    fsm_search *search = self->search;
    for (uint32_t mark = 0; mark < search->model->mark_count; mark++)
        gather_mark(self, mark);
    for (uint32_t group = 0; group < search->group_count; group++)
        gather_group(self, group);
    self->bytes = 0;
    for (uint32_t i = 0; i < FSM_BLOCK_CHUNKS; i++)
        for (uint32_t shard = 0; shard < self->shards; shard++)
            self->bytes += self->chunks[i].shards[shard].room * sizeof(candidate);
    for (uint32_t i = 0; i < self->count; i++) {
        hand *h = &self->hands[i];
        search->transitions += h->transitions;
        search->maybe_cyclic = search->maybe_cyclic || h->cyclic;
        search->left_out += h->left_out;
        h->transitions = h->left_out = 0;
        if (h->outcome != FSM_COMPLETE)
            search->outcome = h->outcome;
    }
    return search->outcome == FSM_COMPLETE;
}

/* --- first round: what the states of a chunk lead to ---------------------------------------------------- */

typedef struct {
    candidate what;
    uint64_t home;
} looked_up;

typedef struct {
    looked_up items[PIPE];
    uint32_t first, count;
} pipeline;

static bool add_candidate(candidates *self, candidate what)
{
    if (!FSM_HAS_ROOM(self->items, self->count, self->room, 64))
        return false;
    self->items[self->count++] = what;
    return true;
}

static bool drain(const fsm_search *search, hand *h, chunk *c, pipeline *pipe, uint32_t left)
{
    while (pipe->count > left) {
        looked_up *at = &pipe->items[pipe->first];
        uint32_t shard = fsm_set_part_of(&search->passed, at->what.to);
        pipe->first = (pipe->first + 1) % PIPE;
        pipe->count--;
        if (fsm_set_has(&search->passed, shard, at->home)) {
            h->cyclic = h->cyclic || (at->what.order & 1) != 0;
            continue;
        }
        at->what.order |= c->found++ << 1;
        if (!add_candidate(&c->shards[shard], at->what))
            return false;
    }
    return true;
}

static fsm_outcome expand_state(const fsm_search *search, hand *h, chunk *c, uint32_t number, fsm_found at,
                                const fsm_steps *steps, pipeline *pipe)
{
    if (steps == NULL)
        return FSM_MODEL_FAILED;
    if (steps->deadlock)
        note_mark(h, number, 0, at, FSM_NONE);
    for (size_t i = 0; i < steps->count; i++) {
        const fsm_step *step = &steps->items[i];
        bool internal = step->kind == FSM_STEP_INTERNAL;
        if (step->marks != 0)
            note_marks(search, h, number, step->marks, at, step->ordinal);
        if (pipe->count == PIPE && !drain(search, h, c, pipe, PIPE - 1))
            return FSM_OUT_OF_MEMORY;
        pipe->items[(pipe->first + pipe->count++) % PIPE] =
            (looked_up){{step->to, at.tag, internal, step->footprint}, fsm_set_home(&search->passed, step->to)};
    }
    h->transitions += steps->count + steps->left_out;
    h->left_out += steps->left_out;
    h->cyclic = h->cyclic || steps->left_out_internal;
    return FSM_COMPLETE;
}

static void expand_chunk(const fsm_parallel_search *self, hand *h, chunk *c, uint32_t number)
{
    const fsm_search *search = self->search;
    size_t first = self->first + (size_t)number * search->chunk;
    size_t end = first + search->chunk < self->end ? first + search->chunk : self->end;
    pipeline pipe = {.count = 0};
    h->ahead.requested = first;
    c->found = 0;
    for (uint32_t shard = 0; shard < self->shards; shard++)
        c->shards[shard].count = c->shards[shard].kept = 0;
    for (size_t i = first; i < end && h->outcome == FSM_COMPLETE; i++) {
        fsm_found at = {fsm_layer_states(self->layer)[i], search->depth, search->checkpoint_count - 1,
                        fsm_layer_tags(self->layer)[i]};
        h->outcome = expand_state(search, h, c, number, at, fsm_search_steps(search, &h->ahead, self->layer, i, end, true), &pipe);
    }
    if (h->outcome == FSM_COMPLETE && !drain(search, h, c, &pipe, 0))
        h->outcome = FSM_OUT_OF_MEMORY;
}

static void expand_chunks(void *context, uint32_t worker)
{
    fsm_parallel_search *self = context;
    hand *h = &self->hands[worker];
    uint32_t turn;
    while (h->outcome == FSM_COMPLETE && (turn = fsm_take_turn(&self->turns, self->chunk_count)) < self->chunk_count)
        expand_chunk(self, h, &self->chunks[turn], turn);
}

/* --- second round: a shard of the set takes in what was noted for it ---------------------------------------- */

typedef struct {
    candidates *list;
    uint64_t home;
    uint32_t at, edition;
} entering;

/* `shard` is NULL if the set is lossy. */
static fsm_put put(fsm_search *search, fsm_shard *shard, fsm_state state, const entering *what)
{
    return shard == NULL
        ? fsm_hash_compaction_put(search->passed.lossy, what->home)
        : fsm_shard_put_home(shard, fsm_set_inner(&search->passed, state), what->home, what->edition);
}

static bool enter(fsm_search *search, fsm_shard *shard, hand *h, const entering *what)
{
    candidates *list = what->list;
    candidate *item = &list->items[what->at];
    switch (put(search, shard, item->to, what)) {
    case FSM_KNOWN:
        h->cyclic = h->cyclic || (item->order & 1) != 0;
        return true;
    case FSM_ADDED:
        list->items[list->kept++] = *item;
        return true;
    case FSM_NO_ROOM:
        break;
    }
    h->outcome = FSM_OUT_OF_MEMORY;
    return false;
}

static void fill_shard(fsm_parallel_search *self, hand *h, uint32_t number)
{
    fsm_search *search = self->search;
    fsm_shard *shard = search->passed.lossy != NULL ? NULL : &search->passed.shards[number];
    entering pipe[PIPE];
    uint64_t in = 0, out = 0;
    bool fine = true;
    for (uint32_t c = 0; c < self->chunk_count; c++) {
        candidates *list = &self->chunks[c].shards[number];
        for (uint32_t i = 0; fine && i < list->count; i++) {
            if (in - out == PIPE)
                fine = enter(search, shard, h, &pipe[out++ % PIPE]);
            uint64_t home = fsm_set_home(&search->passed, list->items[i].to);
            pipe[in++ % PIPE] = (entering){list, home, i, shard == NULL ? 0 : shard->edition};
        }
    }
    while (fine && out < in)
        fine = enter(search, shard, h, &pipe[out++ % PIPE]);
}

static void fill_shards(void *context, uint32_t worker)
{
    fsm_parallel_search *self = context;
    hand *h = &self->hands[worker];
    uint32_t turn;
    while (h->outcome == FSM_COMPLETE && (turn = fsm_take_turn(&self->turns, self->shards)) < self->shards)
        fill_shard(self, h, turn);
}

/* --- third round: new states go to the next layer, in the order of steps ------------------------------------- */

static bool clear_taken(hand *self, uint32_t found)
{
    size_t words = (size_t)found / 64 + 1;
    if (words > self->taken_room) {
        free(self->taken);
        free(self->ranks);
        self->taken_room = 2 * words;
        self->taken = malloc(self->taken_room * sizeof *self->taken);
        self->ranks = malloc(self->taken_room * sizeof *self->ranks);
        if (self->taken == NULL || self->ranks == NULL)
            return false;
    }
    memset(self->taken, 0, words * sizeof *self->taken);
    return true;
}

static void rank_taken(hand *h, const fsm_parallel_search *self, const chunk *c)
{
    uint32_t rank = 0;
    for (uint32_t shard = 0; shard < self->shards; shard++)
        for (uint32_t i = 0; i < c->shards[shard].kept; i++) {
            uint32_t order = c->shards[shard].items[i].order >> 1;
            h->taken[order / 64] |= UINT64_C(1) << order % 64;
        }
    for (size_t word = 0; word <= c->found / 64; word++) {
        h->ranks[word] = rank;
        rank += (uint32_t)__builtin_popcountll(h->taken[word]);
    }
}

static void look_at_new(const fsm_parallel_search *self, hand *h, const chunk *c, uint32_t number)
{
    const fsm_search *search = self->search;
    const fsm_model *model = search->model;
    for (size_t i = c->at; i < c->at + c->kept; i++) {
        if (model->fetch_first != NULL && i + LAG < c->at + c->kept)
            model->fetch_first(model->self, fsm_layer_states(self->next)[i + LAG]);
        fsm_found found = {fsm_layer_states(self->next)[i], search->depth + 1, search->checkpoint_count - 1,
                           fsm_layer_tags(self->next)[i]};
        uint32_t marks = model->marks(model->self, found.state);
        if (marks == FSM_NONE) {
            h->outcome = FSM_MODEL_FAILED;
            return;
        }
        if (marks != 0)
            note_marks(search, h, number, marks, found, FSM_NONE);
        if (fsm_search_has_targets(search))
            note_target(search, h, number, found);
    }
}

static void append_chunk(const fsm_parallel_search *self, hand *h, const chunk *c, uint32_t number)
{
    if (c->kept == 0)
        return;
    if (!clear_taken(h, c->found)) {
        h->outcome = FSM_OUT_OF_MEMORY;
        return;
    }
    rank_taken(h, self, c);
    for (uint32_t shard = 0; shard < self->shards; shard++)
        for (uint32_t i = 0; i < c->shards[shard].kept; i++) {
            const candidate *item = &c->shards[shard].items[i];
            uint32_t order = item->order >> 1;
            uint64_t before = h->taken[order / 64] & ((UINT64_C(1) << order % 64) - 1);
            size_t at = c->at + h->ranks[order / 64] + (uint32_t)__builtin_popcountll(before);
            fsm_layer_states(self->next)[at] = item->to;
            fsm_layer_tags(self->next)[at] = item->tag;
            fsm_layer_footprints(self->next)[at] = item->footprint;
        }
    look_at_new(self, h, c, number);
}

static void append_chunks(void *context, uint32_t worker)
{
    fsm_parallel_search *self = context;
    hand *h = &self->hands[worker];
    uint32_t turn;
    while (h->outcome == FSM_COMPLETE && (turn = fsm_take_turn(&self->turns, self->chunk_count)) < self->chunk_count)
        append_chunk(self, h, &self->chunks[turn], turn);
}

/* --- a block ------------------------------------------------------------------------------------------------ */

static void work(fsm_parallel_search *self, fsm_work *what)
{
    self->turns = 0;
    fsm_workers_run(self->workers, what, self);
}

/* Finds where the new states of each chunk go. False if there is no room for them. */
static bool lay_out(fsm_parallel_search *self)
{
    size_t at = self->next->count;
    for (uint32_t i = 0; i < self->chunk_count; i++) {
        chunk *c = &self->chunks[i];
        c->at = at;
        c->kept = 0;
        for (uint32_t shard = 0; shard < self->shards; shard++)
            c->kept += c->shards[shard].kept;
        at += c->kept;
    }
    if (!fsm_layer_has_room(self->next, at))
        return false;
    self->next->count = at;
    return true;
}

bool fsm_parallel_search_expand(fsm_parallel_search *self, const fsm_layer *layer, size_t first, size_t count, fsm_layer *next)
{
    fsm_search *search = self->search;
    self->layer = layer;
    self->next = next;
    self->first = first;
    self->end = first + count;
    self->chunk_count = (uint32_t)((count + search->chunk - 1) / search->chunk);
    work(self, expand_chunks);
    if (!gather(self))
        return false;
    work(self, fill_shards);
    fsm_set_count_again(&search->passed);
    if (!lay_out(self)) {
        search->outcome = FSM_OUT_OF_MEMORY;
        return false;
    }
    work(self, append_chunks);
    next->seen = next->count;
    search->expanded += count;
    return gather(self);
}
