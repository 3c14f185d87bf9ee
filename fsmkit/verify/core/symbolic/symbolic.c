#include "symbolic/symbolic.h"

#include <stdlib.h>
#include <string.h>

static bool no_memory(fsm_symbolic *self)
{
    fsm_symbolic_stop(self, FSM_OUT_OF_MEMORY);
    return false;
}

void fsm_symbolic_stop(fsm_symbolic *self, fsm_outcome outcome)
{
    if (self->outcome == FSM_COMPLETE)
        self->outcome = outcome;
}

/* Makes room for one more of something; false if memory ran out. */
static bool grow(fsm_symbolic *self, void *place, uint32_t count, uint32_t *room, size_t size)
{
    void **items = place;
    if (count < *room)
        return true;
    uint32_t more = *room == 0 ? 4 : *room + *room / 2;
    void *grown = more >= FSM_NONE / 2 ? NULL : fsm_mdd_allocate(&self->mdd, *items, *room * size, more * size);
    if (grown == NULL)
        return no_memory(self);
    *items = grown;
    self->event_bytes += (more - *room) * size;
    *room = more;
    return true;
}

/* Makes room for the element of a number; what is new is 0. */
static bool grow_to(fsm_symbolic *self, void *place, uint32_t number, uint32_t *room, size_t size)
{
    void **items = place;
    uint32_t more = *room == 0 ? 8 : *room;
    if (number < *room)
        return true;
    while (more <= number)
        more *= 2;
    void *grown = fsm_mdd_allocate(&self->mdd, *items, *room * size, more * size);
    if (grown == NULL)
        return no_memory(self);
    memset((char *)grown + *room * size, 0, (more - *room) * size);
    *items = grown;
    self->event_bytes += (more - *room) * size;
    *room = more;
    return true;
}

size_t fsm_symbolic_bytes(const fsm_symbolic *self)
{
    return fsm_mdd_bytes(&self->mdd) + self->event_bytes + fsm_lists_bytes(&self->keys) + fsm_lists_bytes(&self->pairs)
        + fsm_lists_bytes(&self->sent) + fsm_lists_bytes(&self->carried) + fsm_hash_map_bytes(&self->split.wholes);
}

/* --- what waits ------------------------------------------------------------------------------------- */

bool fsm_symbolic_allows(const fsm_symbolic *self, fsm_class class, fsm_waiting waiting)
{
    switch (class) {
    case FSM_CLASS_WATCH:
        return waiting.watched > 0;
    case FSM_CLASS_ANSWER:
        return waiting.watched == 0 && waiting.answered > 0;
    case FSM_CLASS_OPEN:
        return waiting.watched == 0 && waiting.answered == 0
            && waiting.all <= (int64_t)self->system->max_pending_before_input;
    case FSM_CLASS_OWN:
    case FSM_CLASS_TIME:
    case FSM_CLASSES:
        break;
    }
    return waiting.watched == 0 && waiting.answered == 0;
}

uint32_t fsm_symbolic_terminal(fsm_symbolic *self, fsm_waiting waiting)
{
    const int32_t most = 1 << 20;
    if (waiting.watched < 0 || waiting.answered < 0 || waiting.all < 0 || waiting.watched > most
        || waiting.answered > most || waiting.all > most) {
        (void)fsm_fail(self->composition, "too many events wait");
        fsm_symbolic_stop(self, FSM_MODEL_FAILED);
        return 0;
    }
    uint64_t key = ((uint64_t)waiting.watched << 42) | ((uint64_t)waiting.answered << 21) | (uint64_t)waiting.all;
    const uint64_t *known = fsm_hash_map_find(&self->terminal_of, key);
    if (known != NULL)
        return (uint32_t)*known;
    uint32_t flags = 0;
    for (fsm_class class = FSM_CLASS_WATCH; class < FSM_CLASSES; class++)
        flags |= fsm_symbolic_allows(self, class, waiting) ? fsm_allows(class) : fsm_forbids(class);
    uint32_t node = 0;
    if (grow(self, &self->terminals, self->terminal_count, &self->terminal_room, sizeof *self->terminals))
        node = fsm_mdd_terminal(&self->mdd, self->terminal_count, flags);
    if (node == 0 || !fsm_hash_map_add(&self->terminal_of, key, node)) {
        (void)no_memory(self);
        return 0;
    }
    self->terminals[self->terminal_count++] = waiting;
    return node;
}

