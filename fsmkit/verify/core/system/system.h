/* system.h: machines, their wires and their environment, put together as one fsm_model.
 *
 * A local state is the struct of a machine, as shipped. Local states are numbered, and a local step is
 * run once for each local state and action, by the machine's own code (local.c); machines are composed
 * to groups (tree.c). So the machines run seldom, and the search is look-ups.
 *
 * The steps of a global state, in this order:
 *   while a monitor has an event waiting, only monitors move;
 *   else, while a machine of the environment has, only such machines move;
 *   else each machine in turn: an eventless transition that its inputs enable; else the next event of
 *   its queue; else a timer that is due (untimed: any armed one), and spontaneous transitions;
 *   then what may happen to each machine, while at most `max_pending_before_input` events wait in all queues;
 *   and time passes if no machine has anything to do and some timer is armed.
 *
 * With turns (cyclic.c), of the machines that are ordered only that whose turn it is may move; the last
 * machine may move on to the next turn when it has nothing left to do.
 *
 * A machine whose node is frozen (cyclic.c, too) has no steps, nothing comes to it from outside, and what waits for it does
 * not count for `max_pending_before_input`. Of one whose node is stopped for good nothing changes any more. */
#ifndef FSM_SYSTEM_H
#define FSM_SYSTEM_H

#include "model.h"
#include "system/machine.h"

/* In one system. A program of more is compiled for so many. */
#ifndef FSM_MOST_MACHINES
#define FSM_MOST_MACHINES 64
#endif

typedef struct {
    uint32_t source, port, target, event, count;
    uint32_t from[FSM_MOST_VALUES]; /* for each field of the event: the value of the port it takes */
} fsm_event_link;

typedef struct {
    uint32_t source, output, target, input;
} fsm_input_link;

/* Something that can happen to a machine from outside. */
typedef struct {
    uint32_t machine, event;
    fsm_value values[FSM_MOST_VALUES];
    /* Happens some time if it stays possible; a spontaneous one only of a machine of the environment. */
    bool fair;
    bool spontaneous; /* a transition of the machine itself */
} fsm_possible;

/* An event of a machine that some property asks of whether it occurs. */
typedef struct {
    uint32_t machine, event;
} fsm_asked;

/* Machines that a property looks at, in order. */
typedef struct {
    uint32_t count;
    const uint32_t *machines;
} fsm_reads;

/* Numbers of the parts of a property, behind all properties: it marks a state where some part does. */
typedef struct {
    uint32_t first, count; /* 0: it has none */
} fsm_parts;

/* What a node does to its machines. */
typedef enum { FSM_HOLD_NONE, FSM_HOLD_FROZEN, FSM_HOLD_STOPPED } fsm_hold;

typedef struct {
    const fsm_machine *const *machines;
    const fsm_event_link *event_links;
    const fsm_input_link *input_links;
    const fsm_possible *possible;
    uint32_t machine_count, event_link_count, input_link_count, possible_count, property_count;
    bool (*evaluate)(const void *const *machines, uint32_t property); /* whether to mark the state */
    const fsm_reads *reads; /* by property, then by part */
    const fsm_parts *parts; /* by property */
    const fsm_asked *asked;
    uint32_t asked_count; /* 0: no property is evaluated at steps */
    bool (*evaluate_step)(const void *const *machines, const bool *occurs, uint32_t property); /* `occurs`: of `asked` */
    const size_t *seen_sizes; /* by machine: bytes of what properties see of it */
    void (*see)(uint32_t machine, const void *m, unsigned char *seen);
    /* By machine: it moves in its turn only; and what comes from outside comes to it then. NULL where there are no turns. */
    const bool *ordered;
    /* Whose turn it is, from 1; 0: nobody's. Asked of the last machine, which keeps turns. NULL: there are none. */
    uint32_t (*turn)(const void *m);
    const uint32_t *freezers; /* by machine: the machine that keeps the state of its node, or FSM_NONE. NULL: none freezes */
    fsm_hold (*hold)(uint32_t freezer, const void *m); /* what such a machine does to those of its node */
    bool untimed, zones, open;
    uint32_t unit;     /* ticks that pass at once, of which all delays are multiples; 0: no delays */
    uint32_t max_pending_before_input; /* UINT32_MAX: no limit */
} fsm_system;

/* The system that is explored: of the generated code. */
extern const fsm_system fsm_the_system;

/* Whether steps are those of cyclic.c. */
static inline bool fsm_is_ordered(const fsm_system *system)
{
    return system->turn != NULL || system->freezers != NULL;
}

typedef enum {
    FSM_DO_START,
    FSM_DO_TAKE,
    FSM_DO_FIRE,
    FSM_DO_EVENTLESS,
    FSM_DO_OCCUR,
    FSM_DO_ELAPSE
} fsm_action;

/* Marks: 0 deadlock, then the properties, then those of each machine (recorder.h). */
uint32_t fsm_first_mark(const fsm_system *system, uint32_t machine);

typedef struct {
    uint32_t queue, timers, microsteps;
} fsm_bounds;

typedef struct fsm_composition fsm_composition;

fsm_composition *fsm_compose(const fsm_system *system, size_t memory_limit);
void fsm_composition_free(fsm_composition *self);
const fsm_model *fsm_composition_model(const fsm_composition *self);
fsm_bounds fsm_composition_bounds(const fsm_composition *self, uint32_t machine);
const unsigned char *fsm_states_seen(const fsm_composition *self, uint32_t machine);
const unsigned char *fsm_transitions_seen(const fsm_composition *self, uint32_t machine);
uint32_t fsm_local_count(const fsm_composition *self, uint32_t machine);
const void *fsm_local(const fsm_composition *self, uint32_t machine, uint32_t number);

/* What a step was. */
typedef struct {
    fsm_action action;
    uint32_t machine, argument;
    uint32_t before; /* the local state it starts from */
    const uint32_t *choices;
    uint32_t choice_count;
} fsm_description;

/* How all machines started, in that order. */
typedef struct {
    fsm_description what[FSM_MOST_MACHINES];
    uint32_t choices[FSM_MOST_MACHINES][FSM_MOST_CHOICES];
} fsm_described_start;

/* What the initial step of an ordinal was; or a step of a state. False if there is no such step. */
bool fsm_describe_start(fsm_composition *self, uint32_t ordinal, fsm_described_start *described, fsm_state *to);
bool fsm_describe_step(fsm_composition *self, fsm_state state, uint32_t ordinal, fsm_description *what,
                       fsm_state *to);

/* Runs a described step again, into `after` (of the machine's size), tracing. */
void fsm_run_again(fsm_composition *self, fsm_description what, void *after);

#endif
