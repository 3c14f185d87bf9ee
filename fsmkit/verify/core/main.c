/* main.c: the explorer as a program. It prints one JSON document a line: progress, then a result;
 * or, with --replay, the steps of one path as the machines perform them.
 *
 *   explore [--memory BYTES] [--timeout SECONDS] [--progress] [--livelock] [--traps] [--list]
 *           [--until MARK,MARK,...] [--watch BEGIN,END,MOST]
 *   explore --replay ORDINAL,ORDINAL,... */
#include "cycles.h"
#include "report.h"
#include "search.h"
#include "system.h"
#include "timed_main.h"

#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>


static volatile sig_atomic_t interrupted;

static void interrupt(int signal_number)
{
    (void)signal_number;
    interrupted = 1;
}

typedef struct {
    size_t memory;
    double timeout; /* seconds; 0: none */
    bool progress, livelock, traps, list;
    const char *until; /* marks to wait for, separated by commas; NULL: explore everything */
    time_t started, last_shown;
} options;

static bool keep_on(fsm_search *search)
{
    options *o = search->context;
    time_t now = time(NULL);
    if (interrupted)
        search->outcome = FSM_INTERRUPTED;
    else if (o->timeout > 0 && difftime(now, o->started) >= o->timeout)
        search->outcome = FSM_OUT_OF_TIME;
    if (o->progress && now != o->last_shown) {
        o->last_shown = now;
        printf("{\"progress\": {\"states\": %" PRIu32 ", \"expanded\": %" PRIu32 ", \"transitions\": %" PRIu64
               ", \"depth\": %" PRIu32 ", \"bytes\": %zu}}\n",
               search->passed.count, search->next, search->transitions, search->depth,
               fsm_search_bytes(search));
        (void)fflush(stdout);
    }
    return search->outcome == FSM_COMPLETE;
}