static uint32_t add_change(uint32_t change, int which, int64_t more)
{
    int64_t sum = fsm_changed(change, which) + more;
    if (sum < -512 || sum > 511)
        return FSM_NONE;
    uint32_t at = (uint32_t)which * FSM_CHANGE_BITS;
    return (change & ~(1023u << at)) | (uint32_t)(sum + 512) << at;
}

uint32_t fsm_symbolic_change(const fsm_symbolic *self, uint32_t machine, uint32_t from, uint32_t to, uint32_t change)
{
    if (from == to)
        return change;
    if (machine == FSM_NONE)
        return change; /* a variable */
    int64_t more = (int64_t)fsm_info(self->composition, machine, to)->view.waiting
        - fsm_info(self->composition, machine, from)->view.waiting;
    return fsm_symbolic_more(self, machine, (int32_t)more, change);
}

uint32_t fsm_symbolic_more(const fsm_symbolic *self, uint32_t machine, int32_t more, uint32_t change)
{
    const fsm_machine *m = self->system->machines[machine];
    if (more == 0 || change == FSM_NONE)
        return change;
    if (self->counts_watched && m->monitor)
        change = add_change(change, 0, more);
    else if (self->counts_answered && m->environment)
        change = add_change(change, 1, more);
    return self->counts_all && change != FSM_NONE ? add_change(change, 2, more) : change;
}

static const uint32_t HAS_PHASE = UINT32_C(1) << 31;

uint32_t fsm_symbolic_carry(fsm_symbolic *self, uint32_t what, uint32_t phase)
{
    const uint32_t both[] = {what, phase};
    if (phase == 0)
        return what;
    uint32_t number = fsm_lists_number(&self->carried, both, 2);
    if (number >= HAS_PHASE - 1) {
        (void)no_memory(self);
        return FSM_NONE;
    }
    return HAS_PHASE | number;
}

void fsm_symbolic_carried(const fsm_symbolic *self, uint32_t carried, uint32_t *what, uint32_t *phase)
{
    uint32_t count;
    *what = carried;
    *phase = 0;
    if ((carried & HAS_PHASE) == 0)
        return;
    const uint32_t *both = fsm_lists_at(&self->carried, carried & ~HAS_PHASE, &count);
    *what = both[0];
    *phase = both[1];
}

fsm_class fsm_symbolic_class(const fsm_symbolic *self, uint32_t machine, uint32_t local)
{
    const fsm_machine *m = self->system->machines[machine];
    if (fsm_info(self->composition, machine, local)->view.waiting == 0)
        return FSM_CLASS_OWN;
    return m->monitor ? FSM_CLASS_WATCH : m->environment ? FSM_CLASS_ANSWER : FSM_CLASS_OWN;
}

/* --- events -------------------------------------------------------------------------------------------- */

static int from_the_top(const void *a, const void *b)
{
    uint32_t x = ((const fsm_touch *)a)->level, y = ((const fsm_touch *)b)->level;
    return (x < y) - (x > y);
}

/* Messages of a key, those of each machine together: the first of the next one. */
static uint32_t same_target(const fsm_symbolic *self, const uint32_t *messages, uint32_t first, uint32_t count)
{
    const fsm_store *all = &self->composition->messages;
    uint32_t target = ((const fsm_message *)fsm_store_at(all, messages[first]))->target, end = first;
    while (end < count && ((const fsm_message *)fsm_store_at(all, messages[end]))->target == target)
        end++;
    return end;
}

static bool add_to_list(fsm_symbolic *self, fsm_event_list *list, uint32_t event);

