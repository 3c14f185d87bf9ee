/* machine.h: a generated machine as the explorer runs it: its table (fsm_info.h), what the explorer knows of it
 * beyond that, and what can be done with it. A machine in a slot of another (SCXML 6.4) is one, too: it lies in the
 * struct of its invoker and is part of its state. */
#ifndef FSM_MACHINE_H
#define FSM_MACHINE_H

#include "fsm_info.h"
#include "system/recorder.h"
#include "zones/zones.h"

typedef struct {
    uint32_t waiting; /* events that can be taken from the queue now */
    uint32_t queued;  /* all events kept in it */
    uint32_t armed;   /* timers */
    uint32_t awaited; /* timers that are not assumed to stay silent */
    bool due;         /* a timer has expired */
    bool running;     /* started, neither finished nor stopped by a fault */
    bool faulted;
    bool at_rest;     /* finished, or every active leaf may wait for ever */
} fsm_view;

/* Bytes of a local state; of one of its parts, such as its queue or a variable (spread.h). */
typedef struct {
    uint32_t part;
    size_t offset, size;
} fsm_span;

/* A variable of the table, or an element of one that is an array, which is shared. */
typedef struct {
    uint32_t variable, element; /* UINT32_MAX: none, the whole */
} fsm_slot_of;

/* Values that something may have, scalar by scalar: what an operation returns, or a variable of the table. */
typedef struct {
    uint32_t variable, count;
    const fsm_value *values;
} fsm_choices;

/* A variable that is reset where no state of a set, a bit for each, is active. */
typedef struct {
    uint32_t variable;
    const unsigned char *live;
} fsm_resettable;

/* Values of a variable that others share, from the least one on; none: they are too many. */
typedef struct {
    fsm_value least;
    uint32_t count;
} fsm_range;

typedef struct fsm_machine fsm_machine;

struct fsm_machine {
    const char *name;
    const char *path; /* the slots in which it lies: the prefix of the lines of its trace */
    const fsm_machine_info *info;
    const fsm_machine *const *inner; /* the machines in its slots, in order */
    void *initial;                   /* room for it as it is made; see fsm_prepare */
    bool untimed, zones; /* as of the system */
    bool environment;
    bool monitor;    /* one of the environment that only watches: it moves first, and nothing waits for it */
    bool is_channel; /* a connection, which keeps its order */
    bool resets_inputs; /* inputs are no state, but for `kept_inputs`: chosen anew in each step */
    uint32_t first_port;   /* of its operations; those below are its events */
    uint32_t covered;      /* its transitions, if each that is taken is marked, and each state; else 0 */
    uint32_t microsteps;   /* the bound of a macrostep */
    uint32_t look;         /* the event by which a monitor looks at an input that has changed; FSM_NONE */
    uint32_t shared_count; /* variables that others share, in `inputs` after the inputs */
    uint32_t constant_count; /* the last of its inputs, which differ from those of other machines with its code */
    uint32_t span_count, part_count, cleared_count, stopped_count, free_count, resettable_count;
    const fsm_span *spans;
    const fsm_span *cleared, *stopped; /* what is no state: never, and while it does not run */
    const fsm_value *constants; /* their values */
    const fsm_choices *free_inputs;
    const unsigned char *kept_inputs; /* by input: whether it counts as state; NULL: none does, or all do */
    const uint16_t *read_inputs; /* by input: chosen when it is read first, its place among the free ones from 1; NULL: none */
    const fsm_resettable *resettable;
    const fsm_slot_of *inputs, *outputs;
    const fsm_range *shared_ranges;  /* of the variables that others share */
    const fsm_choices *answers;      /* by operation */
    const unsigned char *linked;     /* by port, whether a wire starts there: those of events, then of operations */
    const unsigned char *noted;      /* by event: whether it is worth a mark when nobody answers it */
    const unsigned char *by_property;      /* by event: whether some property depends on its
                                      * occurrence; NULL: none */
    const unsigned char *by_monitor;      /* by event: whether a monitor watches it; NULL: none */
    const fsm_number_list *deferring; /* by event: the states that defer it; NULL: none */
    const unsigned char *restless;   /* by state: whether the machine must go on where it is an active leaf */
    const unsigned char *silent;     /* by transition: whether its timer is assumed never to fire; NULL: none */
    const uint32_t *slack;           /* by transition: how long before its deadline it may fire; NULL: no delay is an interval */
    /* For the outermost machine: */
    const fsm_driver *driver;
    bool (*take)(void *m);
    bool (*fire_first)(void *m);
    bool (*eventless)(void *m); /* NULL where no eventless guard reads an input */
    void (*rebase)(void *m, uint32_t now);
};

