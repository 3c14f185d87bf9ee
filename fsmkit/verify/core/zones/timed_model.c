#include "zones/timed_model.h"

#include <stdlib.h>
#include <string.h>

static bool fail(fsm_timed_model *self, const char *why)
{
    if (self->failure == NULL)
        self->failure = why;
    return false;
}

/* --- states: twice the number of the discrete part, odd if stable; and the number of the zone ------------ */

bool fsm_timed_is_stable(fsm_state state)
{
    return (fsm_left(state) & 1) != 0;
}

static const uint32_t *tuple_of(const fsm_timed_model *self, fsm_state state)
{
    return fsm_store_at(&self->timed.tuples, fsm_left(state) >> 1);
}

/* Whether zones are points for now. */
static bool has_points(const fsm_timed_model *self)
{
    return self->cover == FSM_COVER_POINTS && !self->exact;
}

/* Where timers have no end, it is forgotten how far they are beyond their least durations; others never pass their
 * deadlines. */
static void forget(fsm_bound *zone, uint32_t size, const fsm_limits *limits)
{
    int32_t most[FSM_MOST_CLOCKS + 1];
    bool endless = false;
    for (uint32_t i = 1; i < size; i++) {
        most[i] = limits[i].upper != FSM_NEVER ? limits[i].upper : limits[i].lower < 0 ? 0 : limits[i].lower;
        endless = endless || limits[i].upper == FSM_NEVER;
    }
    if (endless)
        fsm_zone_forget(zone, size, most);
}

/* --- states and what covers them ------------------------------------------------------------------------- */

static uint32_t keep_zone(fsm_timed_model *self)
{
    return fsm_zones_keep(&self->timed.zones, self->timed.memory_limit);
}

/* Adds a state to the nodes, unless it is one. */
static bool add_node(fsm_timed_model *self, fsm_state state)
{
    if (fsm_hash_map_find(&self->numbers, state) != NULL)
        return true;
    if (self->node_count == self->node_room) {
        size_t room = self->node_room == 0 ? 128 : 2 * (size_t)self->node_room;
        fsm_timed_node *nodes = room >= FSM_NONE ? NULL : realloc(self->nodes, room * sizeof *nodes);
        if (nodes == NULL)
            return false;
        self->nodes = nodes;
        self->node_room = (uint32_t)room;
    }
    self->nodes[self->node_count] = (fsm_timed_node){state, self->from, (uint32_t)self->move_count, FSM_NONE, 0, 0};
    return fsm_hash_map_add(&self->numbers, state, self->node_count++);
}

static fsm_family *family_of(fsm_timed_model *self, uint32_t part)
{
    if (part >= self->cover_room) {
        size_t room = self->cover_room == 0 ? 128 : self->cover_room;
        while (room <= part)
            room *= 2;
        fsm_family *covers = room >= FSM_NONE ? NULL : realloc(self->covers, room * sizeof *covers);
        if (covers == NULL)
            return NULL;
        memset(covers + self->cover_room, 0, (room - self->cover_room) * sizeof *covers);
        self->covers = covers;
        self->cover_room = (uint32_t)room;
    }
    return &self->covers[part];
}

/* The least zone that holds `zone` and a kept one, which have the same timers due; false if they have not. */
static bool widen(fsm_timed_model *self, fsm_bound *zone, uint32_t number, uint32_t size, const fsm_limits *limits)
{
    fsm_bound *other = self->other;
    fsm_zones_read(&self->timed.zones, number, size, other);
    for (uint32_t i = 1; i < size; i++) {
        fsm_bound due = fsm_at_most(-limits[i].upper);
        if (limits[i].upper != FSM_NEVER && (zone[i] <= due) != (other[i] <= due))
            return false;
    }
    for (uint32_t i = 0; i < size * size; i++)
        zone[i] = other[i] > zone[i] ? other[i] : zone[i]; /* closed: Floyd's inequalities hold for maxima */
    return true;
}

/* The limits up to which zones are compared; NULL: as sets. */
static const fsm_limits *compared_limits(const fsm_timed_model *self, const fsm_limits *limits, uint32_t size)
{
    for (uint32_t i = 1; self->cover == FSM_COVER_SIMULATED && i < size; i++)
        if (limits[i].lower != limits[i].upper)
            return limits;
    return NULL;
}