/* The rows of an event at a variable: they are known at once. */
static bool make_pairs(fsm_symbolic *self, fsm_touch *touch, uint32_t variable, uint32_t list)
{
    uint32_t count, values = self->split.variables[variable].count, items = 0;
    const uint32_t *pairs = fsm_lists_at(&self->pairs, list, &count);
    touch->level = self->level_of_variable[variable];
    touch->rows = fsm_mdd_allocate(&self->mdd, NULL, 0, values * sizeof *touch->rows);
    touch->values = fsm_mdd_allocate(&self->mdd, NULL, 0, values * sizeof *touch->values);
    touch->items = fsm_mdd_allocate(&self->mdd, NULL, 0, (values + count) * sizeof *touch->items);
    if (touch->rows == NULL || touch->values == NULL || touch->items == NULL)
        return no_memory(self);
    touch->room = values;
    touch->value_room = values;
    touch->item_room = values + count;
    memset(touch->rows, 0, values * sizeof *touch->rows);
    for (uint32_t i = 0; i < count; i++) { /* they are sorted */
        uint32_t value = pairs[i] / values;
        if (touch->rows[value] == 0) {
            touch->values[touch->value_count++] = value;
            touch->items[items++] = 0;
            touch->rows[value] = items;
        }
        touch->items[touch->rows[value] - 1]++;
        touch->items[items++] = pairs[i] % values;
    }
    touch->item_count = items;
    return true;
}

/* An event whose highest level is a variable is tried for each value that it has a row for. */
static bool file_by_values(fsm_symbolic *self, const fsm_event *event)
{
    const fsm_touch *top = &event->touches[0];
    fsm_level *level = &self->levels[top->level];
    for (uint32_t i = 0; level->is_variable && i < top->value_count; i++)
        if (!add_to_list(self, &level->of_value[top->values[i]], event->number))
            return false;
    return true;
}

/* Returns the number of the change that messages cause in a machine's slots; FSM_NONE if memory ran out. */
static uint32_t change_by(fsm_symbolic *self, uint32_t machine, const uint32_t *messages, uint32_t count)
{
    uint32_t pushed[count + 1u];
    fsm_change change = {.machine = machine, .length = FSM_NONE, .pushed = pushed, .loses = true};
    if (!fsm_symbolic_has_slots(self, machine))
        return 0;
    for (uint32_t i = 0; i < count; i++) {
        if (((const fsm_message *)fsm_store_at(&self->composition->messages, messages[i]))->is_input)
            continue;
        pushed[change.pushed_count] = fsm_slots_value_of(&self->slots, machine, messages[i]);
        if (pushed[change.pushed_count++] == FSM_NONE)
            return FSM_NONE;
    }
    uint32_t number = change.pushed_count == 0 ? 0 : fsm_slots_number(&self->slots, &change);
    return number == 0 && change.pushed_count > 0 ? FSM_NONE : number;
}

/* Touches of a change at the slots of a machine, from `at` on; where they end. */
static uint32_t add_slot_touches(const fsm_symbolic *self, fsm_event *event, uint32_t machine, uint32_t change, uint32_t at)
{
    uint32_t room = change == 0 ? 0 : self->slots.machines[machine].room;
    for (uint32_t slot = 0; slot < room; slot++)
        event->touches[at++] = (fsm_touch){.level = self->level_of[machine] - fsm_slots_levels(&self->slots, machine) + slot, .is_function = true, .is_slot = true,
                                           .change = change, .left = slot};
    return at;
}

static uint32_t target_of(const fsm_symbolic *self, uint32_t message)
{
    return ((const fsm_message *)fsm_store_at(&self->composition->messages, message))->target;
}

/* The maximum of levels that an event touches. */
static uint32_t count_touches(const fsm_symbolic *self, const fsm_event *event, uint32_t variable_count,
                              const uint32_t *messages, uint32_t count)
{
    uint32_t touches = 2 + variable_count + self->slots.machines[event->mover].room;
    for (uint32_t i = 0; i < count; i = same_target(self, messages, i, count))
        touches += 1 + self->slots.machines[target_of(self, messages[i])].room;
    return touches;
}

