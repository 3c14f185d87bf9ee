#include "symbolic/figures.h"

#include "symbolic/natural.h"

#include <stdlib.h>
#include <string.h>

/* --- nodes in order --------------------------------------------------------------------------------- */

static void note(const fsm_mdd *mdd, uint32_t node, unsigned char *seen, uint32_t *found, uint32_t *count)
{
    if (node == 0 || seen[node] || fsm_mdd_at(mdd, node)->level == 0)
        return;
    seen[node] = 1;
    found[(*count)++] = node;
}

/* By level: places first, then the nodes. */
static bool sort_by_level(const fsm_mdd *mdd, uint32_t *nodes, uint32_t count)
{
    uint32_t *places = calloc((size_t)mdd->levels + 2, sizeof *places), *sorted = malloc((count + 1u) * sizeof *sorted);
    bool fine = places != NULL && sorted != NULL;
    for (uint32_t i = 0; fine && i < count; i++)
        places[fsm_mdd_at(mdd, nodes[i])->level + 1]++;
    for (uint32_t level = 1; fine && level <= mdd->levels; level++)
        places[level + 1] += places[level];
    for (uint32_t i = 0; fine && i < count; i++)
        sorted[places[fsm_mdd_at(mdd, nodes[i])->level]++] = nodes[i];
    if (fine)
        memcpy(nodes, sorted, count * sizeof *nodes);
    free(places);
    free(sorted);
    return fine;
}

uint32_t *fsm_nodes_of(const fsm_mdd *mdd, uint32_t root, uint32_t *count)
{
    unsigned char *seen = calloc(mdd->node_count, 1);
    uint32_t *found = malloc(mdd->node_count * sizeof *found);
    bool fine = seen != NULL && found != NULL;
    *count = 0;
    if (fine)
        note(mdd, root, seen, found, count);
    for (uint32_t at = 0; fine && at < *count; at++)
        for (uint32_t i = 0; i < fsm_mdd_at(mdd, found[at])->count; i++)
            note(mdd, fsm_mdd_pairs(mdd, found[at])[i].child, seen, found, count);
    fine = fine && sort_by_level(mdd, found, *count);
    free(seen);
    if (fine)
        return found;
    free(found);
    return NULL;
}

/* --- counts ------------------------------------------------------------------------------------------- */

/* Of the states below a node: how many there are; how many allow a class of steps; steps of machines up to here; states in
 * which all machines up to here have nothing to do, and among them those in which no timer is awaited; states in which nothing
 * waits, is owed or has failed, and among them those in which all rest. */
enum { STATES, ALLOWS, STEPS = ALLOWS + FSM_CLASS_TIME, IDLE, UNTIMED, QUIET, RESTING, SUMS };

/* Numbers of a level and the one below, each of the same width within a level. */
typedef struct {
    fsm_symbolic *symbolic;
    uint32_t *place;       /* by node: where its numbers are among those of its level */
    uint32_t *numbers[2];  /* of the level above, and of the one below */
    size_t width[2], bits;
} counting;

static uint32_t *sum_of(const counting *self, int which, uint32_t place, uint32_t sum)
{
    return self->numbers[which] + ((size_t)place * SUMS + sum) * self->width[which];
}

static bool is_quiet(const fsm_local_info *info, bool watches)
{
    return info->view.waiting == 0 && (info->view.awaited == 0 || watches) && !info->view.faulted && !info->busy && !info->owed;
}

static void add(counting *self, uint32_t place, uint32_t sum, uint32_t below, uint32_t of, uint32_t times)
{
    fsm_natural_add(sum_of(self, 0, place, sum), self->width[0], sum_of(self, 1, below, of), self->width[1], times);
}

static void count_pair(counting *self, uint32_t machine, uint32_t place, fsm_mdd_pair pair)
{
    const fsm_symbolic *s = self->symbolic;
    const fsm_local_info *info = fsm_info(s->composition, machine, pair.value);
    uint32_t below = self->place[pair.child];
    for (uint32_t sum = STATES; sum <= STEPS; sum++)
        add(self, place, sum, below, sum, 1);
    fsm_class class = fsm_symbolic_class(s, machine, pair.value);
    add(self, place, STEPS, below, ALLOWS + (uint32_t)class, info->own_count);
    add(self, place, STEPS, below, ALLOWS + FSM_CLASS_OPEN, info->open_count);
    if (!info->busy && info->view.waiting == 0) {
        add(self, place, IDLE, below, IDLE, 1);
        if (info->view.awaited == 0)
            add(self, place, UNTIMED, below, UNTIMED, 1);
    }
    if (is_quiet(info, s->system->machines[machine]->monitor)) {
        add(self, place, QUIET, below, QUIET, 1);
        if (info->view.at_rest)
            add(self, place, RESTING, below, RESTING, 1);
    }
}