/* The state that covers the zone in hand, which is kept if none does. */
static fsm_state covered(fsm_timed_model *self, uint32_t part, fsm_bound *zone, uint32_t size, const fsm_limits *limits)
{
    fsm_zones *zones = &self->timed.zones;
    const fsm_limits *compared = compared_limits(self, limits, size);
    fsm_zone_summary summary = fsm_zones_summary(zones, compared);
    fsm_family *family = family_of(self, part);
    if (family == NULL)
        return FSM_NO_STATE;
    uint32_t same = family->count > 0 ? fsm_zones_find(zones) : FSM_NONE, left = 0;
    for (uint32_t i = 0; i < family->count; i++) {
        const fsm_entry *entry = &family->entries[i];
        if (entry->zone == same || (fsm_may_cover(entry->summary, summary) && fsm_zones_covers(zones, entry->zone, compared)))
            return fsm_join(part, entry->zone);
    }
    for (uint32_t i = 0; self->cover == FSM_COVER_HULL && i < family->count; i++)
        if (widen(self, zone, family->entries[i].zone, size, limits)) {
            if (!fsm_zones_hold(zones, zone, size))
                return FSM_NO_STATE;
            summary = fsm_zones_summary(zones, NULL);
            break;
        }
    for (uint32_t i = 0; i < family->count; i++) {
        fsm_entry entry = family->entries[i];
        if (!fsm_may_cover(summary, entry.summary) || !fsm_zones_is_covered(zones, entry.zone, compared))
            family->entries[left++] = entry;
    }
    family->count = left;
    uint32_t number = keep_zone(self);
    bool fine = number != FSM_NONE && fsm_family_add(family, (fsm_entry){summary, number, self->node_count}, &self->entry_room)
        && add_node(self, fsm_join(part, number));
    return fine ? fsm_join(part, number) : FSM_NO_STATE;
}

static fsm_state intern(fsm_timed_model *self, uint32_t tuple, bool stable, fsm_bound *zone, uint32_t size,
                        const fsm_limits *limits)
{
    uint32_t part = 2 * tuple + stable;
    forget(zone, size, limits);
    if (!fsm_zones_hold(&self->timed.zones, zone, size))
        return FSM_NO_STATE;
    if (self->cover != FSM_COVER_EQUAL && !has_points(self) && !self->exact)
        return covered(self, part, zone, size, limits);
    uint32_t number = keep_zone(self);
    bool fine = number != FSM_NONE && (self->exact || add_node(self, fsm_join(part, number)));
    return fine ? fsm_join(part, number) : FSM_NO_STATE;
}

const fsm_timed_node *fsm_timed_node_of(const fsm_timed_model *self, fsm_state state)
{
    const uint64_t *number = fsm_hash_map_find(&self->numbers, state);
    return number == NULL ? NULL : &self->nodes[*number];
}

bool fsm_timed_is_maximal(const fsm_timed_model *self, fsm_state state)
{
    if (self->cover == FSM_COVER_EQUAL || self->cover == FSM_COVER_POINTS)
        return true;
    const fsm_family *family = &self->covers[fsm_left(state)];
    for (uint32_t i = 0; i < family->count; i++)
        if (family->entries[i].zone == fsm_right(state))
            return true;
    return false;
}

bool fsm_timed_covers(fsm_timed_model *self, fsm_state big, fsm_state small)
{
    const uint32_t *tuple = tuple_of(self, small);
    bool choice;
    if (big == small)
        return true;
    if (fsm_left(big) != fsm_left(small))
        return false;
    uint32_t size = fsm_timed_size(&self->timed, tuple);
    fsm_zones_read(&self->timed.zones, fsm_right(small), size, self->part);
    if (!fsm_timed_limits(&self->timed, tuple, self->limits, &choice) || !fsm_zones_hold(&self->timed.zones, self->part, size))
        return false;
    return fsm_zones_covers(&self->timed.zones, fsm_right(big), compared_limits(self, self->limits, size));
}