static bool make_touches(fsm_symbolic *self, fsm_event *event, const uint32_t *variables, uint32_t variable_count, uint32_t change,
                         uint32_t clock, const uint32_t *messages, uint32_t count)
{
    event->touch_count = count_touches(self, event, variable_count, messages, count);
    event->touches = fsm_mdd_allocate(&self->mdd, NULL, 0, event->touch_count * sizeof *event->touches);
    if (event->touches == NULL)
        return no_memory(self);
    self->event_bytes += sizeof *event + event->touch_count * sizeof *event->touches;
    memset(event->touches, 0, event->touch_count * sizeof *event->touches);
    event->touches[0].level = self->level_of[event->mover];
    event->touches[0].change = change;
    event->touches[0].left = change == 0 ? 0 : self->slots.machines[event->mover].room;
    for (uint32_t i = 0; i < variable_count; i++)
        if (!make_pairs(self, &event->touches[1 + i], variables[2 * i], variables[2 * i + 1]))
            return false;
    uint32_t at = add_slot_touches(self, event, event->mover, change, 1 + variable_count);
    if (clock != 0)
        event->touches[at++] = (fsm_touch){.level = self->level_of[event->mover] - 1, .is_function = true, .clock = clock};
    for (uint32_t i = 0, end; i < count; i = end) {
        end = same_target(self, messages, i, count);
        uint32_t target = target_of(self, messages[i]), done = change_by(self, target, messages + i, end - i);
        if (done == FSM_NONE)
            return no_memory(self);
        event->touches[at++] = (fsm_touch){.level = self->level_of[target], .is_function = true, .change = done,
                                           .left = done == 0 ? 0 : self->slots.machines[target].room, .messages = messages + i,
                                           .message_count = end - i};
        at = add_slot_touches(self, event, target, done, at);
    }
    event->touch_count = at;
    qsort(event->touches, event->touch_count, sizeof *event->touches, from_the_top);
    return true;
}

static bool add_to_list(fsm_symbolic *self, fsm_event_list *list, uint32_t event)
{
    if (!grow(self, &list->items, list->count, &list->room, sizeof *list->items))
        return false;
    list->items[list->count++] = event;
    return true;
}

/* The event of a key (mover, class, messages by target), which is made if it is new; NULL if memory ran out. */
fsm_event *fsm_symbolic_event(fsm_symbolic *self, const uint32_t *key, uint32_t count)
{
    uint32_t number = fsm_lists_number(&self->keys, key, count), length;
    if (number == FSM_NONE || !grow_to(self, &self->event_of_key, number, &self->key_room, sizeof *self->event_of_key)) {
        (void)no_memory(self);
        return NULL;
    }
    if (self->event_of_key[number] != 0)
        return self->events[self->event_of_key[number]];
    if (!grow(self, &self->events, self->event_count + 1, &self->event_room, sizeof *self->events))
        return NULL;
    fsm_event *event = fsm_mdd_allocate(&self->mdd, NULL, 0, sizeof *event);
    if (event == NULL) {
        (void)no_memory(self);
        return NULL;
    }
    const uint32_t *kept = fsm_lists_at(&self->keys, number, &length);
    *event = (fsm_event){.number = self->event_count + 1, .mover = kept[0], .class = (fsm_class)kept[1],
                         .action = kept[5] / 2 - 1, .is_still = kept[5] % 2 == 1};
    self->events[++self->event_count] = event;
    const uint32_t *messages = kept + FSM_KEY_HEAD + 2 * kept[2];
    if (!make_touches(self, event, kept + FSM_KEY_HEAD, kept[2], kept[3], kept[4], messages, length - (uint32_t)(messages - kept)))
        return NULL;
    self->event_of_key[number] = event->number;
    fsm_level *top = &self->levels[event->touches[0].level];
    if (event->is_still)
        return event; /* no state is found by it */
    if (event->touches[0].is_function ? !add_to_list(self, &top->any, event->number) : !file_by_values(self, event))
        return NULL;
    return event;
}

uint32_t fsm_symbolic_label(const fsm_symbolic *self, uint32_t machine, uint32_t local, const fsm_local_step *step, bool is_still)
{
    const fsm_description what = {.action = step->action, .machine = machine, .argument = step->argument, .before = local};
    if (!self->keeps_actions)
        return 0;
    return 2 * (fsm_owed_action(self->composition, step->kind, what) + 1) + is_still; /* FSM_NONE becomes 0 */
}

static fsm_touch *own_touch(const fsm_symbolic *self, const fsm_event *event)
{
    fsm_touch *touch = event->touches;
    while (touch->level != self->level_of[event->mover])
        touch++;
    return touch;
}

