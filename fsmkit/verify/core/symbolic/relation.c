#include "symbolic/relation.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

enum { CHECK_EVERY = 1 << 14 };

/* --- making one ------------------------------------------------------------------------------------- */

static void begin(fsm_relation *self, bool closing)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    self->closing = closing;
    self->symbolic->relation = self;
    fsm_mdd_forget(mdd, &mdd->relations);
    fsm_mdd_forget(mdd, &mdd->others);
}

static bool no_memory(fsm_relation *self)
{
    self->symbolic->mdd.failed = true;
    return false;
}

static bool add_pair(fsm_relation *self, fsm_relation_part *part, uint32_t from, uint32_t to)
{
    if (part->count == part->room) {
        uint32_t room = part->room == 0 ? 4 : 2 * part->room;
        fsm_relation_pair *pairs = fsm_mdd_allocate(&self->symbolic->mdd, part->pairs, part->room * sizeof *pairs, room * sizeof *pairs);
        if (pairs == NULL)
            return false;
        part->pairs = pairs;
        part->room = room;
    }
    part->pairs[part->count++] = self->backwards ? (fsm_relation_pair){to, from} : (fsm_relation_pair){from, to};
    return true;
}

/* The effect on a clock; 0: time passes. */
static bool add_clock_pairs(fsm_relation *self, fsm_relation_part *part, uint32_t change)
{
    const fsm_level *at = &self->symbolic->levels[part->level];
    for (uint32_t value = 0; value < at->room; value++) {
        if (!at->confirmed[value])
            continue;
        uint32_t next = change == 0 ? fsm_clock_elapsed(value) : fsm_clock_after(change, value);
        if (next != FSM_NONE && !add_pair(self, part, value, next))
            return false;
    }
    return true;
}

/* The pairs of an event at each level; at that of its mover only if all steps count. */
static bool start_event(fsm_relation *self, const fsm_event *event, bool all)
{
    fsm_relation_event *made = &self->events[event->number];
    if (made->parts != NULL)
        return true;
    made->parts = calloc(event->touch_count, sizeof *made->parts);
    if (made->parts == NULL)
        return no_memory(self);
    made->class = event->class;
    made->action = event->action;
    made->is_still = event->is_still;
    made->part_count = event->touch_count;
    for (uint32_t i = 0; i < event->touch_count; i++) {
        const fsm_touch *touch = &event->touches[i];
        bool of_mover = touch->level == self->symbolic->level_of[event->mover];
        made->parts[i].level = touch->level;
        made->parts[i].touch = touch;
        made->parts[i].is_slot = touch->is_slot;
        if (touch->clock != 0 && !add_clock_pairs(self, &made->parts[i], touch->clock))
            return false;
        for (uint32_t value = 0; (all || !of_mover) && !touch->is_slot && value < touch->room; value++) {
            uint32_t row = touch->rows[value];
            if (row != 0 && touch->is_function && !add_pair(self, &made->parts[i], value, (row - 1) >> 1))
                return false;
            for (uint32_t n = 0; row != 0 && !touch->is_function && n < touch->items[row - 1]; n++)
                if (!add_pair(self, &made->parts[i], value, touch->items[row + n]))
                    return false;
        }
    }
    return true;
}

/* A pair of an event at its mover. */
static bool add_own_pair(fsm_relation *self, const fsm_event *event, uint32_t from, uint32_t to)
{
    uint32_t at = 0;
    if (!start_event(self, event, false))
        return false;
    while (event->touches[at].level != self->symbolic->level_of[event->mover])
        at++;
    return add_pair(self, &self->events[event->number].parts[at], from, to);
}

static bool add_step(fsm_relation *self, uint32_t machine, uint32_t local, fsm_class class, uint32_t number)
{
    fsm_event *event;
    uint32_t next;
    if (!fsm_symbolic_step(self->symbolic, machine, local, class, number, &event, &next))
        return no_memory(self);
    return event == NULL || add_own_pair(self, event, local, next);
}