bool fsm_timed_be_partial(fsm_timed_model *self, const fsm_set *passed, const uint32_t *marks, uint32_t count)
{
    for (uint32_t i = 0; i < self->node_count; i++) {
        fsm_timed_node *node = &self->nodes[i];
        for (uint32_t k = 0; node->arc_count != FSM_NONE && k < node->arc_count; k++)
            if (fsm_set_find(passed, self->arcs[node->arcs + k].to) == FSM_NOWHERE)
                node->arc_count = FSM_NONE;
    }
    self->at = FSM_NO_STATE;
    self->partial = true;
    self->hoped = fsm_lists_number(&self->marks, marks, count);
    return self->hoped != FSM_NONE;
}

void fsm_timed_be_exact(fsm_timed_model *self, bool exact)
{
    self->exact = exact;
    self->at = FSM_NO_STATE;
}

static bool add_step(fsm_timed_model *self, fsm_state to, fsm_kind kind, fsm_timed_move move)
{
    if (self->move_count == self->move_room) {
        size_t room = self->move_room == 0 ? 64 : 2 * self->move_room;
        fsm_timed_move *moves = realloc(self->moves, room * sizeof *moves);
        if (moves == NULL)
            return fail(self, "out of memory");
        self->moves = moves;
        self->move_room = room;
    }
    self->moves[self->move_count++] = move;
    return (to != FSM_NO_STATE && fsm_steps_add(self->steps, to, 0, kind)) || fail(self, "out of memory");
}

/* --- where a step leads ---------------------------------------------------------------------------------- */

bool fsm_timed_cut_stable(fsm_timed_model *self, const fsm_timed_points *at, fsm_bound *part)
{
    memcpy(part, at->zone, (size_t)at->size * at->size * sizeof *part);
    for (uint32_t i = 1; i < at->size; i++)
        self->upper[i] = at->limits[i].upper == FSM_NEVER ? FSM_UNBOUNDED : fsm_less_than(at->limits[i].upper);
    return fsm_zone_below(part, at->size, self->upper);
}

/* No timer has expired, and time may have passed; in `part`. False if there is no such point. */
static bool stay_below(fsm_timed_model *self, const fsm_timed_points *at)
{
    if (!fsm_timed_cut_stable(self, at, self->part))
        return false;
    if (has_points(self))
        return true;
    fsm_zone_up(self->part, at->size);
    return fsm_zone_below(self->part, at->size, self->upper);
}

bool fsm_timed_cut_due(fsm_timed_model *self, const fsm_timed_points *at, fsm_timed_due *next, fsm_bound *part)
{
    while (next->clock + 1 < at->size) {
        uint32_t clock = ++next->clock;
        while (clock > next->first + fsm_timed_armed(&self->timed, at->locals, next->machine))
            next->first += fsm_timed_armed(&self->timed, at->locals, next->machine++);
        if (at->limits[clock].upper == FSM_NEVER)
            continue;
        for (uint32_t k = 1; k < at->size; k++)
            self->upper[k] = at->limits[k].upper == FSM_NEVER  ? FSM_UNBOUNDED
                : k > next->first && k < clock                 ? fsm_less_than(at->limits[k].upper)
                                                               : fsm_at_most(at->limits[k].upper);
        memcpy(part, at->zone, (size_t)at->size * at->size * sizeof *part);
        if (fsm_zone_below(part, at->size, self->upper) && fsm_zone_above(part, at->size, clock, at->limits[clock].upper))
            return true;
    }
    return false;
}

/* For each machine the points in which one of its timers has expired, but none that was armed
 * earlier. */
static bool add_due(fsm_timed_model *self, const fsm_timed_points *at, fsm_kind kind, fsm_timed_move move)
{
    fsm_timed_due next = {0};
    while (fsm_timed_cut_due(self, at, &next, self->part))
        if (!add_step(self, intern(self, at->tuple, false, self->part, at->size, at->limits), kind, move))
            return false;
    return true;
}

/* Adds a step to each state that holds some of the points. */
static bool arrive(fsm_timed_model *self, const uint32_t *locals, const fsm_bound *zone, uint32_t size, fsm_kind kind,
                   fsm_timed_move move)
{
    fsm_timed *t = &self->timed;
    bool waits, choice;
    if (!fsm_timed_may_wait(t, locals, &waits) || !fsm_timed_limits(t, locals, self->limits, &choice))
        return false;
    self->has_choices = self->has_choices || choice;
    fsm_timed_points at = {locals, fsm_store_insert(&t->tuples, locals, t->memory_limit, NULL), size, self->limits, zone};
    if (at.tuple >= FSM_NONE / 2)
        return fail(self, "out of memory");
    if (!waits) {
        memcpy(self->part, zone, (size_t)size * size * sizeof *zone);
        return add_step(self, intern(self, at.tuple, false, self->part, size, at.limits), kind, move);
    }
    if (stay_below(self, &at)
        && !add_step(self, intern(self, at.tuple, true, self->part, size, at.limits), kind, move))
        return false;
    return add_due(self, &at, kind, move);
}

