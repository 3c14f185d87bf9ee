#include "symbolic/diagram.h"

#include "liveness/answers.h"
#include "paths/approach.h"
#include "symbolic/figures.h"
#include "symbolic/evaluation.h"
#include "symbolic/order.h"
#include "symbolic/traps.h"
#include "paths/symbolic_paths.h"
#include "system/spread.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct fsm_diagram {
    const fsm_diagram_options *options;
    fsm_knowledge knowledge;
    fsm_symbolic symbolic;
    fsm_figures figures;
    size_t memory;
    void (*pause)(void *);
    void *context;
    uint32_t *order;
    const char *order_from; /* how it was found */
    uint32_t mark_count;
    bool *marks;     /* that were found */
    bool *shown;     /* of them: whether ways are shown */
    bool *unknown;   /* that could not be evaluated */
    fsm_path *paths; /* by mark */
    bool *longer;    /* which need not be the shortest */
    fsm_busy_cycle busy;
    fsm_path to_cycle, cycle;
    fsm_traps traps;
    fsm_path to_traps[FSM_MOST_TRAPS];
    bool *slots; /* by machine: whether its queue is levels */
    fsm_answers answers;
    bool splits; /* shared variables and queues may be levels */
    bool fine;
    bool stopped; /* for good */
};

/* --- options
 * -------------------------------------------------------------------------------------- */

static void read_marks(bool *shown, uint32_t count, const char *text)
{
    while (text != NULL && *text != '\0') {
        char *end;
        unsigned long mark = strtoul(text, &end, 10);
        if (end == text || mark >= count)
            return;
        shown[mark] = true;
        text = *end == ',' ? end + 1 : end;
    }
}

/* Reads an order; missing machines come last. */
static void read_order(fsm_diagram *self, const char *text)
{
    uint32_t count = fsm_the_system.machine_count, placed = 0;
    bool *known = calloc(count, sizeof *known);
    while (known != NULL && *text != '\0') {
        char *end;
        unsigned long machine = strtoul(text, &end, 10);
        if (end == text)
            break;
        if (machine < count && !known[machine]) {
            known[machine] = true;
            self->order[placed++] = (uint32_t)machine;
        }
        text = *end == ',' ? end + 1 : end;
    }
    for (uint32_t i = 0; i < count; i++)
        if (known == NULL || !known[i])
            self->order[placed++] = i;
    free(known);
    self->order_from = "given";
}

static bool keep_on(fsm_symbolic *symbolic)
{
    fsm_diagram *self = symbolic->context;
    const fsm_progress progress = {fsm_mdd_live(&symbolic->mdd), symbolic->fires, 0, fsm_symbolic_bytes(symbolic)};
    fsm_outcome why = FSM_COMPLETE;
    if (self->pause != NULL && !self->stopped)
        self->pause(self->context); /* who else searches looks at the clock */
    if (self->stopped)
        why = FSM_INTERRUPTED;
    else if (self->pause == NULL)
        why = fsm_pace_check(self->options->pace, progress);
    if (why != FSM_COMPLETE)
        fsm_symbolic_stop(symbolic, why);
    return symbolic->outcome == FSM_COMPLETE;
}

/* --- the search ------------------------------------------------------------------------------------------ */

static bool start_search(fsm_diagram *self, const uint32_t *order)
{
    const fsm_diagram_options *o = self->options;
    fsm_symbolic_free(&self->symbolic);
    self->symbolic.mdd.fail_at = o->fail_at;
    self->symbolic.keeps_actions = fsm_answers_need_actions(&self->answers);
    if (!fsm_symbolic_init(&self->symbolic, &self->knowledge, order, self->memory, o->cache_bits, self->splits,
                           self->splits ? self->slots : NULL))
        return false;
    if (o->collect_every > 0)
        self->symbolic.mdd.collect_every = o->collect_every;
    self->symbolic.keep_on = keep_on;
    self->symbolic.context = self;
    return true;
}

