/* system.h: the given system: machines, their wires and their environment. */
#ifndef FSM_SYSTEM_H
#define FSM_SYSTEM_H

#include "model.h"
#include "system/machine.h"

/* The limit for one system. A program for more machines is compiled for so many. */
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

/* An external event of a machine. */
typedef struct {
    uint32_t machine, event;
    fsm_value values[FSM_MOST_VALUES];
    /* Happens some time if it stays possible; a spontaneous one only of a machine of the environment. */
    bool fair;
    bool spontaneous; /* a transition of the machine itself */
} fsm_possible;

/* An event of a machine whose occurrence some property depends on. */
typedef struct {
    uint32_t machine, event;
} fsm_observed_event;

/* Machines that a property reads, in order. */
typedef struct {
    uint32_t count;
    const uint32_t *machines;
} fsm_reads;

/* Numbers of the parts of a property, after all properties: it marks a state if some part does. */
typedef struct {
    uint32_t first, count; /* 0: no parts */
} fsm_parts;

/* The layout of a node's machines. */
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
    const fsm_observed_event *observed;
    uint32_t observed_count; /* 0: no property is evaluated at steps */
    bool (*evaluate_step)(const void *const *machines, const bool *occurs, uint32_t property); /* `occurs`: by index of `observed` */
    const size_t *seen_sizes; /* by machine: bytes of the data that properties read */
    void (*see)(uint32_t machine, const void *m, unsigned char *seen);
    /* By machine: it moves, and takes external events, in its turn only. NULL without turns. */
    const bool *ordered;
    /* The machine whose turn it is, from 1; 0: nobody's turn. A function of the last machine,
     * which keeps turns. NULL without turns. */
    uint32_t (*turn)(const void *m);
    const uint32_t *freezers; /* by machine: the machine that keeps the state of its node, or FSM_NONE. NULL: none freezes */
    fsm_hold (*hold)(uint32_t freezer, const void *m); /* how such a machine holds those of its
                                                        * node */
    bool untimed, zones, open;
    uint32_t unit;     /* ticks that pass at once, of which all delays are multiples; 0: no delays */
    uint32_t max_pending_before_input; /* UINT32_MAX: no limit */
} fsm_system;

/* The explored system, in the generated code. */
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

typedef struct {
    uint32_t queue, timers, microsteps;
} fsm_bounds;

typedef struct fsm_composition fsm_composition;

/* The description of a step. */
typedef struct {
    fsm_action action;
    uint32_t machine, argument;
    uint32_t before; /* the local state it starts from */
    const uint32_t *choices;
    uint32_t choice_count;
} fsm_description;

#endif