/* --- steps ------------------------------------------------------------------------------------------------ */

/* The first timer of a machine that has a deadline, counted from 1; 0: no such timer. */
static uint32_t first_bounded(const fsm_timed_model *self, uint32_t machine)
{
    uint32_t clock = 1;
    for (uint32_t i = 0; i < machine; i++)
        clock += fsm_timed_armed(&self->timed, self->tuple, i);
    uint32_t armed = fsm_timed_armed(&self->timed, self->tuple, machine);
    for (uint32_t place = 0; place < armed; place++)
        if (self->timed.limits[clock + place].upper != FSM_NEVER)
            return place + 1;
    return 0;
}

/* The machine that moves, if its first timer with a deadline is not there any more after the step. */
static uint64_t ended_by(const fsm_timed_model *self, uint32_t machine, const fsm_local_step *step)
{
    const fsm_composition *c = self->timed.composition;
    uint32_t first = first_bounded(self, machine);
    uint32_t armed = fsm_info(c, machine, step->next)->view.armed;
    for (uint32_t i = 0; i < armed; i++)
        if (c->numbers.items[step->clocks + i] == first)
            return 0;
    return first == 0 ? 0 : UINT64_C(1) << machine;
}

/* Whether all points of a stable state can wait until a timer has come to its least duration, before another one expires. */
static bool can_wait_for(const fsm_timed_model *self, uint32_t machine, uint32_t place)
{
    const fsm_limits *limits = self->timed.limits;
    uint32_t clock = 1 + place;
    for (uint32_t i = 0; i < machine; i++)
        clock += fsm_timed_armed(&self->timed, self->tuple, i);
    for (uint32_t i = 1; i < self->size; i++)
        if (i != clock && limits[i].upper != FSM_NEVER
            && self->zone[i * self->size + clock] > fsm_less_than(limits[i].upper - limits[clock].lower))
            return false;
    return true;
}

/* --- steps that are kept ---------------------------------------------------------------------------------- */

/* Keeps the steps of a state that is a node, as long as there is room. */
static void keep_steps(fsm_timed_model *self, fsm_state state, uint64_t running)
{
    const uint64_t *number = fsm_hash_map_find(&self->numbers, state);
    size_t count = self->move_count;
    if (number == NULL || self->nodes[*number].arc_count != FSM_NONE)
        return;
    if (self->arc_count + count > self->arc_room) {
        size_t room = self->arc_room == 0 ? 1024 : 2 * self->arc_room;
        while (room < self->arc_count + count)
            room *= 2;
        fsm_timed_arc *arcs = room * sizeof *arcs > self->timed.memory_limit / 4 ? NULL : realloc(self->arcs, room * sizeof *arcs);
        self->forgetful = arcs == NULL;
        if (arcs == NULL)
            return; /* they are enumerated again */
        self->arcs = arcs;
        self->arc_room = room;
    }
    fsm_timed_node *node = &self->nodes[*number];
    node->arcs = self->arc_count;
    node->arc_count = (uint32_t)count;
    node->running = running;
    const fsm_step *items = &self->steps->items[self->steps->count - count];
    for (size_t i = 0; i < count; i++)
        self->arcs[self->arc_count++] = (fsm_timed_arc){self->moves[i], items[i].to, (fsm_kind)items[i].kind};
}

static bool read_steps(fsm_timed_model *self, const fsm_timed_node *node)
{
    for (uint32_t i = 0; i < node->arc_count; i++) {
        const fsm_timed_arc *arc = &self->arcs[node->arcs + i];
        if (!add_step(self, arc->to, arc->kind, arc->move))
            return false;
    }
    self->running = node->running;
    self->at = node->state;
    return true;
}

static uint64_t running_now(const fsm_timed_model *self)
{
    uint64_t found = 0;
    for (uint32_t i = 0; self->stable && i < fsm_timed_machines(&self->timed); i++)
        found |= first_bounded(self, i) > 0 ? UINT64_C(1) << i : 0;
    return found;
}

