#include "liveness/fair_sets.h"

#include "symbolic/evaluation.h"
#include "symbolic/relation.h"

#include <stdlib.h>

typedef struct {
    fsm_symbolic *symbolic;
    fsm_mdd *mdd;
    fsm_relation back;
    fsm_fair_sets *found;
    uint32_t actions, machines;
} deciding;

static uint32_t get(const deciding *self, fsm_set_name name)
{
    return fsm_set_of(self->symbolic, self->found, name);
}

static uint32_t possible(const deciding *self, uint32_t action)
{
    return fsm_set_where_possible(self->symbolic, self->found, action);
}

/* Keeps a set; whether all went well so far. */
static bool put(deciding *self, uint32_t name, uint32_t set)
{
    self->mdd->roots[self->found->first_root + name] = self->mdd->failed ? 0 : set;
    return !self->mdd->failed;
}

/* --- what is looked at -------------------------------------------------------------------------------- */

static bool find_unanswered(deciding *self, uint32_t request, uint32_t answer)
{
    fsm_symbolic *s = self->symbolic;
    fsm_relation steps;
    fsm_evaluated answered = fsm_evaluate(s, s->root, answer, true);
    if (!answered.known)
        return false;
    uint32_t others = fsm_mdd_difference(self->mdd, s->root, answered.marked);
    if (!put(self, FSM_SET_OPEN, others))
        return false;
    fsm_evaluated asking = fsm_evaluate(s, others, request, true);
    if (!asking.known || !put(self, FSM_SET_REQUESTS, asking.marked) || !fsm_relation_make(&steps, s, false, NULL, NULL))
        return false;
    bool fine = put(self, FSM_SET_OPEN, fsm_relation_close(&steps, asking.marked, others));
    fsm_relation_free(&steps);
    return fine;
}

/* The states in which some step of an action is possible: all steps lead to known states. */
static uint32_t where_possible(deciding *self, uint32_t first, uint32_t last)
{
    return fsm_relation_step_by(&self->back, first, last, self->symbolic->root, get(self, FSM_SET_OPEN));
}

/* Actions below the number of machines are what these do by themselves: where one is possible is no stable state. */
static bool find_possible(deciding *self, bool timeless)
{
    uint32_t busy = where_possible(self, 0, self->machines - 1);
    uint32_t stable = fsm_mdd_difference(self->mdd, get(self, FSM_SET_OPEN), busy);
    if (!put(self, FSM_SET_STABLE, stable) || !put(self, FSM_SET_UNSTABLE, timeless ? busy : 0) || !put(self, FSM_SET_ENDS, stable))
        return false;
    for (uint32_t action = timeless ? 0 : self->machines; action < self->actions; action++) {
        uint32_t where = where_possible(self, action, action);
        if (!put(self, FSM_SETS + action, where))
            return false;
        if (action >= self->machines && !put(self, FSM_SET_ENDS, fsm_mdd_difference(self->mdd, get(self, FSM_SET_ENDS), where)))
            return false;
    }
    return true;
}

/* --- the greatest fixed point -------------------------------------------------------------------------- */

/* Demands, by number: a next step; a stable state; then one for each action. */
enum { NEXT, STABLE, FIRST_ACTION };

static bool is_demanded(const deciding *self, uint32_t demand, bool unstable)
{
    uint32_t base = get(self, unstable ? FSM_SET_UNSTABLE : FSM_SET_STABLE);
    if (demand == NEXT)
        return true;
    if (demand == STABLE)
        return !unstable;
    uint32_t action = demand - FIRST_ACTION;
    if (!unstable && action < self->machines)
        return false; /* met by any stable state */
    return fsm_mdd_intersection(self->mdd, base, possible(self, action)) != 0;
}

/* The states of a set that meet a demand within it. */
static uint32_t meet(deciding *self, uint32_t demand, uint32_t set, bool unstable)
{
    fsm_mdd *mdd = self->mdd;
    if (demand == NEXT)
        return fsm_relation_step(&self->back, set, set);
    uint32_t stepping = 0, action = demand - FIRST_ACTION;
    if (demand != STABLE)
        stepping = fsm_relation_step_by(&self->back, action, action, set, set);
    uint32_t goal = unstable ? set : fsm_mdd_intersection(mdd, set, get(self, FSM_SET_STABLE));
    if (demand != STABLE)
        goal = fsm_mdd_union(mdd, fsm_mdd_difference(mdd, goal, possible(self, action)), stepping);
    return mdd->failed || goal == set ? set : fsm_relation_close(&self->back, goal, set);
}

