#define _POSIX_C_SOURCE 200809L
#include "symbolic/symbolic.h"
#include "system/flat.h"

#include <limits.h>
#include <pthread.h>

enum { CHECK_EVERY = 4096 /* events applied between two calls of `keep_on` */ };

static uint32_t fire(fsm_symbolic *self, fsm_event *event, uint32_t at, uint32_t node, uint32_t level, uint32_t change);

static bool is_on(fsm_symbolic *self)
{
    if (self->mdd.failed)
        fsm_symbolic_stop(self, FSM_OUT_OF_MEMORY);
    if (self->outcome != FSM_COMPLETE)
        return false;
    if (self->fires - self->checked_at < CHECK_EVERY)
        return true;
    self->checked_at = self->fires;
    if (self->max_created > 0 && self->mdd.made > self->max_created) {
        self->ran_over = true;
        fsm_symbolic_stop(self, FSM_DECIDED);
    } else if (fsm_symbolic_bytes(self) > self->mdd.limit) {
        fsm_symbolic_stop(self, FSM_OUT_OF_MEMORY);
    } else if (self->keep_on != NULL) {
        (void)self->keep_on(self);
    }
    return self->outcome == FSM_COMPLETE;
}

/* Adds the successors, by an event, of the states in which some value leads to `child`; continues at `next`. */
static bool join_next(fsm_symbolic *self, fsm_event *event, uint32_t at, uint32_t level, uint32_t next, uint32_t child,
                      uint32_t change, fsm_mdd_buffer *buffer, bool *fired)
{
    if (change == FSM_NONE) {
        (void)fsm_fail(self->composition, "too many events are sent in one step");
        fsm_symbolic_stop(self, FSM_MODEL_FAILED);
        return false;
    }
    uint32_t below = fire(self, event, at, child, level - 1, change);
    if (below == 0)
        return self->outcome == FSM_COMPLETE;
    *fired = true;
    if (!fsm_symbolic_confirm(self, level, next))
        return false;
    uint32_t joined = fsm_mdd_union(&self->mdd, fsm_mdd_in(buffer, next), below);
    return fsm_mdd_set(&self->mdd, buffer, next, joined);
}

/* The same where a value goes on to `next` and has slots below, through which a change goes, or none. */
static bool add_next(fsm_symbolic *self, fsm_event *event, uint32_t at, uint32_t level, uint32_t value, uint32_t next,
                     uint32_t child, uint32_t change, fsm_mdd_buffer *buffer, bool *fired)
{
    const fsm_touch *touch = &event->touches[at];
    bool touched = at < event->touch_count && touch->level == level;
    uint32_t phase = FSM_PHASE_DONE, left = 0;
    if (touched && touch->clock != 0)
        return join_next(self, event, at + 1, level, next, child, change, buffer, fired);
    if (!self->levels[level].is_slot)
        change = fsm_symbolic_change(self, self->levels[level].is_variable ? FSM_NONE : self->levels[level].machine, value,
                                     next, change);
    if (touched && touch->change != 0) {
        phase = fsm_symbolic_first_phase(self, touch, value);
        left = phase == FSM_PHASE_DONE ? touch->left : 0;
    }
    if (change != FSM_NONE && phase != FSM_PHASE_DONE)
        change = fsm_symbolic_carry(self, change, phase);
    return join_next(self, event, at + touched + left, level, next, child, change, buffer, fired);
}

