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

static bool is_stable(fsm_state state)
{
    return (fsm_left(state) & 1) != 0;
}

static const uint32_t *tuple_of(const fsm_timed_model *self, fsm_state state)
{
    return fsm_store_at(&self->timed.tuples, fsm_left(state) >> 1);
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

static fsm_state intern(fsm_timed_model *self, uint32_t tuple, bool stable, fsm_bound *zone, uint32_t size,
                        const fsm_limits *limits)
{
    fsm_zones *zones = &self->timed.zones;
    forget(zone, size, limits);
    uint32_t number = fsm_zones_hold(zones, zone, size) ? fsm_zones_keep(zones, self->timed.memory_limit) : FSM_NONE;
    return number == FSM_NONE ? FSM_NO_STATE : fsm_join(2 * tuple + stable, number);
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

/* A discrete part and points of it, before they are told apart. */
typedef struct {
    const uint32_t *locals;
    uint32_t tuple, size;
    const fsm_limits *limits;
    const fsm_bound *zone;
} arrival;

/* No timer is due, and time may have passed; in `part`. False if there is no such point. */
static bool stay_below(fsm_timed_model *self, const arrival *at)
{
    memcpy(self->part, at->zone, (size_t)at->size * at->size * sizeof *self->part);
    for (uint32_t i = 1; i < at->size; i++)
        self->upper[i] = at->limits[i].upper == FSM_NEVER ? FSM_UNBOUNDED : fsm_less_than(at->limits[i].upper);
    if (!fsm_zone_below(self->part, at->size, self->upper))
        return false;
    fsm_zone_up(self->part, at->size);
    return fsm_zone_below(self->part, at->size, self->upper);
}

/* For each machine the points in which one of its timers is due, and none that was armed earlier. */
static bool add_due(fsm_timed_model *self, const arrival *at, fsm_kind kind, fsm_timed_move move)
{
    uint32_t clock = 1;
    for (uint32_t i = 0; i < fsm_timed_machines(&self->timed); i++) {
        uint32_t first = clock, armed = fsm_timed_armed(&self->timed, at->locals, i);
        for (; clock < first + armed; clock++) {
            if (at->limits[clock].upper == FSM_NEVER)
                continue;
            for (uint32_t k = 1; k < at->size; k++)
                self->upper[k] = at->limits[k].upper == FSM_NEVER  ? FSM_UNBOUNDED
                    : k >= first && k < clock                      ? fsm_less_than(at->limits[k].upper)
                                                                   : fsm_at_most(at->limits[k].upper);
            memcpy(self->part, at->zone, (size_t)at->size * at->size * sizeof *self->part);
            if (fsm_zone_below(self->part, at->size, self->upper)
                && fsm_zone_above(self->part, at->size, clock, at->limits[clock].upper)
                && !add_step(self, intern(self, at->tuple, false, self->part, at->size, at->limits), kind, move))
                return false;
        }
    }
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
    arrival at = {locals, fsm_store_insert(&t->tuples, locals, t->memory_limit, NULL), size, self->limits, zone};
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

/* The first timer of a machine that has a deadline, counted from 1; 0: there is none. */
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

/* Whether all points of a stable state can wait until a timer has come to its least duration, before another one is due. */
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

static bool visit(void *context, const fsm_timed_step *step)
{
    fsm_timed_model *self = context;
    const fsm_composition *c = self->timed.composition;
    const fsm_local_step local = c->steps[step->number];
    uint32_t machine = step->what.machine;
    size_t cells = (size_t)self->size * self->size;
    /* A due timer is what the machine does by itself, whether it had a choice before or not. */
    fsm_kind kind = !step->fires ? step->kind : self->stable ? FSM_STEP_ENVIRONMENT : FSM_STEP_INTERNAL;
    fsm_timed_move move = {.number = step->number, .group = self->group++};
    /* All points can take a step with no guard, one whose guard cuts nothing, and one that waiting makes possible. */
    move.sure = !step->fires || (self->stable && can_wait_for(self, machine, step->what.argument))
        || memcmp(self->timed.guarded, self->zone, cells * sizeof *self->zone) == 0;
    move.action = fsm_owed_action(c, kind, step->what);
    move.ended = ended_by(self, machine, &local);
    return arrive(self, step->tuple, step->zone, step->size, kind, move);
}

/* Until some timer is due: time passes, for all points. */
static bool wait(fsm_timed_model *self)
{
    fsm_timed *t = &self->timed;
    bool choice;
    if (!fsm_timed_limits(t, self->tuple, self->limits, &choice))
        return false;
    memcpy(t->after, self->zone, (size_t)self->size * self->size * sizeof *self->zone);
    fsm_zone_up(t->after, self->size);
    uint32_t tuple = fsm_store_find(&t->tuples, self->tuple);
    arrival at = {self->tuple, tuple, self->size, self->limits, t->after};
    fsm_timed_move move = {.number = FSM_NONE, .group = self->group++, .sure = true, .action = FSM_NONE};
    return add_due(self, &at, FSM_STEP_TIME, move);
}

static bool has_deadlines(const fsm_timed_model *self)
{
    for (uint32_t i = 1; i < self->size; i++)
        if (self->limits[i].upper != FSM_NEVER)
            return true;
    return false;
}

static bool enumerate(fsm_timed_model *self, fsm_state state, fsm_steps *steps)
{
    fsm_timed *t = &self->timed;
    bool choice;
    self->at = FSM_NO_STATE;
    self->move_count = self->group = 0;
    self->steps = steps;
    self->stable = is_stable(state);
    memcpy(self->tuple, tuple_of(self, state), t->tuples.state_size);
    self->size = fsm_timed_size(t, self->tuple);
    fsm_zones_read(&t->zones, fsm_right(state), self->size, self->zone);
    if (!fsm_timed_limits(t, self->tuple, self->limits, &choice) || !fsm_timed_may_wait(t, self->tuple, &self->waits))
        return false;
    if ((self->stable && has_deadlines(self) && !wait(self))
        || !fsm_timed_successors(t, self->tuple, self->zone, true, visit, self))
        return false;
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
    self->at = FSM_NO_STATE;
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
    uint64_t found = 0;
    if (!fsm_timed_model_look(self, state))
        return UINT64_MAX; /* the failure is told by the model */
    for (size_t i = 0; i < steps->count; i++)
        ended[i] = self->moves[i].ended;
    for (uint32_t i = 0; is_stable(state) && i < fsm_timed_machines(&self->timed); i++)
        found |= first_bounded(self, i) > 0 ? UINT64_C(1) << i : 0;
    return found;
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
    return fsm_timed_bytes(&self->timed) + fsm_lists_bytes(&self->marks) + self->part_room * sizeof *self->marks_of;
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
    self->upper = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->upper);
    self->limits = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->limits);
    self->model = (fsm_model){
        .abi = FSM_MODEL_ABI, .mark_count = composition->model.mark_count, .self = self,
        .action_count = composition->model.action_count,
        .initial = initial, .successors = successors, .marks = marks, .mark_set = mark_set,
        .configuration = configuration, .at_rest = at_rest, .fair = fair, .running = running, .memory = memory,
        .failure = failure};
    if (fine && self->zone != NULL && self->part != NULL && self->upper != NULL && self->limits != NULL)
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
    fsm_lists_free(&self->marks);
    free(self->marks_of);
    free(self->moves);
    free(self->again.items);
    free(self->zone);
    free(self->part);
    free(self->upper);
    free(self->limits);
}
