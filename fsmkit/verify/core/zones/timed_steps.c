#include "zones/timed.h"

#include <string.h>

static bool fail(fsm_timed *self, const char *why)
{
    if (self->failure == NULL)
        self->failure = why;
    return false;
}

/* --- the clocks of a discrete part ---------------------------------------------------------------- */

static const fsm_view *view_of(const fsm_timed *self, const uint32_t *tuple, uint32_t machine)
{
    return &fsm_info(self->composition, machine, tuple[machine])->view;
}

uint32_t fsm_timed_size(const fsm_timed *self, const uint32_t *tuple)
{
    uint32_t size = 1 + fsm_timed_watches(self, tuple);
    for (uint32_t i = 0; i < fsm_timed_machines(self); i++)
        size += view_of(self, tuple, i)->armed;
    return size;
}

uint32_t fsm_timed_armed(const fsm_timed *self, const uint32_t *tuple, uint32_t machine)
{
    return view_of(self, tuple, machine)->armed;
}

bool fsm_timed_limits(fsm_timed *self, const uint32_t *tuple, fsm_limits *limits, bool *choice)
{
    const fsm_composition *c = self->composition;
    uint32_t clock = 1;
    *choice = false;
    for (uint32_t i = 0; i < fsm_timed_machines(self); i++) {
        uint32_t armed = view_of(self, tuple, i)->armed;
        if (armed == 0)
            continue;
        fsm_limits_of(c->system->machines[i], fsm_store_at(&c->locals[i], tuple[i]), &limits[clock]);
        for (uint32_t end = clock + armed; clock < end; clock++) {
            fsm_limits *l = &limits[clock];
            bool endless = l->upper - l->lower == FSM_OPEN_ENDED;
            if ((endless ? l->lower : l->upper) / self->unit >= FSM_LONGEST)
                return fail(self, "a delay is too long for zones");
            *choice = *choice || l->lower != l->upper;
            l->lower = l->lower == 0 && l->upper > 0 ? -1 : l->lower / self->unit; /* it always is 0 or more */
            l->upper = endless ? FSM_NEVER : l->upper / self->unit;
        }
    }
    if (fsm_timed_watches(self, tuple))
        limits[clock] = (fsm_limits){self->watch.most, self->watch.most};
    limits[0] = (fsm_limits){0, 0};
    return true;
}

/* --- steps ------------------------------------------------------------------------------------------ */

typedef struct {
    fsm_timed *timed;
    const uint32_t *tuple;
    const fsm_bound *zone; /* after the guard */
    uint32_t size;
    bool waits, at_once;
    uint32_t choices; /* of the step, in the numbers of the composition, which may move */
    fsm_timed_visit *visit;
    void *context;
    fsm_timed_step step;
} move;

static void add_mark(move *self, uint32_t mark)
{
    uint32_t *marks = self->timed->marks;
    for (uint32_t i = 0; i < self->step.mark_count; i++)
        if (marks[i] == mark)
            return;
    if (self->step.mark_count < FSM_MOST_NOTES + FSM_MOST_MACHINES)
        marks[self->step.mark_count++] = mark;
}

static bool deliver(move *self, uint32_t message)
{
    fsm_composition *c = self->timed->composition;
    uint32_t *next = self->timed->following;
    uint32_t target = ((const fsm_message *)fsm_store_at(&c->messages, message))->target;
    bool full;
    next[target] = fsm_deliver(c, next[target], message, &full);
    if (next[target] == FSM_NONE)
        return false;
    if (full)
        add_mark(self, fsm_first_mark(c->system, target) + FSM_NOTE_FULL);
    return true;
}

/* The observation of all machines in a discrete part. */
typedef struct {
    bool answering; /* a machine of the environment has an event waiting */
    bool watching;  /* a monitor has */
    uint32_t waiting;
} overview;

