/* symbolic.h: all states of a system as one diagram, by saturation (Ciardo, Marmorstein, Siminiceanu 2003, "Saturation
 * unbound"; values are found while it runs).
 *
 * A level is a machine; its values are the numbers of its local states (composition.h). Or it is a variable that machines share
 * (split.h), with its values; or a slot of a queue (slots.h). An event is a set of local steps of one machine that send the same and change shared variables
 * in the same ways: it changes the level of the machine by rows, those of variables likewise, those of the machines that it
 * sends to by what a message does there, slots of queues by a change that goes through them, and no other level.
 *
 * Which steps may be taken depends on events that wait (system_model.h): those of monitors, those of machines of the environment,
 * all. These numbers are a function of the state. They are in the terminals, as far as the system needs them; an event
 * carries down by how much it changes them. So each node knows for each class of steps whether some state below allows it,
 * and whether some state forbids it.
 *
 * A value is confirmed before a node with it is made: then its steps are known, and have their events. So no event changes
 * for a node that is there, and what a cache holds stays right. */
#ifndef FSM_SYMBOLIC_H
#define FSM_SYMBOLIC_H

#include "search/search.h"
#include "store/lists.h"
#include "symbolic/mdd.h"
#include "slots/slots.h"
#include "symbolic/split.h"
#include "system/system_model.h"

/* Classes of steps: of monitors that have events; of machines of the environment that have; all other own ones; what may
 * happen; the passing of time. */
typedef enum { FSM_CLASS_WATCH, FSM_CLASS_ANSWER, FSM_CLASS_OWN, FSM_CLASS_OPEN, FSM_CLASS_TIME, FSM_CLASSES } fsm_class;

/* Flags of nodes: a bit for each class that some state allows, then one for each that some state forbids. */
static inline uint32_t fsm_allows(fsm_class class)
{
    return UINT32_C(1) << class;
}

static inline uint32_t fsm_forbids(fsm_class class)
{
    return UINT32_C(1) << (FSM_CLASSES + class);
}

/* The coverage of enumerating the steps of a local state. It counts where these steps can be taken. */
typedef struct {
    uint32_t seen;       /* a list: 2 * state, 2 * transition + 1 */
    uint32_t marks;      /* a list of notes */
    uint32_t microsteps; /* of the bound, the most used */
} fsm_executed;

typedef struct {
    fsm_executed own, open;
    bool own_known, open_known;
} fsm_executed_steps;

/* Knowledge of local states beyond a composition, shared by all its searches. */
typedef struct {
    fsm_composition *composition;
    fsm_lists lists;
    fsm_executed_steps **locals; /* by machine and local state */
    uint32_t *room;
    unsigned char *states, *transitions; /* room for what one step runs */
    uint32_t *buffer;
    size_t buffer_room;
} fsm_knowledge;

bool fsm_knowledge_init(fsm_knowledge *self, fsm_composition *composition);
void fsm_knowledge_free(fsm_knowledge *self);

/* Enumerates the steps of a local state, own or external ones, and their coverage. */
bool fsm_knowledge_find(fsm_knowledge *self, uint32_t machine, uint32_t local, bool open);

/* Makes a composition compute its facts by this: then what runs counts as covered. */
void fsm_knowledge_serve(fsm_knowledge *self);

static inline const fsm_executed_steps *fsm_knowledge_at(const fsm_knowledge *self, uint32_t machine, uint32_t local)
{
    return &self->locals[machine][local];
}

/* What an event does at a level. Rows: of each value a range of `items`, its length first. Functions: of each value the next
 * one and whether a queue was full, computed on request. At a machine whose queue is levels, and at each of these: the
 * change that goes through them, and how many of them are still below. */
typedef struct {
    uint32_t level;
    bool is_function, is_slot;
    uint32_t change, left; /* number of the change; 0: no change */
    uint32_t clock;        /* at a clock: the effect on it; else 0 */
    uint32_t *rows, room;     /* by value, plus one; 0: none */
    uint32_t *items;
    uint32_t item_count, item_room;
    uint32_t *values, value_count, value_room; /* that have a row */
    const uint32_t *messages; /* of a function */
    uint32_t message_count;
} fsm_touch;

typedef struct {
    uint32_t number; /* from 1 */
    uint32_t mover;
    fsm_class class;
    uint32_t action; /* to which its steps belong (fsm_model.fair); FSM_NONE: to none, or that is not kept */
    bool is_still;   /* it leads from each state to itself; only where actions are kept */
    uint32_t touch_count;
    fsm_touch *touches; /* from the highest level down */
} fsm_event;

typedef struct {
    uint32_t *items;
    uint32_t count, room;
} fsm_event_list;

