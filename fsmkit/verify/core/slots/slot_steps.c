#include "symbolic/symbolic.h"
#include "store/room.h"

#include <stdlib.h>
#include <string.h>

/* The steps of a machine whose queue is levels. Each is found out in windows (slots.h) of every length, and what it did to the list
 * there is read off. A change that is the same for all lengths at which it fits is one. */

typedef struct {
    uint32_t class, next, sent; /* base, and list of messages to others */
    uint32_t clock;             /* what is done to the clock */
    uint32_t label;             /* fsm_symbolic_label */
    bool internal;
    fsm_change change;
    uint32_t pushed; /* list of the pushed events */
} effect;

typedef struct {
    fsm_symbolic *symbolic;
    uint32_t machine, base, set;
    effect *effects;
    uint32_t count, room;
} finding;

static bool give_up(finding *self)
{
    fsm_symbolic_stop(self->symbolic, FSM_MODEL_FAILED);
    return false;
}

static bool no_memory(finding *self)
{
    fsm_symbolic_stop(self->symbolic, FSM_OUT_OF_MEMORY);
    return false;
}

/* --- what a step does to the list ----------------------------------------------------------------------- */

static uint32_t deferred_of(const uint32_t *values, uint32_t count)
{
    uint32_t deferred = 0;
    while (deferred < count && fsm_slot_is_deferred(values[deferred]))
        deferred++;
    return deferred;
}

/* Whether a list starts with the rest of another; then `*at` is behind that. */
static bool goes_on(const uint32_t *list, uint32_t count, const uint32_t *left, uint32_t left_count, uint32_t *at)
{
    for (uint32_t i = 0; i < left_count; i++)
        if (*at + i >= count || list[*at + i] != left[i])
            return false;
    *at += left_count;
    return true;
}

/* Derives a change; false if it is not one of those of slots.h. */
static bool read_change(finding *self, fsm_action action, uint32_t window, uint32_t next, effect *found)
{
    fsm_slots *slots = &self->symbolic->slots;
    fsm_slot_machine *m = &slots->machines[self->machine];
    uint32_t *before = m->lists[0], *after = m->lists[1], at = 0;
    uint32_t count = fsm_slots_read(slots, self->machine, window, before);
    uint32_t now = fsm_slots_read(slots, self->machine, next, after);
    fsm_change *change = &found->change;
    found->pushed = 0;
    if (count == FSM_NONE || now == FSM_NONE)
        return false;
    uint32_t deferred = deferred_of(before, count), first = action == FSM_DO_TAKE;
    if (!fsm_info(self->symbolic->composition, self->machine, next)->view.running) {
        change->kind = FSM_CHANGE_CLEAR;
        return now == 0;
    }
    change->kind = action == FSM_DO_TAKE ? FSM_CHANGE_TAKE : FSM_CHANGE_NONE;
    if (deferred > first && !goes_on(after, now, before + first, deferred - first, &at))
        return false;
    if (at < now && fsm_slot_is_deferred(after[at])) {
        bool queued = first == 0 || !fsm_slot_is_deferred(before[0]);
        change->kind = action == FSM_DO_TAKE ? FSM_CHANGE_DEFER : FSM_CHANGE_INSERT;
        change->put = after[at++];
        if (!queued || (action != FSM_DO_TAKE && action != FSM_DO_OCCUR))
            return false;
    }
    first = first > deferred ? first : deferred;
    if (!goes_on(after, now, before + first, count - first, &at) || deferred_of(after + at, now - at) > 0)
        return false;
    found->pushed = fsm_lists_number(&self->symbolic->sent, after + at, now - at);
    change->pushed_count = now - at;
    bool inserts = change->kind == FSM_CHANGE_INSERT;
    return found->pushed != FSM_NONE && (!inserts || (change->pushed_count == 0 && change->condition != FSM_IF_RECALLED));
}

/* --- all of a window ---------------------------------------------------------------------------------------- */

static bool add_effect(finding *self, effect found)
{
    if (!FSM_HAS_ROOM(self->effects, self->count, self->room, 64))
        return no_memory(self);
    self->effects[self->count++] = found;
    return true;
}

/* A timer that fires has expired; one that is in the base as it was has not been touched. */
static uint32_t clock_change(const finding *self, fsm_action action, uint32_t window, uint32_t next)
{
    const fsm_slots *slots = &self->symbolic->slots;
    bool fires = action == FSM_DO_FIRE && slots->machines[self->machine].has_clock;
    uint32_t clock = fsm_slots_clock(slots, self->machine, next);
    bool had_none = fsm_slots_clock(slots, self->machine, window) == FSM_CLOCK_NONE;
    return fsm_clock_change(had_none && clock == FSM_CLOCK_NONE ? FSM_CLOCK_FAR : clock, fires);
}

