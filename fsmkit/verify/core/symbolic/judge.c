#include "symbolic/judge.h"

#include "system/flat.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_COMBINATIONS = 1000000 };
enum { PROJECT = 3, RESTRICT, DEAD, DEAD_OR_RESTING }; /* operations, besides those of mdd.c */

typedef struct {
    fsm_symbolic *symbolic;
    fsm_mdd *mdd;
    uint32_t property, lowest; /* level that is looked at */
    uint32_t **aspect;         /* of each such level, by value: the first value that looks the same; else NULL */
    uint32_t all;              /* the terminal of a projection */
    uint32_t *locals;          /* by machine, of a combination */
    uint64_t combinations;
    bool failed, wants_set, found;
} judging;

static bool find_aspects(judging *self, uint32_t machine)
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

static uint32_t project(judging *self, uint32_t node)
{
    fsm_mdd *mdd = self->mdd;
    uint32_t level = fsm_mdd_at(mdd, node)->level;
    if (node == 0 || level < self->lowest)
        return node == 0 ? 0 : self->all;
    const fsm_mdd_entry *known = fsm_mdd_entry_of(&mdd->others, node, 0, PROJECT, 0);
    if (fsm_mdd_knows(known, node, 0, PROJECT, 0))
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
        *fsm_mdd_entry_of(&mdd->others, node, 0, PROJECT, 0) = (fsm_mdd_entry){node, 0, PROJECT, 0, result};
    return result;
}

/* The combinations that the property marks. */
static uint32_t judge_all(judging *self, uint32_t node)
{
    fsm_mdd *mdd = self->mdd;
    uint32_t level = fsm_mdd_at(mdd, node)->level;
    if (self->failed || (self->found && !self->wants_set))
        return 0;
    if (level == 0) {
        self->failed = ++self->combinations > MOST_COMBINATIONS;
        bool marked = !self->failed && fsm_flat_judge(self->symbolic->composition, self->locals, self->property);
        self->found = self->found || marked;
        return marked ? node : 0;
    }
    size_t base = fsm_mdd_begin(mdd);
    for (uint32_t i = 0; i < fsm_mdd_at(mdd, node)->count && !self->failed; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, node)[i];
        self->locals[self->symbolic->levels[level].machine] = pair.value;
        uint32_t below = judge_all(self, pair.child);
        if (below != 0 && !fsm_mdd_push(mdd, pair.value, below))
            self->failed = true;
    }
    uint32_t made = fsm_mdd_make(mdd, level, base);
    self->failed = self->failed || mdd->failed;
    return made;
}

/* The states of a set that are in some of the combinations. */
static uint32_t restrict_to(judging *self, uint32_t node, uint32_t to)
{
    fsm_mdd *mdd = self->mdd;
    if (node == 0 || to == 0 || fsm_mdd_at(mdd, to)->level == 0)
        return to == 0 ? 0 : node;
    const fsm_mdd_entry *known = fsm_mdd_entry_of(&mdd->others, node, to, RESTRICT, 0);
    if (fsm_mdd_knows(known, node, to, RESTRICT, 0))
        return known->result;
    uint32_t level = fsm_mdd_at(mdd, node)->level;
    bool is_same = fsm_mdd_at(mdd, to)->level == level;
    size_t base = fsm_mdd_begin(mdd);
    for (uint32_t i = 0; i < fsm_mdd_at(mdd, node)->count && !mdd->failed; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, node)[i];
        uint32_t other = is_same ? fsm_mdd_child(mdd, to, self->aspect[level][pair.value]) : to;
        uint32_t below = restrict_to(self, pair.child, other);
        if (below != 0)
            (void)fsm_mdd_push(mdd, pair.value, below);
    }
    uint32_t made = fsm_mdd_make(mdd, level, base);
    if (!mdd->failed)
        *fsm_mdd_entry_of(&mdd->others, node, to, RESTRICT, 0) = (fsm_mdd_entry){node, to, RESTRICT, 0, made};
    return made;
}