static bool add_slot_steps(fsm_relation *self, fsm_counts_step *counts, void *context)
{
    const fsm_symbolic *symbolic = self->symbolic;
    for (uint32_t i = 0; i < symbolic->slot_step_count; i++) {
        const fsm_slot_step *step = &symbolic->slot_steps[i];
        if (counts(context, FSM_SLOT_STEP | i) && !add_own_pair(self, step->event, step->base, step->next))
            return false;
    }
    return true;
}

static bool add_machine(fsm_relation *self, uint32_t level, fsm_counts_step *counts, void *context)
{
    fsm_symbolic *symbolic = self->symbolic;
    const fsm_level *at = &symbolic->levels[level];
    bool skipped = !fsm_level_is_whole(at) || fsm_symbolic_is_split(symbolic, at->machine) /* no step of these is requested separately */
        || fsm_symbolic_has_slots(symbolic, at->machine);
    for (uint32_t value = 0; !skipped && value < at->room; value++) {
        if (!at->confirmed[value])
            continue;
        const fsm_local_info info = *fsm_info(symbolic->composition, at->machine, value);
        fsm_class class = fsm_symbolic_class(symbolic, at->machine, value);
        for (uint32_t s = info.own; s < info.own + info.own_count; s++)
            if (counts(context, s) && !add_step(self, at->machine, value, class, s))
                return false;
        for (uint32_t s = info.open; s < info.open + info.open_count; s++)
            if (counts(context, s) && !add_step(self, at->machine, value, FSM_CLASS_OPEN, s))
                return false;
    }
    return true;
}

/* The passing of time changes every level. */
static bool add_time(fsm_relation *self)
{
    const fsm_symbolic *symbolic = self->symbolic;
    fsm_relation_event *made = &self->events[0];
    made->parts = calloc(symbolic->level_count, sizeof *made->parts);
    if (made->parts == NULL)
        return no_memory(self);
    made->class = FSM_CLASS_TIME;
    made->action = fsm_owed_action(symbolic->composition, FSM_STEP_TIME, (fsm_description){.action = FSM_DO_ELAPSE});
    made->part_count = symbolic->level_count;
    for (uint32_t level = symbolic->level_count, i = 0; level >= 1; level--, i++) {
        const fsm_level *at = &symbolic->levels[level];
        made->parts[i].level = level;
        made->parts[i].is_slot = at->is_slot;
        if (at->is_clock && !add_clock_pairs(self, &made->parts[i], 0))
            return false;
        for (uint32_t value = 0; !at->is_slot && !at->is_clock && value < at->room; value++) {
            if (!at->confirmed[value])
                continue;
            const fsm_local_info *info = fsm_info(symbolic->composition, at->machine, value);
            uint32_t next = symbolic->slots.machines[at->machine].has_clock ? value : info->elapsed;
            if (!info->busy && info->view.waiting == 0 && !add_pair(self, &made->parts[i], value, next))
                return false;
        }
    }
    return true;
}

static int by_values(const void *a, const void *b)
{
    const fsm_relation_pair *x = a, *y = b;
    return x->from != y->from ? (x->from > y->from) - (x->from < y->from) : (x->to > y->to) - (x->to < y->to);
}

static bool sort_part(fsm_relation *self, fsm_relation_part *part)
{
    if (part->count > 0)
        qsort(part->pairs, part->count, sizeof *part->pairs, by_values);
    part->values = part->count == 0 ? 0 : part->pairs[part->count - 1].from + 1;
    part->first = calloc(part->values + 1u, sizeof *part->first);
    if (part->first == NULL)
        return no_memory(self);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < part->count; i++)
        if (i == 0 || by_values(&part->pairs[i], &part->pairs[kept - 1]) != 0)
            part->pairs[kept++] = part->pairs[i];
    part->count = kept;
    for (uint32_t i = kept, value = part->values + 1; value-- > 0;) {
        while (i > 0 && part->pairs[i - 1].from >= value)
            i--;
        part->first[value] = i;
    }
    return true;
}

/* Sorts all, and files events by their highest levels; one that lacks pairs somewhere does nothing, and one that leads nowhere else
 * nothing to a closure. */