static overview look(const fsm_timed *self, const uint32_t *tuple)
{
    overview seen = {false, false, 0};
    for (uint32_t i = 0; i < fsm_timed_machines(self); i++) {
        uint32_t waiting = view_of(self, tuple, i)->waiting;
        const fsm_machine *m = self->composition->system->machines[i];
        seen.waiting += waiting;
        seen.answering = seen.answering || (m->environment && waiting > 0);
        seen.watching = seen.watching || (m->monitor && waiting > 0);
    }
    return seen;
}

bool fsm_timed_may_wait(fsm_timed *self, const uint32_t *tuple, bool *waits)
{
    *waits = false;
    if (look(self, tuple).answering)
        return true;
    for (uint32_t i = 0; i < fsm_timed_machines(self); i++) {
        if (!fsm_know(self->composition, i, tuple[i]))
            return false;
        if (fsm_info(self->composition, i, tuple[i])->busy)
            return true;
    }
    *waits = true;
    return true;
}

static bool holds(const fsm_timed *self, const uint32_t *tuple, uint32_t property)
{
    return fsm_flat_evaluate(self->composition, tuple, property);
}

/* Lets time pass where it may, and hands the step on. */
static bool arrive(move *self)
{
    fsm_timed *t = self->timed;
    bool waits = false, choice;
    if (!self->at_once && !fsm_timed_may_wait(t, t->following, &waits))
        return false;
    if (!fsm_timed_limits(t, t->following, t->next_limits, &choice))
        return false;
    uint32_t size = self->step.size, clocks = size - fsm_timed_watches(t, t->following);
    if (waits) {
        for (uint32_t i = 1; i < size; i++)
            t->upper[i] = i < clocks && t->next_limits[i].upper != FSM_NEVER
                ? fsm_at_most(t->next_limits[i].upper) : FSM_UNBOUNDED;
        fsm_zone_up(t->after, size);
        (void)fsm_zone_below(t->after, size, t->upper); /* not empty: it was below before */
    }
    if (clocks < size)
        fsm_zone_extrapolate(t->after, size, clocks, t->watch.most);
    self->step.tuple = t->following;
    self->step.zone = t->after;
    self->step.limits = choice ? t->next_limits : NULL;
    self->step.marks = t->marks;
    self->step.waits = self->waits;
    self->step.what.choices = t->composition->numbers.items + self->choices;
    return self->visit(self->context, &self->step);
}

/* Stops the watch, or lets it continue, or starts it; each case is a step of its own. */
static bool arrive_with_watch(move *self, bool ran, bool begins)
{
    fsm_timed *t = self->timed;
    uint32_t machines = fsm_timed_machines(t), size = self->step.size;
    bool ends = holds(t, t->following, t->watch.end);
    uint32_t watched = ran ? self->size - 1 : 0; /* the clock of the watch before the step */
    t->source[0] = 0;
    self->step.stops = false;
    if (ends && (ran || begins)) {
        self->step.stops = true;
        self->step.arrival_least = begins ? fsm_at_most(0) : self->zone[watched];
        self->step.arrival_most = ran ? self->zone[watched * self->size] : fsm_at_most(0);
    }
    if (!ran || ends) {
        t->following[machines] = 0;
        fsm_zone_map(t->after, size, self->zone, self->size, t->source);
        if (!arrive(self))
            return false;
        self->step.stops = false;
    }
    if (!ends && (ran || begins)) {
        t->following[machines] = 1;
        self->step.size = size + 1;
        t->source[size] = watched;
        fsm_zone_map(t->after, size + 1, self->zone, self->size, t->source);
        bool fine = arrive(self);
        self->step.size = size;
        return fine;
    }
    return true;
}