static void evaluate_all(fsm_diagram *self)
{
    fsm_symbolic *symbolic = &self->symbolic;
    bool whole = symbolic->outcome == FSM_COMPLETE;
    self->marks[0] = self->figures.has_deadlock;
    for (uint32_t p = 0; p < fsm_the_system.property_count; p++) {
        if (!self->shown[1 + p])
            continue;
        fsm_evaluated found = fsm_evaluate(symbolic, symbolic->root, p, false);
        self->marks[1 + p] = self->marks[1 + p] || found.found;
        self->unknown[1 + p] = !found.known && whole;
        symbolic->mdd.failed = false; /* nodes created before are valid */
    }
}

/* About the binary logarithm of a number from 1 on, within a tenth. */
static double log_of(double number)
{
    double log = 0;
    for (; number >= 2; number /= 2)
        log++;
    return log + number - 1;
}

/* How well an order does: the states that were reached, for the events that were applied to nodes, both by their logarithms. Of
 * orders that make as many nodes, some apply five times as many events for hardly more states. */
static double merit(const fsm_symbolic *symbolic)
{
    return fsm_log_states(symbolic) / log_of((double)symbolic->fires + 2);
}

/* A good order: those that reach most states with few nodes, and few events applied to these, go on. */
static bool race(fsm_diagram *self)
{
    enum { RUNNERS = 4, FIRST_NODES = 5000 };
    fsm_order orders[RUNNERS];
    uint32_t count = fsm_find_orders(&fsm_the_system, orders, RUNNERS), left = count;
    size_t bytes = fsm_the_system.machine_count * sizeof *self->order;
    bool won = false;
    for (uint64_t nodes = FIRST_NODES; left > 0 && !won && self->symbolic.outcome == FSM_COMPLETE; nodes *= 2) {
        double merits[RUNNERS];
        for (uint32_t i = 0; i < left && !won; i++) {
            memcpy(self->order, orders[i].machines, bytes);
            if (!start_search(self, self->order)) {
                left = 0;
                break;
            }
            self->symbolic.max_created = left == 1 ? 0 : nodes;
            fsm_symbolic_run(&self->symbolic, self->marks);
            won = !self->symbolic.ran_over;
            merits[i] = won ? 0 : merit(&self->symbolic);
            if (!won && i + 1 < left)
                self->symbolic.outcome = FSM_COMPLETE;
        }
        for (uint32_t i = 1; i < left && !won; i++) /* the best first */
            for (uint32_t j = i; j > 0 && merits[j] > merits[j - 1]; j--) {
                double held = merits[j];
                fsm_order order = orders[j];
                merits[j] = merits[j - 1];
                merits[j - 1] = held;
                orders[j] = orders[j - 1];
                orders[j - 1] = order;
            }
        left = (left + 1) / 2 < left ? (left + 1) / 2 : left;
        if (!won && left > 0)
            self->symbolic.outcome = FSM_COMPLETE;
    }
    fsm_free_orders(orders, count);
    self->symbolic.max_created = 0; /* the current query has no such limit */
    return count > 0 && won;
}

/* --- queries
 * -------------------------------------------------------------------------------------- */

static void find_traps(fsm_diagram *self)
{
    fsm_symbolic *symbolic = &self->symbolic;
    self->traps = fsm_find_trap_sets(symbolic);
    symbolic->outcome = FSM_COMPLETE; /* all states are known, even if no time is left for this */
    symbolic->mdd.failed = false;
}

static void find_livelock(fsm_diagram *self)
{
    self->busy = fsm_find_busy_cycle(&self->symbolic);
    self->symbolic.outcome = FSM_COMPLETE;
    self->symbolic.mdd.failed = false;
}

static void decide(fsm_diagram *self)
{
    fsm_answers_decide(&self->answers, &self->symbolic);
    self->symbolic.outcome = FSM_COMPLETE;
}

