#include "paths/approach.h"

#include "symbolic/evaluation.h"
#include "symbolic/relation.h"
#include "system/tree.h"

#include <stdlib.h>
#include <string.h>

enum {
    FAR = 1 << 10,              /* of a value from which one does not get there */
    MOST_FAR = 1 << 20,         /* distances of states are cut here */
    MOST_VISITS = 1 << 20,      /* states that are kept */
    MOST_WITHIN = 1 << 17,      /* of them, where sets at each distance are another way */
    MOST_LOOKED_AT = 1 << 24,   /* steps */
    CHECK_EVERY = 1 << 10
};

/* A state: which step of which other one led there, and which of its own steps is to be looked at next. */
typedef struct {
    fsm_state state;
    uint32_t from, ordinal;
    uint32_t next;
    uint32_t other; /* of those that are as near, from 1 */
} visit;

typedef struct {
    const fsm_path_context *ways;
    fsm_symbolic *symbolic;
    const fsm_relation *steps;
    bool backwards;      /* so are they */
    uint32_t bound;      /* the states to keep to; 0: any */
    uint32_t most;       /* states that are kept */
    uint32_t **distance; /* by level and value */
    uint32_t *goal;      /* by level */
    uint32_t *locals;
    visit *visits;
    uint32_t visit_count, visit_room;
    uint32_t *nearest;   /* by distance: the visit, from 1 */
    fsm_hash_map known;
    uint64_t looked_at;
} approach;

/* --- distances of single levels ------------------------------------------------------------------------ */

/* One pass over what events do at each level: whether some distance became smaller. */
static bool relax(approach *self, bool forwards)
{
    bool changed = false;
    for (uint32_t n = 0; n <= self->steps->event_count; n++) {
        const fsm_relation_event *event = &self->steps->events[n];
        for (uint32_t p = 0; event->parts != NULL && p < event->part_count; p++) {
            const fsm_relation_part *part = &event->parts[p];
            uint32_t *distance = self->distance[part->level], room = self->symbolic->levels[part->level].room;
            for (uint32_t i = 0; i < part->count; i++) {
                uint32_t a = forwards != self->backwards ? part->pairs[i].from : part->pairs[i].to;
                uint32_t b = forwards != self->backwards ? part->pairs[i].to : part->pairs[i].from;
                if (a < room && b < room && distance[a] + 1 < distance[b]) {
                    distance[b] = distance[a] + 1;
                    changed = true;
                }
            }
        }
    }
    return changed;
}

/* At each level, how many steps lead from a value to the others, or from these to it, without other conditions. */
static void measure(approach *self, const uint32_t *values, bool forwards)
{
    for (uint32_t level = 1; level <= self->symbolic->level_count; level++)
        for (uint32_t value = 0; value < self->symbolic->levels[level].room; value++)
            self->distance[level][value] = value == values[level] || self->symbolic->levels[level].is_slot ? 0 : FAR;
    for (uint32_t pass = 0; pass < FAR && relax(self, forwards); pass++)
        ;
}

/* Returns the distance of the unfolded state. */
static uint32_t distance_of(const approach *self)
{
    uint32_t sum = 0;
    for (uint32_t level = 1; level <= self->symbolic->level_count; level++) {
        uint32_t value = fsm_symbolic_value(self->symbolic, level, self->locals);
        sum += value < self->symbolic->levels[level].room ? self->distance[level][value] : FAR;
    }
    return sum < MOST_FAR ? sum : MOST_FAR;
}

/* --- the state to go to -------------------------------------------------------------------------------- */

/* For each node of a set, the least sum of distances of values on a path down; its first pair. */
typedef struct {
    uint32_t least, pair;
} descent;

static uint32_t descend(const approach *self, uint32_t node, descent *known)
{
    const fsm_mdd *mdd = &self->symbolic->mdd;
    const fsm_mdd_node *at = fsm_mdd_at(mdd, node);
    if (at->level == 0)
        return 0;
    if (known[node].least != FSM_NONE)
        return known[node].least;
    for (uint32_t i = 0; i < at->count; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, node)[i];
        uint32_t sum = self->distance[at->level][pair.value] + descend(self, pair.child, known);
        if (sum < known[node].least)
            known[node] = (descent){sum, i};
    }
    return known[node].least;
}

