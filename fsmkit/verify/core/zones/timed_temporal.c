#include "zones/timed_temporal.h"

#include "zones/timed_backward.h"

#include <stdlib.h>
#include <string.h>

/* --- from where all points get to a mark ---------------------------------------------------------------------
 * All points of a state can take a group of steps that is sure, and each then is in one of the states that it ends in.
 * So all points get there if they are there, or if all points do of all the states in which some sure group ends. */

/* A step of a sure group; those to the same place are a list. */
typedef struct {
    uint32_t group, next; /* the next one counted from 1; 0: none */
} arc;

typedef struct {
    uint32_t from, left; /* the place it starts in; its steps to states where some points may not reach the mark */
} group;

typedef struct {
    fsm_timed_model *model;
    fsm_search *search;
    arc *arcs;
    group *groups;
    uint32_t *heads, *waiting; /* by place: the first arc there; places that are sure and not spread yet */
    unsigned char *sure;
    size_t arc_count, arc_room, group_count, group_room, waiting_count;
} sureness;

static void *grown(void *items, size_t *room, size_t size, size_t limit)
{
    size_t more = *room == 0 ? 256 : 2 * *room;
    void *found = more >= FSM_NONE || more * size > limit ? NULL : realloc(items, more * size);
    *room = found == NULL ? *room : more;
    return found;
}

static bool add_arc(sureness *self, uint64_t to, uint32_t from, bool new_group)
{
    size_t limit = self->search->memory_limit;
    if (self->arc_count == self->arc_room) {
        arc *arcs = grown(self->arcs, &self->arc_room, sizeof *arcs, limit);
        if (arcs == NULL)
            return false;
        self->arcs = arcs;
    }
    if (self->group_count == self->group_room) {
        group *groups = grown(self->groups, &self->group_room, sizeof *groups, limit);
        if (groups == NULL)
            return false;
        self->groups = groups;
    }
    if (new_group)
        self->groups[self->group_count++] = (group){from, 0};
    uint32_t number = (uint32_t)self->group_count - 1;
    self->groups[number].left++;
    self->arcs[self->arc_count++] = (arc){number, self->heads[to]};
    self->heads[to] = (uint32_t)self->arc_count;
    return true;
}

static bool add_arcs_from(sureness *self, uint64_t place)
{
    fsm_timed_model *m = self->model;
    const fsm_set *passed = &self->search->passed;
    fsm_steps steps = {0};
    bool fine = m->model.successors(m, fsm_set_at(passed, place), &steps);
    for (size_t i = 0; fine && i < steps.count; i++) {
        const fsm_timed_move *move = &m->moves[i];
        bool new_group = i == 0 || move[-1].group != move->group;
        if (move->sure)
            fine = add_arc(self, fsm_set_find(passed, steps.items[i].to), (uint32_t)place, new_group);
    }
    free(steps.items);
    return fine;
}

static void note_sure(sureness *self, uint32_t place)
{
    if (self->sure[place])
        return;
    self->sure[place] = 1;
    self->waiting[self->waiting_count++] = place;
}

static void spread(sureness *self)
{
    while (self->waiting_count > 0) {
        uint32_t at = self->heads[self->waiting[--self->waiting_count]];
        for (; at != 0; at = self->arcs[at - 1].next) {
            group *g = &self->groups[self->arcs[at - 1].group];
            if (--g->left == 0)
                note_sure(self, g->from);
        }
    }
}

/* Whether all points of all states reach the mark, `*all`; false if that could not be decided. */
static bool all_get_there(fsm_timed_model *model, fsm_search *search, uint32_t mark, bool *all)
{
    const fsm_set *passed = &search->passed;
    uint64_t places = fsm_set_places(passed);
    sureness self = {.model = model, .search = search};
    self.heads = calloc(places, sizeof *self.heads);
    self.waiting = malloc((passed->count + 1) * sizeof *self.waiting);
    self.sure = calloc(places, 1);
    bool fine = places < FSM_NONE && self.heads != NULL && self.waiting != NULL && self.sure != NULL;
    for (uint64_t place = 0; fine && place < places; place++) {
        if (!fsm_set_taken(passed, place))
            continue;
        if (place % 1024 == 0 && search->keep_on != NULL)
            fine = search->keep_on(search);
        if (fsm_is_marked(search->model, fsm_set_at(passed, place), mark))
            note_sure(&self, (uint32_t)place);
        else
            fine = fine && add_arcs_from(&self, place);
    }
    if (fine)
        spread(&self);
    *all = true;
    for (uint64_t place = 0; fine && place < places; place++)
        *all = *all && (!fsm_set_taken(passed, place) || self.sure[place] || !fsm_timed_is_maximal(model, fsm_set_at(passed, place)));
    if (fine && !*all && model->cover != FSM_COVER_EQUAL)
        fine = fsm_timed_reach_sure(model, search, self.sure, all);
    free(self.arcs);
    free(self.groups);
    free(self.heads);
    free(self.waiting);
    free(self.sure);
    return fine;
}

