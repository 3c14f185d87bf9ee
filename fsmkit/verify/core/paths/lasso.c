#include "paths/lasso.h"

#include "symbolic/evaluation.h"
#include "symbolic/relation.h"
#include "system/tree.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    const fsm_path_context *ways;
    fsm_symbolic *symbolic;
    const fsm_model *model;
    const fsm_fair_sets *sets;
    fsm_relation back;
    fsm_steps steps;      /* of the state looked at */
    uint32_t *actions;    /* of these */
    size_t action_room;
    uint32_t *locals;
    fsm_state at;
    bool unstable;        /* the run comes to no stable state */
    bool stable_seen;
    bool *open;           /* by action: neither taken nor impossible so far */
    size_t round;         /* the root that is the component to go round in */
} walker;

static uint32_t round_of(const walker *self)
{
    return self->symbolic->mdd.roots[self->round];
}

/* The set was made before, which may have moved the roots. */
static void set_root(walker *self, size_t root, uint32_t set)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    mdd->roots[root] = mdd->failed ? 0 : set;
}

static uint32_t get(const walker *self, fsm_set_name name)
{
    return fsm_set_of(self->symbolic, self->sets, name);
}

static bool is_in(walker *self, fsm_state state, uint32_t set)
{
    fsm_tree_unfold(self->symbolic->composition->tree, state, self->locals);
    return fsm_symbolic_has(self->symbolic, set, self->locals);
}

/* Fills in `steps` and `actions`. */
static bool look_at(walker *self, fsm_state state)
{
    fsm_steps_clear(&self->steps, 0);
    if (!fsm_successors(self->model, state, &self->steps))
        return false;
    if (self->steps.count > self->action_room) {
        uint32_t *actions = realloc(self->actions, 2 * self->steps.count * sizeof *actions);
        if (actions == NULL)
            return false;
        self->actions = actions;
        self->action_room = 2 * self->steps.count;
    }
    return self->steps.count == 0 || self->model->fair(self->model->self, state, &self->steps, self->actions);
}

/* --- to the component ----------------------------------------------------------------------------------- */

static bool follow(walker *self, const fsm_path *path)
{
    fsm_steps_clear(&self->steps, 0);
    if (!self->model->initial(self->model->self, &self->steps))
        return false;
    for (size_t i = 0; i < path->count; i++) {
        if (path->steps[i] >= self->steps.count)
            return false;
        self->at = self->steps.items[path->steps[i]].to;
        if (!look_at(self, self->at))
            return false;
    }
    return path->count > 0;
}

static uint32_t single(walker *self, uint32_t set)
{
    fsm_tree_unfold(self->symbolic->composition->tree, self->at, self->locals);
    return fsm_symbolic_single(self->symbolic, set, self->locals);
}

/* Whether a fair run may stay in a component: everything that must occur infinitely often is there. */
static bool is_fair(walker *self)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    uint32_t base = self->unstable ? round_of(self) : fsm_mdd_intersection(mdd, round_of(self), get(self, FSM_SET_STABLE));
    size_t kept = mdd->root_count;
    bool fair = base != 0 && fsm_mdd_root(mdd, base) && fsm_relation_step(&self->back, round_of(self), round_of(self)) != 0;
    for (uint32_t a = 0; fair && a < self->model->action_count; a++) {
        uint32_t without = fsm_mdd_difference(mdd, mdd->roots[kept], fsm_set_where_possible(self->symbolic, self->sets, a));
        fair = without != 0 || fsm_relation_step_by(&self->back, a, a, round_of(self), round_of(self)) != 0;
    }
    mdd->root_count = kept;
    return fair && !mdd->failed;
}

/* A component in which a fair run may stay, to be reached within a set from the current state: that of this state or, since from
 * each state of the set a fair run starts, one of the other reached states, which are fewer each time. */
static bool find_component(walker *self, uint32_t set)
{
    enum { MOST = 4096 };
    fsm_symbolic *s = self->symbolic;
    fsm_mdd *mdd = &s->mdd;
    fsm_relation forwards;
    uint32_t state = single(self, set);
    size_t kept = mdd->root_count, reached = kept + 1;
    bool found = false, fine = fsm_mdd_root(mdd, state) && fsm_mdd_root(mdd, set) && fsm_relation_make(&forwards, s, false, NULL, NULL);
    if (!fine)
        return false;
    for (uint32_t i = 0; fine && !found && i < MOST; i++) {
        uint32_t from = mdd->roots[kept];
        set_root(self, reached, fsm_relation_close(&forwards, from, mdd->roots[reached]));
        set_root(self, self->round, fsm_relation_close(&self->back, from, mdd->roots[reached]));
        found = !mdd->failed && is_fair(self);
        uint32_t others = found || mdd->failed ? 0 : fsm_mdd_difference(mdd, mdd->roots[reached], round_of(self));
        fine = found || fsm_symbolic_pick(s, others, self->locals);
        if (fine && !found)
            set_root(self, kept, fsm_symbolic_single(s, others, self->locals));
        fine = fine && mdd->roots[kept] != 0;
    }
    fsm_relation_free(&forwards);
    mdd->root_count = kept;
    return found;
}

/* --- round it ------------------------------------------------------------------------------------------------ */

static bool is_all_seen(const walker *self)
{
    return self->stable_seen && memchr(self->open, 1, self->model->action_count) == NULL;
}

/* Notes what need not be seen any more once a state has been. */
static void see(walker *self, fsm_state state)
{
    bool stable = is_in(self, state, get(self, FSM_SET_STABLE));
    if (!stable && !self->unstable)
        return;
    self->stable_seen = true;
    for (uint32_t a = 0; a < self->model->action_count; a++)
        self->open[a] = self->open[a] && is_in(self, state, fsm_set_where_possible(self->symbolic, self->sets, a));
}