typedef struct {
    uint32_t machine;         /* or its number is that of a variable */
    bool is_variable, is_slot, is_clock;
    uint32_t slot;            /* of the queue of the machine */
    unsigned char *confirmed; /* by value */
    uint32_t room, confirmed_count;
    fsm_event_list any;       /* events of which this is the highest level: functions of it */
    fsm_event_list *of_value; /* and those with a row for a value */
    bool full;                /* a message was lost here */
    bool may_have_slots;      /* its queue can be levels, but is not */
    uint32_t queueless_count; /* of the values that are confirmed, those with nothing queued */
} fsm_level;

/* A step of a machine whose queue is levels: from base to base. */
typedef struct {
    uint32_t machine, base, next;
    fsm_event *event;
    bool internal;
} fsm_slot_step;

/* The number of waiting events, up to the relevant maximum. */
typedef struct {
    int32_t watched, answered, all;
} fsm_waiting;

typedef struct fsm_symbolic fsm_symbolic;

struct fsm_symbolic {
    fsm_knowledge *knowledge;
    fsm_composition *composition;
    const fsm_system *system;
    uint32_t level_count;
    fsm_level *levels;          /* 1 is the lowest; 0 is unused */
    uint32_t *level_of;         /* by machine */
    uint32_t *level_of_variable;
    fsm_split split;
    fsm_slots slots;
    fsm_slot_step *slot_steps;
    uint32_t slot_step_count, slot_step_room;
    uint32_t wants_slots;       /* a machine whose queue had better be levels, which ended the search; FSM_NONE */
    fsm_lists keys;             /* of events: see fsm_symbolic_start_key */
    fsm_lists carried;          /* a change of the numbers that wait, and the phase of that of a queue */
    fsm_lists pairs;            /* of values of a variable, before and after a step: before * count + after */
    fsm_lists sent;             /* messages, by target */
    uint32_t *event_of_key;
    uint32_t key_room;
    fsm_event **events;         /* by number */
    uint32_t event_count, event_room;
    fsm_waiting *terminals;     /* by number of a terminal */
    uint32_t terminal_count, terminal_room;
    fsm_hash_map terminal_of;   /* node, by these */
    bool counts_watched, counts_answered, counts_all;
    bool keeps_actions; /* steps of an event belong to one action, and those are events, too, that lead nowhere else */
    uint32_t *buffer;
    size_t buffer_room, event_bytes;
    fsm_mdd mdd;
    uint32_t root;              /* what was reached */
    bool root_pushed;           /* on the stack of roots */
    fsm_outcome outcome;
    uint64_t fires;             /* events applied to nodes, but for those that a cache knew */
    uint64_t checked_at;
    uint64_t max_created;         /* the limit of nodes; 0: no limit */
    bool ran_over;              /* it did */
    bool (*keep_on)(fsm_symbolic *); /* called now and then; sets `outcome` to stop; may be NULL */
    void *context;
    const void *relation;       /* that was followed last, whose results caches hold (relation.h) */
};

/* `order`: the machines, the highest first. `splits`: shared variables may be levels. `slots`: by machine, whether its queue is
 * levels, if it can be; NULL: none is, and none is wanted to be. `cache_bits`: see fsm_mdd_init. `keeps_actions` and
 * `mdd.fail_at` are taken over from what was there. False if memory ran out. */
bool fsm_symbolic_init(fsm_symbolic *self, fsm_knowledge *knowledge, const uint32_t *order, size_t limit,
                       uint32_t cache_bits, bool splits, const bool *slots);
void fsm_symbolic_free(fsm_symbolic *self);
size_t fsm_symbolic_bytes(const fsm_symbolic *self);

/* Finds all states from the initial ones, and says in `outcome` whether these are all. Marks of the initial steps are set in
 * `marks`. Its stack is as deep as there are levels: see fsm_on_stack. */
void fsm_symbolic_run(fsm_symbolic *self, bool *marks);

/* Calls a function on a stack with room for so many levels. False if there is no such stack. */
bool fsm_on_stack(uint32_t levels, void (*what)(void *), void *context);

/* --- inside */
bool fsm_symbolic_confirm(fsm_symbolic *self, uint32_t level, uint32_t value);
uint32_t fsm_symbolic_terminal(fsm_symbolic *self, fsm_waiting waiting); /* 0 if memory ran out */

/* Returns the result of a function; FSM_NONE if it failed. */
uint32_t fsm_touch_apply(fsm_symbolic *self, fsm_touch *touch, uint32_t value, bool *full);

static inline bool fsm_symbolic_is_split(const fsm_symbolic *self, uint32_t machine)
{
    return self->split.machines[machine].count > 0;
}

/* Whether a level is that of a machine, and not of a part of one. */
static inline bool fsm_level_is_whole(const fsm_level *level)
{
    return !level->is_variable && !level->is_slot && !level->is_clock;
}

static inline bool fsm_symbolic_has_slots(const fsm_symbolic *self, uint32_t machine)
{
    return self->slots.machines[machine].room > 0;
}

/* The event of a local step of a machine that is not split and has no slots, and where that leads with what the machine sends to
 * itself; NULL: it leads nowhere else, and actions are not kept. False if that failed. */
