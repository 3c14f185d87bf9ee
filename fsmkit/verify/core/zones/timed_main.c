#include "zones/timed_main.h"

#include "report.h"
#include "zones/timed_graph.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool keep_on(fsm_timed *search)
{
    const fsm_progress progress = {search->tuples.count, search->transitions, search->depth, search->bytes};
    fsm_outcome why = fsm_pace_check(search->context, progress);
    if (why == FSM_COMPLETE && search->bytes > search->memory_limit)
        why = FSM_OUT_OF_MEMORY;
    if (why != FSM_COMPLETE)
        search->outcome = why;
    return search->outcome == FSM_COMPLETE;
}

/* Prints the path to a pair and one more step, unless that is FSM_NONE. */
static void print_path(const fsm_timed *search, uint32_t pair, uint32_t step)
{
    uint32_t length = fsm_timed_path(search, pair, NULL);
    uint32_t *path = malloc(((size_t)length + 1) * sizeof *path);
    if (path == NULL) {
        printf("[]");
        return;
    }
    (void)fsm_timed_path(search, pair, path);
    if (step != FSM_NONE)
        path[length++] = step;
    printf("[");
    for (uint32_t i = 0; i < length; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", path[i]);
    printf("]");
    free(path);
}

static void print_marks(const fsm_timed *search)
{
    bool first = true;
    printf("\"marks\": [");
    for (uint32_t mark = 0; mark < search->composition->model.mark_count; mark++) {
        fsm_timed_witness witness = search->witnesses[mark];
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

static void print_steps(const uint32_t *steps, uint32_t count)
{
    printf("[");
    for (uint32_t i = 0; i < count; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", steps[i]);
    printf("]");
}

static void print_livelock(const fsm_timed *search, const fsm_timed_cycle *cycle, bool known)
{
    printf(", \"livelock_known\": %s, \"livelock\": ", known ? "true" : "false");
    if (cycle->pair == FSM_NONE) {
        printf("null");
        return;
    }
    printf("{\"path\": ");
    print_path(search, cycle->pair, FSM_NONE);
    printf(", \"lead\": ");
    print_steps(cycle->path, cycle->lead);
    printf(", \"cycle\": ");
    print_steps(cycle->path + cycle->lead, cycle->length - cycle->lead);
    printf("}");
}

enum { MOST_TRAPS = 64 };

typedef struct {
    const fsm_timed *search;
    uint32_t pairs[MOST_TRAPS], shown[MOST_TRAPS], count;
} traps;

/* Keeps the oldest trap of each configuration; they come in the order of their age. */
static void note_trap(void *context, uint32_t pair)
{
    traps *self = context;
    uint32_t shown = fsm_flat_configuration(self->search->composition, fsm_timed_tuple(self->search, pair));
    for (uint32_t i = 0; i < self->count; i++)
        if (self->shown[i] == shown)
            return;
    if (self->count < MOST_TRAPS) {
        self->pairs[self->count] = pair;
        self->shown[self->count++] = shown;
    }
}

static void print_traps(const traps *found, bool known, bool doubt)
{
    printf(", \"traps_known\": %s, \"doubt\": \"%s\", \"traps\": [", known && !doubt ? "true" : "false",
           known && doubt ? "whether some states are left for ever depends on when events come" : "");
    for (uint32_t i = 0; i < found->count; i++) {
        printf("%s", i == 0 ? "" : ", ");
        print_path(found->search, found->pairs[i], FSM_NONE);
    }
    printf("]");
}

static void print_bound(const char *name, fsm_bound bound, int32_t sign, const fsm_timed *search)
{
    printf("\"%s\": ", name);
    int32_t units = sign * (bound >> 1), most = search->watch.most;
    bool reached = bound & 1, more = units > most || (sign < 0 && units == most && !reached);
    if (bound == FSM_UNBOUNDED || more)
        printf("null, ");
    else
        printf("[%" PRId64 ", %s], ", (int64_t)units * search->unit, reached ? "true" : "false");
}

/* Bounds in ticks, each with whether it is reached; null: no bound below the limit of the watch. */
static void print_watch(const fsm_timed *search)
{
    const fsm_watch *watch = &search->watch;
    if (!watch->present)
        return;
    printf(", \"watch\": {");
    print_bound("least", watch->least, -1, search);
    print_bound("greatest", watch->greatest, 1, search);
    print_bound("pending", watch->pending, 1, search);
    printf("\"stopped\": %s}", watch->stopped ? "true" : "false");
}

static bool await_marks(fsm_timed *search, const char *until, bool any)
{
    uint32_t count = search->composition->model.mark_count;
    if (until == NULL)
        return true;
    search->awaited = calloc(count + 1u, sizeof *search->awaited);
    if (search->awaited == NULL)
        return false;
    while (*until != '\0') {
        char *end;
        unsigned long mark = strtoul(until, &end, 10);
        if (end == until || mark >= count)
            break;
        search->awaited_count += !search->awaited[mark];
        search->awaited[mark] = true;
        until = *end == ',' ? end + 1 : end;
    }
    if (any && search->awaited_count > 0)
        search->awaited_count = 1;
    return true;
}

static bool read_watch(fsm_timed *search, const char *text)
{
    fsm_watch *watch = &search->watch;
    if (text == NULL)
        return true;
    watch->present = true;
    watch->pending = fsm_at_most(0);
    return sscanf(text, "%" SCNu32 ",%" SCNu32 ",%" SCNd32, &watch->begin, &watch->end, &watch->most) == 3
        && watch->most < FSM_LONGEST;
}

static void print_result(const fsm_timed *search)
{
    const char *why = search->failure != NULL ? search->failure
        : search->composition->failure != NULL ? search->composition->failure : "";
    printf("{\"result\": {\"outcome\": \"%s\", \"why\": \"%s\", \"states\": %" PRIu32 ", \"zones\": %" PRIu32
           ", \"transitions\": %" PRIu64 ", \"depth\": %" PRIu32 ", \"bytes\": %zu, ",
           fsm_outcome_name(search->outcome), why, search->tuples.count, search->kept,
           search->transitions, search->depth, fsm_timed_bytes(search));
    print_marks(search);
}

/* Prints what the machines show of each discrete part. */
static void list_parts(const fsm_timed *search)
{
    const fsm_system *system = search->composition->system;
    for (uint32_t part = 0; part < search->tuples.count; part++) {
        const uint32_t *tuple = fsm_store_at(&search->tuples, part);
        printf("%c{\"part\": %" PRIu32 "}\n", FSM_MARK, part);
        for (uint32_t i = 0; i < system->machine_count; i++)
            fsm_dump(search->composition->system->machines[i], fsm_local(search->composition, i, tuple[i]));
    }
    printf("%c{}\n", FSM_MARK);
}

int fsm_timed_explore(fsm_composition *composition, const fsm_timed_options *options)
{
    if (options->temporal_count > 0)
        return fsm_timed_decide(composition, options);
    fsm_timed search;
    if (!fsm_timed_init(&search, composition, options->memory))
        return FSM_NO_MEMORY;
    search.keep_on = keep_on;
    search.context = options->pace;
    if (!await_marks(&search, options->until, options->any) || !read_watch(&search, options->watch))
        return FSM_NO_MEMORY;
    double begin = fsm_seconds();
    fsm_timed_run(&search);
    if (options->list)
        list_parts(&search);
    fsm_timed_cycle cycle = {.pair = FSM_NONE};
    traps trapped = {.search = &search};
    bool complete = search.outcome == FSM_COMPLETE, doubt = false;
    bool livelock_known = options->livelock && complete && fsm_timed_livelock(&search, &cycle);
    bool traps_known = options->traps && complete && fsm_timed_traps(&search, note_trap, &trapped, &doubt);
    print_result(&search);
    print_livelock(&search, &cycle, livelock_known);
    print_traps(&trapped, traps_known, doubt);
    print_watch(&search);
    fsm_print_machines(composition, search.outcome);
    printf(", \"seconds\": %.3f}}\n", fsm_seconds() - begin);
    free(cycle.path);
    free(search.awaited);
    fsm_timed_free(&search);
    return 0;
}

/* --- replay ------------------------------------------------------------------------------------------- */

typedef struct {
    fsm_timed *timed;
    uint32_t requested, at;
    uint32_t tuple[FSM_MOST_MACHINES + 1];
    fsm_bound *zone;
    fsm_description what[FSM_MOST_MACHINES];
    uint32_t choices[FSM_MOST_MACHINES][FSM_MOST_CHOICES];
    bool first, waits, found;
} replay;

static void keep_description(replay *self, uint32_t slot, fsm_description what)
{
    for (uint32_t c = 0; c < what.choice_count; c++)
        self->choices[slot][c] = what.choices[c];
    what.choices = self->choices[slot];
    self->what[slot] = what;
}

static bool pick(void *context, const fsm_timed_step *step)
{
    replay *self = context;
    if (self->at++ != self->requested)
        return true;
    uint32_t machines = self->timed->composition->system->machine_count;
    memcpy(self->tuple, step->tuple, (machines + 1u) * sizeof *self->tuple);
    memcpy(self->zone, step->zone, (size_t)step->size * step->size * sizeof *step->zone);
    self->waits = step->waits;
    if (!self->first)
        keep_description(self, 0, step->what);
    for (uint32_t i = 0; self->first && i < machines; i++)
        keep_description(self, i, self->timed->starts[i]);
    self->found = true;
    return false;
}

/* Prints a step, what the machine did, and its timers then: which one each was, and its limits. */
static bool run_described(const replay *self, fsm_description what)
{
    fsm_composition *c = self->timed->composition;
    const fsm_machine *m = c->system->machines[what.machine];
    fsm_limits limits[UINT8_MAX + 1];
    void *after = malloc(m->info->size);
    if (after == NULL)
        return false;
    printf("%c{\"step\": {\"action\": \"%s\", \"machine\": %" PRIu32 ", \"argument\": %" PRIu32 ", \"choices\": ",
           FSM_MARK, fsm_action_name(what.action), what.machine, what.argument);
    print_steps(what.choices, what.choice_count);
    printf(", \"waits\": %s}}\n", self->waits ? "true" : "false");
    fsm_run_again(c, what, after);
    fsm_dump(m, after);
    uint32_t armed = fsm_look(m, after).armed;
    if (armed > 0)
        fsm_limits_of(m, after, limits);
    printf("%c{\"timers\": [", FSM_MARK);
    for (uint32_t i = 0; i < armed; i++)
        printf("%s[%" PRIu32 ", %" PRId32 ", %" PRId32 "]", i == 0 ? "" : ", ", c->clocks[i], limits[i].lower,
               limits[i].upper);
    printf("]}\n");
    free(after);
    return true;
}

static bool replay_step(replay *self, uint32_t ordinal, bool at_once)
{
    fsm_timed *t = self->timed;
    uint32_t before[FSM_MOST_MACHINES + 1];
    memcpy(before, self->tuple, sizeof before);
    self->requested = ordinal;
    self->at = 0;
    self->found = false;
    if (self->first) {
        (void)fsm_timed_initial(t, pick, self);
    } else {
        uint32_t size = fsm_timed_size(t, before);
        memcpy(t->before, self->zone, (size_t)size * size * sizeof *t->before);
        (void)fsm_timed_successors(t, before, t->before, at_once, pick, self);
    }
    uint32_t count = self->first ? t->composition->system->machine_count : 1;
    bool fine = self->found;
    for (uint32_t i = 0; fine && i < count; i++)
        fine = run_described(self, self->what[i]);
    self->first = false;
    return fine;
}

int fsm_timed_replay(fsm_composition *composition, const char *path)
{
    fsm_timed timed;
    if (!fsm_timed_init(&timed, composition, SIZE_MAX))
        return 2;
    replay *self = calloc(1, sizeof *self);
    fsm_bound *zone = malloc(FSM_ZONE_ROOM * sizeof *zone);
    bool at_once = false, fine = self != NULL && zone != NULL;
    if (fine)
        *self = (replay){.timed = &timed, .zone = zone, .first = true};
    while (fine && *path != '\0') {
        char *end;
        if (*path == '!') {
            at_once = true;
            path += path[1] == ',' ? 2 : 1;
            continue;
        }
        unsigned long ordinal = strtoul(path, &end, 10);
        fine = end != path && replay_step(self, (uint32_t)ordinal, at_once);
        if (!fine)
            (void)fprintf(stderr, "there is no such step: %s\n", path);
        path = *end == ',' ? end + 1 : end;
    }
    free(self);
    free(zone);
    fsm_timed_free(&timed);
    return fine ? 0 : 2;
}
