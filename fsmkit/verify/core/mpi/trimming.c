/* Whether there is a cycle of internal steps, by taking away states: those to which no internal step leads any more lie on
 * none, and nor do those that then are left so. What stays is empty, or has a cycle: each state that stays has one before it.
 * (Topological sorting, Kahn 1962; over the parts of all ranks, in rounds.) */
#include "mpi/ranks.h"
#include "store/room.h"

#define GONE UINT32_MAX

typedef struct {
    fsm_ranks *ranks;
    uint32_t *entering; /* by place in the set: internal steps from states that stay; GONE: the state has been taken away */
    uint64_t *free_now, *free_next;
    size_t now_count, next_count, now_room, next_room;
    uint32_t *before_place; /* a predecessor that is kept, by its position and rank; allocated only if some are kept */
    uint16_t *before_rank;
} trimming;

static bool push(trimming *self, uint64_t place)
{
    if (!FSM_HAS_ROOM(self->free_next, self->next_count, self->next_room, 1024))
        return fsm_ranks_stop(self->ranks, FSM_OUT_OF_MEMORY);
    self->free_next[self->next_count++] = place;
    return true;
}

/* Applies a step into a state of this rank; `rank` and `from` identify its predecessor. */
typedef bool arrival(trimming *self, uint64_t place, uint32_t rank, uint32_t from);

static bool enter(trimming *self, uint64_t place, uint32_t rank, uint32_t from)
{
    (void)rank;
    (void)from;
    self->entering[place]++;
    return true;
}

static bool leave(trimming *self, uint64_t place, uint32_t rank, uint32_t from)
{
    (void)rank;
    (void)from;
    return --self->entering[place] > 0 || push(self, place);
}

static bool remember(trimming *self, uint64_t place, uint32_t rank, uint32_t from)
{
    self->before_place[place] = from;
    self->before_rank[place] = (uint16_t)rank;
    return true;
}

typedef struct {
    trimming *self;
    arrival *arrives;
} taking;

static bool take_step(void *context, uint32_t peer, fsm_unread *from)
{
    taking *t = context;
    fsm_ranks *r = t->self->ranks;
    fsm_state state;
    if (!fsm_dictionary_receive(&r->words, peer, from, &state))
        return fsm_ranks_stop(r, FSM_MODEL_FAILED);
    uint32_t place = fsm_read_small(from);
    return !from->failed && t->arrives(t->self, fsm_set_find(&r->passed, state), peer, place);
}

/* Lets each internal step of a state arrive, wherever that is. */
static bool follow(trimming *self, uint64_t place, arrival *arrives)
{
    fsm_ranks *r = self->ranks;
    fsm_steps *steps = &r->steps;
    fsm_steps_clear(steps, 0);
    if (!fsm_successors(r->model, fsm_set_at(&r->passed, place), steps))
        return fsm_ranks_stop(r, FSM_MODEL_FAILED);
    for (size_t i = 0; i < steps->count; i++) {
        if (steps->items[i].kind != FSM_STEP_INTERNAL)
            continue;
        fsm_state to = steps->items[i].to;
        uint32_t owner = fsm_dictionary_owner(&r->words, to);
        if (owner == r->rank) {
            if (!arrives(self, fsm_set_find(&r->passed, to), r->rank, (uint32_t)place))
                return false;
            continue;
        }
        fsm_wire *wire = owner == FSM_NONE ? NULL : fsm_exchange_to(&r->exchange, owner);
        if (wire == NULL || !fsm_dictionary_send(&r->words, owner, to, wire))
            return fsm_ranks_stop(r, FSM_OUT_OF_MEMORY);
        fsm_wire_number(wire, place);
        fsm_exchange_wrote(&r->exchange, owner);
    }
    return true;
}

static bool is_time_to_check(fsm_ranks *r, uint64_t count)
{
    enum { LOOK_EVERY = 4096, CHECK_EVERY = 1024 };
    if (count % LOOK_EVERY == 0)
        fsm_exchange_look(&r->exchange);
    return count % CHECK_EVERY == 0;
}

/* For each state that stays, in all ranks at once. */
static bool follow_all(trimming *self, arrival *arrives)
{
    fsm_ranks *r = self->ranks;
    taking t = {self, arrives};
    uint64_t count = 0;
    fsm_exchange_start(&r->exchange, take_step, &t);
    for (uint64_t place = 0; place < fsm_set_places(&r->passed); place++) {
        if (!fsm_set_taken(&r->passed, place) || self->entering[place] == GONE)
            continue;
        if ((is_time_to_check(r, count++) && !fsm_ranks_keep_on(r)) || !follow(self, place, arrives))
            break;
    }
    (void)fsm_exchange_end(&r->exchange);
    return fsm_ranks_agree(r) == FSM_COMPLETE;
}