static bool add_step(finding *self, uint32_t window, uint32_t length, fsm_class class, const fsm_local_step *step,
                     fsm_change_condition condition, uint32_t taken)
{
    fsm_symbolic *s = self->symbolic;
    uint32_t sent = 0, next;
    effect found = {.class = (uint32_t)class, .internal = step->kind == FSM_STEP_INTERNAL};
    if (!fsm_symbolic_make_room(s, (size_t)step->message_count + 1)
        || !fsm_symbolic_sort_messages(s, self->machine, step, &sent, &next))
        return give_up(self);
    bool is_still = next == window && sent == 0 && !found.internal;
    if (is_still && !s->keeps_actions)
        return true;
    found.label = fsm_symbolic_label(s, self->machine, window, step, is_still);
    found.change = (fsm_change){.machine = self->machine, .condition = condition, .taken = taken, .length = length,
                                .before = self->set};
    found.sent = fsm_lists_number(&s->sent, s->buffer, sent);
    found.next = fsm_slots_base(&s->slots, self->machine, next);
    if (found.sent == FSM_NONE || found.next == FSM_NONE)
        return no_memory(self);
    if (!read_change(self, step->action, window, next, &found)) {
        (void)fsm_fail(s->composition, "a step does something else to its queue");
        return give_up(self);
    }
    found.clock = clock_change(self, step->action, window, next);
    if (found.clock >= 2 && !fsm_slots_set_clock(&s->slots, self->machine, self->base, fsm_clock_after(found.clock, FSM_CLOCK_DUE)))
        return no_memory(self);
    found.change.after = fsm_slots_set(&s->slots, self->machine, found.next);
    return found.change.after == FSM_NONE ? no_memory(self) : add_effect(self, found);
}

/* Which steps of a window are requested: an event that is taken; eventless transitions; timers, where there is a clock; other steps
 * of the machine; external events. */
typedef enum { TAKEN, EVENTLESS, FIRED, BY_ITSELF, FROM_OUTSIDE } part;

static part part_of(const finding *self, const fsm_local_step *step)
{
    bool has_clock = self->symbolic->slots.machines[self->machine].has_clock;
    if (step->action == FSM_DO_FIRE && has_clock)
        return FIRED;
    return step->action == FSM_DO_TAKE ? TAKEN : step->action == FSM_DO_EVENTLESS ? EVENTLESS : BY_ITSELF;
}

static bool add_window(finding *self, uint32_t window, uint32_t length, part requested, fsm_change_condition condition,
                       uint32_t taken)
{
    fsm_symbolic *s = self->symbolic;
    bool open = requested == FROM_OUTSIDE;
    if (window == FSM_NONE || !fsm_knowledge_find(s->knowledge, self->machine, window, open))
        return give_up(self);
    const fsm_local_info info = *fsm_info(s->composition, self->machine, window);
    uint32_t first = open ? info.open : info.own, count = open ? info.open_count : info.own_count;
    for (uint32_t n = first; n < first + count; n++) {
        const fsm_local_step step = s->composition->steps[n];
        if ((open || part_of(self, &step) == requested)
            && !add_step(self, window, length, open ? FSM_CLASS_OPEN : FSM_CLASS_OWN, &step, condition, taken))
            return false;
    }
    return true;
}

/* --- events of them ---------------------------------------------------------------------------------------------- */

static int compare(uint32_t a, uint32_t b)
{
    return (a > b) - (a < b);
}

/* Lengths come last, so that equal steps of several lengths are adjacent. */
static int by_effect(const void *a, const void *b)
{
    const effect *x = a, *y = b;
    const uint32_t differ[][2] = {
        {x->class, y->class}, {x->next, y->next}, {x->sent, y->sent}, {x->internal, y->internal}, {x->clock, y->clock},
        {x->label, y->label},
        {(uint32_t)x->change.kind, (uint32_t)y->change.kind}, {(uint32_t)x->change.condition, (uint32_t)y->change.condition},
        {x->change.taken, y->change.taken}, {x->change.put, y->change.put}, {x->pushed, y->pushed}};
    for (size_t i = 0; i < sizeof differ / sizeof *differ; i++)
        if (differ[i][0] != differ[i][1])
            return compare(differ[i][0], differ[i][1]);
    return 0;
}

