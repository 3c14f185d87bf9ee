/* slots.h: places of a queue as levels of their own. As part of a local state the queue would multiply the local states by all
 * that it can hold; as levels it costs as many nodes as there are differences.
 *
 * A *base* is the local state of a machine with nothing queued and nothing deferred. The events that it keeps are one list, those
 * that are deferred first, each in its order; slot 0 holds the head. The value of a slot is 0 if it is empty, an odd number
 * for an event in the queue, an even one for an event that is deferred.
 *
 * In discrete time a machine that has one timer at most has that in a level, too, its *clock*, above the slots: 0 where the timer
 * is not armed, else 1 and the units of time that are left. In a base an armed timer is far from its deadline.
 *
 * A step looks at one event of the list at most (the first that is not deferred where the machine is), and at how many there
 * are. So steps are found out in *windows*: local states with that event and as many others, whatever these are. What a step
 * does to the list is a *change*; it goes through the slots from the last one to the head and carries a phase. */
#ifndef FSM_SLOTS_H
#define FSM_SLOTS_H

#include "store/lists.h"
#include "symbolic/split.h"

/* The change of the list, beside the appended events. */
typedef enum {
    FSM_CHANGE_NONE,
    FSM_CHANGE_TAKE,  /* the first that waits is taken out */
    FSM_CHANGE_DEFER, /* it is taken, and put behind those that are deferred */
    FSM_CHANGE_INSERT, /* external events are put behind deferred ones */
    FSM_CHANGE_CLEAR  /* all are lost: the machine stops */
} fsm_change_kind;

/* The states in which a change is possible. */
typedef enum {
    FSM_IF_ANY,
    FSM_IF_IDLE,     /* nothing waits: all are deferred where the machine is */
    FSM_IF_FIRST,    /* what it takes is the first that waits */
    FSM_IF_KEPT,     /* what is deferred stays deferred */
    FSM_IF_RECALLED  /* some deferred event is so no more */
} fsm_change_condition;

typedef struct {
    uint32_t machine;
    fsm_change_kind kind;
    fsm_change_condition condition;
    uint32_t taken, put;    /* values */
    uint32_t length;        /* of the list before; FSM_NONE: whatever it is */
    uint32_t before, after; /* numbers of sets of events that are deferred; equal ones: it makes no difference */
    const uint32_t *pushed; /* values that are put behind, in order */
    uint32_t pushed_count;
    bool loses;             /* events that do not fit are lost; otherwise all fit */
} fsm_change;

typedef struct {
    uint32_t room;                /* slots; 0: the queue is part of the local state */
    bool has_clock;
    fsm_store events;             /* as bytes */
    uint32_t *bases, base_room;   /* by local state: its base, plus one */
    uint32_t *sets, set_room;     /* by base: the events that are deferred there, plus one */
    uint32_t *values, value_count, value_room; /* of slots, in the order in which they were found */
    unsigned char *known;         /* by value */
    uint32_t known_room;
    uint32_t *places, place_count, place_room; /* bases that were found */
    uint32_t *lists[2];           /* room for values */
    fsm_hash_map agreeing;        /* base and what for -> 1 */
    fsm_hash_map clocks_set;      /* base and clock -> 1 */
} fsm_slot_machine;

typedef struct {
    fsm_composition *composition;
    fsm_slot_machine *machines;
    fsm_lists sets, changes;
    unsigned char *scratch; /* room for the largest machine */
} fsm_slots;

/* Whether the queue of a machine can be levels. */
bool fsm_slots_can(const fsm_system *system, const fsm_split *split, uint32_t machine);

/* `requested`: by machine, whether its queue is levels, if it can be. False if memory ran out. */
bool fsm_slots_init(fsm_slots *self, fsm_composition *composition, const fsm_split *split, const bool *requested);
void fsm_slots_free(fsm_slots *self);

/* Whether a queue may hold so much that other searches should not be waited for: more than 100,000 combinations of
 * deferred and external events. */
bool fsm_slots_are_many(const fsm_system *system);

static inline bool fsm_slot_is_deferred(uint32_t value)
{
    return value != 0 && value % 2 == 0;
}

/* Returns whether the event in a slot can be taken, given the set of deferred events. */
bool fsm_slot_waits(const fsm_slots *self, uint32_t machine, uint32_t value, uint32_t set);

/* These return FSM_NONE if memory ran out. The value of an event that a message brings; the base of a local state; the set of
 * events that are deferred there. */
uint32_t fsm_slots_value_of(fsm_slots *self, uint32_t machine, uint32_t message);
uint32_t fsm_slots_base(fsm_slots *self, uint32_t machine, uint32_t local);
uint32_t fsm_slots_set(fsm_slots *self, uint32_t machine, uint32_t base);

/* The values of a local state, from the head on, in `values`, which has room for all; how many. */
uint32_t fsm_slots_read(fsm_slots *self, uint32_t machine, uint32_t local, uint32_t *values);

/* The clock of a local state; FSM_CLOCK_FAR: that of a base. */
enum { FSM_CLOCK_NONE, FSM_CLOCK_DUE };
#define FSM_CLOCK_FAR FSM_NONE
uint32_t fsm_slots_clock(const fsm_slots *self, uint32_t machine, uint32_t local);