/* Takes away states until none can be any more. */
static bool trim(trimming *self)
{
    fsm_ranks *r = self->ranks;
    taking t = {self, leave};
    for (uint64_t place = 0; place < fsm_set_places(&r->passed); place++)
        if (fsm_set_taken(&r->passed, place) && self->entering[place] == 0 && !push(self, place))
            break;
    while (fsm_ranks_agree(r) == FSM_COMPLETE && fsm_ranks_sum(self->next_count) > 0) {
        uint64_t *items = self->free_now;
        size_t room = self->now_room;
        self->free_now = self->free_next;
        self->now_count = self->next_count;
        self->now_room = self->next_room;
        self->free_next = items;
        self->next_room = room;
        self->next_count = 0;
        fsm_exchange_start(&r->exchange, take_step, &t);
        for (size_t i = 0; i < self->now_count; i++) {
            self->entering[self->free_now[i]] = GONE;
            if ((is_time_to_check(r, i) && !fsm_ranks_keep_on(r)) || !follow(self, self->free_now[i], leave))
                break;
        }
        (void)fsm_exchange_end(&r->exchange);
    }
    return r->outcome == FSM_COMPLETE;
}

static uint64_t first_that_stays(const trimming *self)
{
    const fsm_set *passed = &self->ranks->passed;
    uint64_t place = 0, places = fsm_set_places(passed);
    while (place < places && (!fsm_set_taken(passed, place) || self->entering[place] == GONE))
        place++;
    return place < places ? place : FSM_NOWHERE;
}

/* The state that was requested last, when one of its ancestors is requested again: it lies on a cycle. States are
 * walked back one by one, from rank to rank, and the walk is compared with itself at twice the distance (Brent 1980). */
static void walk_back(trimming *self, uint32_t rank, uint64_t place)
{
    fsm_ranks *r = self->ranks;
    uint64_t here[2] = {rank, place}, kept[2] = {rank, place};
    for (uint64_t steps = 0, power = 1;; steps++) {
        int requested = (int)here[0];
        if (here[0] == r->rank) {
            here[0] = self->before_rank[here[1]];
            here[1] = self->before_place[here[1]];
        }
        MPI_Bcast(here, 2, MPI_UINT64_T, requested, MPI_COMM_WORLD);
        if (here[0] == kept[0] && here[1] == kept[1])
            break;
        if (steps + 1 == power) {
            power *= 2;
            steps = 0;
            kept[0] = here[0];
            kept[1] = here[1];
        }
    }
    if (here[0] == r->rank)
        r->target = fsm_set_at(&r->passed, here[1]);
}

static void find_cycle(trimming *self, bool *cyclic)
{
    fsm_ranks *r = self->ranks;
    uint64_t first = first_that_stays(self), places = fsm_set_places(&r->passed);
    uint32_t own = first == FSM_NOWHERE ? r->ranks : r->rank, rank;
    MPI_Allreduce(&own, &rank, 1, MPI_UINT32_T, MPI_MIN, MPI_COMM_WORLD);
    if (rank == r->ranks)
        return;
    self->before_place = malloc((places + 1) * sizeof *self->before_place);
    self->before_rank = malloc((places + 1) * sizeof *self->before_rank);
    if (self->before_place == NULL || self->before_rank == NULL || places > UINT32_MAX)
        (void)fsm_ranks_stop(r, FSM_OUT_OF_MEMORY);
    if (fsm_ranks_agree(r) != FSM_COMPLETE || !follow_all(self, remember))
        return;
    MPI_Bcast(&first, 1, MPI_UINT64_T, (int)rank, MPI_COMM_WORLD);
    walk_back(self, rank, first);
    *cyclic = true;
}

bool fsm_ranks_find_livelock(fsm_ranks *r, bool *cyclic)
{
    trimming self = {.ranks = r, .entering = calloc(fsm_set_places(&r->passed) + 1, sizeof *self.entering)};
    *cyclic = false;
    if (self.entering == NULL)
        (void)fsm_ranks_stop(r, FSM_OUT_OF_MEMORY);
    if (fsm_ranks_agree(r) == FSM_COMPLETE && follow_all(&self, enter) && trim(&self))
        find_cycle(&self, cyclic);
    bool known = fsm_ranks_agree(r) == FSM_COMPLETE;
    free(self.entering);
    free(self.free_now);
    free(self.free_next);
    free(self.before_place);
    free(self.before_rank);
    r->outcome = FSM_COMPLETE;
    return known;
}
