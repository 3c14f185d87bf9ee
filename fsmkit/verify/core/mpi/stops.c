#include "mpi/ranks.h"

enum { ROUND = 1 << 16 /* places that are looked up at once */ };

#ifndef FSM_FREE_MEMBERS /* of stops, in all ranks, that need not be saved; fewer for tests */
#define FSM_FREE_MEMBERS (2 << 20)
#endif

bool fsm_stops_keep(fsm_ranks *self, fsm_members *layer)
{
    if (layer->count > UINT32_MAX - 1)
        return false;
    fsm_stop *all = realloc(self->stops, (self->stop_count + 1u) * sizeof *all);
    if (all == NULL)
        return false;
    self->stops = all;
    fsm_member *members = malloc((layer->count + 1) * sizeof *members);
    if (members == NULL)
        return false;
    memcpy(members, fsm_members_of(layer), layer->count * sizeof *members);
    all[self->stop_count++] = (fsm_stop){self->depth, (uint32_t)layer->count, members};
    self->stop_members += layer->count;
    for (size_t i = 0; i < layer->count; i++) {
        fsm_members_of(layer)[i].place = (uint32_t)i;
        fsm_members_of(layer)[i].rank = (uint16_t)self->rank;
    }
    return true;
}

/* --- looking up in the stops of other ranks --------------------------------------------------------------- */

typedef struct {
    uint32_t place, rank;
} ancestor;

typedef struct {
    int *counts, *at, *their_counts, *their_at; /* by rank */
    uint32_t *order, *requested, *theirs;
    ancestor *answers, *found;
} lookup;

static void fill_places(int *at, const int *counts, uint32_t ranks, int each)
{
    for (uint32_t i = 0, sum = 0; i < ranks; sum += (uint32_t)(counts[i] * each), i++)
        at[i] = (int)sum;
}

static void scale(int *counts, uint32_t ranks, int by, bool up)
{
    for (uint32_t i = 0; i < ranks; i++)
        counts[i] = up ? counts[i] * by : counts[i] / by;
}

/* Replaces the ancestor of each of some members by that one's own, in a stop. */
static bool look_up_round(fsm_ranks *self, const fsm_stop *stop, lookup *l, fsm_member *members, uint32_t count)
{
    const int both = (int)(sizeof(ancestor) / sizeof(uint32_t));
    memset(l->counts, 0, self->ranks * sizeof *l->counts);
    for (uint32_t i = 0; i < count; i++)
        l->counts[members[i].rank]++;
    fill_places(l->at, l->counts, self->ranks, 1);
    for (uint32_t i = 0; i < count; i++) {
        l->order[i] = (uint32_t)l->at[members[i].rank]++;
        l->requested[l->order[i]] = members[i].place;
    }
    fill_places(l->at, l->counts, self->ranks, 1);
    MPI_Alltoall(l->counts, 1, MPI_INT, l->their_counts, 1, MPI_INT, MPI_COMM_WORLD);
    fill_places(l->their_at, l->their_counts, self->ranks, 1);
    uint32_t last = self->ranks - 1, all = (uint32_t)(l->their_at[last] + l->their_counts[last]);
    free(l->theirs);
    free(l->answers);
    l->theirs = malloc((all + 1u) * sizeof *l->theirs);
    l->answers = malloc((all + 1u) * sizeof *l->answers);
    if (l->theirs == NULL || l->answers == NULL)
        return false;
    MPI_Alltoallv(l->requested, l->counts, l->at, MPI_UINT32_T, l->theirs, l->their_counts, l->their_at, MPI_UINT32_T, MPI_COMM_WORLD);
    for (uint32_t i = 0; i < all; i++)
        l->answers[i] = (ancestor){stop->members[l->theirs[i]].place, stop->members[l->theirs[i]].rank};
    fill_places(l->at, l->counts, self->ranks, both);
    fill_places(l->their_at, l->their_counts, self->ranks, both);
    scale(l->counts, self->ranks, both, true);
    scale(l->their_counts, self->ranks, both, true);
    MPI_Alltoallv(l->answers, l->their_counts, l->their_at, MPI_UINT32_T, l->found, l->counts, l->at, MPI_UINT32_T, MPI_COMM_WORLD);
    for (uint32_t i = 0; i < count; i++) {
        members[i].place = l->found[l->order[i]].place;
        members[i].rank = (uint16_t)l->found[l->order[i]].rank;
    }
    return true;
}