static bool finish(fsm_relation *self)
{
    for (uint32_t n = 0; n <= self->event_count; n++) {
        fsm_relation_event *event = &self->events[n];
        bool empty = event->parts == NULL;
        for (uint32_t i = 0; event->parts != NULL && i < event->part_count; i++) {
            if (!sort_part(self, &event->parts[i]))
                return false;
            empty = empty || (event->parts[i].count == 0 && !event->parts[i].is_slot);
        }
        if (empty || event->is_still)
            continue;
        fsm_event_list *list = &self->of_level[event->parts[0].level];
        if (!FSM_HAS_ROOM(list->items, list->count, list->room, 8))
            return no_memory(self);
        list->items[list->count++] = n;
    }
    return true;
}

bool fsm_relation_make(fsm_relation *self, fsm_symbolic *symbolic, bool backwards, fsm_counts_step *counts, void *context)
{
    *self = (fsm_relation){.symbolic = symbolic, .event_count = symbolic->event_count, .backwards = backwards};
    self->events = calloc((size_t)self->event_count + 1, sizeof *self->events);
    self->of_level = calloc((size_t)symbolic->level_count + 1, sizeof *self->of_level);
    bool fine = fsm_lists_init(&self->keys) && self->events != NULL && self->of_level != NULL;
    fine = fine && (counts == NULL || add_slot_steps(self, counts, context));
    for (uint32_t level = 1; fine && counts != NULL && level <= symbolic->level_count; level++)
        fine = add_machine(self, level, counts, context);
    for (uint32_t n = 1; fine && counts == NULL && n <= symbolic->event_count; n++)
        fine = symbolic->events[n]->class == FSM_CLASS_TIME || start_event(self, symbolic->events[n], true);
    fine = fine && (counts != NULL || symbolic->system->unit == 0 || add_time(self)) && finish(self);
    begin(self, false); /* what is known of another relation is no more right */
    if (fine)
        return true;
    symbolic->mdd.failed = true;
    fsm_relation_free(self);
    return false;
}

void fsm_relation_free(fsm_relation *self)
{
    for (uint32_t n = 0; self->events != NULL && n <= self->event_count; n++) {
        for (uint32_t i = 0; self->events[n].parts != NULL && i < self->events[n].part_count; i++) {
            free(self->events[n].parts[i].pairs);
            free(self->events[n].parts[i].first);
        }
        free(self->events[n].parts);
    }
    for (uint32_t level = 0; self->of_level != NULL && level <= self->symbolic->level_count; level++)
        free(self->of_level[level].items);
    fsm_lists_free(&self->keys);
    free(self->events);
    free(self->of_level);
    *self = (fsm_relation){0};
}

/* --- steps -------------------------------------------------------------------------------------------- */

/* What is carried down: whether some timer is awaited, as time passes, and the phase of a change of slots; there, as time passes,
 * the set of events that are deferred, plus one. */
typedef struct {
    bool timed;
    uint32_t phase;
} carried;

static uint32_t apply(fsm_relation *self, uint32_t number, uint32_t at, uint32_t set, uint32_t bound, carried down);
static uint32_t close(fsm_relation *self, uint32_t set, uint32_t bound);

static bool is_on(fsm_relation *self)
{
    fsm_symbolic *symbolic = self->symbolic;
    if (symbolic->mdd.failed || symbolic->outcome != FSM_COMPLETE)
        return false;
    if (++symbolic->fires - symbolic->checked_at < CHECK_EVERY)
        return true;
    symbolic->checked_at = symbolic->fires;
    if (symbolic->max_created > 0 && symbolic->mdd.made > symbolic->max_created)
        symbolic->mdd.failed = true;
    if (symbolic->keep_on != NULL && !symbolic->keep_on(symbolic))
        symbolic->mdd.failed = true;
    return !symbolic->mdd.failed;
}

/* What is carried below a pair of a machine or a variable, and how many parts are omitted there. The state before counts,
 * which is the given value or that which it leads to. */