static void search(fsm_diagram *self)
{
    bool found;
    if (!self->splits) {
        found = start_search(self, self->order);
        if (found)
            fsm_symbolic_run(&self->symbolic, self->marks);
    } else if (self->options->order != NULL) {
        read_order(self, self->options->order);
        found = start_search(self, self->order);
        if (found)
            fsm_symbolic_run(&self->symbolic, self->marks);
    } else {
        found = race(self);
        self->order_from = "found";
    }
    if (!found || self->symbolic.wants_slots != FSM_NONE)
        return;
    self->symbolic.mdd.failed = false;
    self->fine = fsm_figures_find(&self->symbolic, &self->figures, self->marks);
    if (!self->fine)
        return;
    evaluate_all(self);
    if (self->symbolic.outcome == FSM_COMPLETE && self->options->traps)
        find_traps(self);
    if (self->symbolic.outcome == FSM_COMPLETE && self->options->livelock)
        find_livelock(self);
    if (self->symbolic.outcome == FSM_COMPLETE && !self->busy.needs_copies)
        decide(self);
}

static void search_again(fsm_diagram *self)
{
    fsm_figures_free(&self->symbolic, &self->figures);
    memset(self->marks, 0, self->mark_count * sizeof *self->marks);
    self->symbolic.outcome = FSM_COMPLETE;
    self->busy = (fsm_busy_cycle){.known = false};
    self->traps = (fsm_traps){.known = false};
    self->fine = false;
    search(self);
}

/* Whether parts of local states are levels of their own. */
static bool has_parts(const fsm_symbolic *symbolic)
{
    bool found = symbolic->split.variable_count > 0;
    for (uint32_t i = 0; symbolic->slots.machines != NULL && i < symbolic->system->machine_count; i++)
        found = found || symbolic->slots.machines[i].room > 0;
    return found;
}

void fsm_diagram_search(void *context)
{
    fsm_diagram *self = context;
    search(self);
    for (uint32_t requested; (requested = self->symbolic.wants_slots) != FSM_NONE && !self->stopped;) {
        self->slots[requested] = true;
        search_again(self);
    }
    bool failed = self->symbolic.outcome == FSM_MODEL_FAILED && has_parts(&self->symbolic);
    if (self->stopped || (!failed && !self->busy.needs_copies))
        return;
    self->splits = false; /* with a copy of each shared variable in each machine, and queues in local states */
    search_again(self);
}

fsm_outcome fsm_diagram_outcome(const fsm_diagram *self)
{
    return self->symbolic.outcome;
}

uint64_t fsm_diagram_work(const fsm_diagram *self)
{
    return self->symbolic.fires;
}

void fsm_diagram_stop(fsm_diagram *self)
{
    self->stopped = true;
}

void fsm_diagram_go_alone(fsm_diagram *self)
{
    self->pause = NULL;
}

bool fsm_diagram_is_sound(const fsm_diagram *self)
{
    return self->fine;
}

bool fsm_diagram_answers_all(const fsm_diagram *self)
{
    return fsm_answers_are_known(&self->answers);
}

void fsm_diagram_set_memory(fsm_diagram *self, size_t memory)
{
    self->memory = self->symbolic.mdd.limit = memory;
}

/* --- ways --------------------------------------------------------------------------------------------------- */

enum { FEW_STATES = 2000000 }; /* of a search for ways that keeps each, before distances are tried */

uint32_t fsm_diagram_requested(const fsm_diagram *self, bool *requested)
{
    uint32_t count = 0;
    for (uint32_t mark = 0; mark < self->mark_count; mark++) {
        requested[mark] = self->shown[mark] && self->marks[mark] && self->paths[mark].count == 0;
        count += requested[mark];
    }
    return count;
}

/* The states that have a mark, as far as that is a matter of states. */
static uint32_t marked_states(fsm_diagram *self, uint32_t mark)
{
    fsm_symbolic *symbolic = &self->symbolic;
    if (mark == 0)
        return fsm_dead_states(symbolic, symbolic->root);
    if (mark <= fsm_the_system.property_count)
        return fsm_evaluate(symbolic, symbolic->root, mark - 1, true).marked;
    return 0;
}

