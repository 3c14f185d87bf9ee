#include "symbolic/livelock.h"

#include "symbolic/evaluation.h"
#include "symbolic/relation.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

/* --- steps that can be in a cycle at all ----------------------------------------------------------------
 *
 * In a cycle each machine comes back to where it was. So a step in it leads within a strongly connected component of the graph of
 * its machine, whose edges are internal steps and effects of those of other machines. Other steps are removed,
 * and with them their messages, until nothing changes. Mostly nothing is left. */

typedef struct {
    uint32_t machine, from, to, number; /* of the step in the composition, or of a slot step: see fsm_counts_step */
    fsm_event *event;
    bool live;
} inner_step;

typedef struct {
    uint32_t from, to;
} edge;

/* The function of an event at a level: the messages to the machine there. */
typedef struct {
    uint32_t event;
    const fsm_touch *touch;
} arrival;

typedef struct {
    fsm_symbolic *symbolic;
    arrival *arrivals;       /* in the order of levels */
    uint32_t *arrivals_from; /* of each level, and one more */
    inner_step *steps;
    uint32_t count, room;
    uint32_t *first_of;   /* of each level, and one more: they are in the order of levels */
    uint32_t *sent;       /* by event: live steps */
    bool *live;           /* by step of the composition */
    bool *live_slot;      /* by slot step */
    edge *edges;          /* of a machine */
    uint32_t edge_count, edge_room;
    uint32_t *first, *index, *low, *component, *stack, *frames, *at; /* by local state of it */
    bool failed, split; /* `split`: steps are left that cannot be followed further */
} filter;

static void add_edge(filter *self, uint32_t from, uint32_t to)
{
    if (FSM_HAS_ROOM(self->edges, self->edge_count, self->edge_room, 256))
        self->edges[self->edge_count++] = (edge){from, to};
    else
        self->failed = true;
}

static bool add_step(filter *self, inner_step step)
{
    if (!FSM_HAS_ROOM(self->steps, self->count, self->room, 256))
        return false;
    self->steps[self->count++] = step;
    return true;
}

/* For a split machine, its steps for each value of its shared data count, without their conditions on the values: too many. */
static bool find_split_steps(filter *self, uint32_t machine, uint32_t base)
{
    fsm_symbolic *symbolic = self->symbolic;
    for (uint32_t n = 0; n < symbolic->split.machines[machine].combinations; n++) {
        uint32_t whole = fsm_split_whole(&symbolic->split, machine, base, n);
        if (whole == FSM_NONE)
            return false;
        const fsm_local_info info = *fsm_info(symbolic->composition, machine, whole);
        for (uint32_t s = info.own; s < info.own + info.own_count; s++) {
            const fsm_local_step step = symbolic->composition->steps[s];
            uint32_t length = 0, next;
            inner_step found = {machine, base, 0, s, NULL, true};
            if (step.kind != FSM_STEP_INTERNAL)
                continue;
            if (!fsm_symbolic_make_room(symbolic, (size_t)step.message_count + 1)
                || !fsm_symbolic_sort_messages(symbolic, machine, &step, &length, &next))
                return false;
            found.to = fsm_split_base(&symbolic->split, machine, next);
            if (found.to == FSM_NONE || !add_step(self, found))
                return false;
        }
    }
    return true;
}

/* For a machine whose queue is levels, between bases: in a cycle it comes back to its base, too. */
static bool find_slot_steps(filter *self, uint32_t machine)
{
    const fsm_symbolic *symbolic = self->symbolic;
    for (uint32_t i = 0; i < symbolic->slot_step_count; i++) {
        const fsm_slot_step *step = &symbolic->slot_steps[i];
        inner_step found = {machine, step->base, step->next, FSM_SLOT_STEP | i, step->event, true};
        if (step->machine == machine && step->internal && !add_step(self, found))
            return false;
    }
    return true;
}

static bool *live_of(const filter *self, uint32_t number)
{
    return number < FSM_SLOT_STEP ? &self->live[number] : &self->live_slot[number & ~FSM_SLOT_STEP];
}