/* If memory for this ran out in one rank, the others would wait for it. */
static void *must(void *memory)
{
    if (memory == NULL)
        MPI_Abort(MPI_COMM_WORLD, 1);
    return memory;
}

static void look_up(fsm_ranks *self, const fsm_stop *stop, fsm_member *members, size_t count)
{
    size_t ranks = self->ranks;
    lookup l = {.counts = must(malloc(4 * ranks * sizeof(int))), .order = must(malloc(ROUND * sizeof(uint32_t))),
                .requested = must(malloc(ROUND * sizeof(uint32_t))), .found = must(malloc(ROUND * sizeof(ancestor)))};
    l.at = l.counts + ranks;
    l.their_counts = l.at + ranks;
    l.their_at = l.their_counts + ranks;
    for (size_t at = 0; fsm_ranks_sum(count - at) > 0;) {
        uint32_t some = count - at < ROUND ? (uint32_t)(count - at) : ROUND;
        if (!look_up_round(self, stop, &l, members + at, some))
            MPI_Abort(MPI_COMM_WORLD, 1);
        at += some;
    }
    free(l.counts);
    free(l.order);
    free(l.requested);
    free(l.found);
    free(l.theirs);
    free(l.answers);
}

/* --- dropping some -------------------------------------------------------------------------------------------- */

static bool is_seen(const fsm_sight *sight)
{
    return sight->count > 0 && sight->at.state != FSM_NO_STATE;
}

/* Makes what refers to a stop refer to the one before it: the members of the next kept stop, or of the layer, and sights. */
static void drop(fsm_ranks *self, uint32_t number, fsm_member *after, size_t after_count)
{
    fsm_stop *dropped = &self->stops[number];
    uint32_t marks = self->model->mark_count, some = 0;
    fsm_member *seen = must(malloc((marks + 1u) * sizeof *seen));
    look_up(self, dropped, after, after_count);
    for (uint32_t i = 0; i < marks; i++)
        if (is_seen(&self->sights[i]) && self->sights[i].stop == number)
            seen[some++] = self->sights[i].at;
    look_up(self, dropped, seen, some);
    some = 0;
    for (uint32_t i = 0; i < marks; i++) {
        fsm_sight *sight = &self->sights[i];
        if (!is_seen(sight) || sight->stop != number)
            continue;
        sight->at = seen[some++];
        sight->stop = number - 1;
    }
    free(seen);
    self->stop_members -= dropped->count;
    free(dropped->members);
    dropped->members = NULL;
}

/* Drops all stops but those at multiples of the interval; that is linear in their number. */
static void drop_others(fsm_ranks *self, fsm_members *layer)
{
    fsm_member *after = fsm_members_of(layer);
    size_t after_count = layer->count;
    uint32_t kept = 1;
    for (uint32_t i = self->stop_count; i-- > 1;) {
        if (self->stops[i].depth % self->interval != 0) {
            drop(self, i, after, after_count);
        } else {
            after = self->stops[i].members;
            after_count = self->stops[i].count;
        }
    }
    uint32_t *numbers = must(calloc(self->stop_count, sizeof *numbers));
    for (uint32_t i = 1; i < self->stop_count; i++) {
        if (self->stops[i].members == NULL)
            continue;
        numbers[i] = kept;
        self->stops[kept++] = self->stops[i];
    }
    for (uint32_t i = 0; i < self->model->mark_count; i++)
        if (is_seen(&self->sights[i]))
            self->sights[i].stop = numbers[self->sights[i].stop];
    free(numbers);
    self->stop_count = kept;
}

/* Twice as far apart, while they take more than a byte for each state. */
bool fsm_stops_thin_out(fsm_ranks *self, fsm_members *layer)
{
    for (;;) {
        uint64_t members = fsm_ranks_sum(self->stop_members);
        if (members <= FSM_FREE_MEMBERS || members * sizeof(fsm_member) <= self->all_states || self->stop_count <= 2)
            return true;
        self->interval *= 2;
        drop_others(self, layer);
    }
}
