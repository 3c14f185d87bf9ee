#include "paths/symbolic_paths.h"

#include "symbolic/evaluation.h"
#include "system/tree.h"
#include "paths/approach.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

/* --- by a search that keeps each state ------------------------------------------------------------------ */

static uint64_t most_states; /* of the current search: its context is the pace */

static bool keep_on(fsm_search *search)
{
    if (!fsm_keep_pace(search))
        return false;
    if (search->passed.count > most_states)
        search->outcome = FSM_OUT_OF_MEMORY;
    return search->outcome == FSM_COMPLETE;
}

static bool begin(const fsm_path_context *self, fsm_search *search)
{
    if (!fsm_search_init(search, fsm_composition_model(self->symbolic->composition), self->memory))
        return false;
    most_states = self->states;
    search->keep_on = keep_on;
    search->seeks_on = fsm_seek_on;
    search->context = self->pace;
    search->sleepless = self->sleepless;
    return true;
}

void fsm_paths_of_search(fsm_search *search, const bool *requested, fsm_path *paths)
{
    fsm_search_forget(search);
    for (uint32_t mark = 0; mark < search->model->mark_count; mark++) {
        const fsm_witness *witness = &search->witnesses[mark];
        if (!requested[mark] || witness->count == 0)
            continue;
        bool found = witness->at.state == FSM_NO_STATE || fsm_path_to(search, &witness->at, &paths[mark]);
        if (!found || (witness->step != FSM_NONE && !fsm_path_add(&paths[mark], witness->step)))
            paths[mark].count = 0;
    }
}

void fsm_paths_to_marks(const fsm_path_context *self, const bool *requested, fsm_path *paths)
{
    fsm_search search;
    uint32_t count = 0;
    for (uint32_t mark = 0; mark < fsm_composition_model(self->symbolic->composition)->mark_count; mark++)
        count += requested[mark];
    if (count == 0 || !begin(self, &search))
        return;
    search.awaited = requested;
    search.awaited_count = count;
    fsm_search_run(&search);
    fsm_paths_of_search(&search, requested, paths);
    fsm_search_free(&search);
}

typedef struct {
    const fsm_path_context *ways;
    uint32_t set, *locals;
} membership;

static bool is_member(void *context, fsm_state state)
{
    const membership *self = context;
    fsm_tree_unfold(self->ways->symbolic->composition->tree, state, self->locals);
    return fsm_symbolic_has(self->ways->symbolic, self->set, self->locals);
}

bool fsm_path_to_set(const fsm_path_context *self, uint32_t set, fsm_path *path)
{
    fsm_search search;
    fsm_found group = {.state = FSM_NO_STATE};
    membership requested = {self, set, malloc(self->symbolic->system->machine_count * sizeof *requested.locals)};
    if (requested.locals == NULL || set == 0 || !begin(self, &search)) {
        free(requested.locals);
        return false;
    }
    search.is_target = is_member;
    search.target_context = &requested;
    search.groups = &group;
    search.group_count = search.groups_left = 1;
    fsm_search_run(&search);
    fsm_search_forget(&search);
    bool fine = group.state != FSM_NO_STATE && fsm_path_to(&search, &group, path);
    if (!fine)
        path->count = 0;
    search.groups = NULL;
    search.group_count = 0;
    fsm_search_free(&search);
    free(requested.locals);
    return fine;
}

/* --- by distances ------------------------------------------------------------------------------------------ */

/* Sets of the states at each distance from a goal; each is a root. */
typedef struct {
    uint32_t *sets, count, room;
    size_t first_root;
} rings;

static bool add_ring(fsm_symbolic *symbolic, rings *self, uint32_t set)
{
    if (!FSM_HAS_ROOM(self->sets, self->count, self->room, 64))
        return false;
    self->sets[self->count++] = set;
    return fsm_mdd_root(&symbolic->mdd, set);
}

/* The index of the first state that is in a set; FSM_NONE: no state is. */
static uint32_t index_in(const fsm_path_context *self, uint32_t set, const fsm_state *starts, size_t count, uint32_t *locals)
{
    for (size_t i = 0; i < count; i++) {
        fsm_tree_unfold(self->symbolic->composition->tree, starts[i], locals);
        if (fsm_symbolic_has(self->symbolic, set, locals))
            return (uint32_t)i;
    }
    return FSM_NONE;
}

/* Rings around a set, within a bound that is a root, until one holds one of some states; its number. */
static uint32_t find_rings(const fsm_path_context *self, fsm_relation *back, uint32_t set, uint32_t bound, const fsm_state *starts,
                           size_t count, uint32_t *locals, rings *found)
{
    fsm_symbolic *symbolic = self->symbolic;
    fsm_mdd *mdd = &symbolic->mdd;
    size_t seen_root = mdd->root_count;
    uint32_t seen = set, start;
    if (!fsm_mdd_root(mdd, seen) || !add_ring(symbolic, found, set))
        return FSM_NONE;
    while ((start = index_in(self, set, starts, count, locals)) == FSM_NONE) {
        uint32_t before = fsm_relation_step(back, set, bound);
        if (before == 0)
            return FSM_NONE;
        set = fsm_mdd_difference(mdd, before, seen);
        seen = fsm_mdd_union(mdd, seen, before);
        mdd->roots[seen_root] = seen;
        if (set == 0 || mdd->failed || !add_ring(symbolic, found, set))
            return FSM_NONE;
    }
    return start;
}

