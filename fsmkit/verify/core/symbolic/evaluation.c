#include "symbolic/evaluation.h"

#include "symbolic/context.h"
#include "system/flat.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_COMBINATIONS = 1000000 };
enum { PROJECT = 3, RESTRICT }; /* operations, besides those of mdd.c */

typedef struct {
    fsm_symbolic *symbolic;
    fsm_mdd *mdd;
    uint32_t property, lowest; /* level that is looked at */
    uint32_t **aspect;         /* of each such level, by value: the first value that looks the same; else NULL */
    uint32_t all;              /* the terminal of a projection */
    uint32_t *values, *locals; /* of a combination: by level, by machine */
    uint64_t combinations;
    bool failed, wants_set, found;
} evaluating;

/* Whether anything that properties see of a machine depends on a variable. */
static bool sees(evaluating *self, uint32_t machine, uint32_t place, unsigned char *one, unsigned char *other, size_t size)
{
    fsm_symbolic *s = self->symbolic;
    const fsm_level *at = &s->levels[s->level_of[machine]];
    uint32_t base = 0, step = 1;
    while (base + 1 < at->room && !at->confirmed[base])
        base++;
    for (uint32_t i = 0; i < place; i++)
        step *= s->split.variables[s->split.machines[machine].variables[i]].count;
    memset(one, 0, size);
    s->system->see(machine, fsm_local(s->composition, machine, base), one);
    for (uint32_t value = 1; value < s->split.variables[s->split.machines[machine].variables[place]].count; value++) {
        uint32_t whole = fsm_split_whole(&s->split, machine, base, value * step);
        if (whole == FSM_NONE)
            return true;
        memset(other, 0, size);
        s->system->see(machine, fsm_local(s->composition, machine, whole), other);
        if (memcmp(one, other, size) != 0)
            return true;
    }
    return false;
}

/* Levels of shared variables that are looked at: each value looks different. */
static bool find_variables(evaluating *self, uint32_t machine)
{
    fsm_symbolic *s = self->symbolic;
    const fsm_split_machine *split = &s->split.machines[machine];
    size_t size = s->system->seen_sizes[machine] + 1;
    unsigned char *one = malloc(size), *other = malloc(size);
    bool fine = one != NULL && other != NULL;
    for (uint32_t place = 0; fine && place < split->count; place++) {
        uint32_t level = s->level_of_variable[split->variables[place]], count = s->split.variables[split->variables[place]].count;
        if (self->aspect[level] != NULL || !sees(self, machine, place, one, other, size))
            continue;
        self->aspect[level] = malloc(count * sizeof **self->aspect);
        fine = self->aspect[level] != NULL;
        for (uint32_t value = 0; fine && value < count; value++)
            self->aspect[level][value] = value;
        self->lowest = level < self->lowest ? level : self->lowest;
    }
    free(one);
    free(other);
    return fine;
}

static bool find_aspects(evaluating *self, uint32_t machine)
{
    const fsm_symbolic *s = self->symbolic;
    uint32_t level = s->level_of[machine], room = s->levels[level].room;
    size_t size = s->system->seen_sizes[machine] + 1;
    uint32_t *aspect = calloc(room + 1u, sizeof *aspect), *first = calloc(room + 1u, sizeof *first);
    unsigned char *seen = malloc(size);
    fsm_store known;
    bool fine = fsm_store_init(&known, size) && aspect != NULL && first != NULL && seen != NULL;
    for (uint32_t value = 0; fine && value < room; value++) {
        if (!s->levels[level].confirmed[value])
            continue;
        bool added;
        memset(seen, 0, size);
        s->system->see(machine, fsm_local(s->composition, machine, value), seen);
        uint32_t number = fsm_store_insert(&known, seen, SIZE_MAX, &added);
        fine = number != FSM_NONE;
        if (fine && added)
            first[number] = value;
        aspect[value] = fine ? first[number] : 0;
    }
    fsm_store_free(&known);
    free(first);
    free(seen);
    self->aspect[level] = aspect;
    return fine;
}

