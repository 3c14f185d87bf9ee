/* main.c: the explorer as a program. It prints a result, one JSON document, on the standard output, and before it now and
 * then how far it is, one a line, on the standard error; or, with --replay, the steps of one path as the machines perform them.
 *
 *   explore [--memory BYTES] [--cores N] [--share LARGE,CHUNK] [--timeout SECONDS] [--paths SECONDS] [--progress] [--livelock] [--traps] [--list] [--graph]
 *           [--until MARK,MARK,...] [--until-any MARK,MARK,...] [--watch BEGIN,END,MOST] [--storage exact|hash-compact|bitstate[,BYTES] [--seed N]]
 *           [--ranks [--saved FOLDER --identity TEXT --save-every LAYERS]]
 *           [--sleepless] [--recoverable MARK] [--leads-to MARK,MARK] [--within MARK,MARK,UNITS] [--timeless] [--cover equal|subset|simulated|hull[,STATES]] [--locals MACHINE,MACHINE,...]
 *   explore --replay ORDINAL,ORDINAL,... */
#include "liveness/cycles.h"
#include "liveness/delays.h"
#include "liveness/liveness.h"
#include "system/graph.h"
#include "system/saved_locals.h"
#include "search/path.h"
#include "report.h"
#include "symbolic/rival.h"
#include "slots/slots.h"
#include "store/room.h"
#include "system/system_model.h"
#include "paths/limits.h"
#include "zones/timed_main.h"
#ifdef FSM_MPI
#include "mpi/ranks.h"
#endif

#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static volatile sig_atomic_t interrupted;

static void interrupt(int signal_number)
{
    (void)signal_number;
    interrupted = 1;
}

static bool is_interrupted(void)
{
    return interrupted != 0;
}

enum { MOST_TEMPORAL = 256, MANY = 2000000 };

typedef struct {
    size_t memory;
    uint32_t cores;
    const char *storage; /* NULL: exact */
    uint64_t seed;       /* of the hashes of a storage that is not exact */
    const char *cover; /* of dense time, see fsm_timed_options; NULL: all */
    const char *share; /* LARGE,CHUNK; see fsm_search; NULL: as it is */
    fsm_pace pace;
    bool livelock, traps, list, graph;
    bool sleepless;    /* no step sleeps (sleep_sets.h) */
    bool timeless;     /* nothing ever takes time */
    const char *until; /* marks to wait for, separated by commas; NULL: explore everything */
    bool symbolic;     /* states are kept as a diagram */
    bool takes_turns;  /* with a diagram, once there are `many` states */
    uint64_t many;     /* UINT64_MAX: as is best */
    fsm_diagram_options diagram; /* further options then */
    bool any;          /* the first of the marks of `until` ends it */
    const char *temporal[2 * MOST_TEMPORAL]; /* options and what follows them, in pairs */
    uint32_t temporal_count;
    bool ranks;        /* it is one of several processes; the next three are for them (mpi/ranks.h) */
    const char *folder, *identity;
    uint32_t save_every;
} options;