static bool find_steps(filter *self)
{
    fsm_symbolic *symbolic = self->symbolic;
    for (uint32_t level = 1; level <= symbolic->level_count; level++) {
        const fsm_level *at = &symbolic->levels[level];
        bool by_locals = fsm_level_is_whole(at) && !fsm_symbolic_has_slots(symbolic, at->machine);
        self->first_of[level] = self->count;
        if (!by_locals && fsm_level_is_whole(at) && !find_slot_steps(self, at->machine))
            return false;
        for (uint32_t value = 0; by_locals && value < at->room; value++) {
            if (!at->confirmed[value])
                continue;
            if (fsm_symbolic_is_split(symbolic, at->machine)) {
                if (!find_split_steps(self, at->machine, value))
                    return false;
                continue;
            }
            const fsm_local_info info = *fsm_info(symbolic->composition, at->machine, value);
            fsm_class class = fsm_symbolic_class(symbolic, at->machine, value);
            for (uint32_t s = info.own; s < info.own + info.own_count; s++) {
                inner_step step = {at->machine, value, 0, s, NULL, true};
                if (symbolic->composition->steps[s].kind != FSM_STEP_INTERNAL)
                    continue;
                if (!fsm_symbolic_step(symbolic, at->machine, value, class, s, &step.event, &step.to) || !add_step(self, step))
                    return false;
            }
        }
    }
    self->first_of[symbolic->level_count + 1] = self->count;
    return true;
}

/* Sorts messages to machines by level: there are many events, each for few machines. */
static bool find_arrivals(filter *self)
{
    const fsm_symbolic *symbolic = self->symbolic;
    const uint32_t levels = symbolic->level_count;
    self->arrivals_from = calloc((size_t)levels + 3, sizeof *self->arrivals_from);
    for (int pass = 0; self->arrivals_from != NULL && pass < 2; pass++) {
        uint32_t *place = self->arrivals_from + 1; /* in the second pass, of the next one of each level */
        for (uint32_t n = 1; n <= symbolic->event_count; n++)
            for (uint32_t t = 0; t < symbolic->events[n]->touch_count; t++) {
                const fsm_touch *touch = &symbolic->events[n]->touches[t];
                if (!touch->is_function || touch->is_slot)
                    continue;
                if (pass == 0)
                    place[touch->level + 1]++;
                else
                    self->arrivals[place[touch->level]++] = (arrival){n, touch};
            }
        for (uint32_t level = 0; pass == 0 && level <= levels; level++)
            place[level + 1] += place[level];
        if (pass == 0)
            self->arrivals = malloc(((size_t)place[levels + 1] + 1) * sizeof *self->arrivals);
        if (self->arrivals == NULL)
            return false;
    }
    return self->arrivals_from != NULL;
}

/* Edges in the graph of a machine: its own steps, and what others send it. */
static void find_edges(filter *self, uint32_t level)
{
    const fsm_symbolic *symbolic = self->symbolic;
    self->edge_count = 0;
    for (uint32_t i = self->first_of[level]; i < self->first_of[level + 1]; i++)
        if (self->steps[i].live)
            add_edge(self, self->steps[i].from, self->steps[i].to);
    for (uint32_t i = self->arrivals_from[level]; i < self->arrivals_from[level + 1]; i++) {
        const uint32_t n = self->arrivals[i].event;
        const fsm_touch *touch = self->arrivals[i].touch;
        /* For a split machine, it is unknown whether it still sends. */
        bool may = self->sent[n] > 0 || fsm_symbolic_is_split(symbolic, symbolic->events[n]->mover);
        for (uint32_t value = 0; may && value < touch->room; value++)
            if (touch->rows[value] != 0)
                add_edge(self, value, (touch->rows[value] - 1) >> 1);
    }
}

static int by_from(const void *a, const void *b)
{
    const edge *x = a, *y = b;
    return (x->from > y->from) - (x->from < y->from);
}