static bool choose_goal(approach *self, uint32_t set)
{
    const fsm_mdd *mdd = &self->symbolic->mdd;
    descent *known = malloc(mdd->node_count * sizeof *known);
    if (known == NULL)
        return false;
    memset(known, 0xff, mdd->node_count * sizeof *known);
    (void)descend(self, set, known);
    for (uint32_t node = set; fsm_mdd_at(mdd, node)->level > 0;) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, node)[known[node].pair];
        self->goal[fsm_mdd_at(mdd, node)->level] = pair.value;
        node = pair.child;
    }
    free(known);
    return true;
}

/* --- the search ------------------------------------------------------------------------------------------ */

static bool has_time(approach *self)
{
    fsm_symbolic *symbolic = self->symbolic;
    if (++self->looked_at % CHECK_EVERY != 0)
        return true;
    return self->looked_at < MOST_LOOKED_AT && (symbolic->keep_on == NULL || symbolic->keep_on(symbolic));
}

/* Keeps a state unless it is known or out of bounds; its distance, or FSM_NONE. */
static uint32_t add_visit(approach *self, fsm_state state, uint32_t from, uint32_t ordinal)
{
    if (fsm_hash_map_find(&self->known, state) != NULL)
        return FSM_NONE;
    fsm_tree_unfold(self->symbolic->composition->tree, state, self->locals);
    if (self->bound != 0 && from != FSM_NONE && !fsm_symbolic_has(self->symbolic, self->bound, self->locals))
        return FSM_NONE;
    if (self->visit_count == self->visit_room) {
        uint32_t room = self->visit_room == 0 ? 256 : 2 * self->visit_room;
        visit *visits = room > self->most ? NULL : realloc(self->visits, room * sizeof *visits);
        if (visits == NULL)
            return FSM_NONE;
        self->visits = visits;
        self->visit_room = room;
    }
    if (!fsm_hash_map_add(&self->known, state, self->visit_count))
        return FSM_NONE;
    uint32_t distance = distance_of(self);
    self->visits[self->visit_count] = (visit){state, from, ordinal, 0, self->nearest[distance]};
    self->nearest[distance] = ++self->visit_count;
    return distance;
}

/* Looks at the steps of a state until one leads nearer: then at those of that state first. The distance to go on from. */
static bool go_on(approach *self, fsm_steps *steps, uint32_t at, uint32_t distance, uint32_t set, uint32_t *found)
{
    const fsm_model *model = fsm_composition_model(self->symbolic->composition);
    fsm_steps_clear(steps, 0);
    if (!fsm_successors(model, self->visits[at].state, steps))
        return false;
    while (self->visits[at].next < steps->count) {
        const fsm_step step = steps->items[self->visits[at].next++];
        if (!has_time(self))
            return false;
        uint32_t now = add_visit(self, step.to, at, step.ordinal);
        if (now == FSM_NONE)
            continue;
        if (fsm_symbolic_has(self->symbolic, set, self->locals)) {
            *found = self->visit_count - 1;
            return true;
        }
        if (now < distance)
            return true;
    }
    return true;
}

static bool search(approach *self, uint32_t set, uint32_t *found)
{
    fsm_steps steps = {0};
    bool fine = true;
    *found = FSM_NONE;
    for (uint32_t distance = 0; fine && *found == FSM_NONE && distance <= MOST_FAR;) {
        uint32_t at = self->nearest[distance] - 1, before = self->visit_count;
        if (at == FSM_NONE) {
            distance++;
            continue;
        }
        fine = go_on(self, &steps, at, distance, set, found);
        if (self->visits[at].next >= steps.count && self->nearest[distance] == at + 1)
            self->nearest[distance] = self->visits[at].other;
        if (before < self->visit_count)
            distance = 0;
    }
    free(steps.items);
    return fine && *found != FSM_NONE;
}

