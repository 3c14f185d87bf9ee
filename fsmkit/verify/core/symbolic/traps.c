#include "symbolic/traps.h"

#include "symbolic/relation.h"

/* A trap is a set of states that no step leaves, of one configuration, which is not at rest. There is one of a configuration if and
 * only if some states of that cannot reach any other: what cannot is closed under steps, so there is a component in it that no
 * step leaves. The machine is the highest level, and its configuration is a matter of its value there alone. */

typedef struct {
    fsm_symbolic *symbolic;
    fsm_relation back;
    size_t first_root;
    bool failed;
} seeking;

static const fsm_local_info *info_of(const fsm_symbolic *symbolic, uint32_t value)
{
    return fsm_info(symbolic->composition, symbolic->levels[symbolic->level_count].machine, value);
}

static bool rests(const fsm_symbolic *symbolic, uint32_t value)
{
    const fsm_view *view = &info_of(symbolic, value)->view;
    return view->at_rest || view->faulted;
}

/* The states of a set that rest, or that have a configuration; or all others. */
static uint32_t part_of(seeking *self, uint32_t set, uint32_t configuration, bool others)
{
    fsm_symbolic *symbolic = self->symbolic;
    fsm_mdd *mdd = &symbolic->mdd;
    size_t base = fsm_mdd_start(mdd);
    for (uint32_t i = 0; i < fsm_mdd_at(mdd, set)->count && !self->failed; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, set)[i];
        bool is_in = configuration == FSM_NONE ? rests(symbolic, pair.value)
                                               : info_of(symbolic, pair.value)->configuration == configuration;
        if (is_in != others)
            self->failed = !fsm_mdd_push(mdd, pair.value, pair.child);
    }
    uint32_t made = fsm_mdd_make(mdd, symbolic->level_count, base);
    self->failed = self->failed || mdd->failed;
    return made;
}

/* The states of a set from which no step leads out of it in the end; the set is closed under successors, but for
 * states of `out`. */
static uint32_t staying(seeking *self, uint32_t set, uint32_t out)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    if (out == 0 || self->failed)
        return set;
    if (!fsm_mdd_root(mdd, set) || !fsm_mdd_root(mdd, out))
        return 0;
    uint32_t leaving = fsm_relation_close(&self->back, out, set);
    uint32_t left = mdd->failed ? 0 : fsm_mdd_difference(mdd, set, leaving);
    self->failed = self->failed || mdd->failed;
    fsm_mdd_unroot(mdd, 2);
    return left;
}

static void find_in(seeking *self, uint32_t lost, fsm_traps *found)
{
    fsm_symbolic *symbolic = self->symbolic;
    fsm_mdd *mdd = &symbolic->mdd;
    for (uint32_t i = 0; i < fsm_mdd_at(mdd, lost)->count && !self->failed && found->count < FSM_MOST_TRAPS; i++) {
        uint32_t value = fsm_mdd_pairs(mdd, lost)[i].value, configuration = info_of(symbolic, value)->configuration;
        bool seen = false;
        for (uint32_t n = 0; n < i && !seen; n++)
            seen = info_of(symbolic, fsm_mdd_pairs(mdd, lost)[n].value)->configuration == configuration;
        if (seen)
            continue;
        uint32_t stays = staying(self, lost, part_of(self, lost, configuration, true));
        self->failed = self->failed || !fsm_mdd_root(mdd, stays);
        stays = stays == 0 ? 0 : part_of(self, stays, configuration, false);
        if (stays == 0 || self->failed)
            continue;
        mdd->roots[mdd->root_count - 1] = stays;
        found->sets[found->count++] = stays;
    }
}

fsm_traps fsm_find_trap_sets(fsm_symbolic *symbolic)
{
    fsm_mdd *mdd = &symbolic->mdd;
    seeking self = {.symbolic = symbolic, .first_root = mdd->root_count};
    fsm_traps found = {.known = false};
    if (symbolic->system->machine_count != 1 || !fsm_relation_make(&self.back, symbolic, true, NULL, NULL))
        return found;
    uint32_t lost = staying(&self, symbolic->root, part_of(&self, symbolic->root, FSM_NONE, false));
    self.failed = self.failed || !fsm_mdd_root(mdd, lost);
    if (!self.failed && lost != 0)
        find_in(&self, lost, &found);
    found.known = !self.failed && !mdd->failed;
    fsm_relation_free(&self.back);
    mdd->root_count = self.first_root;
    for (uint32_t i = 0; found.known && i < found.count; i++)
        found.known = fsm_mdd_root(mdd, found.sets[i]);
    return found;
}
