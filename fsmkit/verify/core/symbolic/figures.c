#include "symbolic/figures.h"

#include "symbolic/context.h"
#include "symbolic/natural.h"
#include "slots/slot_figures.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

/* --- counts ------------------------------------------------------------------------------------------- */

/* Figures of the states below a node: how many there are; how many allow a class of steps; steps of machines up to here; states in
 * which all machines up to here have nothing to do, and among them those in which no timer is awaited; states in which nothing
 * waits, is fair or has failed, and among them those in which all rest. */
enum { STATES, ALLOWS, STEPS = ALLOWS + FSM_CLASS_TIME, IDLE, UNTIMED, QUIET, RESTING, SUMS };

/* Places of a level: a node, and the context in which it is met. */
typedef struct {
    uint32_t *nodes, *contexts, count, room;
    uint32_t *below; /* places of the children of each, one after the other */
    uint32_t below_count, below_room;
} places;

/* Numbers of a level and the one below, each of the same width within a level. The width is what they may need; what they do need
 * is known as soon as they are there, and is often half of it, and nothing for classes of steps that no machine has. */
typedef struct {
    fsm_symbolic *symbolic;
    fsm_contexts contexts;
    places *levels;
    uint32_t **flags;     /* by machine and local state: classes that are allowed where it is in it; 0: it never is */
    uint32_t *flag_room;
    uint32_t *queued;     /* by machine: most events that it keeps */
    uint32_t *numbers[2]; /* of the current level, and of the one below */
    size_t width[2];
    size_t used[2][SUMS]; /* digits, in the longest number of each kind */
} counting;

static uint32_t *sum_of(const counting *self, int which, uint32_t place, uint32_t sum)
{
    return self->numbers[which] + ((size_t)place * SUMS + sum) * self->width[which];
}

static bool append(uint32_t **items, uint32_t count, uint32_t *room, uint32_t item)
{
    if (!FSM_HAS_ROOM(*items, count, *room, 16))
        return false;
    (*items)[count] = item;
    return true;
}

/* The place of a node with a context at a level; FSM_NONE if memory ran out. */
static uint32_t place_of(places *at, fsm_hash_map *known, uint32_t node, uint32_t context)
{
    const uint64_t *found = fsm_hash_map_find(known, fsm_join(node, context));
    uint32_t room = at->room;
    if (found != NULL)
        return (uint32_t)*found;
    if (!append(&at->nodes, at->count, &room, node) || !append(&at->contexts, at->count, &at->room, context)
        || !fsm_hash_map_add(known, fsm_join(node, context), at->count))
        return FSM_NONE;
    return at->count++;
}

static bool find_level(counting *self, uint32_t level)
{
    const fsm_mdd *mdd = &self->symbolic->mdd;
    places *at = &self->levels[level], *below = &self->levels[level - 1];
    fsm_hash_map known = {0};
    bool fine = true;
    for (uint32_t i = 0; fine && i < at->count; i++)
        for (uint32_t n = 0; fine && n < fsm_mdd_at(mdd, at->nodes[i])->count; n++) {
            fsm_mdd_pair pair = fsm_mdd_pairs(mdd, at->nodes[i])[n];
            uint32_t context = fsm_context_below(&self->contexts, level, at->contexts[i], pair.value);
            uint32_t place = context == FSM_NONE ? FSM_NONE : place_of(below, &known, pair.child, context);
            fine = place != FSM_NONE && append(&at->below, at->below_count, &at->below_room, place);
            at->below_count++;
        }
    fsm_hash_map_free(&known);
    return fine;
}

static bool find_places(counting *self)
{
    fsm_symbolic *s = self->symbolic;
    fsm_hash_map known = {0};
    self->levels = calloc((size_t)s->level_count + 1, sizeof *self->levels);
    bool fine = self->levels != NULL && place_of(&self->levels[s->level_count], &known, s->root, 0) == 0;
    fsm_hash_map_free(&known);
    for (uint32_t level = s->level_count; fine && level > 0; level--)
        fine = find_level(self, level);
    return fine;
}

static bool is_quiet(const fsm_local_info *info, const fsm_local_info *open, bool watches)
{
    return info->view.waiting == 0 && (info->view.awaited == 0 || watches) && !info->view.faulted && !info->busy && !info->fair
        && !open->fair;
}

