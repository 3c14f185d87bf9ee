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
 * machine may move on to the next turn when it has nothing left to do. */
#ifndef FSM_SYSTEM_H
#define FSM_SYSTEM_H

#include "model.h"
#include "system/recorder.h"
#include "zones/zones.h"

enum { FSM_MOST_MACHINES = 64 };

typedef struct {
    uint32_t waiting; /* events that can be taken from the queue now */
    uint32_t queued;  /* all events kept in it */
    uint32_t armed;   /* timers */
    uint32_t awaited; /* timers that are not assumed to stay silent */
    bool due;         /* a timer is due */
    bool running;     /* started, neither finished nor stopped by a fault */
    bool faulted;
    bool at_rest;     /* finished, or every active leaf may wait for ever */
} fsm_view;

/* Bytes of a local state that belong to one of its parts, such as its queue or a variable (spread.h). */
typedef struct {
    uint32_t part;
    size_t offset, size;
} fsm_span;

typedef struct {
    const char *name;
    size_t size;
    const fsm_span *spans;
    uint32_t span_count, part_count;
    bool environment;
    bool monitor; /* one of the environment that only watches: it moves first, and nothing waits for it */
    uint32_t state_count, transition_count, event_count;
    uint32_t covered; /* its transitions, if each that is taken is marked, and each state; else 0 */
    const unsigned char *noted; /* which events are worth a mark when nobody answers them */
    const unsigned char *asked; /* which events some property asks of whether they occur; NULL: none */
    void (*hear)(const void *event); /* notes an event that was taken, for monitors; NULL: none watches */
    uint32_t microsteps; /* the bound of a macrostep */
    size_t configuration_size;
    void (*init)(void *m);
    void (*start)(void *m);
    void (*take)(void *m);
    bool (*fire)(void *m, uint32_t timer);  /* the first due one; untimed, zones: that armed one; false: silent */
    /* Whether a timer whose delay is an interval may fire before its deadline; NULL: there is none. */
    bool (*early)(const void *m, uint32_t timer);
    uint32_t (*timer_name)(const void *m, uint32_t timer); /* untimed: by transition, then by event, FSM_NONE: it never fires; else NULL */
    uint32_t timer_names; /* how many there are, with those of the machines in its slots */
    void (*eventless)(void *m);             /* NULL where no eventless guard reads an input */
    void (*occur)(void *m, uint32_t event, const fsm_value *values); /* at once, ahead of the queue */
    bool (*post)(void *m, uint32_t event, const fsm_value *values);  /* false: full */
    void (*elapse)(void *m, uint32_t ticks);
    void (*set_input)(void *m, uint32_t input, fsm_value value);
    fsm_value (*output)(const void *m, uint32_t output);
    void (*choose_inputs)(void *m);         /* of an open chart, before each step; else NULL */
    void (*settle)(void *m);                /* after each step: what does not count as state is cleared */
    /* Zones: timers lie in the order in which they were armed, with their durations as deadlines. `mark`
     * comes before a step; `unmark` after it restores that, given the state before, and tells for each
     * timer which of those before it is, counted from 1, or 0 for one that was armed in the step. */
    void (*mark)(void *m);
    void (*unmark)(void *m, const void *before, uint32_t *source);
    void (*limits)(const void *m, fsm_limits *limits); /* of each timer: the least and the greatest duration */
    fsm_view (*view)(const void *m);
    void (*configuration)(const void *m, unsigned char *shown);
    void (*dump)(const void *m);            /* data and outputs, as trace lines */
} fsm_machine;

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
    bool owed;        /* happens some time if it stays possible */
    bool spontaneous; /* a transition of the machine itself */
} fsm_possible;

/* An event of a machine that some property asks of whether it occurs. */
typedef struct {
    uint32_t machine, event;
} fsm_asked;

typedef struct {
    const fsm_machine *const *machines;
    const fsm_event_link *event_links;
    const fsm_input_link *input_links;
    const fsm_possible *possible;
    uint32_t machine_count, event_link_count, input_link_count, possible_count, property_count;
    bool (*judge)(const void *const *machines, uint32_t property); /* whether to mark the state */
    const fsm_asked *asked;
    uint32_t asked_count; /* 0: no property is judged at steps */
    bool (*judge_step)(const void *const *machines, const bool *occurs, uint32_t property); /* `occurs`: of `asked` */
    const size_t *seen_sizes; /* by machine: bytes of what properties see of it */
    void (*see)(uint32_t machine, const void *m, unsigned char *seen);
    const bool *ordered; /* by machine: it moves in its turn only; and what comes from outside comes to it then */
    /* Whose turn it is, from 1; 0: nobody's. Asked of the last machine, which keeps turns. NULL: there are none. */
    uint32_t (*turn)(const void *m);
    bool untimed, zones, open;
    uint32_t unit;     /* ticks that pass at once, of which all delays are multiples; 0: no delays */
    uint32_t max_pending_before_input;
} fsm_system;

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