static carried carry(fsm_relation *self, const fsm_relation_event *event, const fsm_relation_part *part, fsm_relation_pair pair,
                     carried down, uint32_t *left_out)
{
    fsm_symbolic *symbolic = self->symbolic;
    const fsm_level *at = &symbolic->levels[part->level];
    uint32_t before = self->backwards ? pair.to : pair.from;
    *left_out = 0;
    if (at->is_clock)
        return down;
    if (event->class == FSM_CLASS_TIME) {
        down.timed = down.timed || fsm_info(symbolic->composition, at->machine, before)->view.awaited > 0;
        down.phase = fsm_symbolic_has_slots(symbolic, at->machine) ? fsm_slots_set(&symbolic->slots, at->machine, before) + 1 : 0;
    } else if (part->touch->change != 0) {
        down.phase = fsm_symbolic_first_phase(symbolic, part->touch, before);
        *left_out = down.phase == FSM_PHASE_DONE ? part->touch->left : 0;
    }
    return down;
}

static bool join_next(fsm_relation *self, fsm_mdd_buffer *buffer, uint32_t value, uint32_t below)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    if (below != 0 && !fsm_mdd_set(mdd, buffer, value, fsm_mdd_union(mdd, fsm_mdd_in(buffer, value), below)))
        return false;
    return !mdd->failed;
}

static bool add_pairs(fsm_relation *self, uint32_t number, uint32_t at, uint32_t value, uint32_t child, uint32_t bound,
                      carried down, fsm_mdd_buffer *buffer)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    const fsm_relation_event *event = &self->events[number];
    const fsm_relation_part *part = &event->parts[at];
    if (value >= part->values)
        return true;
    for (uint32_t i = part->first[value]; i < part->first[value + 1]; i++) {
        fsm_relation_pair pair = part->pairs[i];
        uint32_t within = fsm_mdd_child(mdd, bound, pair.to), left_out;
        carried now = carry(self, event, part, pair, down, &left_out);
        if (within != 0 && !join_next(self, buffer, pair.to, apply(self, number, at + 1 + left_out, child, within, now)))
            return false;
    }
    return !mdd->failed;
}

/* What a change makes of a value of a slot, which leads to `before` in the states before; after it the states are within `others`. */
static bool move_slot(fsm_relation *self, uint32_t number, uint32_t at, uint32_t value, uint32_t before, uint32_t others,
                      carried down, fsm_mdd_buffer *buffer)
{
    fsm_symbolic *symbolic = self->symbolic;
    const fsm_relation_part *part = &self->events[number].parts[at];
    const fsm_level *level = &symbolic->levels[part->level];
    fsm_change change = {.machine = level->machine};
    bool passes = part->touch == NULL; /* time does: where nothing waits all stays */
    if (passes && fsm_slot_waits(&symbolic->slots, level->machine, value, down.phase - 1))
        return true;
    if (!passes)
        change = fsm_slots_change(&symbolic->slots, part->touch->change);
    for (uint32_t which = 0;; which++) {
        fsm_slot_move move = {.value = value, .phase = level->slot == 0 ? 0 : down.phase};
        fsm_move_kind kind = which == 0 ? FSM_MOVE : FSM_NO_MOVE;
        if (!passes)
            kind = fsm_slot_move_at(&symbolic->slots, &change, level->slot, down.phase, value, which, &move);
        if (kind == FSM_NO_MOVE)
            return true;
        uint32_t after = kind == FSM_MOVE ? fsm_mdd_child(&symbolic->mdd, others, move.value) : 0;
        if (after == 0)
            continue;
        uint32_t left_out = !passes && move.phase == FSM_PHASE_DONE ? part->touch->left : 0;
        carried now = {down.timed, move.phase};
        uint32_t below = apply(self, number, at + 1 + left_out, self->backwards ? after : before,
                               self->backwards ? before : after, now);
        if (!join_next(self, buffer, self->backwards ? value : move.value, below))
            return false;
    }
}

