#include "slots/slots.h"

/* A change goes from the last slot to the head:
 *
 *   START     above, all slots were empty and stay so;
 *   PUSH n    the pushed events are being written, the last first; n are left of it;
 *   SHIFT v   some slot below is taken from; what was above, v, comes into this one;
 *   SEEK      some slot below is taken from, and those above stay;
 *   BELOW     that was done: what is left is deferred where the machine is;
 *   KEEP n    nothing is taken; n: some deferred event was found that is so no more;
 *   EXPECT v  the slot above got what this one has: v, which was guessed.
 *
 * The list has no gaps, so below an event there is no empty slot. */
typedef enum { BEGIN = FSM_PHASE_START, PUSH, SHIFT, SEEK, BELOW, KEEP, EXPECT } phase_kind;

enum { KIND_BITS = 3 };

static uint32_t phase_of(phase_kind kind, uint32_t what)
{
    return (uint32_t)kind | what << KIND_BITS;
}

typedef struct {
    const fsm_slots *slots;
    const fsm_change *change;
    uint32_t slot, value, which;
    fsm_slot_move *move;
} moving;

static bool waits(const moving *self, uint32_t value)
{
    return fsm_slot_waits(self->slots, self->change->machine, value, self->change->before);
}

/* Whether a change may end in a phase, below the head. */
static bool may_end(const fsm_change *change, uint32_t phase)
{
    uint32_t what = phase >> KIND_BITS;
    bool by_none = change->condition != FSM_IF_FIRST && change->condition != FSM_IF_RECALLED
        && (change->kind == FSM_CHANGE_NONE || change->kind == FSM_CHANGE_CLEAR);
    switch ((phase_kind)(phase & ((1u << KIND_BITS) - 1u))) {
    case BEGIN:
        return by_none && change->pushed_count == 0;
    case PUSH:
        return by_none && what == 0;
    case BELOW:
        return true;
    case KEEP:
        return change->condition != FSM_IF_RECALLED || what > 0;
    case SHIFT:
    case SEEK:
    case EXPECT:
        break;
    }
    return false;
}

static fsm_move_kind go_to(const moving *self, uint32_t value, uint32_t phase)
{
    const fsm_change *change = self->change;
    if (self->slot == 0 && phase != FSM_PHASE_DONE) {
        if (!may_end(change, phase))
            return FSM_NO_SUCH_MOVE;
        phase = FSM_PHASE_DONE;
    }
    self->move->value = value;
    self->move->phase = phase;
    self->move->more = (int32_t)fsm_slot_waits(self->slots, change->machine, value, change->after)
        - (int32_t)fsm_slot_waits(self->slots, change->machine, self->value, change->before);
    return FSM_MOVE;
}

static uint32_t unless_cleared(const moving *self, uint32_t value)
{
    return self->change->kind == FSM_CHANGE_CLEAR ? 0 : value;
}

/* An event where nothing is taken. */
static fsm_move_kind keep(const moving *self, uint32_t found)
{
    const fsm_change *change = self->change;
    bool waiting = waits(self, self->value), recalled = waiting && fsm_slot_is_deferred(self->value);
    if (self->value == 0 || self->which > 0)
        return FSM_NO_MOVE;
    if ((change->condition == FSM_IF_IDLE && waiting) || (change->condition == FSM_IF_KEPT && recalled))
        return FSM_NO_MOVE;
    if (change->condition == FSM_IF_ANY && change->before == change->after && change->kind == FSM_CHANGE_NONE)
        return go_to(self, self->value, FSM_PHASE_DONE);
    return go_to(self, unless_cleared(self, self->value), phase_of(KEEP, found | recalled));
}

static fsm_move_kind below(const moving *self)
{
    if (self->value == 0 || self->which > 0 || waits(self, self->value))
        return FSM_NO_MOVE;
    return go_to(self, unless_cleared(self, self->value), phase_of(BELOW, 0));
}

/* An event above the one that is taken, or this one. */
static fsm_move_kind seek(const moving *self)
{
    const fsm_change *change = self->change;
    if (self->value == 0 || self->which > 1)
        return FSM_NO_MOVE;
    if (self->which == 1)
        return go_to(self, unless_cleared(self, self->value), phase_of(SEEK, 0));
    if (self->value != change->taken)
        return FSM_NO_SUCH_MOVE;
    return go_to(self, change->kind == FSM_CHANGE_DEFER ? change->put : 0, phase_of(BELOW, 0));
}