/* Takes away from a set what does not meet all demands. */
static bool narrow(deciding *self, fsm_set_name name, uint32_t set, bool unstable)
{
    uint32_t demands = FIRST_ACTION + self->actions, met = 0, wanted = 0;
    bool *demanded = calloc(demands, sizeof *demanded);
    bool fine = demanded != NULL && put(self, name, set);
    for (uint32_t demand = 0; fine && demand < demands; demand++) {
        demanded[demand] = is_demanded(self, demand, unstable);
        wanted += demanded[demand];
        fine = !self->mdd->failed;
    }
    for (uint32_t demand = 0; fine && met < wanted && get(self, name) != 0; demand = (demand + 1) % demands) {
        if (!demanded[demand])
            continue;
        uint32_t before = get(self, name);
        fine = put(self, name, meet(self, demand, before, unstable)); /* until then `before` is a root: its number is its own */
        met = get(self, name) == before ? met + 1 : 0; /* in a row, without anything that was taken away */
    }
    free(demanded);
    return fine;
}

/* --- all ---------------------------------------------------------------------------------------------------- */

static bool find_hopeless(deciding *self)
{
    fsm_mdd *mdd = self->mdd;
    uint32_t core = fsm_mdd_union(mdd, get(self, FSM_SET_ENDS), get(self, FSM_SET_FAIR));
    core = fsm_mdd_union(mdd, core, get(self, FSM_SET_ENDLESS));
    uint32_t hopeless = core == 0 ? 0 : fsm_relation_close(&self->back, core, get(self, FSM_SET_OPEN));
    return put(self, FSM_SET_HOPELESS, fsm_mdd_intersection(mdd, hopeless, get(self, FSM_SET_REQUESTS)));
}

/* Where a run may end the answer is known; then the rest, which shows only whether another way is shorter, has a limit. */
static bool find_fair(deciding *self, bool timeless)
{
    enum { FEW_NODES = 2000000 };
    fsm_symbolic *s = self->symbolic;
    bool ends = get(self, FSM_SET_ENDS) != 0;
    if (ends)
        s->max_created = s->mdd.made + FEW_NODES;
    self->found->has_all = narrow(self, FSM_SET_FAIR, get(self, FSM_SET_OPEN), false)
        && (!timeless || narrow(self, FSM_SET_ENDLESS, get(self, FSM_SET_UNSTABLE), true));
    s->max_created = 0;
    if (self->found->has_all || !ends || s->outcome != FSM_COMPLETE)
        return self->found->has_all;
    s->mdd.failed = false; /* nodes created before are valid */
    return put(self, FSM_SET_FAIR, 0) && put(self, FSM_SET_ENDLESS, 0);
}

fsm_fair_sets fsm_find_fair_sets(fsm_symbolic *symbolic, uint32_t request, uint32_t answer, bool timeless)
{
    fsm_mdd *mdd = &symbolic->mdd;
    fsm_fair_sets found = {.first_root = mdd->root_count};
    deciding self = {.symbolic = symbolic, .mdd = mdd, .found = &found, .machines = symbolic->system->machine_count,
                     .actions = fsm_composition_model(symbolic->composition)->action_count};
    bool fine = true;
    for (uint32_t i = 0; fine && i < FSM_SETS + self.actions; i++)
        fine = fsm_mdd_root(mdd, 0);
    bool reached = fine && find_unanswered(&self, request, answer);
    found.unevaluated = fine && !reached && !mdd->failed && symbolic->outcome == FSM_COMPLETE;
    if (reached && get(&self, FSM_SET_REQUESTS) == 0) {
        found.known = found.has_all = true;
    } else if (reached && fsm_relation_make(&self.back, symbolic, true, NULL, NULL)) {
        found.known = find_possible(&self, timeless) && find_fair(&self, timeless) && find_hopeless(&self);
        found.violated = found.known && get(&self, FSM_SET_HOPELESS) != 0;
        fsm_relation_free(&self.back);
    }
    if (!found.known)
        mdd->root_count = found.first_root;
    return found;
}