static void find_by_distances(fsm_diagram *self, const fsm_path_context *ways, const bool *requested)
{
    fsm_symbolic *symbolic = &self->symbolic;
    for (uint32_t mark = 0; mark < self->mark_count && symbolic->outcome == FSM_COMPLETE; mark++) {
        if (!requested[mark])
            continue;
        symbolic->max_created = symbolic->mdd.made + fsm_max_nodes_of_paths();
        (void)fsm_path_by_distances(ways, marked_states(self, mark), &self->paths[mark]);
        symbolic->mdd.failed = false;
    }
    symbolic->max_created = 0;
}

static void find_by_approach(fsm_diagram *self, const fsm_path_context *ways, const bool *requested)
{
    for (uint32_t mark = 0; mark < self->mark_count && self->symbolic.outcome == FSM_COMPLETE; mark++) {
        if (!requested[mark])
            continue;
        uint32_t set = marked_states(self, mark);
        size_t roots = self->symbolic.mdd.root_count;
        self->longer[mark] = fsm_mdd_root(&self->symbolic.mdd, set) && fsm_path_by_approach(ways, set, &self->paths[mark]);
        self->symbolic.mdd.root_count = roots;
        self->symbolic.mdd.failed = false;
    }
}

void fsm_diagram_find_paths(void *context)
{
    fsm_diagram_paths *all = context;
    fsm_diagram *self = all->diagram;
    const fsm_diagram_options *o = self->options;
    fsm_symbolic *symbolic = &self->symbolic;
    fsm_path_context ways = {symbolic, o->pace, o->memory / 2, fsm_as_many(FEW_STATES), o->sleepless};
    const fsm_outcome outcome = symbolic->outcome; /* results are kept, even if no time is left for paths */
    bool *requested = calloc(self->mark_count + 1u, sizeof *requested);
    if (requested == NULL)
        return;
    (void)fsm_diagram_requested(self, requested);
    if (all->search != NULL)
        fsm_paths_of_search(all->search, requested, self->paths);
    else
        fsm_paths_to_marks(&ways, requested, self->paths);
    if (fsm_diagram_requested(self, requested) > 0)
        find_by_distances(self, &ways, requested);
    ways.states = fsm_max_states_of_paths();
    if (ways.states > 0 && fsm_diagram_requested(self, requested) > 0 && symbolic->outcome == FSM_COMPLETE)
        fsm_paths_to_marks(&ways, requested, self->paths);
    if (fsm_diagram_requested(self, requested) > 0)
        find_by_approach(self, &ways, requested);
    free(requested);
    for (uint32_t i = 0; i < self->traps.count; i++) {
        if (!fsm_path_by_distances(&ways, self->traps.sets[i], &self->to_traps[i]))
            self->to_traps[i].count = 0;
        symbolic->mdd.failed = false;
    }
    ways.states = fsm_as_many(FEW_STATES);
    fsm_answers_find_paths(&self->answers, &ways);
    if (self->busy.found && !fsm_path_to_cycle(&ways, &self->busy, &self->to_cycle, &self->cycle))
        self->to_cycle.count = self->cycle.count = 0;
    symbolic->outcome = outcome;
}

/* --- the result ------------------------------------------------------------------------------------------------ */