/* The same of the steps of a path from one number on, which start at a state. */
static bool see_steps(walker *self, fsm_state from, const fsm_path *path, size_t first)
{
    for (size_t i = first; i < path->count; i++) {
        if (!look_at(self, from) || path->steps[i] >= self->steps.count)
            return false;
        if (self->actions[path->steps[i]] != FSM_NONE)
            self->open[self->actions[path->steps[i]]] = false;
        from = self->steps.items[path->steps[i]].to;
        see(self, from);
    }
    return true;
}

/* Where something is seen that has not been yet, or from where a step leads by which it is. */
static uint32_t news(walker *self)
{
    fsm_symbolic *s = self->symbolic;
    fsm_mdd *mdd = &s->mdd;
    uint32_t base = self->unstable ? round_of(self) : fsm_mdd_intersection(mdd, round_of(self), get(self, FSM_SET_STABLE));
    size_t kept = mdd->root_count;
    uint32_t found = self->stable_seen ? 0 : base;
    if (!fsm_mdd_root(mdd, base) || !fsm_mdd_root(mdd, found))
        return 0;
    for (uint32_t a = 0; a < self->model->action_count && !mdd->failed; a++) {
        if (!self->open[a])
            continue;
        uint32_t stepping = fsm_relation_step_by(&self->back, a, a, round_of(self), round_of(self));
        uint32_t without = fsm_mdd_difference(mdd, mdd->roots[kept], fsm_set_where_possible(s, self->sets, a));
        set_root(self, kept + 1, fsm_mdd_union(mdd, mdd->roots[kept + 1], fsm_mdd_union(mdd, stepping, without)));
    }
    found = mdd->roots[kept + 1];
    mdd->root_count = kept;
    return mdd->failed ? 0 : found;
}

/* Takes a step that stays in the component: one of an action that is open, or any. */
static bool take_step(walker *self, bool any, fsm_path *cycle)
{
    if (!look_at(self, self->at))
        return false;
    for (size_t i = 0; i < self->steps.count; i++) {
        bool requested = any || (self->actions[i] != FSM_NONE && self->open[self->actions[i]]);
        if (!requested || !is_in(self, self->steps.items[i].to, round_of(self)))
            continue;
        fsm_state from = self->at;
        self->at = self->steps.items[i].to;
        return fsm_path_add(cycle, (uint32_t)i) && see_steps(self, from, cycle, cycle->count - 1);
    }
    return false;
}

static uint32_t count_open(const walker *self)
{
    uint32_t count = !self->stable_seen;
    for (uint32_t a = 0; a < self->model->action_count; a++)
        count += self->open[a];
    return count;
}

static bool go_round(walker *self, fsm_path *cycle)
{
    const fsm_state first = self->at;
    self->stable_seen = self->unstable;
    memset(self->open, 1, self->model->action_count);
    see(self, first);
    while (!is_all_seen(self)) {
        uint32_t before = count_open(self);
        size_t length = cycle->count;
        fsm_state from = self->at;
        if (!fsm_walk_within(self->ways, &self->back, news(self), round_of(self), &self->at, cycle)
            || !see_steps(self, from, cycle, length))
            return false;
        if (count_open(self) == before && !take_step(self, false, cycle))
            return false;
    }
    if (cycle->count == 0 && !take_step(self, true, cycle))
        return false;
    fsm_tree_unfold(self->symbolic->composition->tree, first, self->locals);
    uint32_t goal = fsm_symbolic_single(self->symbolic, round_of(self), self->locals);
    return fsm_walk_within(self->ways, &self->back, goal, round_of(self), &self->at, cycle);
}

/* --- all ---------------------------------------------------------------------------------------------------- */

static bool walk(walker *self, fsm_path *path, fsm_path *cycle)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    uint32_t core = fsm_mdd_union(mdd, get(self, FSM_SET_ENDS), get(self, FSM_SET_FAIR));
    core = fsm_mdd_union(mdd, core, get(self, FSM_SET_ENDLESS));
    if (!follow(self, path)
        || !fsm_walk_within(self->ways, &self->back, core, get(self, FSM_SET_OPEN), &self->at, path))
        return false;
    if (is_in(self, self->at, get(self, FSM_SET_ENDS)))
        return true;
    self->unstable = !is_in(self, self->at, get(self, FSM_SET_FAIR));
    uint32_t within = get(self, self->unstable ? FSM_SET_ENDLESS : FSM_SET_FAIR);
    return find_component(self, within)
        && fsm_walk_within(self->ways, &self->back, round_of(self),
                           get(self, self->unstable ? FSM_SET_ENDLESS : FSM_SET_FAIR), &self->at, path)
        && go_round(self, cycle);
}

bool fsm_cycle_in_sets(const fsm_path_context *ways, const fsm_fair_sets *sets, fsm_path *path, fsm_path *cycle)
{
    fsm_symbolic *s = ways->symbolic;
    const fsm_model *model = fsm_composition_model(s->composition);
    walker self = {.ways = ways, .symbolic = s, .model = model, .sets = sets, .round = s->mdd.root_count};
    self.locals = malloc(s->system->machine_count * sizeof *self.locals);
    self.open = malloc((model->action_count + 1u) * sizeof *self.open);
    bool fine = self.locals != NULL && self.open != NULL && fsm_mdd_root(&s->mdd, 0)
        && fsm_relation_make(&self.back, s, true, NULL, NULL);
    if (fine) {
        fine = walk(&self, path, cycle);
        fsm_relation_free(&self.back);
    }
    s->mdd.root_count = self.round;
    free(self.steps.items);
    free(self.actions);
    free(self.locals);
    free(self.open);
    return fine;
}