/* --- enumeration ------------------------------------------------------------------------------------------ */

static bool visit(void *context, const fsm_timed_step *step)
{
    fsm_timed_model *self = context;
    const fsm_composition *c = self->timed.composition;
    const fsm_local_step local = c->steps[step->number];
    uint32_t machine = step->what.machine;
    size_t cells = (size_t)self->size * self->size;
    /* An expired timer is a step of the machine itself, whether it had a choice before or not. */
    fsm_kind kind = !step->fires ? step->kind : self->stable ? FSM_STEP_ENVIRONMENT : FSM_STEP_INTERNAL;
    fsm_timed_move move = {.number = step->number, .group = self->group++};
    /* All points can take a step with no guard, one whose guard cuts nothing, and one that waiting makes possible. */
    move.sure = !step->fires || (self->stable && can_wait_for(self, machine, step->what.argument))
        || memcmp(self->timed.guarded, self->zone, cells * sizeof *self->zone) == 0;
    move.action = fsm_owed_action(c, kind, step->what);
    move.ended = ended_by(self, machine, &local);
    bool new_arrival;
    if (!fsm_timed_arrivals_add(&self->arrivals, self->timed.tuples.state_size, step, kind, &move, &new_arrival))
        return fail(self, "out of memory");
    if (!new_arrival)
        return true;
    return arrive(self, step->tuple, step->zone, step->size, kind, move);
}

/* The time until the next timer comes to its least or greatest duration, from the point in `zone`; 0: none will. */
static int32_t time_to_corner(const fsm_timed_model *self)
{
    int32_t least = 0;
    for (uint32_t i = 1; i < self->size; i++) {
        const int32_t corners[] = {self->limits[i].lower, self->limits[i].upper};
        int32_t age = self->zone[i * self->size] >> 1;
        for (int k = 0; self->zone[i * self->size] != FSM_UNBOUNDED && k < 2; k++)
            if (corners[k] > age && (least == 0 || corners[k] - age < least))
                least = corners[k] - age;
    }
    return least;
}

/* Time passes until the next corner. */
static bool wait_for_corner(fsm_timed_model *self, const fsm_timed_points *at, fsm_timed_move move)
{
    fsm_bound *zone = self->timed.after;
    int32_t time = time_to_corner(self);
    for (uint32_t i = 1; i < self->size; i++) {
        zone[i * self->size] = fsm_bound_sum(self->zone[i * self->size], fsm_at_most(time));
        zone[i] = fsm_bound_sum(self->zone[i], fsm_at_most(-time));
    }
    if (time == 0)
        return true;
    if (stay_below(self, at)
        && !add_step(self, intern(self, at->tuple, true, self->part, at->size, at->limits), FSM_STEP_TIME, move))
        return false;
    return add_due(self, at, FSM_STEP_TIME, move);
}

/* Until some timer expires: time passes, for all points. */
static bool wait(fsm_timed_model *self)
{
    fsm_timed *t = &self->timed;
    bool choice;
    if (!fsm_timed_limits(t, self->tuple, self->limits, &choice))
        return false;
    memcpy(t->after, self->zone, (size_t)self->size * self->size * sizeof *self->zone);
    uint32_t tuple = fsm_store_find(&t->tuples, self->tuple);
    fsm_timed_points at = {self->tuple, tuple, self->size, self->limits, t->after};
    fsm_timed_move move = {.number = FSM_NONE, .group = self->group++, .sure = true, .action = FSM_NONE};
    if (has_points(self))
        return wait_for_corner(self, &at, move);
    fsm_zone_up(t->after, self->size);
    return add_due(self, &at, FSM_STEP_TIME, move);
}

static bool has_deadlines(const fsm_timed_model *self)
{
    for (uint32_t i = 1; i < self->size; i++)
        if (self->limits[i].upper != FSM_NEVER)
            return true;
    return false;
}