/* Prints the path to a state and one more step, unless that is FSM_NONE. */
static void print_path(const fsm_search *search, uint32_t state, uint32_t step)
{
    uint32_t length = fsm_search_path(search, state, NULL);
    uint32_t *path = malloc(((size_t)length + 1) * sizeof *path);
    if (path == NULL) {
        printf("[]");
        return;
    }
    (void)fsm_search_path(search, state, path);
    if (step != FSM_NONE)
        path[length++] = step;
    printf("[");
    for (uint32_t i = 0; i < length; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", path[i]);
    printf("]");
    free(path);
}

static void print_marks(const fsm_search *search)
{
    bool first = true;
    printf("\"marks\": [");
    for (uint32_t mark = 0; mark < search->model->mark_count; mark++) {
        fsm_witness witness = search->witnesses[mark];
        if (witness.count == 0)
            continue;
        printf("%s{\"mark\": %" PRIu32 ", \"count\": %" PRIu64 ", \"path\": ", first ? "" : ", ", mark,
               witness.count);
        print_path(search, witness.state, witness.step);
        printf("}");
        first = false;
    }
    printf("]");
}

static void print_livelock(const fsm_search *search, const fsm_cycle *cycle, bool known)
{
    printf(", \"livelock_known\": %s, \"livelock\": ", known ? "true" : "false");
    if (cycle->state == FSM_NONE) {
        printf("null");
        return;
    }
    printf("{\"path\": ");
    print_path(search, cycle->state, FSM_NONE);
    printf(", \"cycle\": [");
    for (uint32_t i = 0; i < cycle->length; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", cycle->steps[i]);
    printf("]}");
}

enum { MOST_TRAPS = 64 };

typedef struct {
    const fsm_search *search;
    uint32_t states[MOST_TRAPS], shown[MOST_TRAPS], count;
} traps;

/* Keeps the oldest trap of each configuration. */
static void note_trap(void *context, uint32_t state)
{
    traps *self = context;
    const fsm_model *model = self->search->model;
    uint32_t shown = model->configuration(model->self, fsm_store_at(&self->search->passed, state));
    for (uint32_t i = 0; i < self->count; i++)
        if (self->shown[i] == shown) {
            self->states[i] = state < self->states[i] ? state : self->states[i];
            return;
        }
    if (self->count < MOST_TRAPS) {
        self->states[self->count] = state;
        self->shown[self->count++] = shown;
    }
}

static void print_traps(const traps *found, bool known)
{
    printf(", \"traps_known\": %s, \"traps\": [", known ? "true" : "false");
    for (uint32_t i = 0; i < found->count; i++) {
        printf("%s", i == 0 ? "" : ", ");
        print_path(found->search, found->states[i], FSM_NONE);
    }
    printf("]");
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

static int explore(fsm_composition *composition, options *o)
{
    fsm_search search;
    if (!fsm_search_init(&search, fsm_composition_model(composition), o->memory))
        return 2;
    search.keep_on = keep_on;
    search.context = o;
    bool *awaited = calloc(search.model->mark_count + 1u, sizeof *awaited);
    if (awaited == NULL)
        return 2;
    if (o->until != NULL) {
        await_marks(&search, awaited, o->until);
        search.awaited = awaited;
    }
    clock_t begin = clock();
    fsm_search_run(&search);
    /* Both tell progress, so they come before the first word of the result. */
    fsm_cycle cycle = {.state = FSM_NONE};
    traps trapped = {.search = &search};
    bool complete = search.outcome == FSM_COMPLETE;
    bool livelock_known = o->livelock && complete && fsm_find_livelock(&search, &cycle);
    bool traps_known = o->traps && complete && fsm_find_traps(&search, note_trap, &trapped);
    const char *why = search.model->failure(search.model->self);
    printf("{\"result\": {\"outcome\": \"%s\", \"why\": \"%s\", \"states\": %" PRIu32 ", \"expanded\": %" PRIu32
           ", \"transitions\": %" PRIu64 ", \"depth\": %" PRIu32 ", \"bytes\": %zu, ",
           fsm_outcome_name(search.outcome), why == NULL ? "" : why, search.passed.count, search.next,
           search.transitions, search.depth, fsm_search_bytes(&search));
    print_marks(&search);
    print_livelock(&search, &cycle, livelock_known);
    print_traps(&trapped, traps_known);
    fsm_print_machines(composition);
    printf(", \"seconds\": %.3f}}\n", (double)(clock() - begin) / CLOCKS_PER_SEC);
    free(cycle.steps);
    free(awaited);
    fsm_search_free(&search);
    return 0;
}

/* --- replay ----------------------------------------------------------------------------------- */

typedef struct {
    fsm_composition *composition;
    uint32_t wanted, at;
    fsm_description what[FSM_MOST_MACHINES];
    uint32_t choices[FSM_MOST_MACHINES][FSM_MOST_CHOICES];
    uint32_t state[FSM_MOST_MACHINES];
    bool found;
} replay;

static bool pick(void *context, const fsm_step *step)
{
    replay *self = context;
    if (self->at++ != self->wanted)
        return true;
    uint32_t machines = fsm_the_system.machine_count;
    memcpy(self->state, step->state, machines * sizeof *self->state);
    for (uint32_t i = 0; i < machines; i++) {
        self->what[i] = fsm_describe(self->composition, i);
        for (uint32_t c = 0; c < self->what[i].choice_count; c++)
            self->choices[i][c] = self->what[i].choices[c];
        self->what[i].choices = self->choices[i];
    }
    self->found = true;
    return false;
}

static bool run_described(fsm_composition *composition, fsm_description what)
{
    const fsm_machine *m = fsm_the_system.machines[what.machine];
    printf("{\"step\": {\"action\": \"%s\", \"machine\": %" PRIu32 ", \"argument\": %" PRIu32 ", \"choices\": [",
           fsm_action_name(what.action), what.machine, what.argument);
    for (uint32_t i = 0; i < what.choice_count; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", what.choices[i]);
    printf("]}}\n");
    if (what.action == FSM_DO_ELAPSE)
        return true;
    void *after = malloc(m->size);
    if (after == NULL)
        return false;
    fsm_run_again(composition, what, after);
    m->dump(after);
    free(after);
    return true;
}

static bool replay_step(replay *self, uint32_t ordinal, bool first)
{
    const fsm_model *model = fsm_composition_model(self->composition);
    uint32_t before[FSM_MOST_MACHINES] = {0};
    memcpy(before, self->state, model->state_size);
    self->wanted = ordinal;
    self->at = 0;
    self->found = false;
    (void)(first ? model->initial(model->self, pick, self) : model->successors(model->self, before, pick, self));
    if (!self->found)
        return false;
    if (!first)
        return run_described(self->composition, self->what[0]);
    for (uint32_t i = 0; i < fsm_the_system.machine_count; i++)
        if (!run_described(self->composition, self->what[i]))
            return false;
    return true;
}

static int replay_path(fsm_composition *composition, const char *path)
{
    replay self = {.composition = composition};
    bool first = true;
    while (*path != '\0') {
        char *end;
        unsigned long ordinal = strtoul(path, &end, 10);
        if (end == path || !replay_step(&self, (uint32_t)ordinal, first)) {
            (void)fprintf(stderr, "there is no such step: %s\n", path);
            return 2;
        }
        first = false;
        path = *end == ',' ? end + 1 : end;
    }
    return 0;
}

static bool is_interrupted(void)
{
    return interrupted != 0;
}

static int run_timed(fsm_composition *composition, const options *o, const char *path, const char *watch)
{
    fsm_timed_options timed = {o->memory, o->timeout, o->progress, o->livelock, o->traps, o->list, o->until, watch,
                               is_interrupted};
    return path != NULL ? fsm_timed_replay(composition, path) : fsm_timed_explore(composition, &timed);
}

int main(int argc, char **argv)
{
    options o = {.memory = (size_t)1 << 32, .started = time(NULL)};
    const char *path = NULL, *watch = NULL;
    for (int i = 1; i < argc; i++) {
        bool more = i + 1 < argc;
        if (strcmp(argv[i], "--progress") == 0)
            o.progress = true;
        else if (strcmp(argv[i], "--livelock") == 0)
            o.livelock = true;
        else if (strcmp(argv[i], "--list") == 0)
            o.list = true;
        else if (strcmp(argv[i], "--traps") == 0)
            o.traps = true;
        else if (more && strcmp(argv[i], "--memory") == 0)
            o.memory = (size_t)strtoull(argv[++i], NULL, 10);
        else if (more && strcmp(argv[i], "--timeout") == 0)
            o.timeout = strtod(argv[++i], NULL);
        else if (more && strcmp(argv[i], "--until") == 0)
            o.until = argv[++i];
        else if (more && strcmp(argv[i], "--watch") == 0)
            watch = argv[++i];
        else if (more && strcmp(argv[i], "--replay") == 0)
            path = argv[++i];
        else
            return 2;
    }
    (void)signal(SIGINT, interrupt);
    fsm_composition *composition = fsm_compose(&fsm_the_system, o.memory);
    if (composition == NULL)
        return 2;
    int code = fsm_the_system.zones ? run_timed(composition, &o, path, watch)
        : path != NULL             ? replay_path(composition, path)
                                   : explore(composition, &o);
    fsm_composition_free(composition);
    return code;
}