static fsm_move_kind shift(const moving *self, uint32_t above)
{
    if (self->value == 0 || self->which > 1)
        return FSM_NO_MOVE;
    if (self->which == 1)
        return go_to(self, above, phase_of(SHIFT, self->value));
    return self->value == self->change->taken ? go_to(self, above, phase_of(BELOW, 0)) : FSM_NO_SUCH_MOVE;
}

/* The first event from above, where nothing is pushed, or no more. */
static fsm_move_kind first_event(const moving *self)
{
    const fsm_change *change = self->change;
    if (change->kind == FSM_CHANGE_DEFER || (change->kind == FSM_CHANGE_CLEAR && change->condition == FSM_IF_FIRST))
        return seek(self);
    return keep(self, 0);
}

/* Writes what is pushed, as if only `count` were. */
static fsm_move_kind write(const moving *self, uint32_t count)
{
    return go_to(self, self->change->pushed[count - 1], phase_of(PUSH, count - 1));
}

/* The slot of a queued event, which moves into the one above: it gets one that is guessed, or what is inserted. */
static fsm_move_kind insert(const moving *self)
{
    const fsm_slot_machine *m = &self->slots->machines[self->change->machine];
    if (self->which == 0)
        return go_to(self, self->change->put, phase_of(BELOW, 0));
    if (self->which > m->value_count || self->change->condition == FSM_IF_IDLE)
        return FSM_NO_MOVE;
    uint32_t guess = m->values[self->which - 1];
    return fsm_slot_is_deferred(guess) ? FSM_NO_SUCH_MOVE : go_to(self, guess, phase_of(EXPECT, guess));
}

static fsm_move_kind begin(moving *self)
{
    const fsm_change *change = self->change;
    uint32_t most = change->pushed_count, at_top = self->slots->machines[change->machine].room - 1;
    bool takes = change->kind == FSM_CHANGE_TAKE;
    if (self->value != 0) {
        if (takes && most <= 1)
            return shift(self, most == 0 ? 0 : change->pushed[0]);
        if (!takes && most == 0 && change->kind != FSM_CHANGE_INSERT)
            return first_event(self);
        self->move->lost = change->loses && self->slot == at_top && self->which == 0;
        return self->move->lost ? keep(self, 0) : FSM_NO_MOVE; /* there is no room for any */
    }
    if (self->which == 0)
        return go_to(self, 0, phase_of(BEGIN, 0));
    if (change->kind == FSM_CHANGE_INSERT) {
        self->which--;
        return insert(self);
    }
    if (self->which == 1)
        return most > takes ? write(self, most) : FSM_NO_SUCH_MOVE;
    self->move->lost = true; /* there is room for the first ones only */
    return change->loses && self->slot == at_top && self->which - 1 < most ? write(self, self->which - 1) : FSM_NO_MOVE;
}

static fsm_move_kind push(const moving *self, uint32_t left)
{
    bool takes = self->change->kind == FSM_CHANGE_TAKE;
    if (left == takes)
        return takes ? shift(self, self->change->pushed[0]) : first_event(self);
    return self->value == 0 && self->which == 0 ? write(self, left) : FSM_NO_MOVE;
}

static fsm_move_kind expect(const moving *self, uint32_t guessed)
{
    return self->value == guessed ? insert(self) : FSM_NO_MOVE;
}

fsm_move_kind fsm_slot_move_at(const fsm_slots *self, const fsm_change *change, uint32_t slot, uint32_t phase, uint32_t value,
                               uint32_t which, fsm_slot_move *move)
{
    moving all = {self, change, slot, value, which, move};
    uint32_t what = phase >> KIND_BITS;
    move->lost = false;
    if (change->length != FSM_NONE && (slot >= change->length) != (value == 0))
        return FSM_NO_MOVE;
    switch ((phase_kind)(phase & ((1u << KIND_BITS) - 1u))) {
    case BEGIN:
        return begin(&all);
    case PUSH:
        return push(&all, what);
    case SHIFT:
        return shift(&all, what);
    case SEEK:
        return seek(&all);
    case BELOW:
        return below(&all);
    case KEEP:
        return keep(&all, what);
    case EXPECT:
        return expect(&all, what);
    }
    return FSM_NO_MOVE;
}