static bool begin_level(counting *self, uint32_t nodes, uint32_t level)
{
    uint32_t bits = 1, values = level == 0 ? 1 : self->symbolic->levels[level].confirmed_count;
    while (level > 0 && values >> bits != 0)
        bits++;
    free(self->numbers[1]);
    self->numbers[1] = self->numbers[0];
    self->width[1] = self->width[0];
    self->bits += bits;
    self->width[0] = self->bits / 32 + 2; /* steps are more than states, but not by so much */
    self->numbers[0] = calloc((size_t)nodes * SUMS * self->width[0] + 1, sizeof *self->numbers[0]);
    return self->numbers[0] != NULL;
}

static bool count_terminals(counting *self)
{
    fsm_symbolic *s = self->symbolic;
    if (!begin_level(self, s->terminal_count, 0))
        return false;
    for (uint32_t i = 1; i < s->mdd.node_count; i++) {
        if (fsm_mdd_at(&s->mdd, i)->level != 0)
            continue;
        uint32_t place = self->place[i] = fsm_mdd_at(&s->mdd, i)->first;
        for (uint32_t sum = 0; sum < SUMS; sum++)
            *sum_of(self, 0, place, sum) = sum != STEPS;
        for (fsm_class class = FSM_CLASS_WATCH; class < FSM_CLASS_TIME; class++)
            *sum_of(self, 0, place, ALLOWS + (uint32_t)class) = fsm_symbolic_allows(s, class, s->terminals[place]);
    }
    return true;
}

static bool count_all(counting *self, const uint32_t *nodes, uint32_t count)
{
    const fsm_mdd *mdd = &self->symbolic->mdd;
    if (!count_terminals(self))
        return false;
    for (uint32_t first = 0, end; first < count; first = end) {
        uint32_t level = fsm_mdd_at(mdd, nodes[first])->level;
        for (end = first; end < count && fsm_mdd_at(mdd, nodes[end])->level == level; end++)
            self->place[nodes[end]] = end - first;
        if (!begin_level(self, end - first, level))
            return false;
        for (uint32_t i = first; i < end; i++)
            for (uint32_t n = 0; n < fsm_mdd_at(mdd, nodes[i])->count; n++)
                count_pair(self, self->symbolic->levels[level].machine, i - first, fsm_mdd_pairs(mdd, nodes[i])[n]);
    }
    return true;
}

static char *text_of(const counting *self, uint32_t sum)
{
    return fsm_natural_text(sum_of(self, 0, 0, sum), self->width[0]);
}

/* The numbers of the root are those of the set. */
static bool read_root(counting *self, bool any, fsm_figures *found)
{
    const fsm_system *system = self->symbolic->system;
    size_t width = self->width[0];
    for (uint32_t sum = 0; !any && sum < SUMS; sum++) /* there is no root: the terminals' were counted last */
        memset(sum_of(self, 0, 0, sum), 0, width * sizeof *self->numbers[0]);
    if (system->unit > 0) {
        fsm_natural_add(sum_of(self, 0, 0, STEPS), width, sum_of(self, 0, 0, IDLE), width, 1);
        fsm_natural_subtract(sum_of(self, 0, 0, STEPS), width, sum_of(self, 0, 0, UNTIMED), width);
    }
    fsm_natural_subtract(sum_of(self, 0, 0, QUIET), width, sum_of(self, 0, 0, RESTING), width);
    found->has_deadlock = !system->open && !fsm_natural_is_zero(sum_of(self, 0, 0, QUIET), width);
    found->states = text_of(self, STATES);
    found->transitions = text_of(self, STEPS);
    found->deadlocks = text_of(self, QUIET);
    return found->states != NULL && found->transitions != NULL && found->deadlocks != NULL;
}

/* --- what can be taken ------------------------------------------------------------------------------------ */

static void cover(const fsm_symbolic *symbolic, uint32_t machine, const fsm_ran *ran, fsm_figures *self, bool *marks)
{
    uint32_t count, first = fsm_first_mark(symbolic->system, machine);
    const uint32_t *seen = fsm_lists_at(&symbolic->knowledge->lists, ran->seen, &count);
    for (uint32_t i = 0; i < count; i++)
        (seen[i] % 2 == 0 ? self->states_seen : self->transitions_seen)[machine][seen[i] / 2] = 1;
    const uint32_t *notes = fsm_lists_at(&symbolic->knowledge->lists, ran->marks, &count);
    for (uint32_t i = 0; i < count; i++)
        marks[first + notes[i]] = true;
    if (ran->microsteps > self->bounds[machine].microsteps)
        self->bounds[machine].microsteps = ran->microsteps;
}