/* Goes through the values of a slot in the states before. */
static bool move_slots(fsm_relation *self, uint32_t number, uint32_t at, uint32_t set, uint32_t bound, carried down,
                       fsm_mdd_buffer *buffer)
{
    const fsm_mdd *mdd = &self->symbolic->mdd;
    uint32_t before = self->backwards ? bound : set, others = self->backwards ? set : bound;
    for (uint32_t i = 0; i < fsm_mdd_at(mdd, before)->count; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, before)[i];
        if (!move_slot(self, number, at, pair.value, pair.child, others, down, buffer))
            return false;
    }
    return true;
}

/* Applies all events whose highest level this is until nothing changes, and makes the node. */
static uint32_t saturate(fsm_relation *self, uint32_t level, fsm_mdd_buffer *buffer, uint32_t bound)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    const fsm_event_list *events = &self->of_level[level];
    uint32_t value;
    while (!mdd->failed && fsm_mdd_next_changed(buffer, &value))
        for (uint32_t i = 0; i < events->count && !mdd->failed; i++) {
            uint32_t child = fsm_mdd_in(buffer, value);
            if (!fsm_mdd_root(mdd, child))
                break;
            if (fsm_mdd_is_full(mdd))
                fsm_mdd_collect(mdd);
            (void)add_pairs(self, events->items[i], 0, value, child, bound, (carried){false, 0}, buffer);
            fsm_mdd_unroot(mdd, 1);
        }
    return fsm_mdd_finish(mdd, buffer);
}

static bool apply_at(fsm_relation *self, uint32_t number, uint32_t at, uint32_t set, uint32_t bound, carried down,
                     fsm_mdd_buffer *buffer)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    const fsm_relation_event *event = &self->events[number];
    bool touched = at < event->part_count && event->parts[at].level == fsm_mdd_at(mdd, set)->level;
    if (touched && event->parts[at].is_slot)
        return move_slots(self, number, at, set, bound, down, buffer);
    for (uint32_t i = 0; i < fsm_mdd_at(mdd, set)->count; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, set)[i];
        if (touched) {
            if (!add_pairs(self, number, at, pair.value, pair.child, bound, down, buffer))
                return false;
            continue;
        }
        uint32_t within = fsm_mdd_child(mdd, bound, pair.value);
        uint32_t below = within == 0 ? 0 : apply(self, number, at, pair.child, within, down);
        if (mdd->failed || (below != 0 && !fsm_mdd_set(mdd, buffer, pair.value, below)))
            return false;
    }
    return true;
}

/* The key of an event and what is carried; no event has 0. */
static uint32_t key_of(fsm_relation *self, uint32_t number, carried down)
{
    const uint32_t both[] = {2 * number + down.timed, down.phase};
    if (down.phase == 0)
        return 2 * number + down.timed + 1;
    uint32_t key = fsm_lists_number(&self->keys, both, 2);
    if (key >= FSM_SLOT_STEP - 1)
        (void)no_memory(self);
    return FSM_SLOT_STEP | key;
}

/* What an event makes of a set within a bound, both of one level; `at`: the first of its parts that is not above. */
static uint32_t apply(fsm_relation *self, uint32_t number, uint32_t at, uint32_t set, uint32_t bound, carried down)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    const fsm_relation_event *event = &self->events[number];
    uint32_t before = self->backwards ? bound : set, level = fsm_mdd_at(mdd, set)->level;
    uint32_t flags = fsm_mdd_at(mdd, before)->flags, key = key_of(self, number, down);
    if ((flags & fsm_allows(event->class)) == 0 || set == 0 || bound == 0)
        return 0;
    if (level == 0)
        return event->class != FSM_CLASS_TIME || down.timed ? bound : 0;
    if (at == event->part_count && (flags & fsm_forbids(event->class)) == 0 && event->class != FSM_CLASS_TIME) {
        uint32_t both = fsm_mdd_intersection(mdd, bound, set);
        return self->closing ? close(self, both, bound) : both; /* other states may be within this bound */
    }
    const fsm_mdd_entry *known = fsm_mdd_entry_of(&mdd->relations, key, set, bound);
    if (fsm_mdd_knows(known, key, set, bound))
        return known->result;
    if (!is_on(self) || !fsm_mdd_root(mdd, set) || !fsm_mdd_root(mdd, bound))
        return 0;
    fsm_mdd_buffer *buffer = fsm_mdd_take(mdd, level);
    uint32_t made = 0;
    if (buffer != NULL) {
        (void)apply_at(self, number, at, set, bound, down, buffer);
        made = self->closing ? saturate(self, level, buffer, bound) : fsm_mdd_finish(mdd, buffer);
    }
    fsm_mdd_unroot(mdd, 2);
    if (!mdd->failed)
        fsm_mdd_keep(mdd, &mdd->relations, (fsm_mdd_entry){key, set, bound, made});
    return made;
}