/* The effect of a change on a slot. */
static bool move_slot(fsm_symbolic *self, fsm_event *event, uint32_t at, uint32_t level, uint32_t value, uint32_t child,
                      uint32_t carried, fsm_mdd_buffer *buffer)
{
    const fsm_touch *touch = &event->touches[at];
    const fsm_change done = fsm_slots_change(&self->slots, touch->change);
    uint32_t change, phase, slot = self->levels[level].slot;
    fsm_symbolic_carried(self, carried, &change, &phase);
    for (uint32_t which = 0;; which++) {
        fsm_slot_move move;
        bool fired = false;
        fsm_move_kind kind = fsm_slot_move_at(&self->slots, &done, slot, phase, value, which, &move);
        if (kind == FSM_NO_MOVE)
            return true;
        if (kind == FSM_NO_SUCH_MOVE)
            continue;
        uint32_t next = fsm_symbolic_more(self, done.machine, move.more, change);
        uint32_t left = move.phase == FSM_PHASE_DONE ? touch->left : 0;
        if (next != FSM_NONE)
            next = fsm_symbolic_carry(self, next, move.phase);
        if (!join_next(self, event, at + 1 + left, level, move.value, child, next, buffer, &fired))
            return false;
        fsm_level *machine = &self->levels[self->level_of[done.machine]];
        machine->full = machine->full || (move.lost && fired);
    }
}

/* Time passes where nothing is left to do; carried down is whether some timer is awaited, and at slots what is deferred. */
static bool pass_time(fsm_symbolic *self, fsm_event *event, uint32_t level, uint32_t value, uint32_t child, uint32_t carried,
                      fsm_mdd_buffer *buffer)
{
    const fsm_level *at = &self->levels[level];
    uint32_t awaited, phase;
    bool fired;
    fsm_symbolic_carried(self, carried, &awaited, &phase);
    if (at->is_slot) {
        if (fsm_slot_waits(&self->slots, at->machine, value, phase - 1))
            return true;
        return join_next(self, event, 0, level, value, child, at->slot == 0 ? awaited : carried, buffer, &fired);
    }
    if (at->is_clock) {
        uint32_t next = fsm_clock_elapsed(value);
        return next == FSM_NONE || join_next(self, event, 0, level, next, child, carried, buffer, &fired);
    }
    const fsm_local_info info = *fsm_info(self->composition, at->machine, value);
    if (info.busy || info.view.waiting > 0)
        return true;
    uint32_t set = fsm_symbolic_has_slots(self, at->machine) ? fsm_slots_set(&self->slots, at->machine, value) + 1 : 0;
    carried = fsm_symbolic_carry(self, awaited | (info.view.awaited > 0), set);
    uint32_t next = self->slots.machines[at->machine].has_clock ? value : info.elapsed;
    return join_next(self, event, 0, level, next, child, carried, buffer, &fired);
}

/* Adds all successors by an event of the states in which a value of this level leads to `child`. */
static bool add_all(fsm_symbolic *self, fsm_event *event, uint32_t at, uint32_t level, uint32_t value, uint32_t child,
                    uint32_t change, fsm_mdd_buffer *buffer)
{
    fsm_touch *touch = &event->touches[at];
    bool fired = false, full = false;
    if (event->class == FSM_CLASS_TIME)
        return pass_time(self, event, level, value, child, change, buffer);
    if (at == event->touch_count || touch->level != level)
        return join_next(self, event, at, level, value, child, change, buffer, &fired);
    if (touch->is_slot)
        return move_slot(self, event, at, level, value, child, change, buffer);
    if (touch->clock != 0) {
        uint32_t next = fsm_clock_after(touch->clock, value);
        return next == FSM_NONE || add_next(self, event, at, level, value, next, child, change, buffer, &fired);
    }
    if (touch->is_function) {
        uint32_t next = fsm_touch_apply(self, touch, value, &full);
        if (next == FSM_NONE || !add_next(self, event, at, level, value, next, child, change, buffer, &fired))
            return false;
        self->levels[level].full = self->levels[level].full || (full && fired);
        return true;
    }
    uint32_t row = fsm_touch_row(touch, value);
    for (uint32_t i = 0; row != 0 && i < touch->items[row - 1]; i++)
        if (!add_next(self, event, at, level, value, touch->items[row + i], child, change, buffer, &fired))
            return false;
    return true;
}