static void print_list(const uint32_t *items, size_t count)
{
    printf("[");
    for (size_t i = 0; i < count; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", items[i]);
    printf("]");
}

static void print_marks(const fsm_diagram *self)
{
    bool first = true;
    printf("\"marks\": [");
    for (uint32_t mark = 0; mark < self->mark_count; mark++) {
        if (!self->marks[mark])
            continue;
        printf("%s{\"mark\": %" PRIu32 ", \"count\": %s, \"path\": ", first ? "" : ", ", mark,
               mark == 0 ? self->figures.deadlocks : "1");
        print_list(self->paths[mark].steps, self->paths[mark].count);
        printf("%s}", self->longer[mark] ? ", \"longer\": true" : "");
        first = false;
    }
    printf("]");
}

static void print_livelock(const fsm_diagram *self)
{
    printf(", \"livelock_known\": %s, \"livelock\": ", self->busy.known ? "true" : "false");
    if (!self->busy.found) {
        printf("null");
        return;
    }
    printf("{\"path\": ");
    print_list(self->to_cycle.steps, self->to_cycle.count);
    printf(", \"cycle\": ");
    print_list(self->cycle.steps, self->cycle.count);
    printf("}");
}

static void print_traps(const fsm_diagram *self)
{
    printf(", \"traps_known\": %s, \"traps\": [", self->traps.known ? "true" : "false");
    for (uint32_t i = 0; i < self->traps.count; i++) {
        printf("%s", i == 0 ? "" : ", ");
        print_list(self->to_traps[i].steps, self->to_traps[i].count);
    }
    printf("]");
}

static void print_seen(const char *name, const unsigned char *seen, uint32_t count)
{
    printf(", \"%s\": \"", name);
    for (uint32_t i = 0; i < count; i++)
        printf("%c", seen[i] ? '1' : '0');
    printf("\"");
}

static void print_machines(const fsm_diagram *self)
{
    printf(", \"machines\": [");
    for (uint32_t i = 0; i < fsm_the_system.machine_count; i++) {
        const fsm_bounds *bounds = &self->figures.bounds[i];
        const fsm_machine_info *info = fsm_the_system.machines[i]->info;
        printf("%s{\"locals\": ", i == 0 ? "" : ", ");
        if (self->figures.many_locals[i] != NULL)
            printf("%s", self->figures.many_locals[i]);
        else
            printf("%" PRIu32, self->figures.locals[i]);
        printf(", \"queue\": %" PRIu32 ", \"timers\": %" PRIu32 ", \"microsteps\": %" PRIu32, bounds->queue, bounds->timers,
               bounds->microsteps);
        print_seen("states", self->figures.states_seen[i], info->state_count);
        print_seen("transitions", self->figures.transitions_seen[i], info->transition_count);
        if (self->symbolic.outcome != FSM_COMPLETE)
            fsm_print_spread(self->symbolic.composition, i);
        printf("}");
    }
    printf("]");
}

static void print_search(const fsm_diagram *self)
{
    const fsm_symbolic *symbolic = &self->symbolic;
    printf(", \"search\": {\"engine\": \"symbolic\", \"nodes\": %" PRIu32 ", \"peak\": %" PRIu32 ", \"made\": %" PRIu64
           ", \"bytes\": %zu, \"levels\": %" PRIu32 ", \"events\": %" PRIu32 ", \"fires\": %" PRIu64 ", \"collections\": %" PRIu64 ", \"order\": ",
           self->figures.nodes, symbolic->mdd.peak, symbolic->mdd.made, fsm_symbolic_bytes(symbolic), symbolic->level_count, symbolic->event_count,
           symbolic->fires, symbolic->mdd.collections);
    print_list(self->order, fsm_the_system.machine_count);
    printf(", \"from\": \"%s\", \"unknown\": [", self->order_from);
    bool first = true;
    for (uint32_t mark = 0; mark < self->mark_count; mark++)
        if (self->unknown[mark]) {
            printf("%s%" PRIu32, first ? "" : ", ", mark);
            first = false;
        }
    printf("]}");
}

void fsm_diagram_print(const fsm_diagram *self, double begin)
{
    const fsm_symbolic *symbolic = &self->symbolic;
    const char *why = symbolic->outcome == FSM_COMPLETE ? NULL : self->symbolic.composition->failure;
    printf("{\"result\": {\"outcome\": \"%s\", \"why\": \"%s\", \"states\": %s, \"expanded\": 0, \"transitions\": %s"
           ", \"left_out\": 0, \"depth\": 0, \"bytes\": %zu, \"dense\": false, \"cores\": 1, ",
           fsm_outcome_name(symbolic->outcome), why == NULL ? "" : why, self->figures.states, self->figures.transitions,
           fsm_symbolic_bytes(symbolic) + fsm_composition_bytes(self->symbolic.composition));
    print_marks(self);
    print_livelock(self);
    print_traps(self);
    fsm_answers_print(&self->answers);
    print_machines(self);
    print_search(self);
    printf(", \"seconds\": %.3f}}\n", fsm_seconds() - begin);
}

/* --- making one -------------------------------------------------------------------------------------------------- */

fsm_diagram *fsm_diagram_make(const fsm_diagram_options *options, fsm_composition *composition, size_t memory,
                              void (*pause)(void *), void *context)
{
    fsm_diagram *self = calloc(1, sizeof *self);
    if (self == NULL)
        return NULL;
    *self = (fsm_diagram){.options = options, .memory = memory, .pause = pause, .context = context, .splits = true};
    self->mark_count = composition->model.mark_count;
    self->order = malloc(fsm_the_system.machine_count * sizeof *self->order);
    self->marks = calloc(self->mark_count + 1u, sizeof *self->marks);
    self->shown = calloc(self->mark_count + 1u, sizeof *self->shown);
    self->unknown = calloc(self->mark_count + 1u, sizeof *self->unknown);
    self->paths = calloc(self->mark_count + 1u, sizeof *self->paths);
    self->longer = calloc(self->mark_count + 1u, sizeof *self->longer);
    self->slots = calloc(fsm_the_system.machine_count, sizeof *self->slots);
    for (uint32_t i = 0; self->slots != NULL && i < fsm_the_system.machine_count; i++)
        self->slots[i] = options->slots;
    bool fine = fsm_knowledge_init(&self->knowledge, composition) && self->slots != NULL;
    fine = fsm_answers_init(&self->answers, options->temporal, options->temporal_count, options->timeless) && fine;
    if (fine && self->order != NULL && self->marks != NULL && self->shown != NULL && self->unknown != NULL && self->paths != NULL
        && self->longer != NULL) {
        fsm_knowledge_serve(&self->knowledge); /* other searches use the facts of this one */
        read_marks(self->shown, self->mark_count, options->ways);
        return self;
    }
    fsm_diagram_free(self);
    return NULL;
}

void fsm_diagram_free(fsm_diagram *self)
{
    if (self == NULL)
        return;
    for (uint32_t mark = 0; self->paths != NULL && mark < self->mark_count; mark++)
        free(self->paths[mark].steps);
    fsm_answers_free(&self->answers);
    free(self->busy.states);
    free(self->to_cycle.steps);
    free(self->cycle.steps);
    fsm_figures_free(&self->symbolic, &self->figures);
    fsm_symbolic_free(&self->symbolic);
    free(self->order);
    free(self->marks);
    free(self->shown);
    free(self->unknown);
    free(self->paths);
    free(self->longer);
    free(self->slots);
    for (uint32_t i = 0; i < FSM_MOST_TRAPS; i++)
        free(self->to_traps[i].steps);
    fsm_knowledge_free(&self->knowledge);
    free(self);
}

int fsm_diagram_explore(const fsm_diagram_options *options)
{
    double begin = fsm_seconds();
    fsm_composition *composition = fsm_compose(&fsm_the_system, options->memory / 2);
    fsm_diagram *self = composition == NULL ? NULL : fsm_diagram_make(options, composition, options->memory / 2, NULL, NULL);
    fsm_diagram_paths ways = {self, NULL};
    uint32_t levels = fsm_most_levels(&fsm_the_system);
    bool fine = self != NULL && fsm_on_stack(levels, fsm_diagram_search, self) && self->fine
        && fsm_on_stack(levels, fsm_diagram_find_paths, &ways);
    if (fine)
        fsm_diagram_print(self, begin);
    fsm_diagram_free(self);
    fsm_composition_free(composition);
    return fine ? 0 : FSM_NO_MEMORY;
}