/* --- a run as the zones perform it -------------------------------------------------------------------------- */

/* Returns the ordinal of a step with a number in the current zones; FSM_NONE: no such step. */
static uint32_t perform(fsm_timed *timed, fsm_timed_sought *at, uint32_t number)
{
    uint32_t tuple[FSM_MOST_MACHINES + 1];
    at->wanted = number;
    at->at = 0;
    at->ordinal = FSM_NONE;
    if (at->initial) {
        (void)fsm_timed_initial(timed, fsm_timed_pick, at);
        at->initial = false;
        return at->ordinal;
    }
    memcpy(tuple, at->tuple, timed->tuples.state_size);
    memcpy(timed->before, at->zone, (size_t)at->size * at->size * sizeof *at->zone);
    (void)fsm_timed_successors(timed, tuple, timed->before, false, fsm_timed_pick, at);
    return at->ordinal;
}

/* Adds what all points of a state have in common: which timers are due, and which are not. */
static bool report_point(fsm_timed_model *self, fsm_state state, fsm_path *path)
{
    uint32_t clock = 1;
    if (!fsm_timed_model_look(self, state))
        return false;
    for (uint32_t i = 0; self->waits && i < fsm_timed_machines(&self->timed); i++) {
        uint32_t armed = fsm_timed_armed(&self->timed, self->tuple, i);
        for (uint32_t place = 0; place < armed; place++, clock++) {
            int32_t upper = self->timed.limits[clock].upper;
            bool due = self->zone[clock] <= fsm_at_most(-upper);
            bool below = self->zone[clock * self->size] < fsm_at_most(upper);
            if (upper != FSM_NEVER && (due || below)
                && !fsm_path_add(path, FSM_TIMED_DUE - 2 * (i * FSM_MOST_CLOCKS + place) - below))
                return false;
        }
    }
    return true;
}

/* Rewrites steps of the model from a state on; the passing of time is not a step. Returns where they lead;
 * FSM_NO_STATE if they cannot be performed so. */
static fsm_state rewrite(fsm_timed_model *self, fsm_state from, fsm_timed_sought *at, fsm_path *path)
{
    fsm_steps steps = {0};
    fsm_path told = {0};
    bool fine = true;
    for (size_t i = 0; fine && i < path->count; i++) {
        uint32_t ordinal = path->steps[i];
        bool initial = from == FSM_NO_STATE;
        fsm_steps_clear(&steps, 0);
        fine = (initial ? self->model.initial(self, &steps) : self->model.successors(self, from, &steps))
            && ordinal < steps.count;
        uint32_t number = fine ? self->moves[ordinal].number : FSM_NONE;
        fsm_state to = fine ? steps.items[ordinal].to : FSM_NO_STATE;
        if (number != FSM_NONE) {
            fine = fine && (initial || report_point(self, from, &told));
            ordinal = perform(&self->timed, at, number);
            self->at = FSM_NO_STATE; /* the limits of others are in hand */
            fine = fine && ordinal != FSM_NONE && fsm_path_add(&told, ordinal);
        }
        from = to;
    }
    free(steps.items);
    free(path->steps);
    *path = told;
    return fine ? from : FSM_NO_STATE;
}

/* --- runs of the graph that are runs of points ---------------------------------------------------------------- */

/* A step of the graph: its number, and where it leads. */
typedef struct {
    uint32_t number;
    fsm_state to;
} leg;

static fsm_state read_legs(fsm_timed_model *self, fsm_state from, const fsm_path *path, leg *legs)
{
    fsm_steps steps = {0};
    for (size_t i = 0; i < path->count; i++) {
        uint32_t ordinal = path->steps[i];
        fsm_steps_clear(&steps, 0);
        bool fine = (from == FSM_NO_STATE ? self->model.initial(self, &steps) : self->model.successors(self, from, &steps))
            && ordinal < steps.count;
        from = fine ? steps.items[ordinal].to : FSM_NO_STATE;
        legs[i] = (leg){fine ? self->moves[ordinal].number : FSM_NONE, from};
        if (!fine)
            break;
    }
    free(steps.items);
    return from;
}