static bool begin(judging *self)
{
    const fsm_symbolic *s = self->symbolic;
    fsm_reads reads = s->system->reads[self->property];
    self->aspect = calloc((size_t)s->level_count + 1, sizeof *self->aspect);
    self->locals = calloc(s->system->machine_count, sizeof *self->locals);
    self->all = fsm_symbolic_terminal(self->symbolic, (fsm_waiting){0, 0, 0});
    bool fine = self->aspect != NULL && self->locals != NULL && self->all != 0;
    self->lowest = s->level_count + 1;
    for (uint32_t i = 0; fine && i < reads.count; i++) {
        uint32_t level = s->level_of[reads.machines[i]];
        self->lowest = level < self->lowest ? level : self->lowest;
        fine = find_aspects(self, reads.machines[i]);
    }
    fsm_mdd_forget(&self->symbolic->mdd, &self->symbolic->mdd.others);
    return fine;
}

fsm_judged fsm_judge(fsm_symbolic *self, uint32_t set, uint32_t property, bool wants_set)
{
    judging all = {.symbolic = self, .mdd = &self->mdd, .property = property, .wants_set = wants_set};
    fsm_judged found = {.known = false};
    if (begin(&all)) {
        uint32_t projected = project(&all, set);
        uint32_t combinations = projected == 0 ? 0 : judge_all(&all, projected);
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
    fsm_mdd_forget(&self->mdd, &self->mdd.others);
    return found;
}

/* --- deadlocks -------------------------------------------------------------------------------------- */

static uint32_t dead(fsm_symbolic *self, uint32_t node, bool rest)
{
    fsm_mdd *mdd = &self->mdd;
    uint32_t level = fsm_mdd_at(mdd, node)->level, what = rest ? DEAD : DEAD_OR_RESTING;
    if (node == 0 || level == 0)
        return rest ? 0 : node;
    const fsm_mdd_entry *known = fsm_mdd_entry_of(&mdd->others, node, 0, what, 0);
    if (fsm_mdd_knows(known, node, 0, what, 0))
        return known->result;
    uint32_t machine = self->levels[level].machine;
    size_t base = fsm_mdd_begin(mdd);
    for (uint32_t i = 0; i < fsm_mdd_at(mdd, node)->count && !mdd->failed; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, node)[i];
        const fsm_local_info *info = fsm_info(self->composition, machine, pair.value);
        if (info->view.waiting > 0 || (info->view.awaited > 0 && !self->system->machines[machine]->monitor)
            || info->view.faulted || info->busy || info->owed)
            continue;
        uint32_t below = dead(self, pair.child, rest && info->view.at_rest);
        if (below != 0)
            (void)fsm_mdd_push(mdd, pair.value, below);
    }
    uint32_t made = fsm_mdd_make(mdd, level, base);
    if (!mdd->failed)
        *fsm_mdd_entry_of(&mdd->others, node, 0, what, 0) = (fsm_mdd_entry){node, 0, what, 0, made};
    return made;
}

uint32_t fsm_dead_states(fsm_symbolic *self, uint32_t set)
{
    return self->system->open ? 0 : dead(self, set, true);
}

/* --- single states ------------------------------------------------------------------------------------ */

bool fsm_symbolic_has(const fsm_symbolic *self, uint32_t set, const uint32_t *locals)
{
    while (set != 0 && fsm_mdd_at(&self->mdd, set)->level > 0)
        set = fsm_mdd_child(&self->mdd, set, locals[self->levels[fsm_mdd_at(&self->mdd, set)->level].machine]);
    return set != 0;
}

bool fsm_symbolic_pick(const fsm_symbolic *self, uint32_t set, uint32_t *locals)
{
    for (uint32_t level; set != 0 && (level = fsm_mdd_at(&self->mdd, set)->level) > 0;) {
        fsm_mdd_pair first = *fsm_mdd_pairs(&self->mdd, set);
        locals[self->levels[level].machine] = first.value;
        set = first.child;
    }
    return set != 0;
}