static void add(counting *self, uint32_t place, uint32_t sum, uint32_t below, uint32_t of, uint32_t times)
{
    fsm_natural_add(sum_of(self, 0, place, sum), self->width[0], sum_of(self, 1, below, of), self->used[1][of], times);
}

static bool note_local(counting *self, uint32_t machine, uint32_t local, uint32_t flags)
{
    if (!FSM_HAS_PLACE(self->flags[machine], self->flag_room[machine], local, 64))
        return false;
    self->flags[machine][local] |= flags;
    return true;
}

/* The contribution of a value of a level, with all levels above: machines of which it is the
 * lowest level are known as a whole. */
static bool count_pair(counting *self, uint32_t level, uint32_t place, fsm_mdd_pair pair, uint32_t below)
{
    fsm_symbolic *s = self->symbolic;
    const fsm_carried *carried = &self->contexts.carried[level];
    bool idle = true, timeless = true, quiet = true, rests = true;
    for (uint32_t sum = STATES; sum <= STEPS; sum++)
        add(self, place, sum, below, sum, 1);
    for (uint32_t i = 0; i < carried->machine_count; i++) {
        uint32_t machine = carried->machines[i];
        uint32_t flags = fsm_mdd_at(&s->mdd, pair.child)->flags;
        fsm_known_local local;
        if (!fsm_context_local(&self->contexts, level, self->levels[level].contexts[place], pair.value, machine, &local)
            || !note_local(self, machine, local.own, flags & ~fsm_allows(FSM_CLASS_OPEN))
            || !note_local(self, machine, local.open, flags & fsm_allows(FSM_CLASS_OPEN)))
            return false;
        self->queued[machine] = local.queued > self->queued[machine] ? local.queued : self->queued[machine];
        const fsm_local_info *info = fsm_info(s->composition, machine, local.own), *open = fsm_info(s->composition, machine, local.open);
        add(self, place, STEPS, below, ALLOWS + (uint32_t)fsm_symbolic_class(s, machine, local.own), info->own_count);
        add(self, place, STEPS, below, ALLOWS + FSM_CLASS_OPEN, open->open_count);
        idle = idle && !info->busy && info->view.waiting == 0;
        timeless = timeless && info->view.awaited == 0;
        quiet = quiet && is_quiet(info, open, s->system->machines[machine]->monitor);
        rests = rests && info->view.at_rest;
    }
    if (idle)
        add(self, place, IDLE, below, IDLE, 1);
    if (idle && timeless)
        add(self, place, UNTIMED, below, UNTIMED, 1);
    if (quiet)
        add(self, place, QUIET, below, QUIET, 1);
    if (quiet && rests)
        add(self, place, RESTING, below, RESTING, 1);
    return true;
}

/* Computes the length of the numbers of the current level. */
static void end_level(counting *self, uint32_t nodes)
{
    for (uint32_t sum = 0; sum < SUMS; sum++) {
        self->used[0][sum] = 0;
        for (uint32_t place = 0; place < nodes; place++) {
            const uint32_t *number = sum_of(self, 0, place, sum);
            size_t used = self->width[0];
            while (used > self->used[0][sum] && number[used - 1] == 0)
                used--;
            self->used[0][sum] = used > self->used[0][sum] ? used : self->used[0][sum];
        }
    }
}

static bool start_level(counting *self, uint32_t nodes, uint32_t level)
{
    size_t longest = 0;
    uint32_t bits = 1, values = level == 0 ? 1 : self->symbolic->levels[level].confirmed_count;
    while (level > 0 && values >> bits != 0)
        bits++;
    free(self->numbers[1]);
    self->numbers[1] = self->numbers[0];
    self->width[1] = self->width[0];
    memcpy(self->used[1], self->used[0], sizeof self->used[0]);
    for (uint32_t sum = 0; sum < SUMS; sum++)
        longest = self->used[1][sum] > longest ? self->used[1][sum] : longest;
    self->width[0] = longest + bits / 32 + 2; /* steps are more than states, but not by so much */
    self->numbers[0] = calloc((size_t)nodes * SUMS * self->width[0] + SUMS * self->width[0], sizeof *self->numbers[0]);
    return self->numbers[0] != NULL;
}