/* Strongly connected components (Tarjan 1972), without recursion: `component` by value. */
static void find_components(filter *self, uint32_t values)
{
    uint32_t next = 1, on_stack = 0, depth = 0;
    if (self->edge_count > 0)
        qsort(self->edges, self->edge_count, sizeof *self->edges, by_from);
    for (uint32_t value = 0, i = 0; value <= values; value++) {
        while (i < self->edge_count && self->edges[i].from < value)
            i++;
        self->first[value] = i;
        self->index[value] = 0;
        self->component[value] = FSM_NONE;
    }
    for (uint32_t root = 0; root < values; root++) {
        if (self->index[root] != 0)
            continue;
        self->frames[depth++] = root;
        self->at[root] = self->first[root];
        self->index[root] = self->low[root] = next++;
        self->stack[on_stack++] = root;
        while (depth > 0) {
            uint32_t value = self->frames[depth - 1];
            if (self->at[value] < self->first[value + 1]) {
                uint32_t to = self->edges[self->at[value]++].to;
                if (self->index[to] == 0) {
                    self->frames[depth++] = to;
                    self->at[to] = self->first[to];
                    self->index[to] = self->low[to] = next++;
                    self->stack[on_stack++] = to;
                } else if (self->component[to] == FSM_NONE && self->index[to] < self->low[value]) {
                    self->low[value] = self->index[to];
                }
                continue;
            }
            depth--;
            if (depth > 0 && self->low[value] < self->low[self->frames[depth - 1]])
                self->low[self->frames[depth - 1]] = self->low[value];
            if (self->low[value] == self->index[value])
                for (uint32_t member = FSM_NONE; member != value;) {
                    member = self->stack[--on_stack];
                    self->component[member] = value;
                }
        }
    }
}

/* Removes steps of a machine that lead elsewhere; returns whether there were some. */
static bool filter_machine(filter *self, uint32_t level)
{
    bool changed = false;
    if (!fsm_level_is_whole(&self->symbolic->levels[level]) || self->first_of[level] == self->first_of[level + 1])
        return false;
    find_edges(self, level);
    if (self->failed)
        return false;
    find_components(self, fsm_local_count(self->symbolic->composition, self->symbolic->levels[level].machine));
    for (uint32_t i = self->first_of[level]; i < self->first_of[level + 1]; i++) {
        inner_step *step = &self->steps[i];
        if (!step->live || self->component[step->from] == self->component[step->to])
            continue;
        step->live = false;
        *live_of(self, step->number) = false;
        if (step->event != NULL)
            self->sent[step->event->number]--;
        changed = true;
    }
    return changed;
}

static bool make_room(filter *self)
{
    const fsm_symbolic *symbolic = self->symbolic;
    uint32_t most = 1;
    for (uint32_t i = 0; i < symbolic->system->machine_count; i++)
        most = fsm_local_count(symbolic->composition, i) > most ? fsm_local_count(symbolic->composition, i) : most;
    uint32_t **arrays[] = {&self->first, &self->index, &self->low, &self->component, &self->stack, &self->frames, &self->at};
    bool fine = true;
    for (int i = 0; i < 7; i++) {
        *arrays[i] = malloc((most + 2u) * sizeof **arrays[i]);
        fine = fine && *arrays[i] != NULL;
    }
    self->first_of = calloc((size_t)symbolic->level_count + 2, sizeof *self->first_of);
    self->sent = calloc((size_t)symbolic->event_count + 1, sizeof *self->sent);
    self->live = calloc(symbolic->composition->step_count + 1u, sizeof *self->live);
    self->live_slot = calloc(symbolic->slot_step_count + 1u, sizeof *self->live_slot);
    return fine && self->first_of != NULL && self->sent != NULL && self->live != NULL && self->live_slot != NULL;
}

static void free_filter(filter *self)
{
    uint32_t *arrays[] = {self->first, self->index, self->low, self->component, self->stack, self->frames, self->at};
    for (int i = 0; i < 7; i++)
        free(arrays[i]);
    free(self->arrivals);
    free(self->arrivals_from);
    free(self->first_of);
    free(self->sent);
    free(self->live);
    free(self->live_slot);
    free(self->steps);
    free(self->edges);
}