void fsm_prepare(const fsm_machine *of);
size_t fsm_configuration_size(const fsm_machine *of);
uint32_t fsm_timer_names(const fsm_machine *of); /* how many there are, with those of the machines in its slots */

/* Steps; `occur`: at once, ahead of the queue. `fire`: the first due timer; untimed, in zones, or where delays are
 * intervals: that armed one; false: nothing to do. */
void fsm_start_machine(const fsm_machine *of, void *m);
void fsm_occur(const fsm_machine *of, void *m, uint32_t event, const fsm_value *values);
bool fsm_fire(const fsm_machine *of, void *m, uint32_t timer);
void fsm_pass_time(const fsm_machine *of, void *m, uint32_t ticks);

/* The event of a number from 0, with its scalars in order. */
void fsm_make_event(const fsm_machine *of, uint32_t number, const fsm_value *values, void *e);

/* Delivers an event from another machine; false if the queue is full. */
bool fsm_post_to(const fsm_machine *of, void *m, uint32_t event, const fsm_value *values);
void fsm_set_input(const fsm_machine *of, void *m, uint32_t input, fsm_value value);
void fsm_put_input(const fsm_machine *of, void *m, uint32_t input, fsm_value value); /* it is not noticed */
fsm_value fsm_output(const fsm_machine *of, const void *m, uint32_t output);

/* Gives a free input the value of a choice. */
void fsm_set_free_input(const fsm_machine *of, void *m, uint32_t free, uint32_t choice);

/* For an open chart, before each step: inputs are chosen now, or will be when they are read first (fsm_note_read). */
void fsm_choose_inputs(const fsm_machine *of, void *m);
void fsm_settle(const fsm_machine *of, void *m);        /* after each step: what does not count as state is cleared */

/* Whether a timer whose delay is an interval may fire before its deadline. */
bool fsm_is_early(const fsm_machine *of, const void *m, uint32_t timer);
/* Untimed: which timer one is, by transition, then by event; FSM_NONE: it never fires. */
uint32_t fsm_timer_name(const fsm_machine *of, const void *m, uint32_t timer);

/* Zones: timers lie in the order in which they were armed, with their durations as deadlines. Before a step the
 * deadlines of armed timers become marks that lie before all times; the step is taken at time 0, and what it arms has
 * its duration as deadline. `unmark` restores the others, given the state before, and says for each timer which of
 * those before it is, counted from 1, or 0 for one that was armed in the step. */
void fsm_mark(const fsm_machine *of, void *m);
void fsm_unmark(const fsm_machine *of, void *m, const void *before, uint32_t *source);
void fsm_limits_of(const fsm_machine *of, const void *m, fsm_limits *limits); /* of each timer: the least and the greatest duration */

fsm_view fsm_look(const fsm_machine *of, const void *m);
void fsm_configuration(const fsm_machine *of, const void *m, unsigned char *shown);
void fsm_dump(const fsm_machine *of, const void *m); /* data, outputs and active leaves, as trace lines */

/* Operations of the machine, and its outgoing events. */
void fsm_do_call(const fsm_machine *of, uint32_t number, const void *const *given, void *result);
void fsm_do_send(const fsm_machine *of, uint32_t number, const void *const *given);
void fsm_note_observed(const fsm_machine *of, uint32_t number, const void *event); /* one that a monitor watches */

/* ---- for the file of a machine X, which defines FSM_THIS as its table -------------------------- */

#define FSM_HOST_CALL(m, operation, given, result) ((void)(m), fsm_do_call(FSM_THIS, operation, given, result))
#define FSM_HOST_SEND(m, event, given) ((void)(m), fsm_do_send(FSM_THIS, event, given))

#define FSM_DEFINE_STEPS(X)                                                                        \
    static bool take(void *m) { return X##_step_event((X *)m); }                                   \
    static bool fire_first(void *m) { return X##_step_timer((X *)m); }                             \
    static void rebase(void *m, uint32_t now) { X##_rebase((X *)m, now); }
#define FSM_DEFINE_EVENTLESS(X)                                                                    \
    static bool eventless(void *m) { return X##_step_eventless((X *)m); }

#endif