/* From ring to ring, each step into the next one. */
static bool walk_in(const fsm_path_context *self, const rings *found, fsm_state *at, uint32_t *locals, fsm_path *path)
{
    fsm_state state = *at;
    const fsm_model *model = fsm_composition_model(self->symbolic->composition);
    fsm_steps steps = {0};
    bool fine = true;
    for (uint32_t ring = found->count - 1; fine && ring-- > 0;) {
        fsm_steps_clear(&steps, 0);
        fine = fsm_successors(model, state, &steps);
        bool inside = false;
        for (size_t i = 0; fine && !inside && i < steps.count; i++) {
            fsm_tree_unfold(self->symbolic->composition->tree, steps.items[i].to, locals);
            inside = fsm_symbolic_has(self->symbolic, found->sets[ring], locals);
            if (inside)
                fine = fsm_path_add(path, steps.items[i].ordinal);
            state = inside ? steps.items[i].to : state;
        }
        fine = fine && inside;
    }
    *at = state;
    free(steps.items);
    return fine;
}

/* A state near by: which step of which other one led there. */
typedef struct {
    fsm_state state;
    uint32_t from, ordinal;
} visit;

enum { MOST_NEAR = 1 << 13 };

typedef struct {
    const fsm_path_context *ways;
    uint32_t set, bound, count, found; /* `found`: the number of a visit that is in the set; FSM_NONE: none is yet */
    visit *visits; /* room for MOST_NEAR */
    uint32_t *locals;
    fsm_hash_map known;
} neighbourhood;

/* Notes a state unless it is known or out of bounds; false if there are too many. */
static bool visit_state(neighbourhood *self, fsm_state state, uint32_t from, uint32_t ordinal)
{
    fsm_symbolic *symbolic = self->ways->symbolic;
    if (fsm_hash_map_find(&self->known, state) != NULL)
        return true;
    fsm_tree_unfold(symbolic->composition->tree, state, self->locals);
    if (from != FSM_NONE && !fsm_symbolic_has(symbolic, self->bound, self->locals))
        return true;
    if (self->count == MOST_NEAR || !fsm_hash_map_add(&self->known, state, self->count))
        return false;
    if (fsm_symbolic_has(symbolic, self->set, self->locals))
        self->found = self->count;
    self->visits[self->count++] = (visit){state, from, ordinal};
    return true;
}

/* Breadth first, as long as states are few: in most cases the set is near, while rings around it are large. */
static bool search_near(neighbourhood *self, fsm_state *at, fsm_path *path)
{
    const fsm_model *model = fsm_composition_model(self->ways->symbolic->composition);
    fsm_steps steps = {0};
    bool fine = visit_state(self, *at, FSM_NONE, 0);
    for (uint32_t i = 0; fine && self->found == FSM_NONE && i < self->count; i++) {
        fsm_steps_clear(&steps, 0);
        fine = fsm_successors(model, self->visits[i].state, &steps);
        for (size_t n = 0; fine && self->found == FSM_NONE && n < steps.count; n++)
            fine = visit_state(self, steps.items[n].to, i, steps.items[n].ordinal);
    }
    free(steps.items);
    if (self->found == FSM_NONE)
        return false;
    size_t before = path->count;
    for (uint32_t i = self->found; self->visits[i].from != FSM_NONE; i = self->visits[i].from)
        if (!fsm_path_add(path, self->visits[i].ordinal))
            return false;
    fsm_path_reverse(path, before);
    *at = self->visits[self->found].state;
    return true;
}

static bool walk_near(const fsm_path_context *self, uint32_t set, uint32_t bound, fsm_state *at, fsm_path *path)
{
    neighbourhood near = {.ways = self, .set = set, .bound = bound, .found = FSM_NONE};
    near.visits = malloc(MOST_NEAR * sizeof *near.visits);
    near.locals = malloc(self->symbolic->system->machine_count * sizeof *near.locals);
    bool found = near.visits != NULL && near.locals != NULL && search_near(&near, at, path);
    free(near.visits);
    free(near.locals);
    fsm_hash_map_free(&near.known);
    return found;
}

bool fsm_walk_within(const fsm_path_context *self, fsm_relation *back, uint32_t set, uint32_t bound, fsm_state *at, fsm_path *path)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    rings found = {.count = 0};
    size_t roots = mdd->root_count;
    const fsm_state start = *at;
    if (set != 0 && (walk_near(self, set, bound, at, path) || fsm_approach_within(self, back, set, bound, at, path)))
        return true;
    uint32_t *locals = malloc(self->symbolic->system->machine_count * sizeof *locals);
    bool fine = locals != NULL && set != 0 && fsm_mdd_root(mdd, bound)
        && find_rings(self, back, set, bound, &start, 1, locals, &found) != FSM_NONE && walk_in(self, &found, at, locals, path);
    mdd->root_count = roots;
    free(found.sets);
    free(locals);
    return fine;
}

