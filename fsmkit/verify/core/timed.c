#include "timed.h"

#include <stdlib.h>
#include <string.h>

enum { ASK_EVERY = 256 }; /* pairs between two calls of `keep_on` */

static bool fail(fsm_timed *self, const char *why)
{
    if (self->failure == NULL)
        self->failure = why;
    return false;
}

/* --- making one --------------------------------------------------------------------------------- */

bool fsm_timed_init(fsm_timed *self, fsm_composition *composition, size_t memory_limit)
{
    const fsm_system *system = composition->system;
    size_t marks = (size_t)composition->model.mark_count + 1;
    *self = (fsm_timed){.composition = composition, .memory_limit = memory_limit,
                        .unit = system->unit > 0 ? (int32_t)system->unit : 1};
    self->pair_room = self->head_room = 64;
    self->pairs = malloc(self->pair_room * sizeof *self->pairs);
    self->heads = malloc(self->head_room * sizeof *self->heads);
    self->witnesses = malloc(marks * sizeof *self->witnesses);
    self->marks = malloc((FSM_MOST_NOTES + FSM_MOST_MACHINES) * sizeof *self->marks);
    self->judged = malloc(marks * sizeof *self->judged);
    self->before = malloc(FSM_ZONE_ROOM * sizeof *self->before);
    self->guarded = malloc(FSM_ZONE_ROOM * sizeof *self->guarded);
    self->after = malloc(FSM_ZONE_ROOM * sizeof *self->after);
    self->upper = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->upper);
    self->limits = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->limits);
    self->next_limits = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->next_limits);
    self->source = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->source);
    bool fine = fsm_store_init(&self->tuples, (system->machine_count + 1u) * sizeof(uint32_t));
    fine = fsm_zones_init(&self->zones) && fine;
    if (!fine || self->pairs == NULL || self->heads == NULL || self->witnesses == NULL
        || self->marks == NULL || self->judged == NULL || self->before == NULL || self->guarded == NULL || self->after == NULL
        || self->upper == NULL || self->limits == NULL || self->next_limits == NULL || self->source == NULL) {
        fsm_timed_free(self);
        return false;
    }
    for (size_t i = 0; i < marks; i++)
        self->witnesses[i] = (fsm_timed_witness){FSM_NONE, FSM_NONE, 0};
    return true;
}

void fsm_timed_free(fsm_timed *self)
{
    fsm_store_free(&self->tuples);
    fsm_zones_free(&self->zones);
    fsm_memo_free(&self->fires);
    free(self->pairs);
    free(self->heads);
    free(self->witnesses);
    free(self->marks);
    free(self->judged);
    free(self->before);
    free(self->guarded);
    free(self->after);
    free(self->upper);
    free(self->limits);
    free(self->next_limits);
    free(self->source);
    *self = (fsm_timed){0};
}

size_t fsm_timed_bytes(const fsm_timed *self)
{
    return fsm_store_bytes(&self->tuples) + self->zones.bytes + self->pair_room * sizeof *self->pairs
        + self->head_room * sizeof *self->heads + fsm_memo_bytes(&self->fires)
        + fsm_composition_bytes(self->composition);
}

/* --- the clocks of a discrete part ---------------------------------------------------------------- */

static uint32_t machine_count(const fsm_timed *self)
{
    return self->composition->system->machine_count;
}

static const fsm_view *view_of(const fsm_timed *self, const uint32_t *tuple, uint32_t machine)
{
    return &fsm_info(self->composition, machine, tuple[machine])->view;
}

static bool runs(const fsm_timed *self, const uint32_t *tuple)
{
    return tuple[machine_count(self)] != 0;
}

uint32_t fsm_timed_size(const fsm_timed *self, const uint32_t *tuple)
{
    uint32_t size = 1 + runs(self, tuple);
    for (uint32_t i = 0; i < machine_count(self); i++)
        size += view_of(self, tuple, i)->armed;
    return size;
}

/* Writes the limits of all clocks, and says in `*choice` whether some timer has a choice of when to
 * fire. The watch is compared with all that it can be told apart from. */