/* Whether an exact zone is one that a leg leads to. */
static bool is_end_of(fsm_timed_model *self, leg at, fsm_state exact)
{
    return self->cover == FSM_COVER_POINTS ? fsm_timed_covers(self, exact, at.to) : fsm_timed_covers(self, at.to, exact);
}

/* Takes the steps of some legs from one exact zone to the next, and adds them to a path. Returns where they lead; FSM_NO_STATE if no
 * point takes them. */
static fsm_state follow(fsm_timed_model *self, fsm_state at, const leg *legs, size_t count, fsm_path *path)
{
    fsm_steps steps = {0};
    bool fine = true;
    for (size_t i = 0; fine && i < count; i++) {
        uint32_t found = FSM_NONE;
        if (legs[i].number == FSM_TIMED_COVERED || (legs[i].number == FSM_NONE && fsm_timed_is_stable(legs[i].to)))
            continue; /* the exact zone holds the points after that time, too */
        fsm_steps_clear(&steps, 0);
        fine = at == FSM_NO_STATE ? self->model.initial(self, &steps) : self->model.successors(self, at, &steps);
        for (uint32_t s = 0; fine && s < steps.count; s++)
            if (self->moves[s].number == legs[i].number
                && (steps.items[s].to == legs[i].to
                    || (found == FSM_NONE && is_end_of(self, legs[i], steps.items[s].to))))
                found = s;
        fine = fine && found != FSM_NONE && fsm_path_add(path, found);
        at = fine ? steps.items[found].to : FSM_NO_STATE;
    }
    free(steps.items);
    return at;
}

/* Writes the steps by which a state was found first. */
static bool trace_back(const fsm_timed_model *self, fsm_state state, fsm_path *path)
{
    path->count = 0;
    for (fsm_state at = state; at != FSM_NO_STATE;) {
        const fsm_timed_node *node = fsm_timed_node_of(self, at);
        if (!fsm_path_add(path, node->step))
            return false;
        at = node->from;
    }
    for (size_t i = 0, k = path->count; i + 1 < k; i++) {
        uint32_t step = path->steps[i];
        path->steps[i] = path->steps[--k];
        path->steps[k] = step;
    }
    return true;
}

/* Whether some point takes a path of the graph. */
static bool is_run(fsm_timed_model *self, const fsm_path *path)
{
    fsm_path exact = {0};
    leg *legs = malloc((path->count + 1) * sizeof *legs);
    bool fine = legs != NULL && read_legs(self, FSM_NO_STATE, path, legs) != FSM_NO_STATE;
    fsm_timed_be_exact(self, true);
    fine = fine && follow(self, FSM_NO_STATE, legs, path->count, &exact) != FSM_NO_STATE;
    fsm_timed_be_exact(self, false);
    free(legs);
    free(exact.steps);
    return fine;
}

fsm_state fsm_timed_trace(const fsm_search *search, const unsigned char *flags, unsigned char wanted, fsm_path *path)
{
    enum { MOST_TRIES = 256 };
    fsm_timed_model *self = search->model->self;
    uint32_t tries = self->cover == FSM_COVER_HULL ? MOST_TRIES : 1;
    for (uint32_t i = 0; tries > 0 && i < self->node_count; i++) {
        fsm_state state = self->nodes[i].state;
        uint64_t place = fsm_set_find(&search->passed, state);
        if (place == FSM_NOWHERE || (flags[place] & wanted) == 0)
            continue;
        tries--;
        if (trace_back(self, state, path) && (self->cover != FSM_COVER_HULL || is_run(self, path)))
            return state;
    }
    path->count = 0;
    return FSM_NO_STATE;
}

/* Goes round until a zone comes again: the rounds before that belong to the path. */
static bool repeat(fsm_timed_model *self, fsm_state at, const leg *legs, size_t count, fsm_lasso *exact)
{
    enum { ROUNDS = 256 };
    fsm_state states[ROUNDS + 1] = {at};
    size_t lengths[ROUNDS + 1] = {0};
    for (uint32_t round = 1; round <= ROUNDS; round++) {
        states[round] = follow(self, states[round - 1], legs, count, &exact->cycle);
        lengths[round] = exact->cycle.count;
        if (states[round] == FSM_NO_STATE)
            return false;
        for (uint32_t first = 0; first < round; first++) {
            if (states[first] != states[round])
                continue;
            bool fine = true;
            for (size_t i = 0; fine && i < lengths[first]; i++)
                fine = fsm_path_add(&exact->path, exact->cycle.steps[i]);
            exact->cycle.count -= lengths[first];
            memmove(exact->cycle.steps, exact->cycle.steps + lengths[first], exact->cycle.count * sizeof *exact->cycle.steps);
            return fine;
        }
    }
    return false;
}