/* Whether some steps are left; false, too, if it failed. */
static bool find_live(filter *self)
{
    bool any = false;
    if (!make_room(self) || !find_steps(self) || !find_arrivals(self)) {
        self->failed = true;
        return false;
    }
    for (uint32_t i = 0; i < self->count; i++) {
        *live_of(self, self->steps[i].number) = true;
        if (self->steps[i].event != NULL)
            self->sent[self->steps[i].event->number]++;
    }
    for (bool changed = true; changed && !self->failed;) {
        changed = false;
        for (uint32_t level = 1; level <= self->symbolic->level_count; level++)
            changed = filter_machine(self, level) || changed;
    }
    for (uint32_t i = 0; i < self->count; i++) {
        any = any || self->steps[i].live;
        self->split = self->split || (self->steps[i].live && fsm_symbolic_is_split(self->symbolic, self->steps[i].machine));
    }
    return any && !self->failed;
}

static bool is_live(void *context, uint32_t number)
{
    const filter *self = context;
    return *live_of(self, number);
}

/* --- a cycle ------------------------------------------------------------------------------------------------ */

/* The states to which endless internal ways lead: none, if there is no cycle. */
static uint32_t endless(fsm_symbolic *self, fsm_relation *steps)
{
    uint32_t set = self->root, next;
    while (!self->mdd.failed && set != 0) {
        next = fsm_relation_step(steps, set, set);
        if (next == set)
            break;
        set = next;
    }
    return self->mdd.failed ? 0 : set;
}

/* From some state of such a set back, until one comes again. */
static bool walk_back(fsm_symbolic *self, fsm_relation *back, uint32_t set, fsm_busy_cycle *found)
{
    enum { MOST = 1 << 16 };
    uint32_t machines = self->system->machine_count, count = 0;
    size_t bytes = machines * sizeof(uint32_t);
    uint32_t *states = NULL;
    uint32_t *at = malloc(bytes);
    bool fine = at != NULL && fsm_symbolic_pick(self, set, at);
    while (fine && count < MOST) {
        uint32_t *grown = realloc(states, (count + 1u) * bytes);
        fine = grown != NULL;
        if (!fine)
            break;
        states = grown;
        memcpy(states + (size_t)count++ * machines, at, bytes);
        uint32_t single = fsm_symbolic_single(self, set, at);
        uint32_t before = single == 0 ? 0 : fsm_relation_step(back, single, set);
        fine = before != 0 && fsm_symbolic_pick(self, before, at);
        for (uint32_t i = 0; fine && i < count; i++) {
            if (memcmp(states + (size_t)i * machines, at, bytes) != 0)
                continue;
            found->length = count - i; /* they were found from the last one to the first */
            found->states = malloc(found->length * bytes);
            for (uint32_t n = 0; found->states != NULL && n < found->length; n++)
                memcpy(found->states + (size_t)n * machines, states + (size_t)(count - 1 - n) * machines, bytes);
            free(states);
            free(at);
            return found->states != NULL;
        }
    }
    free(states);
    free(at);
    return false;
}

fsm_busy_cycle fsm_find_busy_cycle(fsm_symbolic *self)
{
    fsm_busy_cycle found = {.known = false};
    filter steps = {.symbolic = self};
    fsm_relation forwards, back;
    if (!find_live(&steps)) {
        found.known = !steps.failed;
    } else if (steps.split) {
        found.needs_copies = true;
    } else if (fsm_relation_make(&forwards, self, false, is_live, &steps)) {
        uint32_t set = endless(self, &forwards);
        found.known = !self->mdd.failed;
        found.found = found.known && set != 0;
        fsm_relation_free(&forwards);
        if (found.found && fsm_mdd_root(&self->mdd, set) && fsm_relation_make(&back, self, true, is_live, &steps)) {
            (void)walk_back(self, &back, set, &found);
            fsm_relation_free(&back);
            fsm_mdd_unroot(&self->mdd, 1);
        }
    }
    free_filter(&steps);
    return found;
}