/* Applies all events whose highest level this is until nothing changes, and makes the node. */
static uint32_t saturate(fsm_symbolic *self, uint32_t level, fsm_mdd_buffer *buffer)
{
    fsm_level *at = &self->levels[level];
    uint32_t value;
    while (is_on(self) && fsm_mdd_next_changed(buffer, &value)) {
        uint32_t any = 0, own = 0;
        while (any < at->any.count || own < at->of_value[value].count) {
            uint32_t number = any < at->any.count ? at->any.items[any++] : at->of_value[value].items[own++];
            fsm_event *event = self->events[number];
            uint32_t child = fsm_mdd_in(buffer, value);
            uint32_t change = event->class == FSM_CLASS_TIME ? 0 : FSM_NO_CHANGE;
            if ((fsm_mdd_at(&self->mdd, child)->flags & fsm_allows(event->class)) == 0)
                continue;
            if (!is_on(self) || !fsm_mdd_root(&self->mdd, child))
                break;
            if (fsm_mdd_is_full(&self->mdd))
                fsm_mdd_collect(&self->mdd);
            bool fine = add_all(self, event, 0, level, value, child, change, buffer);
            fsm_mdd_unroot(&self->mdd, 1);
            if (!fine)
                break;
        }
    }
    return fsm_mdd_finish(&self->mdd, buffer);
}

static uint32_t fire_at_terminal(fsm_symbolic *self, fsm_class class, uint32_t node, uint32_t change)
{
    if (class == FSM_CLASS_TIME)
        return change != 0 ? node : 0;
    fsm_waiting waiting = self->terminals[fsm_mdd_at(&self->mdd, node)->first];
    waiting.watched += fsm_changed(change, 0);
    waiting.answered += fsm_changed(change, 1);
    waiting.all += fsm_changed(change, 2);
    return fsm_symbolic_terminal(self, waiting);
}

/* Whether an event has fewer rows at a level than the node has values, so that these are looked for one by one. */
static bool is_narrow(const fsm_touch *touch, const fsm_mdd_node *node)
{
    enum { DEARER = 8 }; /* to look for a value than to go on to the next one */
    return !touch->is_function && touch->value_count < node->count / DEARER;
}

static bool fire_rows(fsm_symbolic *self, fsm_event *event, uint32_t at, uint32_t node, uint32_t level, uint32_t change,
                      fsm_mdd_buffer *buffer)
{
    const fsm_touch *touch = &event->touches[at];
    bool touched = event->class != FSM_CLASS_TIME && at < event->touch_count && touch->level == level;
    if (touched && is_narrow(touch, fsm_mdd_at(&self->mdd, node))) {
        for (uint32_t i = 0, count = touch->value_count; i < count; i++) {
            uint32_t child = fsm_mdd_child(&self->mdd, node, touch->values[i]);
            if (child != 0 && !add_all(self, event, at, level, touch->values[i], child, change, buffer))
                return false;
        }
        return true;
    }
    for (uint32_t i = 0; i < fsm_mdd_at(&self->mdd, node)->count; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(&self->mdd, node)[i];
        if (!add_all(self, event, at, level, pair.value, pair.child, change, buffer))
            return false;
    }
    return true;
}

/* The states that an event leads to from those of a node, saturated. `at` is the first of its touches that is not above. */
static uint32_t fire(fsm_symbolic *self, fsm_event *event, uint32_t at, uint32_t node, uint32_t level, uint32_t change)
{
    const uint32_t flags = fsm_mdd_at(&self->mdd, node)->flags;
    if (node == 0 || (flags & fsm_allows(event->class)) == 0)
        return 0;
    if (level == 0)
        return fire_at_terminal(self, event->class, node, change);
    if (event->class != FSM_CLASS_TIME && at == event->touch_count && change == FSM_NO_CHANGE
        && (flags & fsm_forbids(event->class)) == 0)
        return node;
    self->fires++;
    const fsm_mdd_entry *known = fsm_mdd_entry_of(&self->mdd.fires, event->number, node, change);
    if (fsm_mdd_knows(known, event->number, node, change))
        return known->result;
    fsm_mdd_buffer *buffer = is_on(self) && fsm_mdd_root(&self->mdd, node) ? fsm_mdd_take(&self->mdd, level) : NULL;
    if (buffer == NULL) {
        (void)is_on(self);
        return 0;
    }
    (void)fire_rows(self, event, at, node, level, change, buffer);
    uint32_t made = saturate(self, level, buffer);
    fsm_mdd_unroot(&self->mdd, 1);
    if (is_on(self))
        fsm_mdd_keep(&self->mdd, &self->mdd.fires, (fsm_mdd_entry){event->number, node, change, made});
    return made;
}