/* A state that another one covers has one step: to that one. */
static bool pass_to_cover(fsm_timed_model *self, fsm_state state)
{
    const fsm_family *family = &self->covers[fsm_left(state)];
    for (uint32_t i = 0; i < family->count; i++) {
        fsm_state cover = fsm_join(fsm_left(state), family->entries[i].zone);
        if (fsm_timed_covers(self, cover, state)) {
            fsm_timed_move move = {.number = FSM_TIMED_COVERED, .sure = true, .action = FSM_NONE};
            if (!add_step(self, cover, FSM_STEP_INTERNAL, move))
                return false;
            self->running = 0;
            keep_steps(self, state, self->running);
            self->at = state;
            return true;
        }
    }
    return fail(self, "a state has lost its cover");
}

static bool enumerate(fsm_timed_model *self, fsm_state state, fsm_steps *steps)
{
    fsm_timed *t = &self->timed;
    bool choice;
    self->at = FSM_NO_STATE;
    self->from = state;
    self->move_count = self->group = 0;
    self->steps = steps;
    const fsm_timed_node *node = self->exact ? NULL : fsm_timed_node_of(self, state);
    if (node != NULL && node->arc_count != FSM_NONE)
        return read_steps(self, node);
    if (self->partial && !self->exact)
        return true;
    if (!self->exact && !self->forgetful && !fsm_timed_is_maximal(self, state))
        return pass_to_cover(self, state);
    fsm_timed_arrivals_clear(&self->arrivals);
    self->stable = fsm_timed_is_stable(state);
    memcpy(self->tuple, tuple_of(self, state), t->tuples.state_size);
    self->size = fsm_timed_size(t, self->tuple);
    fsm_zones_read(&t->zones, fsm_right(state), self->size, self->zone);
    if (!fsm_timed_limits(t, self->tuple, self->limits, &choice) || !fsm_timed_may_wait(t, self->tuple, &self->waits))
        return false;
    if ((self->stable && has_deadlines(self) && !wait(self))
        || !fsm_timed_successors(t, self->tuple, self->zone, true, visit, self))
        return false;
    if (!fsm_timed_limits(t, self->tuple, t->limits, &choice))
        return false;
    self->running = running_now(self);
    if (!self->exact)
        keep_steps(self, state, self->running);
    self->at = state;
    return true;
}

static bool successors(void *context, fsm_state state, fsm_steps *steps)
{
    return enumerate(context, state, steps);
}

bool fsm_timed_model_look(fsm_timed_model *self, fsm_state state)
{
    self->again.count = 0;
    return self->at == state || enumerate(self, state, &self->again);
}

static bool begin(void *context, const fsm_timed_step *step)
{
    fsm_timed_model *self = context;
    fsm_bound *zone = self->zone;
    fsm_zone_zero(zone, step->size); /* before any time passes */
    fsm_timed_move move = {.number = self->group, .group = self->group, .action = FSM_NONE};
    self->group++;
    return arrive(self, step->tuple, zone, step->size, FSM_STEP_ENVIRONMENT, move);
}

static bool initial(void *context, fsm_steps *steps)
{
    fsm_timed_model *self = context;
    self->at = self->from = FSM_NO_STATE;
    self->move_count = self->group = 0;
    self->steps = steps;
    return fsm_timed_initial(&self->timed, begin, self);
}

/* --- what is fair ------------------------------------------------------------------------------------------- */

/* An event that only arms timers again is a step at the instant at which they were armed, too, where discrete time has
 * none. That makes no run fair that was not: in such a step nothing happens, and without it the event was not possible
 * there. */
static bool fair(void *context, fsm_state state, const fsm_steps *steps, uint32_t *actions)
{
    fsm_timed_model *self = context;
    if (!fsm_timed_model_look(self, state))
        return false;
    for (size_t i = 0; i < steps->count; i++)
        actions[i] = self->moves[i].action;
    return true;
}

static uint64_t running(void *context, fsm_state state, const fsm_steps *steps, uint64_t *ended)
{
    fsm_timed_model *self = context;
    if (!fsm_timed_model_look(self, state))
        return UINT64_MAX; /* the model reports the failure */
    for (size_t i = 0; i < steps->count; i++)
        ended[i] = self->moves[i].ended;
    return self->running;
}

/* --- what is seen of a state -------------------------------------------------------------------------------- */

static bool make_room(fsm_timed_model *self, uint32_t part)
{
    if (part < self->part_room)
        return true;
    uint32_t room = self->part_room == 0 ? 64 : self->part_room;
    while (room <= part)
        room *= 2;
    uint32_t *marks_of = realloc(self->marks_of, room * sizeof *marks_of);
    if (marks_of == NULL)
        return fail(self, "out of memory");
    for (uint32_t i = self->part_room; i < room; i++)
        marks_of[i] = FSM_NONE;
    self->marks_of = marks_of;
    self->part_room = room;
    return true;
}