static fsm_state *states_of(const fsm_steps *steps)
{
    fsm_state *states = malloc((steps->count + 1) * sizeof *states);
    for (size_t i = 0; states != NULL && i < steps->count; i++)
        states[i] = steps->items[i].to;
    return states;
}

bool fsm_path_by_distances(const fsm_path_context *self, uint32_t set, fsm_path *path)
{
    fsm_symbolic *symbolic = self->symbolic;
    const fsm_model *model = fsm_composition_model(symbolic->composition);
    fsm_relation back;
    fsm_steps starts = {0};
    rings found = {.count = 0};
    size_t roots = symbolic->mdd.root_count;
    uint32_t *locals = malloc(symbolic->system->machine_count * sizeof *locals);
    bool fine = locals != NULL && set != 0 && fsm_mdd_root(&symbolic->mdd, set) && model->initial(model->self, &starts);
    if (fine && fsm_relation_make(&back, symbolic, true, NULL, NULL)) {
        fsm_state *states = states_of(&starts);
        uint32_t start = states == NULL
            ? FSM_NONE
            : find_rings(self, &back, set, symbolic->root, states, starts.count, locals, &found);
        fine = start != FSM_NONE && fsm_path_add(path, start) && walk_in(self, &found, &states[start], locals, path);
        free(states);
        fsm_relation_free(&back);
    } else {
        fine = false;
    }
    symbolic->mdd.root_count = roots;
    if (!fine)
        path->count = 0;
    free(starts.items);
    free(found.sets);
    free(locals);
    return fine;
}

/* --- cycles -------------------------------------------------------------------------------------------------- */

static int by_state(const void *a, const void *b)
{
    fsm_state x = ((const fsm_target *)a)->state, y = ((const fsm_target *)b)->state;
    return (x > y) - (x < y);
}

/* The internal steps from each state of a cycle to the next one, from the given one on. */
static bool go_round(const fsm_path_context *self, const fsm_state *states, uint32_t length, uint32_t first, fsm_path *path)
{
    const fsm_model *model = fsm_composition_model(self->symbolic->composition);
    fsm_steps steps = {0};
    bool fine = true;
    for (uint32_t n = 0; fine && n < length; n++) {
        fsm_state from = states[(first + n) % length], to = states[(first + n + 1) % length];
        bool found = false;
        fsm_steps_clear(&steps, 0);
        fine = fsm_successors(model, from, &steps);
        for (size_t i = 0; fine && !found && i < steps.count; i++) {
            found = steps.items[i].to == to && steps.items[i].kind == FSM_STEP_INTERNAL;
            if (found)
                fine = fsm_path_add(path, steps.items[i].ordinal);
        }
        fine = fine && found;
    }
    free(steps.items);
    return fine;
}

static bool path_to_states(const fsm_path_context *self, fsm_target *targets, uint32_t count, fsm_path *path, fsm_state *reached)
{
    fsm_search search;
    fsm_found group = {.state = FSM_NO_STATE};
    if (!begin(self, &search))
        return false;
    search.targets = targets;
    search.target_count = count;
    search.groups = &group;
    search.group_count = search.groups_left = 1;
    fsm_search_run(&search);
    fsm_search_forget(&search);
    bool fine = group.state != FSM_NO_STATE && fsm_path_to(&search, &group, path);
    *reached = group.state;
    fsm_search_free(&search);
    return fine;
}

bool fsm_path_to_cycle(const fsm_path_context *self, const fsm_busy_cycle *cycle, fsm_path *path, fsm_path *steps)
{
    fsm_symbolic *symbolic = self->symbolic;
    uint32_t machines = symbolic->system->machine_count, first = 0;
    fsm_state *states = malloc(cycle->length * sizeof *states), reached;
    fsm_target *targets = malloc(cycle->length * sizeof *targets);
    bool fine = states != NULL && targets != NULL && cycle->length > 0;
    for (uint32_t n = 0; fine && n < cycle->length; n++) {
        states[n] = fsm_tree_fold(symbolic->composition->tree, cycle->states + (size_t)n * machines);
        targets[n] = (fsm_target){states[n], 0};
        fine = states[n] != FSM_NO_STATE;
    }
    if (fine) {
        qsort(targets, cycle->length, sizeof *targets, by_state);
        if (!path_to_states(self, targets, cycle->length, path, &reached)) {
            path->count = 0;
            reached = states[0];
            fine = fsm_path_by_distances(self, fsm_symbolic_single(symbolic, symbolic->root, cycle->states), path);
        }
        while (fine && first < cycle->length && states[first] != reached)
            first++;
        fine = fine && first < cycle->length && go_round(self, states, cycle->length, first, steps);
    }
    free(states);
    free(targets);
    return fine;
}