static bool count_terminals(counting *self)
{
    fsm_symbolic *s = self->symbolic;
    const places *at = &self->levels[0];
    if (!start_level(self, at->count, 0))
        return false;
    for (uint32_t place = 0; place < at->count; place++) {
        fsm_waiting waiting = s->terminals[fsm_mdd_at(&s->mdd, at->nodes[place])->first];
        for (uint32_t sum = 0; sum < SUMS; sum++)
            *sum_of(self, 0, place, sum) = sum != STEPS;
        for (fsm_class class = FSM_CLASS_WATCH; class < FSM_CLASS_TIME; class++)
            *sum_of(self, 0, place, ALLOWS + (uint32_t)class) = fsm_symbolic_allows(s, class, waiting);
    }
    end_level(self, at->count);
    return true;
}

static bool count_all(counting *self)
{
    fsm_symbolic *s = self->symbolic;
    if (!fsm_contexts_init(&self->contexts, s) || !find_places(self) || !count_terminals(self))
        return false;
    for (uint32_t level = 1; level <= s->level_count; level++) {
        const places *at = &self->levels[level];
        uint32_t edge = 0;
        if (!start_level(self, at->count, level))
            return false;
        for (uint32_t place = 0; place < at->count; place++)
            for (uint32_t n = 0; n < fsm_mdd_at(&s->mdd, at->nodes[place])->count; n++) {
                fsm_mdd_pair pair = fsm_mdd_pairs(&s->mdd, at->nodes[place])[n];
                if (!count_pair(self, level, place, pair, at->below[edge++]))
                    return false;
            }
        end_level(self, at->count);
    }
    return true;
}

static char *text_of(const counting *self, uint32_t sum)
{
    return fsm_natural_text(sum_of(self, 0, 0, sum), self->width[0]);
}