/* Adds to the row of a value, which is the last one that was started. */
bool fsm_symbolic_add_to_row(fsm_symbolic *self, fsm_event *event, uint32_t value, uint32_t next)
{
    fsm_touch *touch = own_touch(self, event);
    if (!grow_to(self, &touch->rows, value, &touch->room, sizeof *touch->rows))
        return false;
    uint32_t row = touch->rows[value];
    if (row == 0) {
        if (!grow(self, &touch->items, touch->item_count, &touch->item_room, sizeof *touch->items)
            || !grow(self, &touch->values, touch->value_count, &touch->value_room, sizeof *touch->values))
            return false;
        touch->values[touch->value_count++] = value;
        touch->items[touch->item_count] = 0;
        row = touch->rows[value] = ++touch->item_count;
        fsm_level *level = &self->levels[touch->level];
        if (touch == event->touches && !event->is_still && !add_to_list(self, &level->of_value[value], event->number))
            return false;
    }
    for (uint32_t i = 0; i < touch->items[row - 1]; i++)
        if (touch->items[row + i] == next)
            return true;
    if (!grow(self, &touch->items, touch->item_count, &touch->item_room, sizeof *touch->items))
        return false;
    touch->items[touch->item_count++] = next;
    touch->items[row - 1]++;
    return true;
}

uint32_t fsm_touch_apply(fsm_symbolic *self, fsm_touch *touch, uint32_t value, bool *full)
{
    if (fsm_touch_row(touch, value) == 0) {
        uint32_t next = value;
        bool lost = false;
        if (!grow_to(self, &touch->rows, value, &touch->room, sizeof *touch->rows))
            return FSM_NONE;
        bool has_slots = fsm_symbolic_has_slots(self, self->levels[touch->level].machine);
        for (uint32_t i = 0; i < touch->message_count; i++) {
            bool one_lost;
            if (has_slots && !((const fsm_message *)fsm_store_at(&self->composition->messages, touch->messages[i]))->is_input)
                continue;
            next = fsm_deliver(self->composition, next, touch->messages[i], &one_lost);
            if (next == FSM_NONE) {
                fsm_symbolic_stop(self, FSM_MODEL_FAILED);
                return FSM_NONE;
            }
            lost = lost || one_lost;
        }
        touch->rows[value] = (next << 1 | lost) + 1;
    }
    *full = (touch->rows[value] - 1) & 1;
    return (touch->rows[value] - 1) >> 1;
}

uint32_t fsm_symbolic_first_phase(const fsm_symbolic *self, const fsm_touch *touch, uint32_t value)
{
    uint32_t machine = self->levels[touch->level].machine;
    return touch->change != 0 && fsm_info(self->composition, machine, value)->view.running ? FSM_PHASE_START : FSM_PHASE_DONE;
}

bool fsm_symbolic_add_slot_step(fsm_symbolic *self, fsm_slot_step step)
{
    if (!grow(self, &self->slot_steps, self->slot_step_count, &self->slot_step_room, sizeof *self->slot_steps))
        return false;
    self->slot_steps[self->slot_step_count++] = step;
    return true;
}

/* --- values ---------------------------------------------------------------------------------------------- */

bool fsm_symbolic_make_room(fsm_symbolic *self, size_t count)
{
    if (count <= self->buffer_room)
        return true;
    uint32_t *buffer = realloc(self->buffer, 2 * count * sizeof *buffer);
    if (buffer == NULL)
        return no_memory(self);
    self->buffer = buffer;
    self->buffer_room = 2 * count;
    return true;
}

/* Puts messages behind what is in the buffer, sorted by their targets, each one's in their order; `*next` is the local state
 * of the mover with what it has sent to itself. */
bool fsm_symbolic_sort_messages(fsm_symbolic *self, uint32_t machine, const fsm_local_step *step, uint32_t *count, uint32_t *next)
{
    fsm_composition *c = self->composition;
    const uint32_t first = *count;
    *next = step->next;
    for (uint32_t i = 0; i < step->message_count; i++) {
        uint32_t message = c->numbers.items[step->messages + i], at = *count;
        uint32_t target = ((const fsm_message *)fsm_store_at(&c->messages, message))->target;
        if (target == machine) {
            bool full;
            *next = fsm_deliver(c, *next, message, &full);
            if (*next == FSM_NONE)
                return false;
            continue;
        }
        if (fsm_split_is_copy(&self->split, message))
            continue;
        while (at > first && ((const fsm_message *)fsm_store_at(&c->messages, self->buffer[at - 1]))->target > target) {
            self->buffer[at] = self->buffer[at - 1];
            at--;
        }
        self->buffer[at] = message;
        (*count)++;
    }
    return true;
}