bool fsm_symbolic_step(fsm_symbolic *self, uint32_t machine, uint32_t local, fsm_class class, uint32_t number,
                       fsm_event **event, uint32_t *next);

/* The value of a state, given by the whole local state of each machine, at a level; and the whole local state of a machine, given
 * the values at all levels. FSM_NONE if that failed. */
uint32_t fsm_symbolic_value(fsm_symbolic *self, uint32_t level, const uint32_t *locals);
uint32_t fsm_symbolic_local(fsm_symbolic *self, uint32_t machine, const uint32_t *values);

/* Stops the search, unless it has stopped. */
void fsm_symbolic_stop(fsm_symbolic *self, fsm_outcome outcome);

static inline uint32_t fsm_touch_row(const fsm_touch *touch, uint32_t value)
{
    return value < touch->room ? touch->rows[value] : 0;
}

/* A change of the numbers that wait, as one number; and those of none. */
enum { FSM_CHANGE_BITS = 10, FSM_NO_CHANGE = 512 | 512 << 10 | 512 << 20 };

/* A number for something below 2^31 and a phase (slots.h), which are carried down together; that of phase 0 is the first. FSM_NONE
 * if memory ran out. And back. */
uint32_t fsm_symbolic_carry(fsm_symbolic *self, uint32_t what, uint32_t phase);
void fsm_symbolic_carried(const fsm_symbolic *self, uint32_t carried, uint32_t *what, uint32_t *phase);

static inline int32_t fsm_changed(uint32_t change, int which)
{
    return (int32_t)(change >> (which * FSM_CHANGE_BITS) & 1023u) - 512;
}

/* The change with that of a machine which goes from one local state to another; FSM_NONE if it is too large. */
uint32_t fsm_symbolic_change(const fsm_symbolic *self, uint32_t machine, uint32_t from, uint32_t to, uint32_t change);

/* The same where so many events more wait at a machine. */
uint32_t fsm_symbolic_more(const fsm_symbolic *self, uint32_t machine, int32_t more, uint32_t change);

/* What an event keeps of a step from a local state besides its effect: its action, and whether it leads nowhere else; 0 where
 * actions are not kept. */
uint32_t fsm_symbolic_label(const fsm_symbolic *self, uint32_t machine, uint32_t local, const fsm_local_step *step, bool is_still);

/* The key of an event in the buffer, but for what follows: variables, each with its pairs, and messages. `change`: of the queue
 * of its mover; `clock`: of its clock (slots.h); 0: none. */
enum { FSM_KEY_HEAD = 6 };

static inline void fsm_symbolic_start_key(fsm_symbolic *self, uint32_t machine, fsm_class class, uint32_t change, uint32_t clock,
                                          uint32_t label)
{
    self->buffer[0] = machine;
    self->buffer[1] = class;
    self->buffer[2] = 0; /* variables */
    self->buffer[3] = change;
    self->buffer[4] = clock;
    self->buffer[5] = label;
}

/* For those who make events: room in the buffer; behind what is in it the messages of a step, sorted by target, each one's in
 * their order (`*next`: with what the machine sends to itself); the event of a key; a row of it, more of the value whose row
 * was started last. False, or NULL, if memory ran out or the model failed. */
bool fsm_symbolic_make_room(fsm_symbolic *self, size_t count);
bool fsm_symbolic_sort_messages(fsm_symbolic *self, uint32_t machine, const fsm_local_step *step, uint32_t *count,
                                uint32_t *next);
fsm_event *fsm_symbolic_event(fsm_symbolic *self, const uint32_t *key, uint32_t count);
bool fsm_symbolic_add_to_row(fsm_symbolic *self, fsm_event *event, uint32_t value, uint32_t next);

/* Files the steps of a local state, a base, for all values of the machine's shared data
 * (products.c). */
bool fsm_symbolic_add_split(fsm_symbolic *self, uint32_t machine, uint32_t base);

/* Files the steps of a base for all values that slots of its machine have; and those of all bases for one more (slots/slot_steps.c). */
bool fsm_symbolic_add_base(fsm_symbolic *self, uint32_t machine, uint32_t base);
bool fsm_symbolic_add_slot_value(fsm_symbolic *self, uint32_t machine, uint32_t value);
bool fsm_symbolic_add_slot_step(fsm_symbolic *self, fsm_slot_step step);

/* The phase in which a change of slots starts where a machine is at a value: no change starts if
 * it has stopped. */
uint32_t fsm_symbolic_first_phase(const fsm_symbolic *self, const fsm_touch *touch, uint32_t value);

/* Whether a class of steps is allowed where so many wait. */
bool fsm_symbolic_allows(const fsm_symbolic *self, fsm_class class, fsm_waiting waiting);

fsm_class fsm_symbolic_class(const fsm_symbolic *self, uint32_t machine, uint32_t local);

#endif