/* The numbers of the root are those of the set. */
static bool read_root(counting *self, fsm_figures *found)
{
    const fsm_system *system = self->symbolic->system;
    size_t width = self->width[0];
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

static void cover(const fsm_symbolic *symbolic, uint32_t machine, const fsm_executed *ran, fsm_figures *self, bool *marks)
{
    uint32_t count, first = symbolic->composition->first_marks[machine];
    const uint32_t *seen = fsm_lists_at(&symbolic->knowledge->lists, ran->seen, &count);
    for (uint32_t i = 0; i < count; i++)
        (seen[i] % 2 == 0 ? self->states_seen : self->transitions_seen)[machine][seen[i] / 2] = 1;
    const uint32_t *notes = fsm_lists_at(&symbolic->knowledge->lists, ran->marks, &count);
    for (uint32_t i = 0; i < count; i++)
        marks[first + notes[i]] = true;
    if (ran->microsteps > self->bounds[machine].microsteps)
        self->bounds[machine].microsteps = ran->microsteps;
}

static void look_at_local(const fsm_symbolic *symbolic, uint32_t machine, uint32_t local, uint32_t flags, fsm_figures *self,
                          bool *marks)
{
    const fsm_executed_steps *ran = fsm_knowledge_at(symbolic->knowledge, machine, local);
    const fsm_view *view = &fsm_info(symbolic->composition, machine, local)->view;
    fsm_bounds *bounds = &self->bounds[machine];
    self->locals[machine]++;
    bounds->timers = view->armed > bounds->timers ? view->armed : bounds->timers;
    if ((flags & fsm_allows(fsm_symbolic_class(symbolic, machine, local))) != 0)
        cover(symbolic, machine, &ran->own, self, marks);
    if ((flags & fsm_allows(FSM_CLASS_OPEN)) != 0)
        cover(symbolic, machine, &ran->open, self, marks);
}

/* Each local state that a machine is in somewhere, with the classes of steps that are allowed there. */
static void look_at_locals(const counting *all, fsm_figures *self, bool *marks)
{
    const fsm_symbolic *symbolic = all->symbolic;
    for (uint32_t machine = 0; machine < symbolic->system->machine_count; machine++) {
        for (uint32_t local = 0; local < all->flag_room[machine]; local++)
            if (all->flags[machine][local] != 0)
                look_at_local(symbolic, machine, local, all->flags[machine][local], self, marks);
        self->bounds[machine].queue = all->queued[machine];
        if (symbolic->levels[symbolic->level_of[machine]].full)
            marks[symbolic->composition->first_marks[machine] + FSM_NOTE_FULL] = true;
    }
}

/* --- all ------------------------------------------------------------------------------------------------------ */

/* The composition contains the coverage of the initial steps. */
static bool begin(const fsm_symbolic *symbolic, fsm_figures *self)
{
    uint32_t count = symbolic->system->machine_count;
    *self = (fsm_figures){.has_deadlock = false};
    self->bounds = calloc(count, sizeof *self->bounds);
    self->locals = calloc(count, sizeof *self->locals);
    self->many_locals = calloc(count, sizeof *self->many_locals);
    self->states_seen = calloc(count, sizeof *self->states_seen);
    self->transitions_seen = calloc(count, sizeof *self->transitions_seen);
    if (self->bounds == NULL || self->locals == NULL || self->many_locals == NULL || self->states_seen == NULL || self->transitions_seen == NULL)
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

static void free_counting(counting *self)
{
    for (uint32_t level = 0; self->levels != NULL && level <= self->symbolic->level_count; level++) {
        free(self->levels[level].nodes);
        free(self->levels[level].contexts);
        free(self->levels[level].below);
    }
    for (uint32_t i = 0; self->flags != NULL && i < self->symbolic->system->machine_count; i++)
        free(self->flags[i]);
    free(self->levels);
    free(self->flags);
    free(self->flag_room);
    free(self->queued);
    free(self->numbers[0]);
    free(self->numbers[1]);
    if (self->contexts.symbolic != NULL)
        fsm_contexts_free(&self->contexts);
}

bool fsm_figures_find(fsm_symbolic *symbolic, fsm_figures *self, bool *marks)
{
    counting all = {.symbolic = symbolic};
    uint32_t machines = symbolic->system->machine_count, count;
    uint32_t *nodes = fsm_nodes_of(&symbolic->mdd, symbolic->root, &count);
    all.flags = calloc(machines, sizeof *all.flags);
    all.flag_room = calloc(machines, sizeof *all.flag_room);
    all.queued = calloc(machines, sizeof *all.queued);
    bool fine = begin(symbolic, self) && nodes != NULL && all.flags != NULL && all.flag_room != NULL && all.queued != NULL;
    if (fine && symbolic->root == 0)
        fine = start_level(&all, 1, 0) && read_root(&all, self); /* nothing was found */
    else if (fine)
        fine = count_all(&all) && read_root(&all, self);
    if (fine)
        look_at_locals(&all, self, marks);
    for (uint32_t i = 0; fine && i < machines; i++)
        if (fsm_symbolic_has_slots(symbolic, i))
            fine = (self->many_locals[i] = fsm_count_locals(symbolic, i)) != NULL;
    self->nodes = count;
    free(nodes);
    free_counting(&all);
    return fine;
}

void fsm_figures_free(const fsm_symbolic *symbolic, fsm_figures *self)
{
    for (uint32_t i = 0; symbolic->system != NULL && i < symbolic->system->machine_count; i++) {
        if (self->states_seen != NULL)
            free(self->states_seen[i]);
        if (self->transitions_seen != NULL)
            free(self->transitions_seen[i]);
        if (self->many_locals != NULL)
            free(self->many_locals[i]);
    }
    free(self->states);
    free(self->transitions);
    free(self->deadlocks);
    free(self->bounds);
    free(self->locals);
    free(self->many_locals);
    free(self->states_seen);
    free(self->transitions_seen);
    *self = (fsm_figures){0};
}

/* --- about -------------------------------------------------------------------------------------------------------- */

/* The logarithm of the sum of two numbers given by theirs, within a tenth, by halves; no library of mathematics is needed. */
static double log_of_sum(double a, double b)
{
    double larger = a > b ? a : b, factor = 1, apart = larger - (a > b ? b : a);
    for (; apart >= 1 && factor > 1e-9; apart -= 1)
        factor /= 2;
    factor *= 1 - apart / 2;
    return larger + factor; /* log2(1 + x) is about x, from 0 to 1 */
}

double fsm_log_states(const fsm_symbolic *symbolic)
{
    uint32_t count;
    uint32_t *nodes = fsm_nodes_of(&symbolic->mdd, symbolic->root, &count);
    double *logs = calloc(symbolic->mdd.node_count, sizeof *logs), found = 0;
    for (uint32_t i = 0; nodes != NULL && logs != NULL && i < count; i++) {
        const fsm_mdd_pair *pairs = fsm_mdd_pairs(&symbolic->mdd, nodes[i]);
        logs[nodes[i]] = logs[pairs[0].child];
        for (uint32_t n = 1; n < fsm_mdd_at(&symbolic->mdd, nodes[i])->count; n++)
            logs[nodes[i]] = log_of_sum(logs[nodes[i]], logs[pairs[n].child]);
        found = logs[nodes[i]];
    }
    free(nodes);
    free(logs);
    return found;
}