/* --- from the initial states ------------------------------------------------------------------------------- */

typedef struct {
    fsm_symbolic *self;
    bool *marks;
} beginning;

static fsm_waiting waiting_in(const fsm_symbolic *self, const uint32_t *locals)
{
    fsm_waiting waiting = {0, 0, 0};
    for (uint32_t i = 0; i < self->system->machine_count; i++) {
        const fsm_machine *m = self->system->machines[i];
        int32_t count = (int32_t)fsm_info(self->composition, i, locals[i])->view.waiting;
        waiting.watched += self->counts_watched && m->monitor ? count : 0;
        waiting.answered += self->counts_answered && m->environment && !m->monitor ? count : 0;
        waiting.all += self->counts_all ? count : 0;
    }
    return waiting;
}

static bool add_start(void *context, const fsm_start *start)
{
    beginning *all = context;
    fsm_symbolic *self = all->self;
    for (uint32_t i = 0; i < start->mark_count; i++)
        all->marks[start->marks[i]] = true;
    uint32_t node = fsm_symbolic_terminal(self, waiting_in(self, start->locals));
    for (uint32_t level = 1; node != 0 && level <= self->level_count; level++) {
        uint32_t local = fsm_symbolic_value(self, level, start->locals);
        fsm_mdd_buffer *buffer = fsm_symbolic_confirm(self, level, local) ? fsm_mdd_take(&self->mdd, level) : NULL;
        if (buffer == NULL) {
            fsm_symbolic_stop(self, FSM_OUT_OF_MEMORY);
            return false;
        }
        (void)fsm_mdd_set(&self->mdd, buffer, local, node);
        node = saturate(self, level, buffer);
    }
    if (self->root_pushed)
        fsm_mdd_unroot(&self->mdd, 1);
    self->root = fsm_mdd_union(&self->mdd, self->root, node);
    self->root_pushed = fsm_mdd_root(&self->mdd, self->root);
    return is_on(self);
}

void fsm_symbolic_run(fsm_symbolic *self, bool *marks)
{
    beginning all = {self, marks};
    if (!fsm_start_all(self->composition, add_start, &all))
        fsm_symbolic_stop(self, FSM_MODEL_FAILED);
    (void)is_on(self);
}

/* --- a stack ------------------------------------------------------------------------------------------------ */

typedef struct {
    void (*what)(void *);
    void *context;
} call;

static void *start_call(void *context)
{
    const call *self = context;
    self->what(self->context);
    return NULL;
}

bool fsm_on_stack(uint32_t levels, void (*what)(void *), void *context)
{
    enum { LEAST = 1 << 22, EACH = 1 << 13 }; /* some functions a level, each of a few hundred bytes; more where they are watched */
    call self = {what, context};
    pthread_attr_t kind;
    pthread_t thread;
    if (pthread_attr_init(&kind) != 0)
        return false;
    bool fine = pthread_attr_setstacksize(&kind, LEAST + (size_t)levels * EACH) == 0
        && pthread_create(&thread, &kind, start_call, &self) == 0;
    (void)pthread_attr_destroy(&kind);
    return fine && pthread_join(thread, NULL) == 0;
}