static uint32_t project(evaluating *self, uint32_t node)
{
    fsm_mdd *mdd = self->mdd;
    uint32_t level = fsm_mdd_at(mdd, node)->level;
    if (node == 0 || level < self->lowest)
        return node == 0 ? 0 : self->all;
    const fsm_mdd_entry *known = fsm_mdd_entry_of(&mdd->others, node, 0, PROJECT);
    if (fsm_mdd_knows(known, node, 0, PROJECT))
        return known->result;
    const uint32_t *aspect = self->aspect[level];
    fsm_mdd_buffer *buffer = aspect == NULL || mdd->failed ? NULL : fsm_mdd_take(mdd, level);
    uint32_t result = 0;
    for (uint32_t i = 0; i < fsm_mdd_at(mdd, node)->count && !mdd->failed; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, node)[i];
        uint32_t below = project(self, pair.child);
        if (aspect == NULL)
            result = fsm_mdd_union(mdd, result, below);
        else
            (void)fsm_mdd_set(mdd, buffer, aspect[pair.value],
                              fsm_mdd_union(mdd, fsm_mdd_in(buffer, aspect[pair.value]), below));
    }
    if (buffer != NULL)
        result = fsm_mdd_finish(mdd, buffer);
    if (!mdd->failed)
        fsm_mdd_keep(mdd, &mdd->others, (fsm_mdd_entry){node, 0, PROJECT, result});
    return result;
}

static bool evaluate_one(evaluating *self)
{
    fsm_reads reads = self->symbolic->system->reads[self->property];
    const fsm_symbolic *s = self->symbolic;
    for (uint32_t i = 0; i < reads.count; i++) {
        bool has_slots = fsm_symbolic_has_slots(s, reads.machines[i]); /* nothing is seen of a queue */
        self->locals[reads.machines[i]] = has_slots ? self->values[s->level_of[reads.machines[i]]]
                                                    : fsm_symbolic_local(self->symbolic, reads.machines[i], self->values);
        self->failed = self->failed || self->locals[reads.machines[i]] == FSM_NONE;
    }
    return !self->failed && fsm_flat_evaluate(self->symbolic->composition, self->locals, self->property);
}

/* The combinations that the property marks. */
static uint32_t evaluate_all(evaluating *self, uint32_t node)
{
    fsm_mdd *mdd = self->mdd;
    uint32_t level = fsm_mdd_at(mdd, node)->level;
    if (self->failed || (self->found && !self->wants_set))
        return 0;
    if (level == 0) {
        self->failed = ++self->combinations > MOST_COMBINATIONS;
        bool marked = !self->failed && evaluate_one(self);
        self->found = self->found || marked;
        return marked ? node : 0;
    }
    size_t base = fsm_mdd_start(mdd);
    for (uint32_t i = 0; i < fsm_mdd_at(mdd, node)->count && !self->failed; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, node)[i];
        self->values[level] = pair.value;
        uint32_t below = evaluate_all(self, pair.child);
        if (below != 0 && !fsm_mdd_push(mdd, pair.value, below))
            self->failed = true;
    }
    uint32_t made = fsm_mdd_make(mdd, level, base);
    self->failed = self->failed || mdd->failed;
    return made;
}

/* The states of a set that are in some of the combinations. */
static uint32_t restrict_to(evaluating *self, uint32_t node, uint32_t to)
{
    fsm_mdd *mdd = self->mdd;
    if (node == 0 || to == 0 || fsm_mdd_at(mdd, to)->level == 0)
        return to == 0 ? 0 : node;
    const fsm_mdd_entry *known = fsm_mdd_entry_of(&mdd->others, node, to, RESTRICT);
    if (fsm_mdd_knows(known, node, to, RESTRICT))
        return known->result;
    uint32_t level = fsm_mdd_at(mdd, node)->level;
    bool is_same = fsm_mdd_at(mdd, to)->level == level;
    size_t base = fsm_mdd_start(mdd);
    for (uint32_t i = 0; i < fsm_mdd_at(mdd, node)->count && !mdd->failed; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, node)[i];
        uint32_t other = is_same ? fsm_mdd_child(mdd, to, self->aspect[level][pair.value]) : to;
        uint32_t below = restrict_to(self, pair.child, other);
        if (below != 0)
            (void)fsm_mdd_push(mdd, pair.value, below);
    }
    uint32_t made = fsm_mdd_make(mdd, level, base);
    if (!mdd->failed)
        fsm_mdd_keep(mdd, &mdd->others, (fsm_mdd_entry){node, to, RESTRICT, made});
    return made;
}

