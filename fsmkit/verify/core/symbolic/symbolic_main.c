#include "symbolic/symbolic_main.h"

#include "search/path.h"
#include "symbolic/figures.h"
#include "symbolic/judge.h"
#include "symbolic/order.h"
#include "system/spread.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const fsm_symbolic_options *options;
    fsm_knowledge *knowledge;
    fsm_symbolic symbolic;
    fsm_figures figures;
    uint32_t *order;
    const char *order_from; /* how it was found */
    uint32_t mark_count;
    bool *marks;     /* that were found */
    bool *asked;     /* of them: whether ways are shown */
    bool *unknown;   /* that could not be judged */
    fsm_path *paths; /* by mark */
    bool fine;
} exploration;

/* --- what is asked for -------------------------------------------------------------------------------- */

static void read_marks(bool *asked, uint32_t count, const char *text)
{
    while (text != NULL && *text != '\0') {
        char *end;
        unsigned long mark = strtoul(text, &end, 10);
        if (end == text || mark >= count)
            return;
        asked[mark] = true;
        text = *end == ',' ? end + 1 : end;
    }
}

/* Reads an order; machines that it leaves out come last. */
static void read_order(exploration *self, const char *text)
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
    const fsm_progress progress = {fsm_mdd_live(&symbolic->mdd), symbolic->fires, 0, fsm_symbolic_bytes(symbolic)};
    fsm_outcome why = fsm_pace_ask(symbolic->context, progress);
    if (why != FSM_COMPLETE)
        fsm_symbolic_stop(symbolic, why);
    return why == FSM_COMPLETE;
}

/* --- the search ------------------------------------------------------------------------------------------ */

static bool begin_search(exploration *self, const uint32_t *order)
{
    const fsm_symbolic_options *o = self->options;
    self->symbolic.mdd.fail_at = o->fail_at;
    if (!fsm_symbolic_init(&self->symbolic, self->knowledge, order, o->memory / 4 * 3, o->cache_bits))
        return false;
    if (o->collect_every > 0)
        self->symbolic.mdd.collect_every = o->collect_every;
    self->symbolic.keep_on = keep_on;
    self->symbolic.context = o->pace;
    return true;
}

static void judge_all(exploration *self)
{
    fsm_symbolic *symbolic = &self->symbolic;
    bool whole = symbolic->outcome == FSM_COMPLETE;
    self->marks[0] = self->figures.has_deadlock;
    for (uint32_t p = 0; p < fsm_the_system.property_count; p++) {
        if (!self->asked[1 + p])
            continue;
        fsm_judged found = fsm_judge(symbolic, symbolic->root, p, false);
        self->marks[1 + p] = self->marks[1 + p] || found.found;
        self->unknown[1 + p] = !found.known && whole;
        symbolic->mdd.failed = false; /* what was made before is there */
    }
}

static void search(void *context)
{
    exploration *self = context;
    uint32_t count = fsm_the_system.machine_count;
    if (self->options->order != NULL) {
        read_order(self, self->options->order);
    } else {
        fsm_order orders[1];
        uint32_t found = fsm_find_orders(&fsm_the_system, orders, 1);
        for (uint32_t i = 0; i < count; i++)
            self->order[i] = found > 0 ? orders[0].machines[i] : i;
        fsm_free_orders(orders, found);
        self->order_from = "found";
    }
    if (!begin_search(self, self->order))
        return;
    fsm_symbolic_run(&self->symbolic, self->marks);
    self->symbolic.mdd.failed = false;
    self->fine = fsm_figures_find(&self->symbolic, &self->figures, self->marks);
    if (self->fine)
        judge_all(self);
}

/* --- ways --------------------------------------------------------------------------------------------------- */

/* Shortest ways, by a search that keeps each state, as long as memory and time for it last. */
static bool find_ways(exploration *self)
{
    const fsm_symbolic_options *o = self->options;
    fsm_search explicit;
    uint32_t wanted = 0;
    bool *awaited = calloc(self->mark_count + 1u, sizeof *awaited);
    for (uint32_t mark = 0; awaited != NULL && mark < self->mark_count; mark++) {
        awaited[mark] = self->asked[mark] && self->marks[mark];
        wanted += awaited[mark];
    }
    fsm_composition *composition = wanted == 0 || awaited == NULL ? NULL : fsm_compose(&fsm_the_system, o->memory / 2);
    bool fine = composition != NULL && fsm_search_init(&explicit, fsm_composition_model(composition), o->memory / 2);
    if (fine) {
        explicit.keep_on = fsm_keep_pace;
        explicit.seeks_on = fsm_seek_on;
        explicit.context = o->pace;
        explicit.sleepless = o->sleepless;
        explicit.awaited = awaited;
        explicit.awaited_count = wanted;
        fsm_search_run(&explicit);
        fsm_search_forget(&explicit);
        for (uint32_t mark = 0; mark < self->mark_count; mark++) {
            const fsm_witness *witness = &explicit.witnesses[mark];
            if (!awaited[mark] || witness->count == 0)
                continue;
            bool found = witness->at.state == FSM_NO_STATE || fsm_path_to(&explicit, &witness->at, &self->paths[mark]);
            found = found && (witness->step == FSM_NONE || fsm_path_add(&self->paths[mark], witness->step));
            if (!found)
                self->paths[mark].count = 0;
        }
        fsm_search_free(&explicit);
    }
    fsm_composition_free(composition);
    free(awaited);
    return fine || wanted == 0;
}