/* Takes a local step from where the guard allows it. */
static bool take(move *self, uint32_t machine, uint32_t number)
{
    fsm_timed *t = self->timed;
    fsm_composition *c = t->composition;
    fsm_local_step step = c->steps[number];
    uint32_t machines = fsm_timed_machines(t), first = fsm_first_mark(c->system, machine);
    memcpy(t->following, self->tuple, (machines + 1u) * sizeof *t->following);
    t->following[machine] = step.next;
    self->step.mark_count = 0;
    for (uint32_t i = 0; i < step.note_count; i++)
        add_mark(self, first + c->numbers.items[step.notes + i]);
    for (uint32_t i = 0; i < step.message_count; i++)
        if (!deliver(self, c->numbers.items[step.messages + i]))
            return false;
    uint32_t clock = 1, old = 1;
    for (uint32_t i = 0; i < machines; i++) {
        uint32_t before = view_of(t, self->tuple, i)->armed, after = view_of(t, t->following, i)->armed;
        if (clock + after > FSM_MOST_CLOCKS)
            return fail(t, "too many timers are armed at once");
        for (uint32_t k = 0; k < after; k++) {
            uint32_t place = i == machine ? c->numbers.items[step.clocks + k] : k + 1;
            t->source[clock++] = place == 0 ? 0 : old + place - 1;
        }
        old += before;
    }
    self->step.size = clock;
    self->step.kind = step.kind;
    self->step.number = number;
    self->step.what = (fsm_description){step.action, machine, step.argument, self->tuple[machine],
                                        NULL, step.choice_count};
    self->choices = step.choices;
    if (t->watch.present) {
        bool begins = holds(t, t->following, t->watch.begin) && !holds(t, self->tuple, t->watch.begin);
        return arrive_with_watch(self, fsm_timed_watches(t, self->tuple), begins);
    }
    self->step.stops = false;
    fsm_zone_map(t->after, clock, self->zone, self->size, t->source);
    return arrive(self);
}

static bool take_all(move *self, uint32_t machine, uint32_t first, uint32_t count)
{
    for (uint32_t number = first; number < first + count; number++)
        if (!take(self, machine, number))
            return false;
    return true;
}

/* The steps of a local state in which one of its timers fires. */
static bool know_fire(fsm_timed *self, uint32_t machine, uint32_t local, uint32_t place, fsm_kind kind,
                      uint32_t *first, uint32_t *count)
{
    fsm_composition *c = self->composition;
    uint64_t key = (uint64_t)machine << 56 | (uint64_t)local << 16 | place;
    const uint64_t *known = fsm_hash_map_find(&self->fires, key);
    if (known != NULL) {
        *first = (uint32_t)(*known >> 32);
        *count = (uint32_t)*known;
        return true;
    }
    *first = (uint32_t)c->step_count;
    if (!fsm_explore(c, machine, local, FSM_DO_FIRE, place, kind))
        return false;
    *count = (uint32_t)c->step_count - *first;
    return fsm_hash_map_add(&self->fires, key, (uint64_t)*first << 32 | *count) || fail(self, "out of memory");
}

/* Fires those timers of a machine that can be due: where none armed earlier is. One with a choice of
 * when to fire need not wait for the others. */
static bool fire(move *self, uint32_t machine, uint32_t clock)
{
    fsm_timed *t = self->timed;
    const fsm_bound *zone = self->zone;
    uint32_t armed = view_of(t, self->tuple, machine)->armed, size = self->size;
    bool fine = true;
    for (uint32_t place = 0; fine && place < armed; place++) {
        fsm_limits limits = t->limits[clock + place];
        if (zone[(clock + place) * size] < fsm_at_most(limits.lower))
            continue;
        for (uint32_t i = 1; i < size; i++)
            t->upper[i] = i >= clock && i < clock + place && t->limits[i].upper != FSM_NEVER
                ? fsm_less_than(t->limits[i].upper) : FSM_UNBOUNDED;
        memcpy(t->guarded, zone, (size_t)size * size * sizeof *zone);
        bool exact = limits.lower == limits.upper;
        if (!fsm_zone_above(t->guarded, size, clock + place, limits.lower)
            || (exact && place > 0 && !fsm_zone_below(t->guarded, size, t->upper)))
            continue;
        fsm_kind kind = exact ? FSM_STEP_INTERNAL : FSM_STEP_ENVIRONMENT;
        uint32_t first, count;
        self->zone = t->guarded;
        self->step.fires = true;
        self->step.instant = limits.upper == 0;
        fine = know_fire(t, machine, self->tuple[machine], place, kind, &first, &count)
            && take_all(self, machine, first, count);
        self->zone = zone;
        self->step.fires = false;
    }
    return fine;
}