bool fsm_symbolic_step(fsm_symbolic *self, uint32_t machine, uint32_t local, fsm_class class, uint32_t number,
                       fsm_event **event, uint32_t *next)
{
    const fsm_local_step step = self->composition->steps[number];
    uint32_t length = FSM_KEY_HEAD;
    *event = NULL;
    if (!fsm_symbolic_make_room(self, (size_t)step.message_count + FSM_KEY_HEAD))
        return false;
    if (!fsm_symbolic_sort_messages(self, machine, &step, &length, next)) {
        fsm_symbolic_stop(self, FSM_MODEL_FAILED);
        return false;
    }
    bool is_still = *next == local && length == FSM_KEY_HEAD && step.kind != FSM_STEP_INTERNAL; /* else it is a livelock */
    if (is_still && !self->keeps_actions)
        return true;
    fsm_symbolic_start_key(self, machine, class, 0, 0, fsm_symbolic_label(self, machine, local, &step, is_still));
    *event = fsm_symbolic_event(self, self->buffer, length);
    return *event != NULL;
}

static bool add_steps(fsm_symbolic *self, uint32_t machine, uint32_t local, fsm_class class, uint32_t first, uint32_t count)
{
    for (uint32_t s = first; s < first + count; s++) {
        fsm_event *event;
        uint32_t next;
        if (!fsm_symbolic_step(self, machine, local, class, s, &event, &next)
            || (event != NULL && !fsm_symbolic_add_to_row(self, event, local, next)))
            return false;
    }
    return true;
}

/* Whether a machine is in so many local states by what its queue holds that this had better be levels; then the search stops. */
static bool wants_slots(fsm_symbolic *self, fsm_level *at, uint32_t value)
{
    enum { FEW = 4096, MORE = 8 };
    at->queueless_count += fsm_info(self->composition, at->machine, value)->view.queued == 0;
    if (!at->may_have_slots || at->confirmed_count <= FEW || at->confirmed_count / MORE <= at->queueless_count)
        return false;
    self->wants_slots = at->machine;
    fsm_symbolic_stop(self, FSM_DECIDED);
    return true;
}

static bool confirm_slot(fsm_symbolic *self, fsm_level *at, uint32_t value)
{
    at->confirmed[value] = 1;
    at->confirmed_count++;
    return fsm_symbolic_add_slot_value(self, at->machine, value);
}

bool fsm_symbolic_confirm(fsm_symbolic *self, uint32_t level, uint32_t value)
{
    fsm_level *at = &self->levels[level];
    if (value < at->room && at->confirmed[value])
        return true;
    uint32_t room = at->room, machine = at->machine;
    if (!grow_to(self, &at->of_value, value, &room, sizeof *at->of_value)
        || !grow_to(self, &at->confirmed, value, &at->room, sizeof *at->confirmed))
        return false;
    if (at->is_slot)
        return confirm_slot(self, at, value);
    if (at->is_variable || at->is_clock || fsm_symbolic_is_split(self, machine)) {
        at->confirmed[value] = 1;
        at->confirmed_count++;
        return at->is_variable || at->is_clock || fsm_symbolic_add_split(self, machine, value);
    }
    bool has_clock = self->slots.machines[machine].has_clock;
    if (!fsm_knowledge_find(self->knowledge, machine, value, false) || !fsm_knowledge_find(self->knowledge, machine, value, true)
        || (self->system->unit > 0 && !has_clock && fsm_elapse(self->composition, machine, value) == FSM_NONE)) {
        fsm_symbolic_stop(self, FSM_MODEL_FAILED);
        return false;
    }
    at->confirmed[value] = 1;
    at->confirmed_count++;
    if (fsm_symbolic_has_slots(self, machine))
        return fsm_symbolic_add_base(self, machine, value);
    if (wants_slots(self, at, value))
        return false;
    const fsm_local_info info = *fsm_info(self->composition, machine, value);
    fsm_class class = fsm_symbolic_class(self, machine, value);
    return add_steps(self, machine, value, class, info.own, info.own_count)
        && add_steps(self, machine, value, FSM_CLASS_OPEN, info.open, info.open_count);
}