/* Adds the steps to a visit, from the first one or, of those within bounds, from the state where they start. */
static bool write_path(const approach *self, uint32_t at, fsm_path *path)
{
    const size_t before = path->count;
    for (; at != FSM_NONE && (self->bound == 0 || self->visits[at].from != FSM_NONE); at = self->visits[at].from)
        if (!fsm_path_add(path, self->visits[at].ordinal))
            return false;
    fsm_path_reverse(path, before);
    return true;
}

/* --- all of it --------------------------------------------------------------------------------------------- */

static bool prepare(approach *self)
{
    const fsm_symbolic *symbolic = self->symbolic;
    size_t levels = (size_t)symbolic->level_count + 1;
    self->distance = calloc(levels, sizeof *self->distance);
    self->goal = calloc(levels, sizeof *self->goal);
    self->nearest = calloc((size_t)MOST_FAR + 1, sizeof *self->nearest);
    self->locals = malloc(symbolic->system->machine_count * sizeof *self->locals);
    bool fine = self->distance != NULL && self->goal != NULL && self->nearest != NULL && self->locals != NULL;
    for (uint32_t level = 1; fine && level < levels; level++) {
        self->distance[level] = malloc((symbolic->levels[level].room + 1u) * sizeof **self->distance);
        fine = self->distance[level] != NULL;
    }
    return fine;
}

/* Chooses the state to go to from the first of some states, and starts at all of them. */
static bool begin(approach *self, uint32_t set, const fsm_step *starts, size_t count)
{
    if (count == 0)
        return false;
    fsm_tree_unfold(self->symbolic->composition->tree, starts[0].to, self->locals);
    for (uint32_t level = 1; level <= self->symbolic->level_count; level++)
        self->goal[level] = fsm_symbolic_value(self->symbolic, level, self->locals);
    measure(self, self->goal, true);
    if (!choose_goal(self, set))
        return false;
    measure(self, self->goal, false);
    for (size_t i = 0; i < count; i++)
        (void)add_visit(self, starts[i].to, FSM_NONE, (uint32_t)i);
    return true;
}

static void free_approach(approach *self)
{
    for (uint32_t level = 0; self->distance != NULL && level <= self->symbolic->level_count; level++)
        free(self->distance[level]);
    free(self->distance);
    free(self->goal);
    free(self->nearest);
    free(self->locals);
    free(self->visits);
    fsm_hash_map_free(&self->known);
}

bool fsm_path_by_approach(const fsm_path_context *ways, uint32_t set, fsm_path *path)
{
    fsm_symbolic *symbolic = ways->symbolic;
    const fsm_model *model = fsm_composition_model(symbolic->composition);
    fsm_relation steps;
    fsm_steps starts = {0};
    uint32_t found;
    if (set == 0 || !fsm_relation_make(&steps, symbolic, false, NULL, NULL))
        return false;
    approach self = {.ways = ways, .symbolic = symbolic, .steps = &steps, .most = MOST_VISITS};
    path->count = 0;
    bool fine = prepare(&self) && model->initial(model->self, &starts) && begin(&self, set, starts.items, starts.count)
        && search(&self, set, &found) && write_path(&self, found, path);
    free_approach(&self);
    free(starts.items);
    fsm_relation_free(&steps);
    if (!fine)
        path->count = 0;
    return fine;
}

bool fsm_approach_within(const fsm_path_context *ways, const fsm_relation *back, uint32_t set, uint32_t bound, fsm_state *at,
                         fsm_path *path)
{
    const fsm_step start = {.to = *at};
    const size_t before = path->count;
    approach self = {.ways = ways, .symbolic = ways->symbolic, .steps = back, .backwards = true, .bound = bound,
                     .most = MOST_WITHIN};
    uint32_t found;
    bool fine = set != 0 && bound != 0 && prepare(&self) && begin(&self, set, &start, 1) && search(&self, set, &found)
        && write_path(&self, found, path);
    if (fine)
        *at = self.visits[found].state;
    else
        path->count = before;
    free_approach(&self);
    return fine;
}