bool fsm_timed_successors(fsm_timed *self, const uint32_t *tuple, const fsm_bound *zone, bool at_once,
                          fsm_timed_visit *visit, void *context)
{
    fsm_composition *c = self->composition;
    const fsm_system *system = c->system;
    move m = {.timed = self, .tuple = tuple, .zone = zone, .at_once = at_once, .visit = visit,
              .context = context, .size = fsm_timed_size(self, tuple)};
    bool choice;
    overview seen = look(self, tuple);
    bool is_open = !seen.answering && seen.waiting <= system->max_pending_before_input;
    if (!fsm_timed_may_wait(self, tuple, &m.waits) || !fsm_timed_limits(self, tuple, self->limits, &choice))
        return false;
    m.waits = m.waits && !at_once;
    uint32_t clock = 1;
    for (uint32_t i = 0; i < system->machine_count; i++) {
        const fsm_view view = *view_of(self, tuple, i);
        const fsm_machine *first = system->machines[i];
        bool answers = (seen.watching ? first->monitor : first->environment) && view.waiting > 0;
        if (!seen.answering || answers) {
            if (!fsm_know(c, i, tuple[i]) || (is_open && !fsm_know_open(c, i, tuple[i])))
                return false;
            fsm_local_info info = *fsm_info(c, i, tuple[i]);
            if (!take_all(&m, i, info.own, info.own_count))
                return false;
            if (view.running && !info.busy && view.armed > 0 && !fire(&m, i, clock))
                return false;
            if (is_open && !take_all(&m, i, info.open, info.open_count))
                return false;
        }
        clock += view.armed;
    }
    return true;
}

static bool begin(void *context, const fsm_start *start)
{
    move *self = context;
    fsm_timed *t = self->timed;
    uint32_t machines = fsm_timed_machines(t);
    memcpy(t->following, start->locals, machines * sizeof *t->following);
    t->following[machines] = 0;
    memcpy(t->marks, start->marks, start->mark_count * sizeof *t->marks);
    t->starts = start->what;
    self->step = (fsm_timed_step){.mark_count = start->mark_count, .kind = FSM_STEP_ENVIRONMENT};
    self->step.size = fsm_timed_size(t, t->following);
    if (self->step.size > FSM_MOST_CLOCKS)
        return fail(t, "too many timers are armed at once");
    memset(t->source, 0, self->step.size * sizeof *t->source);
    if (t->watch.present)
        return arrive_with_watch(self, false, holds(t, t->following, t->watch.begin));
    fsm_zone_zero(t->after, self->step.size);
    return arrive(self);
}

bool fsm_timed_initial(fsm_timed *self, fsm_timed_visit *visit, void *context)
{
    static const fsm_bound nothing = 1; /* the zone of no clock */
    move m = {.timed = self, .zone = &nothing, .size = 1, .visit = visit, .context = context};
    return fsm_start_all(self->composition, begin, &m);
}

bool fsm_timed_pick(void *sought, const fsm_timed_step *step)
{
    fsm_timed_sought *self = sought;
    uint32_t at = self->at++;
    if ((self->initial ? at : step->number) != self->wanted)
        return true;
    self->ordinal = at;
    self->size = step->size;
    memcpy(self->tuple, step->tuple, (self->machines + 1u) * sizeof *self->tuple);
    memcpy(self->zone, step->zone, (size_t)step->size * step->size * sizeof *step->zone);
    return false;
}