uint32_t fsm_symbolic_value(fsm_symbolic *self, uint32_t level, const uint32_t *locals)
{
    const fsm_level *at = &self->levels[level];
    if (at->is_variable)
        return fsm_split_value_of(&self->split, at->machine, locals[self->split.variables[at->machine].holder]);
    if (!fsm_symbolic_has_slots(self, at->machine))
        return fsm_split_base(&self->split, at->machine, locals[at->machine]);
    uint32_t *values = self->slots.machines[at->machine].lists[0];
    if (at->is_clock)
        return fsm_slots_clock(&self->slots, at->machine, locals[at->machine]);
    if (!at->is_slot)
        return fsm_slots_base(&self->slots, at->machine, locals[at->machine]);
    uint32_t count = fsm_slots_read(&self->slots, at->machine, locals[at->machine], values);
    return count == FSM_NONE ? FSM_NONE : at->slot < count ? values[at->slot] : 0;
}

uint32_t fsm_symbolic_local(fsm_symbolic *self, uint32_t machine, const uint32_t *values)
{
    const fsm_split_machine *m = &self->split.machines[machine];
    uint32_t combination = 0, level = self->level_of[machine];
    if (fsm_symbolic_has_slots(self, machine)) {
        const fsm_slot_machine *slots = &self->slots.machines[machine];
        const uint32_t *list = values + level - fsm_slots_levels(&self->slots, machine);
        uint32_t count = 0;
        while (count < slots->room && list[count] != 0)
            count++;
        return fsm_slots_local(&self->slots, machine, values[level], list, count,
                               slots->has_clock ? values[level - 1] : FSM_CLOCK_FAR);
    }
    for (uint32_t i = m->count; i-- > 0;)
        combination = combination * self->split.variables[m->variables[i]].count
            + values[self->level_of_variable[m->variables[i]]];
    return fsm_split_whole(&self->split, machine, values[level], combination);
}

/* --- making one --------------------------------------------------------------------------------------------- */

/* The numbers in the terminals: each only if some rule needs it. */
static void choose_counts(fsm_symbolic *self)
{
    const fsm_system *system = self->system;
    for (uint32_t i = 0; i < system->machine_count; i++) {
        self->counts_watched = self->counts_watched || system->machines[i]->monitor;
        self->counts_answered = self->counts_answered || (system->machines[i]->environment && !system->machines[i]->monitor);
    }
    for (uint32_t i = 0; i < system->possible_count; i++)
        self->counts_all = self->counts_all
            || (!system->possible[i].spontaneous && system->max_pending_before_input != UINT32_MAX);
}

/* The passing of time: at every level. It is the first event of the highest one. */
static bool make_time(fsm_symbolic *self)
{
    const uint32_t key[FSM_KEY_HEAD] = {self->levels[self->level_count].machine, FSM_CLASS_TIME};
    fsm_event *event = self->system->unit == 0 ? NULL : fsm_symbolic_event(self, key, FSM_KEY_HEAD);
    if (event != NULL)
        event->touches[0].level = self->level_count;
    return self->system->unit == 0 || (event != NULL && add_to_list(self, &self->levels[self->level_count].any, event->number));
}

/* The clock and the slots of a machine below it, the last slot on top; the next level. */
static uint32_t make_slot_levels(fsm_symbolic *self, uint32_t machine, uint32_t level)
{
    if (self->slots.machines[machine].has_clock) {
        self->levels[level].machine = machine;
        self->levels[level--].is_clock = true;
    }
    for (uint32_t slot = self->slots.machines[machine].room; slot-- > 0; level--) {
        self->levels[level].machine = machine;
        self->levels[level].is_slot = true;
        self->levels[level].slot = slot;
    }
    return level;
}