/* --- the result ------------------------------------------------------------------------------------------------ */

static void print_list(const uint32_t *items, size_t count)
{
    printf("[");
    for (size_t i = 0; i < count; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", items[i]);
    printf("]");
}

static void print_marks(const exploration *self)
{
    bool first = true;
    printf("\"marks\": [");
    for (uint32_t mark = 0; mark < self->mark_count; mark++) {
        if (!self->marks[mark])
            continue;
        printf("%s{\"mark\": %" PRIu32 ", \"count\": %s, \"path\": ", first ? "" : ", ", mark,
               mark == 0 ? self->figures.deadlocks : "1");
        print_list(self->paths[mark].steps, self->paths[mark].count);
        printf("}");
        first = false;
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

static void print_machines(const exploration *self)
{
    printf(", \"machines\": [");
    for (uint32_t i = 0; i < fsm_the_system.machine_count; i++) {
        const fsm_bounds *bounds = &self->figures.bounds[i];
        const fsm_machine_info *info = fsm_the_system.machines[i]->info;
        printf("%s{\"locals\": %" PRIu32 ", \"queue\": %" PRIu32 ", \"timers\": %" PRIu32 ", \"microsteps\": %" PRIu32,
               i == 0 ? "" : ", ", self->figures.locals[i], bounds->queue, bounds->timers, bounds->microsteps);
        print_seen("states", self->figures.states_seen[i], info->state_count);
        print_seen("transitions", self->figures.transitions_seen[i], info->transition_count);
        if (self->symbolic.outcome != FSM_COMPLETE)
            fsm_print_spread(self->knowledge->composition, i);
        printf("}");
    }
    printf("]");
}

static void print_search(const exploration *self)
{
    const fsm_symbolic *symbolic = &self->symbolic;
    printf(", \"search\": {\"engine\": \"symbolic\", \"nodes\": %" PRIu32 ", \"peak\": %" PRIu32 ", \"made\": %" PRIu64
           ", \"bytes\": %zu, \"events\": %" PRIu32 ", \"fires\": %" PRIu64 ", \"collections\": %" PRIu64 ", \"order\": ",
           self->figures.nodes, symbolic->mdd.peak, symbolic->mdd.made, fsm_symbolic_bytes(symbolic), symbolic->event_count,
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

static void print_result(const exploration *self, double begin)
{
    const fsm_symbolic *symbolic = &self->symbolic;
    const char *why = symbolic->outcome == FSM_COMPLETE ? NULL : self->knowledge->composition->failure;
    printf("{\"result\": {\"outcome\": \"%s\", \"why\": \"%s\", \"states\": %s, \"expanded\": 0, \"transitions\": %s"
           ", \"left_out\": 0, \"depth\": 0, \"bytes\": %zu, \"dense\": false, \"cores\": 1, ",
           fsm_outcome_name(symbolic->outcome), why == NULL ? "" : why, self->figures.states, self->figures.transitions,
           fsm_symbolic_bytes(symbolic) + fsm_composition_bytes(self->knowledge->composition));
    print_marks(self);
    printf(", \"livelock_known\": false, \"livelock\": null, \"traps_known\": false, \"traps\": [], \"temporal\": []");
    print_machines(self);
    print_search(self);
    printf(", \"seconds\": %.3f}}\n", fsm_seconds() - begin);
}

int fsm_symbolic_explore(const fsm_symbolic_options *options)
{
    double begin = fsm_seconds();
    fsm_composition *composition = fsm_compose(&fsm_the_system, options->memory / 4);
    fsm_knowledge knowledge;
    if (composition == NULL || !fsm_knowledge_init(&knowledge, composition)) {
        fsm_composition_free(composition);
        return FSM_NO_MEMORY;
    }
    exploration self = {.options = options, .knowledge = &knowledge, .mark_count = composition->model.mark_count};
    self.order = malloc(fsm_the_system.machine_count * sizeof *self.order);
    self.marks = calloc(self.mark_count + 1u, sizeof *self.marks);
    self.asked = calloc(self.mark_count + 1u, sizeof *self.asked);
    self.unknown = calloc(self.mark_count + 1u, sizeof *self.unknown);
    self.paths = calloc(self.mark_count + 1u, sizeof *self.paths);
    bool fine = self.order != NULL && self.marks != NULL && self.asked != NULL && self.unknown != NULL && self.paths != NULL;
    if (fine) {
        read_marks(self.asked, self.mark_count, options->ways);
        fine = fsm_on_stack(fsm_the_system.machine_count, search, &self) && self.fine && find_ways(&self);
    }
    if (fine)
        print_result(&self, begin);
    for (uint32_t mark = 0; self.paths != NULL && mark < self.mark_count; mark++)
        free(self.paths[mark].steps);
    fsm_figures_free(&self.symbolic, &self.figures);
    fsm_symbolic_free(&self.symbolic);
    free(self.order);
    free(self.marks);
    free(self.asked);
    free(self.unknown);
    free(self.paths);
    fsm_knowledge_free(&knowledge);
    fsm_composition_free(composition);
    return fine ? 0 : FSM_NO_MEMORY;
}