/* --- external events
 * -------------------------------------------------------------------------------- */

uint32_t fsm_relation_step(fsm_relation *self, uint32_t set, uint32_t bound)
{
    return fsm_relation_step_by(self, 0, FSM_NONE, set, bound);
}

uint32_t fsm_relation_step_by(fsm_relation *self, uint32_t first, uint32_t last, uint32_t set, uint32_t bound)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    uint32_t found = 0;
    if (set == 0 || bound == 0 || !fsm_mdd_root(mdd, set) || !fsm_mdd_root(mdd, bound))
        return 0;
    if (self->closing || self->symbolic->relation != self)
        begin(self, false);
    for (uint32_t n = 0; n <= self->event_count && !mdd->failed; n++) {
        const fsm_relation_event *event = &self->events[n];
        bool empty = event->parts == NULL || event->action < first || event->action > last;
        for (uint32_t i = 0; !empty && i < event->part_count; i++)
            empty = event->parts[i].count == 0 && !event->parts[i].is_slot;
        if (empty)
            continue;
        found = fsm_mdd_union(mdd, found, apply(self, n, 0, set, bound, (carried){false, 0}));
        if (fsm_mdd_is_full(mdd) && fsm_mdd_root(mdd, found)) {
            fsm_mdd_collect(mdd);
            fsm_mdd_unroot(mdd, 1);
        }
    }
    fsm_mdd_unroot(mdd, 2);
    return mdd->failed ? 0 : found;
}

static const uint32_t CLOSED = UINT32_MAX; /* no event has this key */

/* The closure of a set within a bound, both of one level, by events that start at or below it. */
static uint32_t close(fsm_relation *self, uint32_t set, uint32_t bound)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    uint32_t level = fsm_mdd_at(mdd, set)->level;
    if (set == 0 || bound == 0)
        return 0;
    if (level == 0)
        return bound;
    const fsm_mdd_entry *known = fsm_mdd_entry_of(&mdd->relations, CLOSED, set, bound);
    if (fsm_mdd_knows(known, CLOSED, set, bound))
        return known->result;
    if (!is_on(self) || !fsm_mdd_root(mdd, set) || !fsm_mdd_root(mdd, bound))
        return 0;
    fsm_mdd_buffer *buffer = fsm_mdd_take(mdd, level);
    uint32_t made = 0;
    if (buffer != NULL) {
        for (uint32_t i = 0; i < fsm_mdd_at(mdd, set)->count && !mdd->failed; i++) {
            fsm_mdd_pair pair = fsm_mdd_pairs(mdd, set)[i];
            uint32_t below = close(self, pair.child, fsm_mdd_child(mdd, bound, pair.value));
            if (below != 0)
                (void)fsm_mdd_set(mdd, buffer, pair.value, below);
        }
        made = saturate(self, level, buffer, bound);
    }
    fsm_mdd_unroot(mdd, 2);
    if (!mdd->failed)
        fsm_mdd_keep(mdd, &mdd->relations, (fsm_mdd_entry){CLOSED, set, bound, made});
    return made;
}

uint32_t fsm_relation_close(fsm_relation *self, uint32_t set, uint32_t bound)
{
    begin(self, true);
    uint32_t closed = close(self, set, bound);
    return self->symbolic->mdd.failed ? 0 : closed;
}
