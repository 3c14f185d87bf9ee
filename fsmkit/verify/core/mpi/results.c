/* The whole search: rank 0 collects the results of all ranks, builds the paths from stop to
 * stop, and prints the result. */
#define _XOPEN_SOURCE 700
#include "mpi/ranks.h"

#include "search/path.h"

#include <inttypes.h>
#include <stdio.h>
#include <sys/resource.h>

/* Requests of rank 0 to another. */
typedef enum { OVER, SIGHT, STOP, LOCALS } question;

enum { ASKED = 2, ANSWERED = 3, MOST_LOCALS = 1024 };

/* The states of a path at the stops, that of the initial one first, and how it ends. */
typedef struct {
    fsm_state *states, end;
    uint32_t count, start, step; /* start: ordinal of the initial step */
    bool known;
} chain;

/* --- requests
 * -------------------------------------------------------------------------------------------- */

static void write_member(const fsm_ranks *self, const fsm_member *member, fsm_wire *wire)
{
    bool is_state = member->state != FSM_NO_STATE;
    fsm_wire_number(wire, member->place);
    fsm_wire_number(wire, member->rank);
    fsm_wire_number(wire, is_state);
    if (is_state)
        fsm_write_state(self->composition, member->state, wire);
}

/* Mark numbers beyond the last one mean the target. */
static const fsm_sight *sight_of(const fsm_ranks *self, uint32_t mark)
{
    return mark < self->model->mark_count ? &self->sights[mark] : &self->found;
}

static void answer(const fsm_ranks *self, const uint32_t *requested, fsm_wire *wire)
{
    const fsm_composition *c = self->composition;
    if (requested[0] == SIGHT) {
        const fsm_sight *sight = sight_of(self, requested[1]);
        fsm_wire_number(wire, sight->stop);
        fsm_wire_number(wire, sight->step);
        write_member(self, &sight->at, wire);
    } else if (requested[0] == STOP) {
        write_member(self, &self->stops[requested[1]].members[requested[2]], wire);
    } else {
        uint32_t count = c->locals[requested[1]].count, last = count - requested[2] < MOST_LOCALS ? count : requested[2] + MOST_LOCALS;
        fsm_wire_number(wire, last - requested[2]);
        for (uint32_t i = requested[2]; i < last; i++)
            fsm_wire_bytes(wire, fsm_local(c, requested[1], i), c->locals[requested[1]].state_size);
    }
    if (wire->failed)
        MPI_Abort(MPI_COMM_WORLD, 1);
}