/* The local state of a base with values, from the head on, and with a clock, which is ignored if the machine has none. */
uint32_t fsm_slots_local(fsm_slots *self, uint32_t machine, uint32_t base, const uint32_t *values, uint32_t count,
                         uint32_t clock);

/* Levels of a machine besides its base. */
static inline uint32_t fsm_slots_levels(const fsm_slots *self, uint32_t machine)
{
    return self->machines[machine].room + self->machines[machine].has_clock;
}

/* What a step does to a clock, as a number; 0: nothing, whatever it is. `due`: it is possible only when that has expired. And the clock
 * after it; FSM_NONE: it is not possible. */
static inline uint32_t fsm_clock_change(uint32_t clock, bool due)
{
    return (clock == FSM_CLOCK_FAR ? 0 : 2 * clock + 2) | due;
}

static inline uint32_t fsm_clock_after(uint32_t change, uint32_t clock)
{
    if ((change & 1) != 0 && clock != FSM_CLOCK_DUE)
        return FSM_NONE;
    return change < 2 ? clock : change / 2 - 1;
}

/* The clock after a unit of time; FSM_NONE if it has expired, so that no time passes. */
static inline uint32_t fsm_clock_elapsed(uint32_t clock)
{
    return clock == FSM_CLOCK_DUE ? FSM_NONE : clock == FSM_CLOCK_NONE ? clock : clock - 1;
}

/* The purpose of a window: the own steps of a machine, where a value is the first that waits, where nothing does (FSM_WINDOW_IDLE),
 * and whatever waits; external events, where all are queued, or where the first is deferred, but no more; the effect of an
 * expired timer, where nothing waits. Other numbers are values. */
enum { FSM_WINDOW_IDLE = 0 };
#define FSM_WINDOW_QUEUED (FSM_NONE - 1)
#define FSM_WINDOW_RECALLED (FSM_NONE - 2)
#define FSM_WINDOW_EVENTLESS (FSM_NONE - 3)
#define FSM_WINDOW_DUE (FSM_NONE - 4)

/* The local state of a base with so many events and a clock: 0 events and FSM_CLOCK_FAR make the base. FSM_NONE, too, if there is no
 * such state. */
uint32_t fsm_slots_window(fsm_slots *self, uint32_t machine, uint32_t base, uint32_t what, uint32_t count, uint32_t clock);

/* Whether windows of all lengths have the same steps, but for what they queue: so it is once that was found out. */
bool fsm_slots_agree(const fsm_slots *self, uint32_t machine, uint32_t base, uint32_t what);
bool fsm_slots_set_agree(fsm_slots *self, uint32_t machine, uint32_t base, uint32_t what); /* false if memory ran out */

/* The window with the steps of that one, as short as can be. */
uint32_t fsm_slots_short_window(fsm_slots *self, uint32_t machine, uint32_t base, uint32_t what, uint32_t count, uint32_t clock);

/* Notes that some step from a base sets the clock so; false if memory ran out. Where it is so already, that step may be none, or
 * one with another step: then its clock matters, else FSM_CLOCK_FAR represents it. */
bool fsm_slots_set_clock(fsm_slots *self, uint32_t machine, uint32_t base, uint32_t clock);
uint32_t fsm_slots_clock_that_matters(const fsm_slots *self, uint32_t machine, uint32_t base, uint32_t clock);

/* Whether there is an event that some state defers, and this one does (`deferred`), or does not. */
bool fsm_slots_has_event(const fsm_slots *self, uint32_t machine, uint32_t set, bool deferred);

/* Notes a value, or a base, that was found; `*added`: it is new. False if memory ran out. */
bool fsm_slots_add_value(fsm_slots *self, uint32_t machine, uint32_t value, bool *added);
bool fsm_slots_add_place(fsm_slots *self, uint32_t machine, uint32_t base);

/* The number of a change, from 1; 0 if memory ran out. And one of a number. */
uint32_t fsm_slots_number(fsm_slots *self, const fsm_change *change);
fsm_change fsm_slots_change(const fsm_slots *self, uint32_t number);

/* A change that leaves every list as it is. */
bool fsm_change_is_none(const fsm_change *change);

/* --- a change, slot by slot (slot_moves.c) */
enum { FSM_PHASE_DONE, FSM_PHASE_START };

typedef struct {
    uint32_t value, phase; /* that the slot has then, and for the slot below */
    int32_t more;          /* events that wait */
    bool lost;             /* some event is lost */
} fsm_slot_move;

typedef enum { FSM_NO_MOVE, FSM_NO_SUCH_MOVE, FSM_MOVE } fsm_move_kind;

/* What a change does to the value of a slot in a phase, one possibility after the other: FSM_NO_MOVE after the last one,
 * FSM_NO_SUCH_MOVE where this one is impossible. */
fsm_move_kind fsm_slot_move_at(const fsm_slots *self, const fsm_change *change, uint32_t slot, uint32_t phase, uint32_t value,
                               uint32_t which, fsm_slot_move *move);

#endif