/* Replaces a run of the graph by one from exact zone to exact zone; false if there is no such run or memory ran out. */
static bool make_exact(fsm_timed_model *self, fsm_lasso *lasso)
{
    fsm_lasso exact = {.violated = lasso->violated};
    size_t count = lasso->path.count + lasso->cycle.count;
    leg *legs = malloc((count + 1) * sizeof *legs), *round = legs + lasso->path.count;
    bool fine = legs != NULL && lasso->path.count > 0;
    if (fine) {
        fsm_state end = read_legs(self, FSM_NO_STATE, &lasso->path, legs);
        fine = end != FSM_NO_STATE
            && (lasso->cycle.count == 0 || read_legs(self, end, &lasso->cycle, round) != FSM_NO_STATE);
    }
    fsm_timed_be_exact(self, true);
    fsm_state at = fine ? follow(self, FSM_NO_STATE, legs, lasso->path.count, &exact.path) : FSM_NO_STATE;
    fine = at != FSM_NO_STATE && (lasso->cycle.count == 0 || repeat(self, at, round, lasso->cycle.count, &exact));
    fsm_timed_be_exact(self, false);
    free(legs);
    fsm_lasso_free(fine ? lasso : &exact);
    if (fine)
        *lasso = exact;
    return fine;
}

/* An answer with the run that is shown: to the cycle, and once round it. */
static fsm_timed_answer answer_with(fsm_timed_model *self, bool known, fsm_lasso lasso)
{
    fsm_timed_answer found = {known, "", lasso};
    fsm_timed_sought at = {.initial = true, .machines = fsm_timed_machines(&self->timed), .zone = malloc(FSM_ZONE_ROOM * sizeof *at.zone)};
    bool rounds = lasso.cycle.count > 0;
    bool told = !known || !lasso.violated;
    fsm_timed_be_exact(self, true);
    if (!told && at.zone != NULL && lasso.path.count > 0) {
        fsm_state last = rewrite(self, FSM_NO_STATE, &at, &found.lasso.path);
        last = last != FSM_NO_STATE && rounds ? rewrite(self, last, &at, &found.lasso.cycle) : last;
        told = last != FSM_NO_STATE
            && report_point(self, last, rounds ? &found.lasso.cycle : &found.lasso.path);
    }
    fsm_timed_be_exact(self, false);
    if (!told) {
        fsm_lasso_free(&found.lasso);
        found.known = false;
    }
    free(at.zone);
    return found;
}

/* --- properties ---------------------------------------------------------------------------------------------- */

static fsm_timed_answer undecided(const char *why)
{
    return (fsm_timed_answer){.why = why};
}

fsm_timed_answer fsm_timed_recoverable(fsm_timed_model *self, fsm_search *search, uint32_t mark)
{
    fsm_lasso lasso = {0};
    bool all = false, known = true;
    if (self->cover == FSM_COVER_POINTS)
        return undecided("");
    known = fsm_find_unrecoverable(search, mark, &lasso);
    if (self->cover == FSM_COVER_HULL && lasso.violated && (lasso.path.count == 0 || !make_exact(self, &lasso))) {
        fsm_lasso_free(&lasso);
        return undecided("");
    }
    if (!known || lasso.violated)
        return answer_with(self, known, lasso);
    if (self->partial || (self->cover == FSM_COVER_SIMULATED && self->has_choices) || !all_get_there(self, search, mark, &all))
        return undecided("");
    return all ? answer_with(self, true, lasso)
               : undecided("whether it can be reached again depends on when events come");
}

fsm_timed_answer fsm_timed_leads_to(fsm_timed_model *self, fsm_search *search, uint32_t request, uint32_t answer,
                                    bool timeless)
{
    fsm_lasso lasso;
    bool known = fsm_find_violations(search, request, answer, timeless, &lasso);
    if (known && lasso.violated && !make_exact(self, &lasso)) {
        fsm_lasso_free(&lasso);
        return undecided("");
    }
    if ((self->partial || self->cover == FSM_COVER_POINTS) && !lasso.violated)
        return undecided("");
    return answer_with(self, known, lasso);
}