/* Levels from the top: the machines in order, each with its slots and those of its variables that have no level yet. */
static bool make_levels(fsm_symbolic *self, const uint32_t *order, bool may_have)
{
    uint32_t machines = self->system->machine_count, level = self->level_count;
    for (uint32_t i = 0; i < machines; i++) {
        const fsm_split_machine *split = &self->split.machines[order[i]];
        self->levels[level].machine = order[i];
        self->levels[level].may_have_slots = may_have && fsm_slots_can(self->system, &self->split, order[i]);
        self->level_of[order[i]] = level--;
        level = make_slot_levels(self, order[i], level);
        for (uint32_t v = 0; v < split->count; v++) {
            uint32_t variable = split->variables[v];
            if (self->level_of_variable[variable] != 0)
                continue;
            self->levels[level].machine = variable;
            self->levels[level].is_variable = true;
            self->level_of_variable[variable] = level--;
        }
    }
    for (uint32_t v = 0; v < self->split.variable_count; v++)
        for (uint32_t value = 0; value < self->split.variables[v].count; value++)
            if (!fsm_symbolic_confirm(self, self->level_of_variable[v], value))
                return false;
    return true;
}

bool fsm_symbolic_init(fsm_symbolic *self, fsm_knowledge *knowledge, const uint32_t *order, size_t limit, uint32_t cache_bits,
                       bool splits, const bool *slots)
{
    fsm_composition *composition = knowledge->composition;
    const fsm_system *system = composition->system;
    size_t fail_at = self->mdd.fail_at;
    *self = (fsm_symbolic){.knowledge = knowledge, .composition = composition, .system = system,
                           .keeps_actions = self->keeps_actions, .mdd.fail_at = fail_at};
    bool fine = fsm_split_init(&self->split, composition, splits && system->unit == 0);
    fine = fine && fsm_slots_init(&self->slots, composition, &self->split, slots);
    self->wants_slots = FSM_NONE;
    uint32_t count = system->machine_count + self->split.variable_count;
    for (uint32_t i = 0; fine && i < system->machine_count; i++)
        count += fsm_slots_levels(&self->slots, i);
    self->level_count = count;
    self->levels = calloc((size_t)count + 1, sizeof *self->levels);
    self->level_of = calloc(system->machine_count, sizeof *self->level_of);
    self->level_of_variable = calloc(self->split.variable_count + 1u, sizeof *self->level_of_variable);
    fine = fsm_lists_init(&self->keys) && fine;
    fine = fsm_lists_init(&self->pairs) && fine;
    fine = fsm_lists_init(&self->sent) && fine;
    fine = fsm_lists_init(&self->carried) && fine;
    fine = fsm_mdd_init(&self->mdd, count, limit, cache_bits) && fine;
    choose_counts(self);
    if (fine && self->levels != NULL && self->level_of != NULL && self->level_of_variable != NULL
        && make_levels(self, order, slots != NULL) && make_time(self))
        return true;
    fsm_symbolic_free(self);
    return false;
}

static void free_event(fsm_event *event)
{
    for (uint32_t i = 0; event->touches != NULL && i < event->touch_count; i++) {
        free(event->touches[i].rows);
        free(event->touches[i].items);
        free(event->touches[i].values);
    }
    free(event->touches);
    free(event);
}

void fsm_symbolic_free(fsm_symbolic *self)
{
    for (uint32_t i = 1; i <= self->event_count; i++)
        free_event(self->events[i]);
    for (uint32_t level = 1; self->levels != NULL && level <= self->level_count; level++) {
        fsm_level *at = &self->levels[level];
        for (uint32_t i = 0; at->of_value != NULL && i < at->room; i++)
            free(at->of_value[i].items);
        free(at->of_value);
        free(at->any.items);
        free(at->confirmed);
    }
    fsm_lists_free(&self->keys);
    fsm_lists_free(&self->pairs);
    fsm_lists_free(&self->sent);
    fsm_lists_free(&self->carried);
    free(self->level_of_variable);
    free(self->slot_steps);
    if (self->slots.composition != NULL)
        fsm_slots_free(&self->slots);
    if (self->split.machines != NULL)
        fsm_split_free(&self->split);
    fsm_mdd_free(&self->mdd);
    fsm_hash_map_free(&self->terminal_of);
    free(self->levels);
    free(self->level_of);
    free(self->event_of_key);
    free(self->events);
    free(self->terminals);
    free(self->buffer);
    *self = (fsm_symbolic){.outcome = self->outcome, .wants_slots = FSM_NONE};
}