static uint32_t marks(void *context, fsm_state state)
{
    fsm_timed_model *self = context;
    fsm_timed *t = &self->timed;
    uint32_t part = fsm_left(state) >> 1;
    const fsm_timed_node *node = self->partial ? fsm_timed_node_of(self, state) : NULL;
    if (self->partial && (node == NULL || node->arc_count == FSM_NONE))
        return self->hoped;
    if (!make_room(self, part))
        return FSM_NONE;
    if (self->marks_of[part] == FSM_NONE) {
        uint32_t count = fsm_flat_marks(t->composition, tuple_of(self, state), t->evaluated);
        self->marks_of[part] = fsm_lists_number(&self->marks, t->evaluated, count);
    }
    return self->marks_of[part];
}

static const uint32_t *mark_set(void *context, uint32_t set, uint32_t *count)
{
    const fsm_timed_model *self = context;
    return fsm_lists_at(&self->marks, set, count);
}

static uint32_t configuration(void *context, fsm_state state)
{
    const fsm_timed_model *self = context;
    return fsm_flat_configuration(self->timed.composition, tuple_of(self, state));
}

static bool at_rest(void *context, fsm_state state)
{
    const fsm_timed_model *self = context;
    return fsm_flat_at_rest(self->timed.composition, tuple_of(self, state));
}

static size_t memory(void *context)
{
    const fsm_timed_model *self = context;
    size_t graph = self->cover_room * sizeof *self->covers + self->entry_room * sizeof(fsm_entry)
        + self->node_room * sizeof *self->nodes + self->arc_room * sizeof *self->arcs + fsm_hash_map_bytes(&self->numbers);
    return graph + fsm_timed_bytes(&self->timed) + fsm_lists_bytes(&self->marks) + self->part_room * sizeof *self->marks_of;
}

static const char *failure(void *context)
{
    const fsm_timed_model *self = context;
    const fsm_timed *t = &self->timed;
    return t->failure != NULL ? t->failure : t->composition->failure != NULL ? t->composition->failure : self->failure;
}

/* --- making one ------------------------------------------------------------------------------------------------ */

bool fsm_timed_model_init(fsm_timed_model *self, fsm_composition *composition, size_t memory_limit)
{
    *self = (fsm_timed_model){.at = FSM_NO_STATE};
    bool fine = fsm_timed_init(&self->timed, composition, memory_limit);
    fine = fsm_lists_init(&self->marks) && fine;
    self->zone = malloc(FSM_ZONE_ROOM * sizeof *self->zone);
    self->part = malloc(FSM_ZONE_ROOM * sizeof *self->part);
    self->other = malloc(FSM_ZONE_ROOM * sizeof *self->other);
    self->upper = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->upper);
    self->limits = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->limits);
    self->model = (fsm_model){
        .abi = FSM_MODEL_ABI, .mark_count = composition->model.mark_count, .self = self,
        .action_count = composition->model.action_count,
        .initial = initial, .successors = successors, .marks = marks, .mark_set = mark_set,
        .configuration = configuration, .at_rest = at_rest, .fair = fair, .running = running, .memory = memory,
        .failure = failure};
    if (fine && self->zone != NULL && self->part != NULL && self->other != NULL && self->upper != NULL && self->limits != NULL)
        return true;
    fsm_timed_model_free(self);
    return false;
}

void fsm_timed_model_free(fsm_timed_model *self)
{
    if (self->timed.pairs != NULL) {
        self->timed.tuples.count = 0; /* without families */
        fsm_timed_free(&self->timed);
    }
    for (uint32_t part = 0; part < self->cover_room; part++)
        free(self->covers[part].entries);
    free(self->covers);
    free(self->nodes);
    free(self->arcs);
    fsm_hash_map_free(&self->numbers);
    fsm_timed_arrivals_free(&self->arrivals);
    fsm_lists_free(&self->marks);
    free(self->marks_of);
    free(self->moves);
    free(self->again.items);
    free(self->zone);
    free(self->part);
    free(self->other);
    free(self->upper);
    free(self->limits);
}