static int by_length(const void *a, const void *b)
{
    int order = by_effect(a, b);
    return order != 0 ? order : compare(((const effect *)a)->change.length, ((const effect *)b)->change.length);
}

/* Whether there is an effect for each length that the list can have before it. */
static bool is_for_all(const finding *self, const effect *effects, uint32_t count)
{
    const fsm_change *change = &effects[0].change;
    const fsm_slots *slots = &self->symbolic->slots;
    uint32_t room = slots->machines[self->machine].room, least = 0, most = room, lengths = 1;
    if (change->condition == FSM_IF_FIRST || change->condition == FSM_IF_RECALLED)
        least = 1;
    if (change->condition == FSM_IF_IDLE && !fsm_slots_has_event(slots, self->machine, self->set, true))
        most = 0;
    else if (change->kind == FSM_CHANGE_INSERT)
        most = room - 1;
    else if (change->pushed_count > 0)
        most = room - change->pushed_count + (change->kind == FSM_CHANGE_TAKE);
    most = most < room ? most : room;
    for (uint32_t i = 1; i < count; i++)
        lengths += effects[i].change.length != effects[i - 1].change.length;
    return effects[0].change.length <= least && lengths >= most - least + 1;
}

static bool add_event(finding *self, effect *found)
{
    fsm_symbolic *s = self->symbolic;
    fsm_change *change = &found->change;
    uint32_t count, number = 0;
    bool is_counted = s->counts_all, looks = change->condition != FSM_IF_ANY || change->kind != FSM_CHANGE_NONE;
    if (!is_counted)
        change->after = change->before;
    if (!looks && !is_counted)
        change->before = change->after = 0;
    change->pushed = fsm_lists_at(&s->sent, found->pushed, &change->pushed_count);
    if (!fsm_change_is_none(change) && (number = fsm_slots_number(&s->slots, change)) == 0)
        return no_memory(self);
    const uint32_t *messages = fsm_lists_at(&s->sent, found->sent, &count);
    if (!fsm_symbolic_make_room(s, FSM_KEY_HEAD + (size_t)count))
        return false;
    fsm_symbolic_start_key(s, self->machine, (fsm_class)found->class, number, found->clock, found->label);
    if (count > 0)
        memcpy(s->buffer + FSM_KEY_HEAD, messages, count * sizeof *messages);
    fsm_event *event = fsm_symbolic_event(s, s->buffer, FSM_KEY_HEAD + count);
    return event != NULL && fsm_symbolic_add_to_row(s, event, self->base, found->next)
        && fsm_symbolic_add_slot_step(s, (fsm_slot_step){self->machine, self->base, found->next, event, found->internal});
}

static bool add_events(finding *self)
{
    if (self->count > 0)
        qsort(self->effects, self->count, sizeof *self->effects, by_length);
    for (uint32_t first = 0, end; first < self->count; first = end) {
        for (end = first + 1; end < self->count && by_effect(&self->effects[first], &self->effects[end]) == 0; end++)
            ;
        bool all = is_for_all(self, self->effects + first, end - first);
        for (uint32_t i = first; i < (all ? first + 1 : end); i++) {
            if (i > first && self->effects[i].change.length == self->effects[i - 1].change.length)
                continue;
            if (all)
                self->effects[i].change.length = FSM_NONE;
            if (!add_event(self, &self->effects[i]))
                return false;
        }
    }
    self->count = 0;
    return true;
}

/* --- all ------------------------------------------------------------------------------------------------------------ */

/* Whether a step of those from `first` on has queued something, or may have: then it matters how much room there is. */
static bool needs_room(const finding *self, uint32_t first)
{
    bool found = false;
    for (uint32_t i = first; i < self->count; i++)
        found = found || self->effects[i].change.pushed_count > 0 || self->effects[i].change.kind == FSM_CHANGE_CLEAR;
    return found;
}

/* Files the steps of windows from one length to another. In the shortest one there is room: where no step queues anything, none would in the others,
 * so that these have the same steps. */