/* Prints the path to a state and one more step, unless that is FSM_NONE; nothing if memory ran out. */
static void print_path(const fsm_search *search, const fsm_found *found, uint32_t step)
{
    fsm_path path = {0};
    bool fine = found->state == FSM_NO_STATE || fsm_path_to(search, found, &path);
    fine = fine && (step == FSM_NONE || fsm_path_add(&path, step));
    printf("[");
    for (size_t i = 0; fine && i < path.count; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", path.steps[i]);
    printf("]");
    free(path.steps);
}

static void print_marks(const fsm_search *search)
{
    bool first = true;
    printf("\"marks\": [");
    for (uint32_t mark = 0; mark < search->model->mark_count; mark++) {
        const fsm_witness *witness = &search->witnesses[mark];
        if (witness->count == 0)
            continue;
        printf("%s{\"mark\": %" PRIu32 ", \"count\": %" PRIu64 ", \"path\": ", first ? "" : ", ", mark,
               witness->count);
        print_path(search, &witness->at, witness->step);
        printf("}");
        first = false;
    }
    printf("]");
}

/* --- places of the graph, to be located ------------------------------------------------------- */

enum { MOST_TRAPS = 64 };

/* Groups of traps, one for each configuration; then that of the livelock. */
typedef struct {
    const fsm_search *search;
    fsm_target *items;
    size_t count, room;
    uint32_t shown[MOST_TRAPS], traps;
    bool failed;
} requested;

static void want(requested *self, fsm_state state, uint32_t group)
{
    if (FSM_HAS_ROOM(self->items, self->count, self->room, 64))
        self->items[self->count++] = (fsm_target){state, group};
    else
        self->failed = true;
}

static void want_trap(void *context, const fsm_state *states, size_t count)
{
    requested *self = context;
    const fsm_model *model = self->search->model;
    uint32_t shown = model->configuration(model->self, states[0]), trap = 0;
    while (trap < self->traps && self->shown[trap] != shown)
        trap++;
    if (trap == MOST_TRAPS)
        return;
    if (trap == self->traps)
        self->shown[self->traps++] = shown;
    for (size_t i = 0; i < count; i++)
        want(self, states[i], trap);
}

static int by_state(const void *a, const void *b)
{
    fsm_state x = ((const fsm_target *)a)->state, y = ((const fsm_target *)b)->state;
    return (x > y) - (x < y);
}

static void print_livelock(const fsm_search *search, const fsm_cycle *cycle, const fsm_found *found, bool known)
{
    printf(", \"livelock_known\": %s, \"livelock\": ", known ? "true" : "false");
    if (cycle->state == FSM_NO_STATE) {
        printf("null");
        return;
    }
    printf("{\"path\": ");
    print_path(search, found, FSM_NONE);
    printf(", \"cycle\": [");
    for (uint32_t i = 0; i < cycle->length; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", cycle->steps[i]);
    printf("]}");
}

static void print_traps(const fsm_search *search, const fsm_found *found, uint32_t count, bool known)
{
    printf(", \"traps_known\": %s, \"traps\": [", known ? "true" : "false");
    for (uint32_t i = 0; i < count; i++) {
        printf("%s", i == 0 ? "" : ", ");
        print_path(search, &found[i], FSM_NONE);
    }
    printf("]");
}

/* --- temporal properties ---------------------------------------------------------------------- */

static void print_numbers(const char *name, const fsm_path *path)
{
    printf("\"%s\": [", name);
    for (size_t i = 0; i < path->count; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", path->steps[i]);
    printf("]");
}

typedef struct {
    bool known, started;
    uint32_t greatest;
    fsm_lasso lasso;
} temporal;

static bool has_whole_graph(const fsm_search *search)
{
    return search->outcome == FSM_COMPLETE && search->passed.lossy == NULL;
}

static temporal decide(fsm_search *search, const options *o, const char *option, const char *argument)
{
    temporal found = {.known = false};
    char *end;
    uint32_t first = (uint32_t)strtoul(argument, &end, 10);
    uint32_t second = *end == ',' ? (uint32_t)strtoul(end + 1, &end, 10) : 0;
    uint32_t third = *end == ',' ? (uint32_t)strtoul(end + 1, &end, 10) : 0;
    if (!has_whole_graph(search))
        return found;
    if (strcmp(option, "--within") == 0) {
        fsm_delay delay;
        found.known = fsm_find_delay(search, first, second, third, &delay);
        found.started = delay.started;
        found.greatest = delay.greatest;
        found.lasso = delay.late;
        return found;
    }
    found.known = strcmp(option, "--recoverable") == 0
        ? fsm_find_unrecoverable(search, first, &found.lasso)
        : fsm_find_violations(search, first, second, o->timeless, &found.lasso);
    return found;
}

static temporal *decide_all(fsm_search *search, const options *o)
{
    temporal *found = calloc(o->temporal_count + 1u, sizeof *found);
    for (uint32_t i = 0; found != NULL && i < o->temporal_count; i++)
        found[i] = decide(search, o, o->temporal[2 * i], o->temporal[2 * i + 1]);
    return found;
}

/* In the order of the options. */
static void print_temporal(temporal *found, uint32_t count)
{
    printf(", \"temporal\": [");
    for (uint32_t i = 0; found != NULL && i < count; i++) {
        printf("%s{\"known\": %s, \"violated\": %s, ", i == 0 ? "" : ", ", found[i].known ? "true" : "false",
               found[i].lasso.violated ? "true" : "false");
        if (found[i].started && found[i].greatest != FSM_FOREVER)
            printf("\"greatest\": %" PRIu32 ", ", found[i].greatest);
        print_numbers("path", &found[i].lasso.path);
        printf(", ");
        print_numbers("cycle", &found[i].lasso.cycle);
        printf("}");
        fsm_lasso_free(&found[i].lasso);
    }
    printf("]");
    free(found);
}

static void await_marks(fsm_search *search, bool *awaited, const char *until)
{
    while (*until != '\0') {
        char *end;
        unsigned long mark = strtoul(until, &end, 10);
        if (end == until || mark >= search->model->mark_count)
            return;
        search->awaited_count += !awaited[mark];
        awaited[mark] = true;
        until = *end == ',' ? end + 1 : end;
    }
}

static void read_share(fsm_search *search, const char *share)
{
    char *end;
    unsigned long large = strtoul(share, &end, 10), chunk = *end == ',' ? strtoul(end + 1, &end, 10) : 0;
    if (large > 0 && chunk > 0) {
        search->large = (uint32_t)large;
        search->chunk = (uint32_t)chunk;
    }
}

#ifdef FSM_MPI
static int explore_in_ranks(fsm_composition *composition, options *o)
{
    fsm_search awaits = {.model = fsm_composition_model(composition)};
    bool *awaited = calloc(awaits.model->mark_count + 1u, sizeof *awaited);
    if (awaited == NULL)
        return FSM_NO_MEMORY;
    if (o->until != NULL)
        await_marks(&awaits, awaited, o->until);
    const fsm_ranks_options given = {
        .composition = composition, .model = awaits.model, .pace = &o->pace, .memory = o->memory, .sleepless = o->sleepless,
        .livelock = o->livelock, .awaited = o->until == NULL ? NULL : awaited,
        .awaited_count = o->any && awaits.awaited_count > 0 ? 1 : awaits.awaited_count, .folder = o->folder,
        .identity = o->identity, .save_every = o->save_every};
    int code = fsm_ranks_explore(&given);
    free(awaited);
    return code;
}
#else
static int explore_in_ranks(fsm_composition *composition, options *o)
{
    (void)composition;
    (void)o;
    return 2; /* it was not compiled for that */
}
#endif

static const char *const storages[] = {"exact", "hash-compact", "bitstate"};

/* Most of the memory is for the table; the rest is for the model and two layers. */
static bool choose_storage(fsm_search *search, const options *o)
{
    const char *comma = strchr(o->storage, ',');
    size_t length = comma == NULL ? strlen(o->storage) : (size_t)(comma - o->storage);
    size_t bytes = comma == NULL ? o->memory / 4 * 3 : (size_t)strtoull(comma + 1, NULL, 10);
    for (int i = FSM_EXACT; i <= FSM_BITSTATE; i++)
        if (strlen(storages[i]) == length && strncmp(storages[i], o->storage, length) == 0)
            return i == FSM_EXACT || fsm_search_make_lossy(search, (fsm_storage)i, bytes);
    return false;
}

/* For a lossy table: how full each part is, and how many bits it has, or lines (hash_compaction.h). */
static void print_table(const fsm_hash_compaction *lossy)
{
    if (lossy == NULL)
        return;
    printf("\"table\": {\"storage\": \"%s\", \"filled\": [", storages[lossy->storage]);
    for (uint32_t part = 0; part < FSM_HASH_COMPACTION_PARTS; part++)
        printf("%s%" PRIu64, part == 0 ? "" : ", ", fsm_hash_compaction_filled(lossy, part));
    printf("], \"room\": %" PRIu64 ", \"bytes\": %zu}, ",
           lossy->lines * (lossy->storage == FSM_BITSTATE ? FSM_LINE_BITS : 1), fsm_hash_compaction_bytes(lossy));
}

static int explore(fsm_composition *composition, options *o)
{
    fsm_search search;
    if (!fsm_search_init(&search, fsm_composition_model(composition), o->memory))
        return FSM_NO_MEMORY;
    search.cores = o->cores;
    search.sleepless = o->sleepless || o->graph; /* the graph has what every message does wherever it comes (sleep_sets.h) */
    if (o->share != NULL)
        read_share(&search, o->share);
    if (o->storage != NULL && !choose_storage(&search, o))
        return FSM_NO_MEMORY;
    if (search.passed.lossy != NULL)
        search.passed.lossy->seed = o->seed;
    search.keep_on = fsm_keep_pace;
    search.seeks_on = fsm_seek_on;
    search.context = &o->pace;
    bool *awaited = calloc(search.model->mark_count + 1u, sizeof *awaited);
    if (awaited == NULL)
        return FSM_NO_MEMORY;
    if (o->until != NULL) {
        await_marks(&search, awaited, o->until);
        search.awaited = awaited;
        search.awaited_count = o->any && search.awaited_count > 0 ? 1 : search.awaited_count;
    }
    double begin = fsm_seconds();
    fsm_rival *rival = o->takes_turns ? fsm_rival_join(&search, composition, &o->diagram, o->many) : NULL;
    fsm_search_run(&search);
    const uint64_t states = search.passed.count;
    const size_t bytes = fsm_search_bytes(&search);
    const bool is_dense = fsm_set_is_dense(&search.passed); /* before a rival needs the memory */
    const bool wins = rival != NULL && fsm_rival_wins(rival, begin);
    fsm_rival_free(rival);
    if (wins) {
        free(awaited);
        fsm_search_free(&search);
        return 0;
    }
    temporal *answers = decide_all(&search, o);
    fsm_cycle cycle = {.state = FSM_NO_STATE};
    requested found = {.search = &search};
    bool whole = has_whole_graph(&search);
    bool livelock_known = o->livelock && whole && fsm_find_livelock(&search, &cycle);
    bool traps_known = o->traps && whole && fsm_find_traps(&search, want_trap, &found) && !found.failed;
    const char *why = search.model->failure(search.model->self);
    printf("{\"result\": {\"outcome\": \"%s\", \"why\": \"%s\", \"states\": %" PRIu64 ", \"expanded\": %" PRIu64
           ", \"transitions\": %" PRIu64 ", \"left_out\": %" PRIu64 ", \"depth\": %" PRIu32 ", \"bytes\": %zu, \"dense\": %s, \"cores\": %" PRIu32 ", ",
           fsm_outcome_name(search.outcome), why == NULL ? "" : why, states, search.expanded,
           search.transitions, search.left_out, search.depth, bytes, is_dense ? "true" : "false",
           search.cores_used);
    print_table(search.passed.lossy);
    fsm_search_forget(&search); /* so that paths have room */
    print_marks(&search);
    fsm_found groups[MOST_TRAPS + 1] = {{.state = FSM_NO_STATE}};
    uint32_t group_count = found.traps;
    if (cycle.state != FSM_NO_STATE)
        want(&found, cycle.state, group_count++);
    if (found.count > 0) {
        qsort(found.items, found.count, sizeof *found.items, by_state);
        fsm_search_locate(&search, found.items, found.count, groups, group_count);
    }
    print_livelock(&search, &cycle, &groups[found.traps], livelock_known);
    print_traps(&search, groups, found.traps, traps_known);
    print_temporal(answers, o->temporal_count);
    fsm_print_machines(composition, search.outcome);
    if (o->graph)
        fsm_print_graph(composition);
    printf(", \"seconds\": %.3f}}\n", fsm_seconds() - begin);
    free(cycle.steps);
    free(found.items);
    free(awaited);
    fsm_search_free(&search);
    return 0;
}

/* --- replay ----------------------------------------------------------------------------------- */

static bool run_described(fsm_composition *composition, fsm_description what)
{
    const fsm_machine *m = fsm_the_system.machines[what.machine];
    printf("%c{\"step\": {\"action\": \"%s\", \"machine\": %" PRIu32 ", \"argument\": %" PRIu32 ", \"choices\": [",
           FSM_MARK, fsm_action_name(what.action), what.machine, what.argument);
    for (uint32_t i = 0; i < what.choice_count; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", what.choices[i]);
    printf("]}}\n");
    if (what.action == FSM_DO_ELAPSE)
        return true;
    void *after = malloc(m->info->size);
    if (after == NULL)
        return false;
    fsm_run_again(composition, what, after);
    fsm_dump(m, after);
    free(after);
    return true;
}

static bool replay_step(fsm_composition *composition, fsm_state *state, uint32_t ordinal)
{
    fsm_description what;
    return fsm_describe_step(composition, *state, ordinal, &what, state) && run_described(composition, what);
}

static bool replay_start(fsm_composition *composition, fsm_state *state, uint32_t ordinal)
{
    fsm_described_start *start = malloc(sizeof *start);
    bool found = start != NULL && fsm_describe_start(composition, ordinal, start, state);
    for (uint32_t i = 0; found && i < fsm_the_system.machine_count; i++)
        found = run_described(composition, start->what[i]);
    free(start);
    return found;
}

static int replay_path(fsm_composition *composition, const char *path)
{
    fsm_state state = FSM_NO_STATE;
    while (*path != '\0') {
        char *end;
        unsigned long ordinal = strtoul(path, &end, 10);
        bool fine = end != path
            && (state == FSM_NO_STATE ? replay_start(composition, &state, (uint32_t)ordinal)
                                      : replay_step(composition, &state, (uint32_t)ordinal));
        if (!fine) {
            (void)fprintf(stderr, "there is no such step: %s\n", path);
            return 2;
        }
        path = *end == ',' ? end + 1 : end;
    }
    return 0;
}

static int run_timed(fsm_composition *composition, options *o, const char *path, const char *watch)
{
    fsm_timed_options timed = {o->memory, &o->pace, o->livelock, o->traps, o->list, o->until, o->any, watch,
                               o->temporal, o->temporal_count, o->timeless, o->cover};
    return path != NULL ? fsm_timed_replay(composition, path) : fsm_timed_explore(composition, &timed);
}

int main(int argc, char **argv)
{
    options o = {.memory = (size_t)1 << 32, .cores = 1, .many = UINT64_MAX, .save_every = UINT32_MAX, .identity = "", .pace = {.interrupted = is_interrupted}};
    fsm_pace_start(&o.pace);
    const char *path = NULL, *watch = NULL;
    for (int i = 1; i < argc; i++) {
        bool more = i + 1 < argc;
        if (strcmp(argv[i], "--progress") == 0)
            o.pace.progress = true;
        else if (strcmp(argv[i], "--livelock") == 0)
            o.livelock = true;
        else if (strcmp(argv[i], "--sleepless") == 0)
            o.sleepless = true;
        else if (strcmp(argv[i], "--timeless") == 0)
            o.timeless = true;
        else if (more && o.temporal_count < MOST_TEMPORAL
                 && (strcmp(argv[i], "--recoverable") == 0 || strcmp(argv[i], "--leads-to") == 0
                     || strcmp(argv[i], "--within") == 0)) {
            o.temporal[2 * o.temporal_count] = argv[i];
            o.temporal[2 * o.temporal_count++ + 1] = argv[i + 1];
            i++;
        } else if (strcmp(argv[i], "--list") == 0)
            o.list = true;
        else if (strcmp(argv[i], "--graph") == 0)
            o.graph = true;
        else if (more && strcmp(argv[i], "--locals") == 0)
            fsm_show_locals(argv[++i]);
        else if (strcmp(argv[i], "--traps") == 0)
            o.traps = true;
        else if (more && strcmp(argv[i], "--memory") == 0)
            o.memory = (size_t)strtoull(argv[++i], NULL, 10);
        else if (more && strcmp(argv[i], "--cores") == 0)
            o.cores = (uint32_t)strtoul(argv[++i], NULL, 10);
        else if (more && strcmp(argv[i], "--storage") == 0)
            o.storage = argv[++i];
        else if (more && strcmp(argv[i], "--seed") == 0)
            o.seed = strtoull(argv[++i], NULL, 10);
        else if (more && strcmp(argv[i], "--cover") == 0)
            o.cover = argv[++i];
        else if (more && strcmp(argv[i], "--share") == 0)
            o.share = argv[++i];
        else if (more && strcmp(argv[i], "--timeout") == 0)
            o.pace.timeout = strtod(argv[++i], NULL);
        else if (more && strcmp(argv[i], "--paths") == 0)
            o.pace.paths = strtod(argv[++i], NULL);
        else if (more && (strcmp(argv[i], "--until") == 0 || strcmp(argv[i], "--until-any") == 0)) {
            o.any = strcmp(argv[i], "--until-any") == 0;
            o.until = argv[++i];
        } else if (more && strcmp(argv[i], "--watch") == 0)
            watch = argv[++i];
        else if (more && strcmp(argv[i], "--search") == 0)
            i++, o.symbolic = strcmp(argv[i], "symbolic") == 0, o.takes_turns = strcmp(argv[i], "auto") == 0;
        else if (more && strcmp(argv[i], "--many") == 0)
            o.many = strtoull(argv[++i], NULL, 10);
        else if (more && strcmp(argv[i], "--order") == 0)
            o.diagram.order = argv[++i];
        else if (more && strcmp(argv[i], "--ways") == 0)
            o.diagram.ways = argv[++i];
        else if (more && strcmp(argv[i], "--cache-bits") == 0)
            o.diagram.cache_bits = (uint32_t)strtoul(argv[++i], NULL, 10);
        else if (more && strcmp(argv[i], "--collect-every") == 0)
            o.diagram.collect_every = (uint32_t)strtoul(argv[++i], NULL, 10);
        else if (more && strcmp(argv[i], "--fail-at") == 0)
            o.diagram.fail_at = (size_t)strtoull(argv[++i], NULL, 10);
        else if (strcmp(argv[i], "--slots") == 0)
            o.diagram.slots = true;
        else if (strcmp(argv[i], "--ranks") == 0)
            o.ranks = true;
        else if (more && strcmp(argv[i], "--saved") == 0)
            o.folder = argv[++i];
        else if (more && strcmp(argv[i], "--identity") == 0)
            o.identity = argv[++i];
        else if (more && strcmp(argv[i], "--save-every") == 0)
            o.save_every = (uint32_t)strtoul(argv[++i], NULL, 10);
        else if (more && strcmp(argv[i], "--replay") == 0)
            path = argv[++i];
        else
            return 2;
    }
    (void)signal(SIGINT, interrupt);
    (void)signal(SIGTERM, interrupt);
    o.diagram.memory = o.memory;
    o.diagram.pace = &o.pace;
    o.diagram.livelock = o.livelock;
    o.diagram.traps = o.traps;
    if (o.many == UINT64_MAX)
        o.many = fsm_slots_are_many(&fsm_the_system) ? 0 : fsm_as_many(MANY);
    o.diagram.sleepless = o.sleepless;
    o.diagram.temporal = o.temporal;
    o.diagram.temporal_count = o.temporal_count;
    o.diagram.timeless = o.timeless;
    if (o.symbolic)
        return fsm_diagram_explore(&o.diagram);
    fsm_composition *composition = fsm_compose(&fsm_the_system, o.memory);
    if (composition == NULL)
        return FSM_NO_MEMORY;
    int code = fsm_the_system.zones ? run_timed(composition, &o, path, watch)
        : path != NULL             ? replay_path(composition, path)
        : o.ranks                  ? explore_in_ranks(composition, &o)
                                   : explore(composition, &o);
    fsm_composition_free(composition);
    return code;
}