/* Answers until it is over. */
static void serve(const fsm_ranks *self)
{
    fsm_wire wire = {0};
    for (;;) {
        uint32_t requested[3];
        MPI_Recv(requested, 3, MPI_UINT32_T, 0, ASKED, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        if (requested[0] == OVER)
            break;
        wire.count = 0;
        answer(self, requested, &wire);
        MPI_Send(wire.bytes, (int)wire.count, MPI_BYTE, 0, ANSWERED, MPI_COMM_WORLD);
    }
    fsm_wire_free(&wire);
}

/* By rank 0. The reply stays in the wire until the next request. */
static fsm_unread ask(const fsm_ranks *self, uint32_t rank, question what, uint32_t a, uint32_t b, fsm_wire *wire)
{
    const uint32_t requested[3] = {(uint32_t)what, a, b};
    wire->count = 0;
    if (rank == 0) {
        answer(self, requested, wire);
        return (fsm_unread){wire->bytes, wire->bytes + wire->count, false};
    }
    MPI_Status status;
    int count;
    MPI_Send(requested, 3, MPI_UINT32_T, (int)rank, ASKED, MPI_COMM_WORLD);
    MPI_Probe((int)rank, ANSWERED, MPI_COMM_WORLD, &status);
    MPI_Get_count(&status, MPI_BYTE, &count);
    if (!fsm_wire_make_room(wire, (size_t)count))
        MPI_Abort(MPI_COMM_WORLD, 1);
    MPI_Recv(wire->bytes, count, MPI_BYTE, (int)rank, ANSWERED, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return (fsm_unread){wire->bytes, wire->bytes + count, false};
}

static void end_serving(const fsm_ranks *self)
{
    const uint32_t requested[3] = {OVER, 0, 0};
    for (uint32_t i = 1; i < self->ranks; i++)
        MPI_Send(requested, 3, MPI_UINT32_T, (int)i, ASKED, MPI_COMM_WORLD);
}

/* --- what rank 0 learns --------------------------------------------------------------------------------------- */

static fsm_member read_member(const fsm_ranks *self, fsm_unread *from)
{
    fsm_member member = {.place = fsm_read_small(from)};
    member.rank = (uint16_t)fsm_read_number(from);
    member.state = fsm_read_number(from) != 0 ? fsm_read_state(self->composition, from) : FSM_NO_STATE;
    return member;
}

static chain fetch_chain(const fsm_ranks *self, uint32_t rank, uint32_t mark)
{
    fsm_wire wire = {0};
    fsm_unread from = ask(self, rank, SIGHT, mark, 0, &wire);
    uint32_t stop = fsm_read_small(&from);
    chain found = {.step = fsm_read_small(&from), .known = true};
    fsm_member at = read_member(self, &from);
    found.end = at.state;
    found.start = at.place;
    if (at.state != FSM_NO_STATE) {
        found.count = stop + 1;
        found.states = malloc(found.count * sizeof *found.states);
        found.known = found.states != NULL;
        for (uint32_t i = found.count; found.known && i-- > 0;) {
            from = ask(self, at.rank, STOP, i, at.place, &wire);
            at = read_member(self, &from);
            found.states[i] = at.state;
            found.known = at.state != FSM_NO_STATE;
        }
        found.start = at.place;
    }
    fsm_wire_free(&wire);
    return found;
}

/* Rank 0 takes in the local states of all, and with them how much of queues and timers is used. */
static bool fetch_locals(const fsm_ranks *self)
{
    fsm_composition *c = self->composition;
    fsm_wire wire = {0};
    bool fine = true;
    for (uint32_t rank = 1; rank < self->ranks; rank++)
        for (uint32_t m = 0; m < c->system->machine_count; m++)
            for (uint32_t at = 0, count = MOST_LOCALS; fine && count == MOST_LOCALS; at += count) {
                fsm_unread from = ask(self, rank, LOCALS, m, at, &wire);
                count = fsm_read_small(&from);
                for (uint32_t i = 0; fine && i < count; i++)
                    fine = fsm_read_local(c, m, &from) != FSM_NONE;
            }
    fsm_wire_free(&wire);
    return fine;
}

/* Gathers the coverage and the microstep counts of all ranks in rank 0. */
static void join_coverage(const fsm_ranks *self)
{
    const fsm_composition *c = self->composition;
    for (uint32_t m = 0; m < c->system->machine_count; m++) {
        const fsm_machine_info *info = c->system->machines[m]->info;
        unsigned char *seen[2] = {c->states_seen[m], c->transitions_seen[m]};
        const int counts[2] = {(int)info->state_count, (int)info->transition_count};
        for (int i = 0; i < 2; i++)
            MPI_Reduce(self->rank == 0 ? MPI_IN_PLACE : seen[i], seen[i], counts[i], MPI_UNSIGNED_CHAR, MPI_MAX, 0, MPI_COMM_WORLD);
        uint32_t *most = &self->composition->bounds[m].microsteps;
        MPI_Reduce(self->rank == 0 ? MPI_IN_PLACE : most, most, 1, MPI_UINT32_T, MPI_MAX, 0, MPI_COMM_WORLD);
    }
}

/* For each mark: how often it was seen, and the rank with the shortest path to it; `ranks` if it
 * was not seen. */
typedef struct {
    uint64_t *counts, *nearest;
} sights;

static sights join_sights(const fsm_ranks *self)
{
    uint32_t marks = self->model->mark_count;
    sights all = {malloc((marks + 1) * sizeof(uint64_t)), malloc((marks + 1) * sizeof(uint64_t))};
    if (all.counts == NULL || all.nearest == NULL)
        MPI_Abort(MPI_COMM_WORLD, 1);
    for (uint32_t i = 0; i <= marks; i++) {
        const fsm_sight *sight = sight_of(self, i);
        uint64_t length = sight->at.state == FSM_NO_STATE ? 0 : (uint64_t)sight->depth + (sight->step != FSM_NONE) + 1;
        all.counts[i] = sight->count;
        all.nearest[i] = sight->count == 0 ? UINT64_MAX : length << 16 | self->rank;
    }
    MPI_Allreduce(MPI_IN_PLACE, all.counts, (int)marks + 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
    MPI_Allreduce(MPI_IN_PLACE, all.nearest, (int)marks + 1, MPI_UINT64_T, MPI_MIN, MPI_COMM_WORLD);
    return all;
}

static void free_sights(sights *self)
{
    free(self->counts);
    free(self->nearest);
}

/* Rank 0 fetches chains of the marks from one on, up to another; all others answer. NULL in these. */
static chain *fetch_chains(const fsm_ranks *self, const sights *all, uint32_t first, uint32_t last, bool *locals)
{
    if (self->rank != 0) {
        serve(self);
        return NULL;
    }
    chain *found = calloc((size_t)(last - first) + 1, sizeof *found);
    for (uint32_t i = first; found != NULL && i < last; i++)
        if (all->counts[i] > 0)
            found[i - first] = fetch_chain(self, (uint32_t)all->nearest[i] & UINT16_MAX, i);
    *locals = fetch_locals(self) && found != NULL;
    end_serving(self);
    return found;
}

/* --- printing --------------------------------------------------------------------------------------------------- */

/* A search that holds just what the path of a chain is built from (path.h). */
static bool borrow(fsm_search *search, const chain *from, fsm_checkpoint *stops, uint32_t *tags)
{
    for (uint32_t i = 0; i < from->count; i++) {
        tags[i] = i == 0 ? from->start : 0;
        stops[i] = (fsm_checkpoint){.count = 1, .states = &from->states[i], .tags = &tags[i]};
    }
    search->checkpoints = stops;
    search->checkpoint_count = from->count;
    return from->known;
}

static bool path_of(fsm_search *search, const chain *from, fsm_path *path)
{
    if (from->end == FSM_NO_STATE)
        return from->known && fsm_path_add(path, from->start);
    fsm_checkpoint *stops = malloc(from->count * sizeof *stops);
    uint32_t *tags = malloc(from->count * sizeof *tags);
    const fsm_found end = {from->end, 0, from->count - 1, 0};
    bool fine = stops != NULL && tags != NULL && borrow(search, from, stops, tags) && fsm_path_to(search, &end, path)
        && (from->step == FSM_NONE || fsm_path_add(path, from->step));
    search->checkpoints = NULL;
    search->checkpoint_count = 0;
    free(stops);
    free(tags);
    return fine;
}

static void print_steps(const fsm_path *path)
{
    printf("[");
    for (size_t i = 0; i < path->count; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", path->steps[i]);
    printf("]");
}

static void print_path(fsm_search *search, const chain *from)
{
    fsm_path path = {0};
    if (!path_of(search, from, &path))
        path.count = 0;
    print_steps(&path);
    free(path.steps);
}

static fsm_path_step around(void *context, const fsm_steps *steps, size_t step, fsm_state from)
{
    const fsm_state *start = context;
    (void)from;
    if (steps->items[step].kind != FSM_STEP_INTERNAL)
        return FSM_OFF_PATH;
    return steps->items[step].to == *start ? FSM_ARRIVES : FSM_GOES_ON;
}

static void print_livelock(fsm_search *search, const chain *cycle, bool known)
{
    printf(", \"livelock_known\": %s, \"livelock\": ", known ? "true" : "false");
    if (cycle == NULL) {
        printf("null");
        return;
    }
    fsm_path path = {0};
    fsm_state start = cycle->end;
    printf("{\"path\": ");
    print_path(search, cycle);
    printf(", \"cycle\": ");
    (void)fsm_path_from(search, cycle->end, around, &start, &path);
    print_steps(&path);
    printf("}");
    free(path.steps);
}

/* Requests to all ranks at the end. */
typedef struct {
    uint64_t states, expanded, transitions, sent_states, filtered, sent, bytes, resident; /* the largest size of each, added up */
    uint32_t depth;
    fsm_outcome outcome;
    char why[256];
} totals;

static totals add_up(fsm_ranks *self)
{
    const char *why = self->model->failure(self->model->self);
    totals all = {.depth = self->depth, .outcome = self->outcome};
    uint32_t speaker, own = why == NULL ? self->ranks : self->rank;
    MPI_Allreduce(&own, &speaker, 1, MPI_UINT32_T, MPI_MIN, MPI_COMM_WORLD);
    (void)snprintf(all.why, sizeof all.why, "%s", why == NULL ? "" : why);
    if (speaker < self->ranks)
        MPI_Bcast(all.why, (int)sizeof all.why, MPI_CHAR, (int)speaker, MPI_COMM_WORLD);
    struct rusage used;
    (void)getrusage(RUSAGE_SELF, &used);
    all.resident = fsm_ranks_sum((uint64_t)used.ru_maxrss * 1024);
    all.states = fsm_ranks_sum(self->passed.count);
    all.expanded = fsm_ranks_sum(self->expanded);
    all.transitions = fsm_ranks_sum(self->transitions);
    all.sent_states = fsm_ranks_sum(self->sent_states);
    all.filtered = fsm_ranks_sum(self->filtered);
    all.sent = fsm_ranks_sum(self->exchange.sent);
    all.bytes = fsm_ranks_sum(fsm_ranks_bytes(self));
    return all;
}

static void print_result(const fsm_ranks *self, const totals *all, const sights *seen, const chain *chains,
                         const chain *cycle, bool livelock_known, double seconds)
{
    fsm_search search;
    if (!fsm_search_init(&search, self->model, self->options.memory))
        MPI_Abort(MPI_COMM_WORLD, FSM_NO_MEMORY);
    search.sleepless = self->options.sleepless;
    search.context = self->options.pace;
    search.seeks_on = fsm_seek_on;
    printf("{\"result\": {\"outcome\": \"%s\", \"why\": \"%s\", \"states\": %" PRIu64 ", \"expanded\": %" PRIu64
           ", \"transitions\": %" PRIu64 ", \"depth\": %" PRIu32 ", \"bytes\": %" PRIu64 ", \"ranks\": {\"count\": %" PRIu32
           ", \"forwarded\": %" PRIu64 ", \"filtered\": %" PRIu64 ", \"sent\": %" PRIu64 ", \"resident\": %" PRIu64 ", \"exploring\": %.3f}, ",
           fsm_outcome_name(all->outcome), all->why, all->states, all->expanded, all->transitions, all->depth, all->bytes,
           self->ranks, all->sent_states, all->filtered, all->sent, all->resident, seconds);
    printf("\"marks\": [");
    bool first = true;
    for (uint32_t i = 0; i < self->model->mark_count; i++) {
        if (seen->counts[i] == 0)
            continue;
        printf("%s{\"mark\": %" PRIu32 ", \"count\": %" PRIu64 ", \"path\": ", first ? "" : ", ", i, seen->counts[i]);
        print_path(&search, &chains[i]);
        printf("}");
        first = false;
    }
    printf("]");
    print_livelock(&search, cycle, livelock_known);
    printf(", \"traps_known\": false, \"traps\": [], \"temporal\": []");
    fsm_print_machines(self->composition, all->outcome);
    printf(", \"seconds\": %.3f}}\n", fsm_seconds() - self->options.pace->started);
    fsm_search_free(&search);
}

/* --- the whole --------------------------------------------------------------------------------------------------- */

static bool open_sets(fsm_ranks *self)
{
    bool fine = fsm_set_init(&self->passed, self->options.memory);
    for (int i = 0; i < 2; i++)
        fine = fsm_region_reserve(&self->layers[i].region, self->options.memory) && fine;
    for (size_t i = 0; i < FSM_LATELY; i++)
        self->lately[i] = FSM_NO_STATE;
    return fine || fsm_ranks_stop(self, FSM_OUT_OF_MEMORY);
}

static void free_chains(chain *chains, uint32_t count)
{
    for (uint32_t i = 0; chains != NULL && i < count; i++)
        free(chains[i].states);
    free(chains);
}

/* After a cycle was found, searches again up to a state on it, for the shortest path to it. */
static chain *fetch_cycle(fsm_ranks *self)
{
    bool locals;
    uint32_t marks = self->model->mark_count;
    fsm_ranks_forget(self);
    (void)open_sets(self);
    fsm_ranks_run(self, true);
    sights all = join_sights(self);
    chain *found = all.counts[marks] == 0 ? NULL : fetch_chains(self, &all, marks, marks + 1, &locals);
    free_sights(&all);
    return found;
}

static void explore(fsm_ranks *self)
{
    uint32_t depth, marks = self->model->mark_count;
    bool opened = open_sets(self) && fsm_saved_open(self, &depth);
    double begin = fsm_seconds();
    if (fsm_ranks_agree(self) == FSM_COMPLETE && opened)
        fsm_ranks_run(self, depth == FSM_NONE);
    double seconds = fsm_seconds() - begin;
    totals all = add_up(self);
    bool cyclic = false, asks = self->options.livelock && all.outcome == FSM_COMPLETE;
    bool may_be = fsm_ranks_sum(self->maybe_cyclic) > 0, locals = true;
    bool known = asks && (!may_be || fsm_ranks_find_livelock(self, &cyclic));
    fsm_saved_close(self, all.outcome == FSM_COMPLETE || all.outcome == FSM_DECIDED);
    join_coverage(self);
    sights seen = join_sights(self);
    chain *chains = fetch_chains(self, &seen, 0, marks, &locals), *cycle = cyclic ? fetch_cycle(self) : NULL;
    fsm_ranks_forget(self);
    if (!locals && all.outcome == FSM_COMPLETE)
        all.outcome = FSM_OUT_OF_MEMORY;
    if (self->rank == 0)
        print_result(self, &all, &seen, chains, cycle, known, seconds);
    free_chains(chains, marks);
    free_chains(cycle, 1);
    free_sights(&seen);
}

int fsm_ranks_explore(const fsm_ranks_options *options)
{
    MPI_Init(NULL, NULL);
    fsm_ranks self = {.options = *options, .composition = options->composition, .model = options->model, .interval = 1,
                      .target = FSM_NO_STATE};
    self.sights = calloc(options->model->mark_count + 1u, sizeof *self.sights);
    self.lately = malloc(FSM_LATELY * sizeof *self.lately);
    bool fine = fsm_exchange_init(&self.exchange) && self.sights != NULL && self.lately != NULL;
    self.rank = self.exchange.rank;
    self.ranks = self.exchange.ranks;
    self.options.pace->progress = self.options.pace->progress && self.rank == 0;
    if (!fine || !fsm_dictionary_init(&self.words, self.composition, self.ranks, options->memory))
        MPI_Abort(MPI_COMM_WORLD, FSM_NO_MEMORY);
    explore(&self);
    fsm_dictionary_free(&self.words);
    fsm_exchange_free(&self.exchange);
    free(self.sights);
    free(self.lately);
    free(self.steps.items);
    MPI_Finalize();
    return 0;
}