static bool add_windows(finding *self, uint32_t what, uint32_t least, uint32_t most, part requested, fsm_change_condition condition)
{
    fsm_slots *slots = &self->symbolic->slots;
    uint32_t first = self->count, taken = condition == FSM_IF_FIRST ? what : 0;
    bool fine = true;
    for (uint32_t length = least; fine && length <= most; length++) {
        uint32_t clock = requested == FIRED ? FSM_CLOCK_DUE : FSM_CLOCK_FAR;
        uint32_t window = fsm_slots_window(slots, self->machine, self->base, what, length, clock);
        fine = add_window(self, window, length, requested, condition, taken);
        if (length > least || !fine || needs_room(self, first))
            continue;
        uint32_t found = self->count;
        for (length++; fine && length <= most; length++)
            for (uint32_t i = first; fine && i < found; i++) {
                effect same = self->effects[i];
                same.change.length = length;
                fine = add_effect(self, same);
            }
        if (fine && !fsm_slots_set_agree(slots, self->machine, self->base, what))
            return no_memory(self);
    }
    return fine;
}

/* The steps by which a value is taken, where that waits. */
static bool add_takes(finding *self, uint32_t value)
{
    const fsm_slots *slots = &self->symbolic->slots;
    return !fsm_slot_waits(slots, self->machine, value, self->set)
        || (add_windows(self, value, 1, slots->machines[self->machine].room, TAKEN, FSM_IF_FIRST) && add_events(self));
}

static bool add_others(finding *self)
{
    const fsm_slots *slots = &self->symbolic->slots;
    uint32_t machine = self->machine, room = slots->machines[machine].room;
    bool defers = slots->composition->system->machines[machine]->info->deferred.count != FSM_ABSENT;
    uint32_t idle = fsm_slots_has_event(slots, machine, self->set, true) ? room : 0;
    fsm_change_condition kept = defers ? FSM_IF_KEPT : FSM_IF_ANY;
    return add_windows(self, FSM_WINDOW_IDLE, 0, idle, BY_ITSELF, FSM_IF_IDLE)
        && (fsm_slots_clock(slots, machine, self->base) == FSM_CLOCK_NONE
            || add_windows(self, FSM_WINDOW_DUE, 0, idle, FIRED, FSM_IF_IDLE))
        && add_windows(self, FSM_WINDOW_EVENTLESS, 0, room, EVENTLESS, FSM_IF_ANY)
        && add_windows(self, FSM_WINDOW_QUEUED, 0, room - 1, FROM_OUTSIDE, kept)
        && add_window(self, fsm_slots_window(&self->symbolic->slots, machine, self->base, FSM_WINDOW_QUEUED, room, FSM_CLOCK_FAR),
                      room, FROM_OUTSIDE, kept, 0)
        && (!fsm_slots_has_event(slots, machine, self->set, false)
            || add_windows(self, FSM_WINDOW_RECALLED, 1, room, FROM_OUTSIDE, FSM_IF_RECALLED))
        && add_events(self);
}

static bool begin(finding *self, fsm_symbolic *symbolic, uint32_t machine, uint32_t base)
{
    *self = (finding){.symbolic = symbolic, .machine = machine, .base = base};
    self->set = fsm_slots_set(&symbolic->slots, machine, base);
    return self->set == FSM_NONE ? no_memory(self) : true;
}

bool fsm_symbolic_add_base(fsm_symbolic *symbolic, uint32_t machine, uint32_t base)
{
    finding self;
    const fsm_slot_machine *m = &symbolic->slots.machines[machine];
    if (!fsm_knowledge_find(symbolic->knowledge, machine, base, false)) {
        fsm_symbolic_stop(symbolic, FSM_MODEL_FAILED);
        return false;
    }
    if (!fsm_info(symbolic->composition, machine, base)->view.running)
        return true; /* it has no steps, and queues nothing */
    bool fine = begin(&self, symbolic, machine, base) && add_others(&self);
    for (uint32_t i = 0; fine && i < m->value_count; i++)
        fine = add_takes(&self, m->values[i]);
    fine = fine && (fsm_slots_add_place(&symbolic->slots, machine, base) || no_memory(&self));
    free(self.effects);
    return fine;
}

bool fsm_symbolic_add_slot_value(fsm_symbolic *symbolic, uint32_t machine, uint32_t value)
{
    const fsm_slot_machine *m = &symbolic->slots.machines[machine];
    bool added, fine = true;
    if (!fsm_slots_add_value(&symbolic->slots, machine, value, &added)) {
        fsm_symbolic_stop(symbolic, FSM_OUT_OF_MEMORY);
        return false;
    }
    for (uint32_t i = 0; fine && added && i < m->place_count; i++) {
        finding self;
        fine = begin(&self, symbolic, machine, m->places[i]) && add_takes(&self, value);
        free(self.effects);
    }
    return fine;
}