static bool read_limits(fsm_timed *self, const uint32_t *tuple, fsm_limits *limits, bool *choice)
{
    const fsm_composition *c = self->composition;
    uint32_t clock = 1;
    *choice = false;
    for (uint32_t i = 0; i < machine_count(self); i++) {
        uint32_t armed = view_of(self, tuple, i)->armed;
        if (armed == 0)
            continue;
        c->system->machines[i]->limits(fsm_store_at(&c->locals[i], tuple[i]), &limits[clock]);
        for (uint32_t end = clock + armed; clock < end; clock++) {
            fsm_limits *l = &limits[clock];
            if (l->upper / self->unit >= FSM_LONGEST)
                return fail(self, "a delay is too long for zones");
            *choice = *choice || l->lower != l->upper;
            l->lower /= self->unit;
            l->upper /= self->unit;
        }
    }
    if (runs(self, tuple))
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

/* What all machines together show of a discrete part. */
typedef struct {
    bool answering; /* a machine of the environment has an event waiting */
    uint32_t waiting;
} overview;

static overview look(const fsm_timed *self, const uint32_t *tuple)
{
    overview seen = {false, 0};
    for (uint32_t i = 0; i < machine_count(self); i++) {
        uint32_t waiting = view_of(self, tuple, i)->waiting;
        seen.waiting += waiting;
        seen.answering = seen.answering || (self->composition->system->machines[i]->environment && waiting > 0);
    }
    return seen;
}

/* Whether time may pass: no machine has anything to do but to wait for its timers. */
static bool may_wait(fsm_timed *self, const uint32_t *tuple, bool *waits)
{
    *waits = false;
    if (look(self, tuple).answering)
        return true;
    for (uint32_t i = 0; i < machine_count(self); i++) {
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
    const fsm_composition *c = self->composition;
    const void *locals[FSM_MOST_MACHINES];
    for (uint32_t i = 0; i < c->system->machine_count; i++)
        locals[i] = fsm_store_at(&c->locals[i], tuple[i]);
    return c->system->judge(locals, property);
}

/* Lets time pass where it may, and hands the step on. */
static bool arrive(move *self)
{
    fsm_timed *t = self->timed;
    bool waits = false, choice;
    if (!self->at_once && !may_wait(t, t->following, &waits))
        return false;
    if (!read_limits(t, t->following, t->next_limits, &choice))
        return false;
    uint32_t size = self->step.size, clocks = size - runs(t, t->following);
    if (waits) {
        for (uint32_t i = 1; i < size; i++)
            t->upper[i] = i < clocks ? fsm_at_most(t->next_limits[i].upper) : FSM_UNBOUNDED;
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

/* Stops the watch, or lets it run on, or begin; each way is a step of its own. */
static bool arrive_with_watch(move *self, bool ran, bool begins)
{
    fsm_timed *t = self->timed;
    uint32_t machines = machine_count(t), size = self->step.size;
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
    uint32_t machines = machine_count(t), first = fsm_first_mark(c->system, machine);
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
        return arrive_with_watch(self, runs(t, self->tuple), begins);
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
    const uint64_t *known = fsm_memo_find(&self->fires, key);
    if (known != NULL) {
        *first = (uint32_t)(*known >> 32);
        *count = (uint32_t)*known;
        return true;
    }
    *first = (uint32_t)c->step_count;
    if (!fsm_explore(c, machine, local, FSM_DO_FIRE, place, kind))
        return false;
    *count = (uint32_t)c->step_count - *first;
    return fsm_memo_add(&self->fires, key, (uint64_t)*first << 32 | *count) || fail(self, "out of memory");
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
            t->upper[i] = i >= clock && i < clock + place ? fsm_less_than(t->limits[i].upper) : FSM_UNBOUNDED;
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
    bool is_open = !seen.answering && seen.waiting <= system->patience;
    if (!may_wait(self, tuple, &m.waits) || !read_limits(self, tuple, self->limits, &choice))
        return false;
    m.waits = m.waits && !at_once;
    uint32_t clock = 1;
    for (uint32_t i = 0; i < system->machine_count; i++) {
        const fsm_view view = *view_of(self, tuple, i);
        if (!seen.answering || (system->machines[i]->environment && view.waiting > 0)) {
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
    uint32_t machines = machine_count(t);
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

/* --- the search ------------------------------------------------------------------------------------- */

static void note_mark(fsm_timed *self, uint32_t mark, uint32_t pair, uint32_t step)
{
    fsm_timed_witness *witness = &self->witnesses[mark];
    if (witness->count++ == 0) {
        if (self->awaited != NULL && self->awaited[mark])
            self->awaited_count--;
        witness->state = pair;
        witness->step = step;
    }
}

static bool out_of_memory(fsm_timed *self)
{
    self->outcome = FSM_OUT_OF_MEMORY;
    return false;
}

/* The bytes that a part of `bytes` may grow to, by what was used when last asked. */
static size_t limit_for(const fsm_timed *self, size_t bytes)
{
    return bytes + (self->memory_limit > self->bytes ? self->memory_limit - self->bytes : 0);
}

static bool make_room(fsm_timed *self)
{
    if (self->pair_count == self->pair_room) {
        size_t room = 2 * (size_t)self->pair_room, bytes = room * sizeof *self->pairs;
        fsm_pair *pairs = room >= FSM_NONE || bytes > limit_for(self, bytes / 2) ? NULL : realloc(self->pairs, bytes);
        if (pairs == NULL)
            return false;
        self->pairs = pairs;
        self->pair_room = (uint32_t)room;
    }
    if (self->tuples.count >= self->head_room) {
        size_t room = 2 * (size_t)self->head_room;
        uint32_t *heads = room >= FSM_NONE ? NULL : realloc(self->heads, room * sizeof *heads);
        if (heads == NULL)
            return false;
        self->heads = heads;
        self->head_room = (uint32_t)room;
    }
    return true;
}

/* Whether a pair kept covers the zone in hand. */
static bool is_known(const fsm_timed *self, uint32_t tuple, const fsm_limits *limits, uint32_t *found)
{
    for (*found = self->heads[tuple]; *found != FSM_NONE; *found = self->pairs[*found].next)
        if (fsm_zones_covers(&self->zones, self->pairs[*found].zone, limits))
            return true;
    return false;
}

/* Takes the pairs out that the zone in hand covers. One whose turn is in the layer at hand still has
 * it, so that paths stay shortest. */
static void displace(fsm_timed *self, uint32_t tuple, const fsm_limits *limits)
{
    uint32_t *link = &self->heads[tuple];
    while (*link != FSM_NONE) {
        fsm_pair *pair = &self->pairs[*link];
        if (fsm_zones_is_covered(&self->zones, pair->zone, limits)) {
            pair->covered = *link >= self->layer_end;
            self->kept--;
            *link = pair->next;
        } else {
            link = &pair->next;
        }
    }
}

static void read_watch(fsm_timed *self, const fsm_timed_step *step)
{
    fsm_watch *watch = &self->watch;
    if (step->stops) {
        watch->least = !watch->stopped || step->arrival_least > watch->least ? step->arrival_least : watch->least;
        watch->greatest = !watch->stopped || step->arrival_most > watch->greatest ? step->arrival_most : watch->greatest;
        watch->stopped = true;
    }
    if (runs(self, step->tuple)) {
        fsm_bound most = step->zone[(size_t)(step->size - 1) * step->size];
        watch->pending = most > watch->pending ? most : watch->pending;
    }
}

static bool add_pair(fsm_timed *self, uint32_t tuple, bool new_tuple, const fsm_timed_step *step)
{
    uint32_t number = self->pair_count;
    uint32_t zone = fsm_zones_keep(&self->zones, limit_for(self, self->zones.bytes));
    if (zone == FSM_NONE)
        return out_of_memory(self);
    self->pairs[number] = (fsm_pair){tuple, zone, self->heads[tuple], {self->next, self->step}, false};
    self->heads[tuple] = number;
    self->pair_count++;
    self->kept++;
    if (!new_tuple)
        return true;
    uint32_t count = fsm_flat_marks(self->composition, step->tuple, self->judged);
    for (uint32_t i = 0; i < count; i++)
        note_mark(self, self->judged[i], number, FSM_NONE);
    return true;
}

static bool visit(void *context, const fsm_timed_step *step)
{
    fsm_timed *self = context;
    bool added;
    if (!make_room(self))
        return out_of_memory(self);
    uint32_t tuple = fsm_store_insert(&self->tuples, step->tuple, limit_for(self, fsm_store_bytes(&self->tuples)), &added);
    if (tuple == FSM_NONE || !fsm_zones_hold(&self->zones, step->zone, step->size))
        return out_of_memory(self);
    if (added)
        self->heads[tuple] = FSM_NONE;
    for (uint32_t i = 0; i < step->mark_count; i++)
        note_mark(self, step->marks[i], self->next, self->step);
    if (self->watch.present)
        read_watch(self, step);
    uint32_t known;
    if (!is_known(self, tuple, step->limits, &known)) {
        displace(self, tuple, step->limits);
        if (!add_pair(self, tuple, added, step))
            return false;
    }
    if (self->next != FSM_NONE && step->kind == FSM_STEP_INTERNAL && (!step->fires || step->instant)
        && tuple <= self->pairs[self->next].tuple)
        self->internal_back_edge = true;
    self->transitions += self->next != FSM_NONE;
    self->step++;
    return true;
}

static bool may_go_on(fsm_timed *self)
{
    if (self->next == self->layer_end) {
        self->layer_end = self->pair_count;
        self->depth++;
    }
    if (self->next % ASK_EVERY != 0)
        return true;
    self->bytes = fsm_timed_bytes(self);
    return self->keep_on == NULL || self->keep_on(self);
}

static bool expand(fsm_timed *self)
{
    const fsm_pair *pair = &self->pairs[self->next];
    size_t bytes = (machine_count(self) + 1u) * sizeof *self->current;
    if (pair->covered)
        return true;
    memcpy(self->current, fsm_store_at(&self->tuples, pair->tuple), bytes);
    fsm_zones_read(&self->zones, pair->zone, fsm_timed_size(self, self->current), self->before);
    self->step = 0;
    return fsm_timed_successors(self, self->current, self->before, false, visit, self);
}

void fsm_timed_run(fsm_timed *self)
{
    self->outcome = FSM_COMPLETE;
    self->next = FSM_NONE;
    bool whole = fsm_timed_initial(self, visit, self);
    self->layer_end = self->pair_count;
    for (self->next = 0; whole && self->next < self->pair_count; self->next++) {
        if (!may_go_on(self))
            return;
        whole = expand(self);
        if (whole && self->awaited != NULL && self->awaited_count == 0) {
            self->outcome = FSM_DECIDED;
            self->next++;
            return;
        }
    }
    if (!whole && self->outcome == FSM_COMPLETE)
        self->outcome = FSM_MODEL_FAILED;
}

uint32_t fsm_timed_find(fsm_timed *self, const fsm_timed_step *step)
{
    uint32_t found, tuple = fsm_store_find(&self->tuples, step->tuple);
    if (tuple == FSM_NONE || !fsm_zones_hold(&self->zones, step->zone, step->size))
        return FSM_NONE;
    return is_known(self, tuple, step->limits, &found) ? found : FSM_NONE;
}

uint32_t fsm_timed_path(const fsm_timed *self, uint32_t pair, uint32_t *path)
{
    uint32_t length = 0;
    for (uint32_t at = pair; at != FSM_NONE; at = self->pairs[at].origin.from)
        length++;
    if (path != NULL)
        for (uint32_t at = pair, i = length; at != FSM_NONE; at = self->pairs[at].origin.from)
            path[--i] = self->pairs[at].origin.step;
    return length;
}