static bool begin(evaluating *self)
{
    const fsm_symbolic *s = self->symbolic;
    fsm_reads reads = s->system->reads[self->property];
    self->aspect = calloc((size_t)s->level_count + 1, sizeof *self->aspect);
    self->locals = calloc(s->system->machine_count, sizeof *self->locals);
    self->values = calloc((size_t)s->level_count + 1, sizeof *self->values);
    self->all = fsm_symbolic_terminal(self->symbolic, (fsm_waiting){0, 0, 0});
    bool fine = self->aspect != NULL && self->locals != NULL && self->values != NULL && self->all != 0;
    self->lowest = s->level_count + 1;
    for (uint32_t i = 0; fine && i < reads.count; i++) {
        uint32_t level = s->level_of[reads.machines[i]];
        self->lowest = level < self->lowest ? level : self->lowest;
        fine = find_aspects(self, reads.machines[i]) && find_variables(self, reads.machines[i]);
    }
    fsm_mdd_forget(&self->symbolic->mdd, &self->symbolic->mdd.others);
    return fine;
}

/* A property, or a part of one. */
static fsm_evaluated evaluate(fsm_symbolic *self, uint32_t set, uint32_t property, bool wants_set)
{
    evaluating all = {.symbolic = self, .mdd = &self->mdd, .property = property, .wants_set = wants_set};
    fsm_evaluated found = {.known = false};
    if (begin(&all)) {
        uint32_t projected = project(&all, set);
        uint32_t combinations = projected == 0 ? 0 : evaluate_all(&all, projected);
        found.known = !self->mdd.failed && !all.failed;
        found.found = all.found;
        if (found.known && wants_set)
            found.marked = restrict_to(&all, set, combinations);
        found.known = found.known && !self->mdd.failed;
        found.combinations = all.combinations;
    }
    for (uint32_t level = 0; all.aspect != NULL && level <= self->level_count; level++)
        free(all.aspect[level]);
    free(all.aspect);
    free(all.locals);
    free(all.values);
    fsm_mdd_forget(&self->mdd, &self->mdd.others);
    return found;
}

static fsm_evaluated evaluate_parts(fsm_symbolic *self, uint32_t set, fsm_parts parts, bool wants_set)
{
    fsm_evaluated found = {.known = true};
    for (uint32_t i = 0; found.known && i < parts.count && (wants_set || !found.found); i++) {
        fsm_evaluated one = evaluate(self, set, parts.first + i, wants_set);
        found.known = one.known;
        found.found = found.found || one.found;
        found.combinations += one.combinations;
        if (wants_set)
            found.marked = fsm_mdd_union(&self->mdd, found.marked, one.marked);
    }
    found.known = found.known && !self->mdd.failed;
    return found;
}

/* One that looks at many machines has too many combinations as a whole; its parts may have few. */
fsm_evaluated fsm_evaluate(fsm_symbolic *self, uint32_t set, uint32_t property, bool wants_set)
{
    enum { FEW_MACHINES = 8 };
    const fsm_parts parts = self->system->parts[property];
    fsm_evaluated found = {.known = false};
    if (parts.count == 0 || self->system->reads[property].count <= FEW_MACHINES)
        found = evaluate(self, set, property, wants_set);
    if (!found.known && parts.count > 0 && !self->mdd.failed)
        found = evaluate_parts(self, set, parts, wants_set);
    return found;
}

/* --- deadlocks -------------------------------------------------------------------------------------- */

typedef struct {
    fsm_symbolic *symbolic;
    fsm_contexts contexts;
    fsm_hash_map known; /* node and context -> node, for where all rest so far, and not */
    bool failed;
} dying;