static void look_at_value(const fsm_symbolic *symbolic, uint32_t level, uint32_t value, uint32_t flags, fsm_figures *self,
                          bool *marks)
{
    uint32_t machine = symbolic->levels[level].machine;
    const fsm_local_ran *ran = fsm_knowledge_at(symbolic->knowledge, machine, value);
    const fsm_view *view = &fsm_info(symbolic->composition, machine, value)->view;
    fsm_bounds *bounds = &self->bounds[machine];
    self->locals[machine]++;
    bounds->queue = view->queued > bounds->queue ? view->queued : bounds->queue;
    bounds->timers = view->armed > bounds->timers ? view->armed : bounds->timers;
    if ((flags & fsm_allows(fsm_symbolic_class(symbolic, machine, value))) != 0)
        cover(symbolic, machine, &ran->own, self, marks);
    if ((flags & fsm_allows(FSM_CLASS_OPEN)) != 0)
        cover(symbolic, machine, &ran->open, self, marks);
}

/* Each value of each level that some state has, with the classes that are allowed there. */
static bool look_at_values(const fsm_symbolic *symbolic, const uint32_t *nodes, uint32_t count, fsm_figures *self, bool *marks)
{
    const fsm_mdd *mdd = &symbolic->mdd;
    for (uint32_t first = 0, end; first < count; first = end) {
        uint32_t level = fsm_mdd_at(mdd, nodes[first])->level, room = symbolic->levels[level].room;
        uint32_t *flags = calloc(room + 1u, sizeof *flags);
        if (flags == NULL)
            return false;
        for (end = first; end < count && fsm_mdd_at(mdd, nodes[end])->level == level; end++)
            for (uint32_t i = 0; i < fsm_mdd_at(mdd, nodes[end])->count; i++) {
                fsm_mdd_pair pair = fsm_mdd_pairs(mdd, nodes[end])[i];
                flags[pair.value] |= fsm_mdd_at(mdd, pair.child)->flags;
            }
        for (uint32_t value = 0; value < room; value++)
            if (flags[value] != 0)
                look_at_value(symbolic, level, value, flags[value], self, marks);
        if (symbolic->levels[level].full)
            marks[fsm_first_mark(symbolic->system, symbolic->levels[level].machine) + FSM_NOTE_FULL] = true;
        free(flags);
    }
    return true;
}

/* --- all ------------------------------------------------------------------------------------------------------ */

/* What the initial steps ran is in the composition. */
static bool begin(const fsm_symbolic *symbolic, fsm_figures *self)
{
    uint32_t count = symbolic->system->machine_count;
    *self = (fsm_figures){.has_deadlock = false};
    self->bounds = calloc(count, sizeof *self->bounds);
    self->locals = calloc(count, sizeof *self->locals);
    self->states_seen = calloc(count, sizeof *self->states_seen);
    self->transitions_seen = calloc(count, sizeof *self->transitions_seen);
    if (self->bounds == NULL || self->locals == NULL || self->states_seen == NULL || self->transitions_seen == NULL)
        return false;
    for (uint32_t i = 0; i < count; i++) {
        const fsm_machine_info *info = symbolic->system->machines[i]->info;
        self->states_seen[i] = malloc(info->state_count + 1u);
        self->transitions_seen[i] = malloc(info->transition_count + 1u);
        if (self->states_seen[i] == NULL || self->transitions_seen[i] == NULL)
            return false;
        memcpy(self->states_seen[i], fsm_states_seen(symbolic->composition, i), info->state_count);
        memcpy(self->transitions_seen[i], fsm_transitions_seen(symbolic->composition, i), info->transition_count);
        self->bounds[i].microsteps = fsm_composition_bounds(symbolic->composition, i).microsteps;
    }
    return true;
}

bool fsm_figures_find(fsm_symbolic *symbolic, fsm_figures *self, bool *marks)
{
    counting all = {.symbolic = symbolic};
    uint32_t *nodes = fsm_nodes_of(&symbolic->mdd, symbolic->root, &self->nodes), count = self->nodes;
    all.place = calloc(symbolic->mdd.node_count, sizeof *all.place);
    bool fine = begin(symbolic, self) && nodes != NULL && all.place != NULL && count_all(&all, nodes, count)
        && read_root(&all, count > 0, self) && look_at_values(symbolic, nodes, count, self, marks);
    self->nodes = count;
    free(nodes);
    free(all.place);
    free(all.numbers[0]);
    free(all.numbers[1]);
    return fine;
}

void fsm_figures_free(const fsm_symbolic *symbolic, fsm_figures *self)
{
    for (uint32_t i = 0; symbolic->system != NULL && i < symbolic->system->machine_count; i++) {
        if (self->states_seen != NULL)
            free(self->states_seen[i]);
        if (self->transitions_seen != NULL)
            free(self->transitions_seen[i]);
    }
    free(self->states);
    free(self->transitions);
    free(self->deadlocks);
    free(self->bounds);
    free(self->locals);
    free(self->states_seen);
    free(self->transitions_seen);
    *self = (fsm_figures){0};
}