static uint32_t dead(dying *self, uint32_t node, uint32_t context, bool rest)
{
    fsm_symbolic *s = self->symbolic;
    uint32_t level = fsm_mdd_at(&s->mdd, node)->level;
    if (node == 0 || level == 0 || self->failed)
        return rest ? 0 : node;
    uint64_t key = (uint64_t)node << 32 | context << 1 | rest;
    const uint64_t *known = fsm_hash_map_find(&self->known, key);
    if (known != NULL)
        return (uint32_t)*known;
    const fsm_carried *carried = &self->contexts.carried[level];
    size_t base = fsm_mdd_start(&s->mdd);
    for (uint32_t n = 0; n < fsm_mdd_at(&s->mdd, node)->count && !self->failed; n++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(&s->mdd, node)[n];
        bool quiet = true, rests = rest;
        for (uint32_t i = 0; quiet && i < carried->machine_count; i++) {
            uint32_t machine = carried->machines[i];
            fsm_known_local local;
            if (!fsm_context_local(&self->contexts, level, context, pair.value, machine, &local)) {
                self->failed = true;
                break;
            }
            const fsm_local_info *info = fsm_info(s->composition, machine, local.own);
            quiet = info->view.waiting == 0 && (info->view.awaited == 0 || s->system->machines[machine]->monitor)
                && !info->view.faulted && !info->busy && !info->fair && !fsm_info(s->composition, machine, local.open)->fair;
            rests = rests && info->view.at_rest;
        }
        uint32_t next = quiet ? fsm_context_below(&self->contexts, level, context, pair.value) : FSM_NONE;
        uint32_t below = next == FSM_NONE ? 0 : dead(self, pair.child, next, rests);
        if (below != 0)
            (void)fsm_mdd_push(&s->mdd, pair.value, below);
    }
    uint32_t made = fsm_mdd_make(&s->mdd, level, base);
    self->failed = self->failed || s->mdd.failed || !fsm_hash_map_add(&self->known, key, made);
    return made;
}

uint32_t fsm_dead_states(fsm_symbolic *self, uint32_t set)
{
    dying all = {.symbolic = self};
    uint32_t found = 0;
    if (!self->system->open && fsm_contexts_init(&all.contexts, self)) {
        found = dead(&all, set, 0, true);
        fsm_contexts_free(&all.contexts);
    }
    fsm_hash_map_free(&all.known);
    return all.failed ? 0 : found;
}

/* --- single states ------------------------------------------------------------------------------------ */

bool fsm_symbolic_has(fsm_symbolic *self, uint32_t set, const uint32_t *locals)
{
    while (set != 0 && fsm_mdd_at(&self->mdd, set)->level > 0)
        set = fsm_mdd_child(&self->mdd, set, fsm_symbolic_value(self, fsm_mdd_at(&self->mdd, set)->level, locals));
    return set != 0;
}

bool fsm_symbolic_pick(fsm_symbolic *self, uint32_t set, uint32_t *locals)
{
    uint32_t *values = calloc((size_t)self->level_count + 1, sizeof *values);
    bool fine = values != NULL && set != 0;
    for (uint32_t level; fine && (level = fsm_mdd_at(&self->mdd, set)->level) > 0;) {
        fsm_mdd_pair first = *fsm_mdd_pairs(&self->mdd, set);
        values[level] = first.value;
        set = first.child;
    }
    for (uint32_t i = 0; fine && i < self->system->machine_count; i++) {
        locals[i] = fsm_symbolic_local(self, i, values);
        fine = locals[i] != FSM_NONE;
    }
    free(values);
    return fine;
}

uint32_t fsm_symbolic_single(fsm_symbolic *self, uint32_t set, const uint32_t *locals)
{
    fsm_mdd *mdd = &self->mdd;
    uint32_t node = set;
    while (node != 0 && fsm_mdd_at(mdd, node)->level > 0)
        node = fsm_mdd_child(mdd, node, fsm_symbolic_value(self, fsm_mdd_at(mdd, node)->level, locals));
    for (uint32_t level = 1; node != 0 && level <= self->level_count; level++) {
        size_t base = fsm_mdd_start(mdd);
        (void)fsm_mdd_push(mdd, fsm_symbolic_value(self, level, locals), node);
        node = fsm_mdd_make(mdd, level, base);
    }
    return node;
}
